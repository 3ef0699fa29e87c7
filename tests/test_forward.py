"""The direct problem: it undoes the inverse, and it is never silently wrong."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from drawn import draw, machine_of
from geometry import Description, transform
from hypothesis import given
from hypothesis import strategies as st
from shipped import load_shipped
from test_conformance import everyone, families, poses_about

import parakin as pk
from parakin.model.spheres import compute_square_determinant, compute_square_height, find_common_point

CLOSE = 1.5e-9  # mm: 1e-9 in a machine of a metre


@cache
def allowed(name, count=4000):
    m = load_shipped(name)
    poses = poses_about(m, 12 * count, seed=11)
    if m.axes == tuple("XYZBC"):  # an axis' angles as the direct problem gives them
        poses[:, 3] = np.abs(poses[:, 3])
    return poses[m.check(poses) == 0][:count]


def nudged(m, poses, seed=0):
    """Poses 1 mm and 0.5° off."""
    mm = np.array(m.axis_units) == "mm"
    off = np.random.default_rng(seed).normal(size=poses.shape)
    off[:, mm] *= 1.0 / np.linalg.norm(off[:, mm], axis=1, keepdims=True)
    if not mm.all():
        off[:, ~mm] *= np.radians(0.5) / np.linalg.norm(off[:, ~mm], axis=1, keepdims=True)
    return poses + off


def errors(m, found, poses):
    """Greatest errors of places (mm), and of angles (rad), (N,) each; 5 axes: of the tool's axis."""
    mm = np.array(m.axis_units) == "mm"
    angles = (found - poses)[:, ~mm]
    angles = np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi)
    if m.axes == tuple("XYZBC"):
        angles[:, 1] *= np.abs(np.sin(poses[:, 3]))
    return np.abs((found - poses)[:, mm]).max(1), angles.max(1, initial=0.0)


def legs_regularity(m, poses):
    """The determinant of the legs' closures, rows and columns scaled, and the least singular value, (N,) each.

    With more drives than freedoms the determinant is the root of AᵀA's.
    """
    rows, scales = sum(len(leg.drives) for leg in m.spec.legs), np.where(np.array(m.axis_units) == "mm", 1.0, 200.0)
    columns = rows - (len(m.joints) - len(m.axes))
    if m.structure.has_slides:  # the slides follow the platform, which C does not turn where it is free
        a, rows, columns = m.twist_rates(poses, m.inverse(poses))[0], len(m.joints), len(m.axes)
    else:
        a, _ = m.jacobians(poses)
    a = (a / scales)[:, :rows, :columns]
    a = a / np.linalg.norm(a, axis=2, keepdims=True)
    det = np.linalg.det(a) if rows == columns else np.sqrt(np.linalg.det(a.swapaxes(1, 2) @ a))
    return det, np.linalg.svd(a)[1][:, -1]


@everyone
@pytest.mark.parametrize("method", [None, "newton"])
def test_it_undoes_the_inverse_from_a_pose_nearby(m, method):
    poses = allowed(m.name)
    joints = m.inverse(poses)
    found = m.forward(joints, near=nudged(m, poses), method=method)
    _, least = legs_regularity(m, poses)
    regular = least > 0.02  # nearer to a singularity the start may lie beyond it
    assert regular.mean() > (0.7 if m.name == "pentapod" else 0.9)  # its rings are near each other
    place, angle = errors(m, found.poses, poses)
    assert found.converged[regular].all()
    assert place[regular].max() < 1e-9
    assert angle[regular].max() < 1e-11
    done = found.converged
    miss, tilt = Description.of(m.spec).misses(found.poses[done], joints[done])
    assert miss.max() < CLOSE
    assert tilt.max() < 1e-11
    assert found.residual[done].max() <= CLOSE


# The share of allowed poses that home's start finds as they are. The limits of hbg80_2d let in
# the other side of the line through its sliders, those of lambda6 the platform turned past its singularity at C = 0;
# and the orthoglide's ranges go a little past the plane of its rods. Home's assembly mode mirrors such poses.
SHARES = {"hbg80_2d": 0.75, "lambda6": 0.9, "orthoglide": 0.98}


@everyone
@pytest.mark.parametrize("method", [None, "newton"])
def test_from_home_what_converges_closes(m, method):
    poses = allowed(m.name)
    joints = m.inverse(poses)
    found = m.forward(joints, method=method)
    done, same = found.converged, SHARES.get(m.name, 0.99)
    assert done[m.sides(poses) * m.sides(m.home[None]) > 0.0].mean() > 0.999  # on home's side, in the machine's mode
    miss, tilt = Description.of(m.spec).misses(found.poses[done], joints[done])
    assert miss.max() < CLOSE
    assert tilt.max() < 1e-11
    assert np.isnan(found.poses[~done]).all()
    place, _ = errors(m, found.poses, poses)
    assert (place < 1e-9).mean() > same
    det, least = legs_regularity(m, np.vstack([poses, m.home + 1e-3]))  # what is not found is not in home's mode
    mode = (det[:-1] * det[-1] > 0.0) & (least[:-1] > (0.02 if m.name == "lambda6" else 1e-3))
    assert (place[mode] < 1e-8).mean() > 0.999
    assert np.nanmin(place[det[:-1] * det[-1] < 0.0], initial=1.0) > 1e-6


@everyone
def test_closed_form_and_newton_agree(m):
    poses = allowed(m.name)
    joints = m.inverse(poses)
    near = nudged(m, poses)
    if not m.model.by_spheres:
        with pytest.raises(pk.NoMethodError):
            m.forward(joints, method="closed")
        return
    closed, newton = (m.forward(joints, near=near, method=method) for method in ("closed", "newton"))
    _, least = legs_regularity(m, poses)
    both = closed.converged & newton.converged & (least > 0.02)
    assert both.mean() > 0.9
    place, angle = errors(m, closed.poses, newton.poses)
    assert place[both].max() < 1e-9
    assert angle[both].max() < 1e-11


@pytest.mark.parametrize("flat", [1.0, 0.01])
def test_spheres_share_the_point_that_they_were_drawn_through(flat):
    """By constants across the rails, or by the normal where centres stand nearly in a plane along each of them."""
    rng = np.random.default_rng(3)
    plane = [0, 1, 2]
    for _ in range(200):
        place, centres = rng.uniform(-1.0, 1.0, 3), rng.uniform(-1.0, 1.0, (3, 3))
        centres[2] = centres[0] + rng.uniform(0.3, 0.7) * (centres[1] - centres[0]) + flat * (centres[2] - centres[0])
        radii = np.linalg.norm(place - centres, axis=1)
        normal = np.cross(centres[1] - centres[0], centres[2] - centres[0])
        height = (place - centres[0]) @ normal / np.linalg.norm(normal)
        given = centres.tolist(), radii.tolist(), plane
        shared = find_common_point(*given, float(np.sign(height)), None)
        doubtful = 1e-13 / (np.linalg.norm(normal) ** 2 * abs(height))
        np.testing.assert_allclose(shared, place, atol=doubtful)
        assert abs(compute_square_height(*given) - height**2) < 1e-13 / np.linalg.norm(normal) ** 2
        determinant = (height * np.linalg.norm(normal)) ** 2
        assert abs(compute_square_determinant(*given) - determinant) < 1e-13


@pytest.mark.parametrize(("tilt", "steps"), [(15.0, 5), (30.0, 9), (45.0, 19)])
def test_the_papers_constant_jacobian_on_the_tricept(tilt, steps):
    m = load_shipped("tricept")
    rng = np.random.default_rng(5)
    psi, theta = np.radians(rng.uniform(-tilt, tilt, (2, 5000)))
    psi[:4], theta[:4] = np.radians(tilt) * np.array([[1, 1, -1, -1], [1, -1, 1, -1]])
    platform = transform("rx", psi) @ transform("ry", theta) @ transform("tz", -rng.uniform(1100, 1300, 5000))
    joints = np.zeros((5000, 5)) + 0.3
    poses = Description.of(m.spec).pose(platform, joints)
    joints = m.inverse(poses)
    found = m.forward(joints, method="constant")
    assert found.converged.all()
    assert found.steps.max() <= steps
    assert found.steps.min() >= 1
    assert errors(m, found.poses, poses)[0].max() < 1e-8


def garbage(m, count=3000):
    """Joint vectors of no machine: of all sizes and signs, by the thousand."""
    rng = np.random.default_rng(6)
    size = 10.0 ** rng.uniform(-3, 5, (count, 1))
    rows = rng.normal(size=(count, len(m.joints))) * size
    rows[: count // 2] = m.inverse(m.home) + rng.normal(size=(count // 2, len(m.joints))) * size[: count // 2]
    return rows


@everyone
@pytest.mark.parametrize("method", [None, "newton", "constant"])
def test_random_joints_are_never_silently_wrong(m, method):
    joints = garbage(m)
    if method == "constant":
        joints = joints[:300]
    with np.errstate(all="ignore"):
        found = m.forward(joints, method=method)
    done = found.converged
    assert np.isnan(found.poses[~done]).all()
    assert np.isfinite(found.poses[done]).all()
    assert found.poses.shape == (len(joints), len(m.axes))
    miss, tilt = Description.of(m.spec).misses(found.poses[done], joints[done])
    size = 1.0 + np.abs(joints[done]).max(1, initial=0.0) / 1e3  # rounding grows with the joints
    assert (miss / size).max(initial=0.0) < 1e-9
    assert tilt.max(initial=0.0) < 1e-9


@everyone
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300, -1e300])
@pytest.mark.parametrize("method", [None, "newton", "constant"])
def test_what_is_no_length_never_converges_and_harms_no_neighbour(m, bad, method):
    legs = m.leg_count
    clean = np.tile(m.inverse(m.home), (300, 1))
    dirty = clean.copy()
    hurt = 7 + 13 * np.arange(legs)
    dirty[hurt, np.arange(legs)] = bad
    with np.errstate(all="ignore"):
        one, two = m.forward(clean, method=method), m.forward(dirty, method=method)
    rest = np.setdiff1d(np.arange(300), hurt)
    assert not two.converged[hurt].any()
    assert np.isnan(two.poses[hurt]).all()
    assert not (two.residual[hurt] <= 1e-9).any()
    assert two.converged[rest].all() == one.converged[rest].all()
    assert np.abs(two.poses[rest] - one.poses[rest]).max() < 1e-9


def test_a_central_leg_does_not_fold_over():
    m = load_shipped("tricept")
    joints = np.random.default_rng(7).uniform([500, 500, 500, -3, 0], [2000, 2000, 2000, 3, 2], (50_000, 5))
    found = m.forward(joints)
    done = found.converged
    assert done.mean() > 0.25
    miss, _ = Description.of(m.spec).misses(found.poses[done], joints[done])
    assert miss.max() < CLOSE


@everyone
def test_joints_that_cannot_assemble_do_not(m):
    joints = m.inverse(m.home)[None, :].copy()
    sliding = np.flatnonzero(np.array(m.joint_units[: m.leg_count]) == "mm")
    if not len(sliding):
        joints[0, 0] = np.inf  # arms that turn come back
    joints[0, sliding] += 5000.0 * (-1.0) ** np.arange(len(sliding))
    found = m.forward(joints)
    assert not found.converged.any()
    assert np.isnan(found.poses).all()


def well_away(m, poses, mode, serial):
    """Poses well away from the singularities of the legs, and of head and table."""
    a, b = m.jacobians(poses, mode=mode)
    calm = np.isfinite(a).all((1, 2)) & np.isfinite(b).all((1, 2))
    calm[calm] &= np.linalg.cond(a[calm]) < 1e14
    rates = np.linalg.pinv(a[calm]) @ b[calm]
    scale = np.where(np.array(m.axis_units) == "mm", 1.0, 200.0)[:, None]
    scale = scale / np.where(np.array(m.joint_units) == "mm", 1.0, 200.0)
    if serial:
        calm[calm] &= np.abs(np.linalg.det(b[calm][:, -serial:, -serial:])) > 0.1
        rates = np.linalg.pinv(a[calm]) @ b[calm]
    calm[calm] &= np.linalg.norm(rates * scale, axis=(1, 2)) < 15.0
    return calm


@families
@given(seed=st.integers(0, 2**32 - 1))
def test_drawn_machines_come_back(family, seed, tmp_path):
    d, drawn = draw(family, seed, 20)
    m = machine_of(d, tmp_path)
    rng = np.random.default_rng(seed)
    for mode in sorted({m.mode, str(rng.choice(m.modes))}):
        joints = m.inverse(drawn, mode=mode)
        good = np.isfinite(joints).all(1)
        poses, joints = drawn[good], joints[good]
        calm = well_away(m, poses, mode, len(d.serial))
        wild = joints * rng.choice([-1.0, 0.5, 1.0, 3.0], joints.shape) + rng.normal(size=joints.shape) * 100.0
        for given_, near in ((joints, nudged(m, poses, seed)), (joints, None), (wild, None)):
            found = m.forward(given_, near=near)
            done = found.converged
            miss, tilt = d.misses(found.poses[done], given_[done])
            size = 1.0 + np.abs(given_[done]).max(1, initial=0.0) / 500.0
            assert (miss / size).max(initial=0.0) < CLOSE
            assert tilt.max(initial=0.0) < 1e-9
            assert np.isnan(found.poses[~done]).all()
            if near is not None:
                place, angle = errors(m, found.poses, poses)
                assert done[calm].all()
                assert place[calm].max(initial=0.0) < 1e-8
                assert angle[calm].max(initial=0.0) < 1e-10
