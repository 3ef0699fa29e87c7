"""What every machine holds: shipped ones against independent formulas, drawn ones against their own geometry."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import FAMILIES, draw, machine_of, text_of
from geometry import Description
from hypothesis import event, given
from hypothesis import strategies as st
from independent import INVERSES as PAPERS
from independent_field import INVERSES as FIELD
from shipped import NAMES, REPRESENTATIVES, list_features, load_shipped

import parakin as pk
from parakin.model.legs import KINDS

INVERSES = PAPERS | FIELD
SPREAD = {  # about home, mm and rad: the allowed workspace and a margin beyond
    "cmw_300": [250, 250, 250, 0.5, 0.5, 0.5],
    "eclipse": [120, 110, 300, 0.35, 0.35, 0.5],
    "eclipse_overactuated": [120, 110, 300, 0.35, 0.35, 0.5],
    "exechon": [500, 500, 300, 1.9, 3.3],
    "five_bar": [330, 230],
    "five_bar_slides": [500, 200],
    "four_struts": [300, 300, 200, 0.9],
    "g500": [250, 250, 250, 0.5, 0.5, 0.5],
    "george_v": [400, 400, 400, 1.9, 3.3],
    "hbg80_2d": [230, 230],
    "hbg80_3d": [230, 230, 230],
    "hexaglide": [300, 140, 160, 0.5, 0.35, 0.5],
    "hexam": [250, 250, 250, 0.5, 0.5, 0.5],
    "hexapod": [300, 300, 250, 0.6, 0.6, 0.6],
    "lambda6": [350, 350, 400, 0.5, 0.5, 0.6],
    "linapod3": [350, 350, 400],
    "linapod6": [150, 150, 300, 0.3, 0.3, 0.4],
    "linear_delta": [260, 260, 300],
    "mikromat_6x": [250, 250, 250, 0.4, 0.4, 0.4],
    "okuma_hexapod": [300, 300, 250, 0.6, 0.6, 0.6],
    "orthoglide": [160, 160, 160],
    "orthoglide5_head": [200, 200, 200, 1.9, 3.3],
    "orthoglide5_table": [220, 220, 220, 1.7, 3.3],
    "pentapod": [200, 200, 150, 0.6, 3.3],
    "prr3": [130, 130, 0.45],
    "quickstep": [280, 300, 350],
    "rotary_delta": [200, 200, 200],
    "rpr3": [200, 200, 0.75],
    "rrr3": [200, 200, 0.45],
    "rus6": [150, 150, 120, 0.3, 0.3, 0.4],
    "sprint_z3": [450, 450, 280, 0.9, 3.3],
    "tornado_2000": [300, 300, 250, 0.6, 0.6, 0.6],
    "tricept": [1200, 1200, 500, 1.8, 3.3],
    "tricept_805": [1400, 1400, 600, 1.8, 3.3],
    "triglide": [500, 260, 250],
    "triglide_pairs": [400, 200, 200],
    "urane_sx": [260, 280, 330],
    "variax": [350, 350, 300, 0.5, 0.5, 0.6],
}
everyone = pytest.mark.parametrize("m", [load_shipped(name) for name in NAMES], ids=NAMES)
families = pytest.mark.parametrize("family", sorted(FAMILIES))
seeds = st.integers(0, 2**32 - 1)


def poses_about(m, count, seed=0):
    return m.home + np.random.default_rng(seed).uniform(-1, 1, (count, len(m.axes))) * SPREAD[m.name]


def signed(m, a, b):
    """a - b of joints, angles modulo a turn."""
    turning = np.array(m.joint_units) == "rad"
    return np.where(turning, (a - b + np.pi) % (2.0 * np.pi) - np.pi, a - b)


REDUNDANT = {"driven_column"}  # which test_redundant.py represents


def test_every_machine_has_a_second_inverse_and_every_leg_kind_is_drawn():
    assert sorted(INVERSES) == NAMES
    assert {kind for _, kinds in FAMILIES.values() for kind in kinds} == set(KINDS)


def test_what_machines_have_is_represented():
    of = {name: list_features(load_shipped(name)) for name in NAMES}
    assert set().union(*of.values()) - REDUNDANT == set().union(*(of[name] for name in REPRESENTATIVES))


@everyone
def test_the_inverse_is_the_second_one(m):
    poses = poses_about(m, 100_000)
    joints, expected = m.inverse(poses), INVERSES[m.name](m.spec.sizes, poses)
    closing = np.isfinite(expected).all(1)
    assert np.array_equal(np.isfinite(joints).all(1), closing)
    assert np.isnan(joints[~closing]).all()
    assert (m.check(poses) == 0).mean() > 0.1  # the draw does cover the workspace
    off, turning = np.abs(signed(m, joints[closing], expected[closing])), np.array(m.joint_units) == "rad"
    assert off[:, ~turning].max(initial=0.0) < 1e-9
    arms = turning & (np.arange(len(turning)) < m.leg_count)
    assert off[:, arms].max(initial=0.0) < 1e-11  # near an arm and rod in line a root of a small difference
    turning &= ~arms
    if turning.any():  # θ1 is worth less the nearer the tool's axis is to the axis it turns about
        first, second = (expected[closing][:, i] for i in np.flatnonzero(turning))
        free = np.abs(np.sin(second)) < 1e-3
        assert off[~free][:, turning].max() < 1e-12
        assert off[:, turning][:, 1].max() < 1e-12
        assert len(first) > 10_000


@everyone
def test_every_working_mode_closes_and_leads_back(m):
    d = Description.of(m.spec)
    poses = poses_about(m, 200, seed=1)
    found = []
    for mode in m.modes:
        joints = m.inverse(poses, mode=mode)
        good = np.isfinite(joints).all(1)
        miss, tilt = d.misses(poses[good], joints[good])
        assert miss.max(initial=0) < 1e-9
        assert tilt.max(initial=0) < 1e-12
        if mode == m.mode:
            assert np.array_equal(joints, m.inverse(poses), equal_nan=True)
        found.append(joints)
        back = m.forward(joints[good], near=poses[good])
        assert back.converged.all()
        assert (
            np.abs(m.inverse(back.poses, mode=mode) - joints[good])[:, np.array(m.joint_units) == "mm"].max(initial=0)
            < 1e-9
        )
    rows = np.stack(found, 1)
    rows = rows[np.isfinite(rows).all((1, 2))]
    assert len(rows) > 20
    for i in range(len(m.modes)):
        for j in range(i):
            assert (np.abs(rows[:, i] - rows[:, j]).max(1) > 1e-3).mean() > 0.9, (m.modes[i], m.modes[j])


@families
@given(seed=seeds)
def test_the_inverse_of_drawn_machines_closes_their_legs(family, seed, tmp_path):
    d, poses = draw(family, seed)
    m = machine_of(d, tmp_path)
    assert m.axes == d.axes
    assert m.joints == d.joints
    assert m.check(m.home) == 0
    modes = np.random.default_rng(seed).choice(m.modes, 3).tolist()
    for mode in sorted({m.mode, *modes}):
        joints = m.inverse(poses, mode=mode)
        good = np.isfinite(joints).all(1)
        miss, tilt = d.misses(poses[good], joints[good])
        assert miss.max(initial=0) < 1e-9
        assert tilt.max(initial=0) < 1e-11
        assert good[0] or mode != m.mode
        margins, verdict = m.margins(poses, mode=mode), m.check(poses, mode=mode)
        broken = ~(margins >= 0.0)
        assert np.array_equal(verdict, np.where(broken.any(1), broken.argmax(1) + 1, 0))
        assert (verdict[~good] > 0).all()
    assert len(set(m.limits)) == len(m.limits)


def differences_of_inverse(m, poses, mode, h):
    """∂q/∂x, (N, joints, axes), by central differences of fourth order; h in rad, a hundredfold in mm."""
    columns = []
    for step in np.diag(np.where(np.array(m.axis_units) == "rad", h, 100 * h)):
        q = [m.inverse(poses + k * step, mode=mode) for k in (-2, -1, 1, 2)]
        columns.append((8 * signed(m, q[2], q[1]) - signed(m, q[3], q[0])) / (12 * step.max()))
    return np.stack(columns, -1)


def check_jacobians(m, poses, mode):
    """A x' = B q' against differences of the inverse, where two step widths agree; the share of such poses."""
    a, b = m.jacobians(poses, mode=mode)
    near, other = (differences_of_inverse(m, poses, mode, h) for h in (1e-3, 5e-4))
    size = np.abs(near).max((1, 2))
    good = np.isfinite(a).all((1, 2)) & np.isfinite(b).all((1, 2)) & (np.abs(near - other).max((1, 2)) < 1e-8 * size)
    a, b, near = a[good], b[good], near[good]
    error = np.abs(np.linalg.solve(b, a) - near).max((1, 2)) / size[good]
    assert error.max(initial=0) < 1e-6
    return good.mean()


@everyone
def test_jacobians_are_the_derivatives_of_the_inverse(m):
    for mode in m.modes[:4]:
        poses = poses_about(m, 300, seed=2)
        assert check_jacobians(m, poses, mode) > 0.5


@families
@given(seed=seeds)
def test_jacobians_of_drawn_machines(family, seed, tmp_path):
    d, poses = draw(family, seed, 10)
    m = machine_of(d, tmp_path)
    share = check_jacobians(m, poses, m.mode)
    event(f"{share:.1f} of the poses")


def test_the_jacobians_of_the_orthoglide_are_the_papers():
    m = load_shipped("orthoglide")
    poses = poses_about(m, 100, seed=3)
    a, b = m.jacobians(poses)
    rods = poses[:, None, :] - m.inverse(poses)[:, :, None] * np.eye(3)
    assert np.allclose(a, rods, atol=1e-10)  # b - c: both sides of A p' = B ρ' may change their sign
    assert np.allclose(b, np.eye(3) * np.einsum("nii->ni", rods)[:, None, :], atol=1e-10)
    a, b = m.jacobians(m.home)
    assert np.allclose(np.linalg.svd(np.linalg.solve(b, a))[1], 1.0, atol=1e-12)


@everyone
def test_check_is_the_first_broken_margin(m):
    poses = poses_about(m, 5000, seed=4)
    poses[::7] *= 3.0
    poses[5, -1] = np.nan
    for mode in m.modes[:3]:
        margins, verdict = m.margins(poses, mode=mode), m.check(poses, mode=mode)
        broken = ~(margins >= 0.0)
        expected = np.where(broken.any(1), broken.argmax(1) + 1, 0)
        expected[5] = verdict[5]
        assert verdict[5] > 0
        assert np.array_equal(verdict, expected)
        joints = m.inverse(poses, mode=mode)
        closes = np.isfinite(joints).all(1)
        assert np.array_equal(m.check(poses[closes], joints[closes], mode=mode), verdict[closes])
        assert (verdict[~closes] > 0).all()
    assert m.check(m.home) == 0
    assert len(set(m.limits)) == len(m.limits) == m.margins(m.home).shape[-1]
    assert [limit.name for limit in m.limit_definitions] == list(m.limits)
    with pytest.raises(pk.PoseError):
        m.check(poses, joints=m.inverse(poses[:1]))


def test_a_passive_limit_bounds_the_coordinate_it_names(tmp_path):
    d, _ = draw("six", 3)
    d.motion, d.mounting, d.head = ("tx", "ty", "tz", "rz", "ry", "rx"), [], []
    d.home = np.array([0.0, 0.0, -700.0, 0.1, 0.2, 0.1])
    d.limits = ["limits: {passive: {rz: [-0.2 rad, 0.2 rad]}}"]
    m = machine_of(d, tmp_path)
    assert m.margins(m.home)[m.limits.index("rz.max")] == pytest.approx(0.1)
    turned = m.home - 0.4 * np.eye(6)[5]
    assert m.margins(turned)[m.limits.index("rz.min")] == pytest.approx(-0.1)


def test_a_head_that_slides_is_refused(tmp_path):
    d, _ = draw("carried", 1)
    d.home = np.zeros(5)
    text = text_of(d).replace("table:", "head:") if not d.head else text_of(d)
    text = text.replace("head:\n", "head:\n  - tz: {joint: quill, range: [-1 mm, 50 mm]}\n")
    (tmp_path / "quill.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(pk.ParakinError) as caught:
        pk.load(tmp_path / "quill.yaml")
    assert "\n" not in str(caught.value)
