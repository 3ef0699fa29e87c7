"""Working modes along a path, against each mode's own inverse, limits and Jacobian, pose by pose."""

from __future__ import annotations

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk


@pytest.mark.parametrize("name", ["hbg80_2d", "linear_delta", "orthoglide", "lambda6", "hexapod"])
def test_modes_carry_what_each_pose_of_the_path_allows(name):
    machine, rng = load_shipped(name), np.random.default_rng(7)
    for _ in range(4):
        way = rng.normal(size=len(machine.axes)) * np.where(np.array(machine.axis_units) == "mm", 900.0, 0.4)
        poses = machine.home + np.linspace(0.0, 1.0, 120)[:, None] * way
        for found in machine.find_path_modes(poses):
            codes = machine.check(poses, mode=found.mode)
            broken = int(np.flatnonzero(codes)[0]) if codes.any() else None
            assert found.broken == broken
            assert found.limit == ("" if broken is None else machine.limits[codes[broken] - 1])
            determinants = np.linalg.det(machine.jacobians(poses[:broken], found.mode)[0])
            changes = np.flatnonzero(np.sign(determinants) != np.sign(determinants[:1]))
            assert found.crossing == (int(changes[0]) if len(changes) else None)
            assert found.carries == (broken is None and not len(changes))


def test_a_path_through_a_parallel_singularity_leaves_its_assembly_mode():
    """Lambda6's parallel singularity lies at C = 0."""
    machine = load_shipped("lambda6")
    poses = np.tile(machine.home, (41, 1))
    poses[:, 5] = np.deg2rad(np.linspace(20.5, -20.5, 41))
    own = machine.find_path_modes(poses)[0]
    assert (own.mode, own.broken, own.crossing, own.carries) == (machine.mode, None, 20, False)
    assert machine.find_path_modes(poses[:20])[0].carries
    with pytest.raises(pk.PoseError, match="a path of shape"):
        machine.find_path_modes(machine.home)
