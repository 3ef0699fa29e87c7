"""The way from LinuxCNC's home to a first record beside the poles of the wrist and of the pose."""

from itertools import pairwise

import numpy as np
import pytest

import parakin as pk
from parakin.controllers.linuxcnc.approach import plan_approach
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.kinematics.wrist.pole_thresholds import STANDING

DENSE = np.unique(np.concatenate([np.linspace(0, 1, 1000), np.geomspace(1e-7, 1, 200), 1 - np.geomspace(1e-7, 1, 200)]))


@pytest.mark.parametrize("seed", range(16))
def test_the_first_joint_takes_the_least_turn(seed):
    """It turns from home to where the record has it, and neither swings to and fro nor takes minutes beside a pole."""
    rng = np.random.default_rng(seed)
    machine = pk.load("tricept")
    wrist = machine.wrist
    x, y = 10.0 ** rng.uniform(-6.0, 0.5, 2) * rng.choice([-1.0, 1.0], 2)
    direction = 10.0 ** rng.uniform(-7.0, -2.0), rng.uniform(-np.pi, np.pi)
    first = np.array([x, y, machine.home[2] + rng.uniform(-100.0, 100.0), *direction])
    joints = machine.inverse(first)
    poses, seconds = plan_approach(machine, first, joints, machine.mode)
    way = [find_home_pose(machine), *poses]
    line = np.concatenate([a + DENSE[:, None] * (b - a) for a, b in pairwise(way)])
    angles = machine.follow(line, machine.mode, STANDING)[:, wrist.first]
    least = abs(joints[wrist.first] - machine.inverse(machine.home)[wrist.first])
    # nearer than STANDING the controller's joint stands still, wherever the record has it
    on_pole = wrist.find_free(first[None], STANDING)[0]
    assert np.abs(np.diff(angles)).sum() < least + np.radians(360.0 if on_pole else 6.0)
    assert np.abs(angles).max() < least + np.radians(6.0)
    assert seconds.sum() < 30.0
