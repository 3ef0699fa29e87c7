"""A wrist's joints are told on the turn of their ranges, however lopsided these are."""

from __future__ import annotations

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.description import find_machine_file

RANGES = [(-30, 330), (-330, 30), (90, 450), (-100, 500)]
WHOLE = "[-360 deg, 360 deg]"


def load_lopsided(name, ends, folder, offset=0.0):
    """A shipped machine whose wrist's first joint has another range."""
    text = find_machine_file(name).read_text(encoding="utf-8")
    assert text.count(WHOLE) == 1
    file = folder / f"{name}.yaml"
    text = text.replace(WHOLE, f"[{ends[0]} deg, {ends[1]} deg], offset: {offset} deg")
    file.write_text(text, encoding="utf-8")
    return pk.load(file)


@pytest.mark.parametrize("ends", RANGES, ids=str)
@pytest.mark.parametrize("name", ["tricept", "orthoglide5_table", "exechon"])
def test_every_angle_is_told_on_the_turn_of_the_range(name, ends, tmp_path):
    """Of the same direction as without a range, within half a turn of the range's middle, and so allowed."""
    shipped, m = load_shipped(name), load_lopsided(name, ends, tmp_path, offset=20.0)
    rng, first = np.random.default_rng(1), m.wrist.first
    poses = np.tile(m.home, (2000, 1))
    poses[:, 3:] = np.column_stack([rng.uniform(0.02, 0.1, 2000), rng.uniform(-4.0, 4.0, 2000)])
    q, own = m.inverse(poses), shipped.inverse(poses)
    assert np.abs(np.cos(q[:, first] + np.radians(20.0) - own[:, first]) - 1.0).max() < 1e-12
    others = [i for i in range(5) if i != first]
    assert np.abs(q[:, others] - own[:, others]).max() < 1e-9
    low, high = np.radians(ends)
    assert (np.abs(q[:, first] - 0.5 * (low + high)) <= np.pi + 1e-12).all()
    assert np.ptp(q[:, first]) > 6.2
    assert not m.check(poses).any()
    back = m.forward(q, near=poses)
    assert back.converged.all()
    assert np.abs(np.cos(back.poses[:, 4] - poses[:, 4]) - 1.0).max() < 1e-12


def test_a_path_keeps_to_the_turn_that_the_range_allows(tmp_path):
    """Most of a turn about the pole: the joint follows from the turn that it begins on, and leaves its range there."""
    m = load_lopsided("orthoglide5_head", (-30, 330), tmp_path)
    shipped, first = load_shipped("orthoglide5_head"), m.wrist.first
    poses = np.tile(m.home, (200, 1))
    poses[:, 3], poses[:, 4] = 0.1, np.linspace(-1.0, 4.0, 200)
    base = shipped.inverse(poses)[0, first] + poses[:, 4] - poses[0, 4]
    start = base[0] - 2.0 * np.pi * np.floor((base[0] - np.radians(-30)) / (2.0 * np.pi))
    q = m.follow(poses)
    assert np.abs(np.diff(q[:, first])).max() < 0.1
    assert q[0, first] == pytest.approx(start)
    jumps = np.abs(np.diff(m.inverse(poses)[:, first]))
    assert (jumps[jumps > 0.1] > 6.0).all()
    allowed = (q[:, first] >= np.radians(-30)) & (q[:, first] <= np.radians(330))
    assert np.array_equal(m.check(poses, q) == 0, allowed)
