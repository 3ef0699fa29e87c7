"""What follows from a tool path does not hang on how dense its records are."""

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.toolpath.path import ToolPath
from parakin.toolpath.posting.post import post_path

DEGREE = np.pi / 180.0


def tilting_path(tip, axis, count):
    """One motion that tilts the tool evenly, in ``count`` records."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    angle = np.arccos(axis[0] @ axis[1])
    axes = (np.sin((1.0 - share) * angle) * axis[0] + np.sin(share * angle) * axis[1]) / np.sin(angle)
    tips = tip[0] + share * (tip[1] - tip[0])
    lines, feed = np.arange(1, count + 1), np.full(count, 1000.0)
    return ToolPath("part.cls", tips, axes, lines, np.zeros(count, bool), feed, np.zeros(count))


def random_motion(machine, rng):
    """From an upright tool, the commonest start of all, to a tilted one."""
    begin = machine.home[:3] + rng.uniform(-100.0, 100.0, 3)
    tilt, azimuth = rng.uniform(5.0, 25.0) * DEGREE, rng.uniform(-np.pi, np.pi)
    axis = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)]
    return np.array([begin, begin + rng.uniform(-40.0, 40.0, 3)]), np.array([[0.0, 0.0, 1.0], axis])


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
def test_two_records_and_two_hundred_get_one_verdict(name):
    machine, rng = load_shipped(name), np.random.default_rng(11)
    for _ in range(12):
        tip, axis = random_motion(machine, rng)
        sparse, dense = (pk.prepare(machine, tilting_path(tip, axis, count)) for count in (2, 201))
        assert sparse.runs == dense.runs, (sparse.unplanned, dense.unplanned)
        if sparse.runs:
            assert sparse.seconds == pytest.approx(dense.seconds, rel=0.1)


def test_the_joints_of_records_are_those_of_a_dense_path():
    machine, rng = load_shipped("tricept"), np.random.default_rng(5)
    for _ in range(40):
        tip, axis = random_motion(machine, rng)
        sparse, dense = (post_path(machine, tilting_path(tip, axis, count)) for count in (2, 801))
        np.testing.assert_allclose(
            np.diff(sparse.joints[[0, -1]], axis=0), np.diff(dense.joints[[0, -1]], axis=0), atol=1e-6
        )
