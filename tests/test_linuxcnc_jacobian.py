"""The Jacobian that LinuxCNC's kinematics exports, against differences of the inverse, for longer tools too."""

from __future__ import annotations

import shutil
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

from parakin.controllers.linuxcnc.hand_box import find_hand_box

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from stub import FIELDS, Stub, outward, pose, world

STEP = 1e-4  # mm and degrees


def find_joints(machine, row, length):
    """The joints, mm and degrees, of a pose of a tool that is longer by a length: its tip stands below the own one."""
    own = pose(machine, row[None])[0]
    a, b, c = np.radians(row[3:6])
    about_z, about_y = (np.cos(c), np.sin(c)), (np.cos(b), np.sin(b))
    y, z = -np.sin(a), np.cos(a)  # Rx(A) z, then turned about Y and Z
    x, z = about_y[1] * z, about_y[0] * z
    axis = np.array([about_z[0] * x - about_z[1] * y, about_z[1] * x + about_z[0] * y, z])
    own[:3] += (length * (axis - [0.0, 0.0, 1.0]))[: len(machine.axes)]
    return outward(machine, machine.inverse(own)[None])[0]


@pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build a kinematics module with")
@pytest.mark.parametrize("name", ["tricept", "hexapod", "orthoglide5_table", "linear_delta"])
def test_rates_are_the_slopes_of_the_inverse(name, tmp_path):
    machine = load_shipped(name)
    module = Stub(tmp_path).built(machine)
    box, rng = find_hand_box(machine), np.random.default_rng(4)
    rows = world(machine, rng.uniform(box.low, box.high, (20, len(box.low))))
    for row, length in product(rows, (0.0, 40.0)):
        module.tool_offset.value = length
        rates, code = module.jacobian(find_joints(machine, row, length), row)
        assert code == 0
        for column, axis in enumerate(FIELDS):
            step = STEP * np.eye(9)[column]
            ends = [find_joints(machine, row + sign * step, length) for sign in (1.0, -1.0)]
            slope = (ends[0] - ends[1]) / (2.0 * STEP) if axis in machine.axes else 0.0
            assert np.abs(rates[:, column] - slope).max() < 1e-5, axis
