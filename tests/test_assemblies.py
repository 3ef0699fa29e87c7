"""Every assembly mode of a joint vector: all of them close, and a massive multistart finds no other."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import draw, machine_of
from geometry import Description
from hypothesis import given
from hypothesis import strategies as st
from independent import orientation, tool_axis
from shipped import REPRESENTATIVES, load_shipped
from test_conformance import poses_about, signed

TABLE_I = [  # the joint vectors of the Lambda machine's paper
    (398.89, 299.68, 414.67, 1758.75, 1714.02, 1723.08),
    (164.59, 223.16, 467.37, 1587.58, 1565.02, 1514.00),
]


def multistart(function, starts, caps, steps=60):
    """Roots of ``function`` (N, n) -> (N, n) by Newton with difference quotients from all starts, (k, n)."""
    x = starts.copy()
    h = np.diag(caps * 1e-7)
    for step in range(steps + 4):
        f = function(x)
        slopes = np.stack([(function(x + e) - function(x - e)) / (2.0 * e.max()) for e in h], -1)
        scale = np.abs(slopes).max(2, keepdims=True)
        regular = np.isfinite(slopes).all((1, 2)) & np.isfinite(f).all(1)
        x, f, slopes, scale = x[regular], f[regular], slopes[regular], scale[regular]
        regular = np.abs(np.linalg.det(slopes / scale)) > 1e-12
        x, f, slopes = x[regular], f[regular], slopes[regular]
        move = -np.linalg.solve(slopes, f[..., None])[..., 0]
        x = x + move / np.maximum(np.abs(move / caps).max(1, keepdims=True), 1.0)
        if step >= steps - 1:
            x = x[np.abs(move / caps).max(1) < 1e-6]
    return x


def distinct(rows, size=1e-5):
    kept = np.empty((0, rows.shape[1]))
    for row in rows:
        if not (np.abs(kept - row).max(1, initial=0.0) < size).any() or not len(kept):
            kept = np.vstack([kept, row])
    return kept


def frames(poses):
    """A pose as twelve numbers that are the same for all its angles: place and orientation (× 100 mm)."""
    turn = orientation(*poses[:, 3:].T) if poses.shape[1] == 6 else np.zeros((len(poses), 0))
    return np.column_stack([poses[:, :3], 100.0 * turn.reshape(len(poses), -1)])


def closes(m, d, poses, joints):
    """The poses' legs close with these very joints, and some working mode's inverse gives them."""
    rows = np.tile(joints, (len(poses), 1))
    miss, tilt = d.misses(poses, rows)
    assert miss.max(initial=0.0) < 1e-9
    assert tilt.max(initial=0.0) < 1e-9
    off = np.min(
        [np.nan_to_num(np.abs(signed(m, m.inverse(poses, mode=mode), rows)).max(1), nan=9e9) for mode in m.modes],
        axis=0,
    )
    assert off.max(initial=0.0) < 1e-6  # near a serial singularity the joints follow the closure's root


@pytest.mark.parametrize("name", REPRESENTATIVES)
def test_all_close_and_the_true_pose_is_among_them(name):
    m = load_shipped(name)
    d = Description.of(m.spec)
    poses = poses_about(m, 400, seed=21)
    if m.axes == tuple("XYZBC"):
        poses[:, 3] = np.abs(poses[:, 3]) + 0.01
    poses = poses[m.check(poses) == 0][:12]
    for pose, joints in zip(poses, m.inverse(poses), strict=True):
        found = m.assemblies(joints).poses
        closes(m, d, found, joints)
        turned = np.abs(frames(found) - frames(pose[None])).max(1)
        assert turned.min() < 1e-7
        if m.model.by_spheres:
            assert len(found) == 2
        for i in range(len(found)):
            assert np.abs(np.delete(found, i, 0) - found[i]).max(1, initial=0.0).min(initial=1.0) > 1e-6


@pytest.mark.parametrize("name", REPRESENTATIVES)
@pytest.mark.parametrize("kind", ["apart", "nan", "inf", "huge", "negative", "zero"])
def test_joints_that_do_not_assemble_have_none(name, kind):
    m = load_shipped(name)
    joints = m.inverse(m.home).copy()
    if kind == "apart":
        sliding = np.flatnonzero(np.array(m.joint_units) == "mm")[:2]
        joints[sliding] += [9000.0, -9000.0 * (name != "tricept")][: len(sliding)]
        if not len(sliding):
            return
    elif kind == "negative" and name == "tricept":
        joints[0] *= -1.0
    elif kind == "zero" and name == "tricept":
        joints[:] = 0.0
    elif kind in ("nan", "inf", "huge"):
        joints[1] = {"nan": np.nan, "inf": np.inf, "huge": 1e300}[kind]
    else:
        return
    found = m.assemblies(joints).poses
    assert found.shape == (0, len(m.axes))


def test_the_tricept_has_no_others():
    m = load_shipped("tricept")
    s = m.spec.sizes
    big, small, root = s["R"], s["r"], np.sqrt(3.0)
    rng = np.random.default_rng(22)
    poses = poses_about(m, 300, seed=23)
    poses = poses[m.check(poses) == 0][:4]
    vectors = [*m.inverse(poses), [500.0, 520.0, 480.0, 0.2, 0.3], [400.0, 310.0, 330.0, 0.2, 0.3]]
    for joints in vectors:

        def legs(x, d=joints):
            (sp, st_), (cp, ct), p = np.sin(x[:, :2]).T, np.cos(x[:, :2]).T, x[:, 2]
            common, half = p**2 + small**2 + big**2, small * big / 2.0
            one = common - 2.0 * p * big * ct * sp - 2.0 * small * big * cp
            two = common + p * big * (ct * sp - root * st_) + half * (-3.0 * ct - root * st_ * sp - cp)
            three = common + p * big * (ct * sp + root * st_) + half * (-3.0 * ct + root * st_ * sp - cp)
            return np.stack([one - d[0] ** 2, two - d[1] ** 2, three - d[2] ** 2], -1) / 1e3

        starts = rng.uniform([-np.pi, -np.pi, -2000.0], [np.pi, np.pi, 2000.0], (3000, 3))
        found = multistart(legs, starts, np.array([0.3, 0.3, 200.0]))
        found[:, :2] = (found[:, :2] + np.pi) % (2.0 * np.pi) - np.pi
        found = distinct(found)
        answer = m.assemblies(joints)
        poses = answer.poses
        closes(m, Description.of(m.spec), poses, np.asarray(joints))
        assert len(poses) + answer.untold_count == len(found)
        assert len(poses) + answer.untold_count + answer.complex_count == 28  # of the family, by monodromy
        centres = poses[:, :3] + s["l2"] * tool_axis(poses[:, 3], poses[:, 4])
        lengths = np.linalg.norm(centres, axis=1) - s["l1"]
        assert (np.abs(lengths[:, None] - found[:, 2]).min(1) < 1e-5).all()


@pytest.mark.parametrize("joints", [*TABLE_I, (500.0, 420.0, 460.0, 1800.0, 1750.0, 1900.0), None])
def test_the_lambda_machine_has_no_others(joints):
    m = load_shipped("lambda6")
    d, s = Description.of(m.spec), m.spec.sizes
    if joints is None:
        joints = m.inverse([30.0, -40.0, 1420.0, 0.1, -0.15, 0.3])
    joints = np.asarray(joints)
    poses = m.assemblies(joints).poses
    closes(m, d, poses, joints)
    if tuple(joints) in TABLE_I:
        assert len(poses) >= 1
        assert np.abs(frames(poses)[:, 11]).max() > 90.0  # one of them nearly level
    directions = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.radians([180.0, 60.0, -60.0])])

    def rods(x):
        points = x[:, None, :3] + np.einsum("nij,kj->nki", orientation(*x[:, 3:].T), s["D"] * directions)
        low = points - s["C"] * directions - joints[:3, None] * np.eye(3)[2]
        gaps = (joints[3:] - joints[:3])[:, None] * np.eye(3)[2]
        hinge = low * ((s["c"] - s["r"]) / s["c"]) - gaps
        return np.concatenate([(low**2).sum(2) - s["c"] ** 2, (hinge**2).sum(2) - s["u"] ** 2], 1) / 1e3

    rng = np.random.default_rng(24)
    reach = [500, 500, 300, np.pi, 1.5, np.pi]
    starts = rng.uniform(-1, 1, (4000, 6)) * reach + [0, 0, joints[:3].mean() + 900.0, 0, 0, 0]
    found = multistart(rods, starts, np.array([100.0, 100.0, 100.0, 0.3, 0.3, 0.3]), steps=40)
    found = distinct(frames(found), 1e-3)
    mine = frames(poses)
    for row in found:
        assert np.abs(mine - row).max(1).min() < 1e-3
    for row in mine:
        assert np.abs(found - row).max(1).min() < 1e-3


def planar_machine(tmp_path, feet, corners):
    legs = [
        {"kind": "length", "joints": [f"q{i}"], "foot": [*foot, 0.0], "platform": [*corner, 0.0]}
        for i, (foot, corner) in enumerate(zip(feet, corners, strict=True))
    ]
    d = Description(("tx", "ty", "rz"), legs, home=np.array([80.0, 60.0, 0.1]))
    return machine_of(d, tmp_path), d


def test_a_planar_platform_has_up_to_six(tmp_path):
    m, d = planar_machine(tmp_path, [[0, 0], [159.1, 0], [0, 100.0]], [[0, 0], [170.4, 0], [131.0, 160.9]])
    rng = np.random.default_rng(25)
    counts, sixes = [], 0
    for pose in rng.uniform([-150, -150, -np.pi], [150, 150, np.pi], (400, 3)):
        joints = m.inverse(pose)
        found = m.assemblies(joints).poses
        closes(m, d, found, joints)
        assert np.abs(signed_pose(found, pose)).max(1).min() < 1e-6
        counts.append(len(found))
        if len(found) == 6:
            sixes += 1
        if sixes > 3 if len(found) == 6 else len(counts) % 80:
            continue

        def rods(x, q=joints):
            c, s = np.cos(x[:, 2]), np.sin(x[:, 2])
            ends = np.array([leg["platform"] for leg in d.legs])
            px = x[:, :1] + c[:, None] * ends[:, 0] - s[:, None] * ends[:, 1]
            py = x[:, 1:2] + s[:, None] * ends[:, 0] + c[:, None] * ends[:, 1]
            feet = np.array([leg["foot"] for leg in d.legs])
            return (np.hypot(px - feet[:, 0], py - feet[:, 1]) - q) / 100.0

        starts = rng.uniform([-400, -400, -np.pi], [400, 400, np.pi], (3000, 3))
        others = multistart(rods, starts, np.array([50.0, 50.0, 0.3]))
        others[:, 2] = (others[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        for row in distinct(others):
            assert np.abs(signed_pose(found, row)).max(1).min() < 1e-4
        assert len(distinct(others)) == len(found)
    assert max(counts) == 6
    assert all(count % 2 == 0 for count in counts)


def signed_pose(poses, pose):
    off = poses - pose
    off[:, 2:] = (off[:, 2:] + np.pi) % (2.0 * np.pi) - np.pi
    return off


@pytest.mark.parametrize(
    "family", ["translational", "carried", "plane", "planar", "sideways", "central", "other central"]
)
@given(seed=st.integers(0, 2**32 - 1))
def test_those_of_drawn_machines(family, seed, tmp_path):
    d, _ = draw(family, seed, 1)
    m = machine_of(d, tmp_path)
    joints = m.inverse(m.home)
    found = m.assemblies(joints).poses
    miss, tilt = d.misses(found, np.tile(joints, (len(found), 1)))
    assert miss.max(initial=0.0) < 2e-9
    assert tilt.max(initial=0.0) < 1e-9
    limit = {"planar": 6, "sideways": 6, "central": 28, "other central": 28}.get(family, 2)
    assert 1 <= len(found) <= limit
    off = np.abs(found - m.home)
    assert off.max(1).min() < 1e-5
