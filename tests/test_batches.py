"""Batches of any shape and type, rows that are not numbers, and joints along a path."""

from __future__ import annotations

import numpy as np
import pytest
from geometry import Description
from independent import tool_axis
from shipped import load_shipped
from test_conformance import everyone, poses_about

import parakin as pk

SHAPES = [(), (5,), (3, 4), (0,), (2, 0), (1, 1, 1)]
FIVE = ["orthoglide5_head", "orthoglide5_table", "tricept"]
five = pytest.mark.parametrize("m", [load_shipped(name) for name in FIVE], ids=FIVE)


def allowed_like(m, shape):
    poses = poses_about(m, 400, seed=41)
    poses = poses[m.check(poses) == 0]
    return np.resize(poses, (*shape, len(m.axes)))


@everyone
@pytest.mark.parametrize("shape", SHAPES)
def test_any_leading_shape_is_kept(m, shape):
    poses = allowed_like(m, shape)
    n, k = len(m.axes), len(m.joints)
    rows = max(n, k)  # of the closures: more drives than freedoms have one each
    flat = poses.reshape(-1, n)
    joints = m.inverse(poses)
    assert joints.shape == (*shape, k)
    assert np.array_equal(joints.reshape(-1, k), m.inverse(flat))
    a, b = m.jacobians(poses)
    assert a.shape == (*shape, rows, n)
    assert b.shape == (*shape, rows, k)
    assert np.array_equal(a.reshape(-1, rows, n), m.jacobians(flat)[0])
    assert m.margins(poses).shape == (*shape, len(m.limits))
    verdict = m.check(poses)
    assert np.shape(verdict) == shape
    assert np.all(verdict == 0)
    assert np.issubdtype(np.asarray(verdict).dtype, np.integer)
    for near in (None, m.home, poses):
        for method in (None, "newton", "constant"):
            s = m.forward(joints, near=near, method=method)
            assert s.poses.shape == poses.shape
            assert np.shape(s.residual) == np.shape(s.converged) == np.shape(s.steps) == shape
    if shape == ():
        assert isinstance(bool(verdict == 0), bool)
        assert s.converged


@everyone
def test_any_numbers_in_any_order_give_the_same(m):
    poses = allowed_like(m, (60,))
    joints, verdict = m.inverse(poses), m.check(poses)
    wide = np.zeros((120, 2 * len(m.axes)))
    wide[::2, ::2] = poses
    backward = np.ascontiguousarray(poses[::-1])[::-1]
    for same in (np.asfortranarray(poses), wide[::2, ::2], backward, poses.tolist(), poses.astype(np.longdouble)):
        assert np.array_equal(m.inverse(same), joints)
        assert np.array_equal(m.check(same), verdict)
        assert np.array_equal(m.jacobians(same)[0], m.jacobians(poses)[0])
        assert np.array_equal(m.margins(same), m.margins(poses))
        assert np.array_equal(m.forward(joints, near=same).poses, m.forward(joints, near=poses).poses)
    from_home = m.forward(joints).poses
    assert np.array_equal(m.forward(np.asfortranarray(joints)).poses, from_home, equal_nan=True)
    short = poses.astype(np.float32)
    assert np.array_equal(m.inverse(short), m.inverse(short.astype(np.float64)))
    whole = np.rint(poses).astype(np.int32)
    assert np.array_equal(m.inverse(whole), m.inverse(whole.astype(np.float64)), equal_nan=True)
    before = poses.copy()
    m.inverse(poses), m.forward(joints), m.check(poses), m.jacobians(poses)
    assert np.array_equal(poses, before)


def no_rows(n):
    """What is no batch of rows of n numbers."""
    row = [0.0] * n
    yield from (None, "", "x", 1.0, [], [[]], {}, {"Q": 1.0}, object(), [1.0, "a"], [[1.0, 2.0], [1.0]], b"12345")
    yield from ([["1"] * n], [row, [*row, 0.0]], [10**400, *row[1:]], [*row[1:], None])
    yield from (np.zeros((1, n), dtype=complex), np.array([["a"] * n]), np.array([object()] * n), np.zeros((n, n + 1)))
    yield from (np.array(["1"] * n, dtype=object), np.zeros(n, dtype="M8[s]"))


@everyone
@pytest.mark.parametrize("what", ["inverse", "forward", "jacobians", "check", "margins", "follow", "assemblies"])
def test_what_is_no_row_of_numbers_is_refused_in_one_line(m, what):
    for bad in no_rows(len(m.joints if what in ("forward", "assemblies") else m.axes)):
        with pytest.raises(pk.PoseError) as caught:
            getattr(m, what)(bad)
        assert "\n" not in str(caught.value)


@everyone
def test_modes_starts_and_methods_that_are_none(m):
    with pytest.raises(pk.PoseError):
        m.inverse(m.home, mode="?")
    with pytest.raises(pk.PoseError):
        m.forward(m.inverse(m.home), near=[1.0])
    with pytest.raises(pk.PoseError):
        m.forward(m.inverse(m.home), near=np.zeros((3, len(m.axes))))
    with pytest.raises(pk.PoseError):
        m.forward(m.inverse(m.home), method="guess")
    with pytest.raises(pk.PoseError):
        m.margins(m.home, joints=np.zeros((4, len(m.joints))))


@everyone
def test_out_is_filled_and_returned(m):
    poses = allowed_like(m, (300,))
    joints = m.inverse(poses)
    for out in (np.empty_like(joints), np.empty((300, 2 * len(m.joints)))[:, ::2], np.empty_like(joints, order="F")):
        assert m.inverse(poses, out=out) is out
        assert np.array_equal(out, joints)
    if len(m.axes) == len(m.joints):
        for same in (poses.copy(), np.asfortranarray(poses)):
            assert np.array_equal(m.inverse(same, out=same), joints)
        shared = np.vstack([poses, poses[:1]])
        assert np.array_equal(m.inverse(shared[:-1], out=shared[1:]), joints)
    k = len(m.joints)
    fixed = np.empty((300, k))
    fixed.flags.writeable = False
    others = [np.empty((299, k)), np.empty((300, k + 1)), np.empty((300, k), np.float32), np.empty(k)]
    for bad in (*others, fixed, [0.0] * k):
        with pytest.raises(pk.PoseError):
            m.inverse(poses, out=bad)


@everyone
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_none_spoils_its_row_alone(m, bad):
    count = 700
    poses = allowed_like(m, (count,))
    clean = m.inverse(poses), m.check(poses), m.jacobians(poses), m.margins(poses)
    hurt = 3 + 101 * np.arange(len(m.axes))
    poses[hurt, np.arange(len(m.axes))] = bad
    rest = np.setdiff1d(np.arange(count), hurt)
    joints, verdict, (a, b), margins = m.inverse(poses), m.check(poses), m.jacobians(poses), m.margins(poses)
    assert np.isnan(joints[hurt]).all()
    assert (verdict[hurt] > 0).all()
    assert np.isnan(a[hurt]).all()
    assert np.isnan(b[hurt]).all()
    assert not (margins[hurt] >= 0.0).all(1).any()
    assert np.array_equal(joints[rest], clean[0][rest])
    assert np.array_equal(verdict[rest], clean[1][rest])
    assert np.array_equal(a[rest], clean[2][0][rest])
    assert np.array_equal(margins[rest], clean[3][rest])
    near = m.forward(clean[0], near=poses, method="newton")
    assert not near.converged[hurt].any()
    assert near.converged[rest].mean() > 0.95


@everyone
def test_poses_out_of_reach_are_not_numbers_and_not_allowed(m):
    far = m.home + np.array([1e5 if axis in "XYZ" else 0.0 for axis in m.axes]) * np.array([[1.0], [-1.0]])
    for poses in (far, m.home + 1e250 * (np.arange(len(m.axes)) < 2)):
        joints = m.inverse(poses)
        if (
            m.spec.legs[0].kind not in ("length", "ring") and not m.structure.has_slides
        ):  # a strut and a slide have no end
            assert np.isnan(joints).all()
        assert (m.check(poses) > 0).all()
        assert np.isnan(m.inverse(np.full(len(m.axes), 1e300))).all()


# Paths.


def leads_to(m, poses, joints):
    miss, tilt = Description.of(m.spec).misses(poses, joints)
    assert miss.max() < 1e-9
    assert tilt.max() < 2e-9


def path(m, b, c):
    """Poses about home with the angles B and C given along the path."""
    along = np.linspace(0.0, 1.0, len(b))[:, None]
    place = m.home[:3] + along * np.array([20.0, -10.0, 5.0])
    return np.column_stack([place, b, c])


@five
def test_following_through_the_singular_axis_is_continuous(m):
    t = np.linspace(-1.0, 1.0, 201)  # the middle one exactly 0
    poses = path(m, np.abs(0.5 * t), np.where(t < 0, 0.7, 0.7 - np.pi))  # straight through B = 0
    poses[100, 4] = 0.0
    straight = path(m, 0.5 * t, np.full(201, 0.7))
    for given in (poses, straight):
        given[:, :3] = m.home[:3]
        if m.name == "tricept":  # keep the central leg upright: only there is θ1 free at B = 0
            k = tool_axis(given[:, 3], given[:, 4])
            given[:, :3] = m.home[:3] + m.spec.sizes["l2"] * (np.array([0.0, 0.0, 1.0]) - k)
        joints = m.follow(given)
        assert np.isfinite(joints).all()
        leads_to(m, given, joints)
        turning = joints[:, 3:]
        assert np.abs(np.diff(turning[:100], axis=0)).max() < 0.1
        assert np.abs(np.diff(turning[101:], axis=0)).max() < 0.1
        assert np.abs(turning[100] - turning[99]).max() < 0.1  # the free angle is its neighbour's


@five
def test_following_from_the_singular_axis(m):
    b = np.r_[np.zeros(5), np.linspace(0.01, 0.4, 40)]
    poses = path(m, b, np.full(45, 0.9))
    poses[:, :2] = m.home[:2]
    start = m.home.copy()
    if m.name == "tricept":
        start[:2] = 0.0
        k = tool_axis(b, poses[:, 4])
        poses[:, :3] = start[:3] + m.spec.sizes["l2"] * (np.array([0.0, 0.0, 1.0]) - k)
    joints = m.follow(poses)
    leads_to(m, poses, joints)
    assert np.abs(np.diff(joints[:, 3:], axis=0)).max() < 0.05  # from the first pose to come where it is not free
    still = np.tile(start, (7, 1))
    assert np.abs(m.follow(still)[:, 3:]).max() == 0.0
    leads_to(m, still, m.follow(still))


@five
def test_following_several_turns_unwinds_them(m):
    c = np.linspace(0.0, 6.0 * np.pi, 721)
    poses = path(m, np.full(721, 0.3), c)
    joints = m.follow(poses)
    leads_to(m, poses, joints)
    assert np.abs(np.diff(joints, axis=0)[:, 3:]).max() < 0.1
    turned = np.ptp(joints[:, 3:], axis=0).max()
    assert turned == pytest.approx(6.0 * np.pi, abs=0.5)
    alone = m.inverse(poses)
    whole = (joints[:, 3:] - alone[:, 3:]) / (2.0 * np.pi)
    assert np.abs(whole - np.rint(whole)).max() < 1e-9
    assert np.allclose(joints[:, :3], alone[:, :3], atol=1e-9)
    assert m.follow(poses, mode=m.modes[1]).shape == joints.shape


@everyone
def test_following_a_path_without_turns_is_the_inverse(m):
    t = np.linspace(0.0, 1.0, 50)[:, None]
    poses = m.home + t * np.array([10.0 if axis in "XYZ" else 0.05 for axis in m.axes])
    joints = m.follow(poses)
    leads_to(m, poses, joints)
    mm = np.array(m.joint_units) == "mm"
    assert np.allclose(joints[:, mm], m.inverse(poses)[:, mm], atol=1e-9)
    assert m.follow(poses[:0]).shape == (0, len(m.joints))
    assert m.follow(poses[:1]).shape == (1, len(m.joints))
    poses[7, 0] = np.nan
    with np.errstate(invalid="ignore"):
        joints = m.follow(poses)
    assert np.isnan(joints[7]).all()
    assert np.isfinite(np.delete(joints, 7, 0)).all()
    for bad in (m.home, poses[None]):
        with pytest.raises(pk.PoseError):
            m.follow(bad)
