"""Where pairs of rods stop holding a translating platform's orientation: nowhere among the allowed poses.

Machine files tell mean rods; a pair of equal rods a short side s apart resists a couple along rod × s. The platform
turns freely where the couples of all legs lie in one plane: a constraint singularity. Machines of six axes have no such
couples, and the Tricept's central leg alone holds what its struts don't.
"""

from __future__ import annotations

import numpy as np
import pytest
from shipped import load_shipped
from test_conformance import poses_about

LEAST = 0.1  # of 1, which couples at right angles have


def find_delta_rods(places):
    """Rods (n, 3, 3) of the linear Delta up from the platform, and short sides along the towers' circle."""
    angles = np.radians([90.0, 210.0, 330.0])
    radial = np.column_stack([np.cos(angles), np.sin(angles)])
    across = (350.0 - 60.0) * radial - places[:, None, :2]
    up = np.sqrt(700.0**2 - (across**2).sum(-1))
    return np.dstack([across, up]), np.column_stack([-radial[:, 1], radial[:, 0], np.zeros(3)])


def find_orthogonal_rods(places, length, signs):
    """Rods (n, 3, 3) on three rails at right angles; the short side of each lies along the next rail."""
    rods = -np.repeat(places[:, None, :], 3, axis=1)
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        rods[:, axis, axis] = signs[axis] * np.sqrt(length**2 - (places[:, others] ** 2).sum(1))
    return rods, np.roll(np.eye(3), 1, axis=1)


def measure_constraint(rods, sides):
    """The least |det| of the couples' directions (n, 3, 3)."""
    couples = np.cross(rods, sides[None])
    return np.abs(np.linalg.det(couples / np.linalg.norm(couples, axis=2, keepdims=True))).min()


@pytest.mark.parametrize("name", ["linear_delta", "orthoglide", "hbg80_3d"])
def test_pairs_of_rods_hold_the_platform_everywhere(name):
    machine = load_shipped(name)
    places = poses_about(machine, 100_000)
    places = places[machine.check(places) == 0]
    assert len(places) > 1000
    if name == "linear_delta":
        found = find_delta_rods(places)
    elif name == "orthoglide":
        rod = np.linalg.norm(np.array([machine.inverse(machine.home)[0] - machine.home[0], *machine.home[1:]]))
        found = find_orthogonal_rods(places, rod, (1.0, 1.0, 1.0))
    else:
        found = find_orthogonal_rods(places - [80.0, 80.0, -120.0], 600.0, (-1.0, -1.0, 1.0))
    assert measure_constraint(*found) > LEAST
