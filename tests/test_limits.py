"""Margins against distances and angles worked out anew, and paths through singular tool axes."""

from pathlib import Path

import numpy as np
import pytest
from geometry import Description
from scipy.optimize import minimize
from shipped import load_shipped

import parakin as pk


def about_home(m, count, spread=120.0, turn=0.3, seed=8):
    width = np.where(np.array(m.axis_units) == "mm", spread, turn)
    poses = m.home + np.random.default_rng(seed).uniform(-1, 1, (count, len(m.axes))) * width
    if m.axes[3:] == ("B", "C"):
        poses[:, 3] = np.abs(poses[:, 3]) + 0.01
    return poses


def hexapod_struts(m, pose):
    """Feet and platform joints of the shipped hexapod in M, (6, 3) each."""
    a, b, c = pose[3:]
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    turn = rz @ ry @ rx
    feet = np.array([leg.foot for leg in m.spec.legs])
    tool = sum(step.value for step in m.spec.head)  # along the platform's Z only
    ends = pose[:3] + (np.array([leg.platform for leg in m.spec.legs]) - [0, 0, tool]) @ turn.T
    return feet, ends, turn


def test_clearances_and_cones_of_the_hexapod():
    m = load_shipped("hexapod")
    names = list(m.limits)
    least = m.spec.limits.clearance
    poses = about_home(m, 6)
    margins = m.margins(poses)
    home_feet, home_ends, _ = hexapod_struts(m, m.home)
    centred = (home_ends - home_feet) / np.linalg.norm(home_ends - home_feet, axis=1, keepdims=True)
    found = {"clearance": 0, "foot": 0, "platform": 0}
    for pose, row in zip(poses, margins, strict=True):
        feet, ends, turn = hexapod_struts(m, pose)
        assert np.abs(np.linalg.norm(ends - feet, axis=1) - m.inverse(pose)).max() < 1e-9
        rods = (ends - feet) / np.linalg.norm(ends - feet, axis=1, keepdims=True)
        for name in names:
            if name.startswith("clearance"):
                i, j = (m.joints.index(part) for part in name.split()[1].split("-"))

                def apart(x, i=i, j=j):
                    gap = feet[i] + x[0] * (ends[i] - feet[i]) - feet[j] - x[1] * (ends[j] - feet[j])  # noqa: B023
                    return gap @ gap

                best = min(minimize(apart, s, bounds=[(0, 1)] * 2, tol=1e-14).fun for s in ([0.1, 0.1], [0.9, 0.9]))
                assert row[names.index(name)] == pytest.approx(np.sqrt(best) - least, abs=1e-3)
                found["clearance"] += 1
            elif name.endswith((".foot", ".platform")):
                joint, at = name.split(".")
                i = m.joints.index(joint)
                cone = next(c for c in m.spec.limits.cones if c.at == at)
                axis = centred[i] if cone.axis is None else np.array(cone.axis)
                axis = turn @ axis if at == "platform" else axis
                angle = np.arctan2(np.linalg.norm(np.cross(axis, rods[i])), axis @ rods[i])
                assert row[names.index(name)] == pytest.approx(cone.angle - angle, abs=1e-12)
                found[at] += 1
    assert found["clearance"] >= 6 * 9
    assert found["foot"] + found["platform"] >= 36


def test_gaps_of_the_lambda():
    m = load_shipped("lambda6")
    poses = about_home(m, 50)
    q, row = m.inverse(poses), m.margins(poses)
    assert len(m.spec.limits.gaps) == 3
    for gap in m.spec.limits.gaps:
        apart = q[:, m.joints.index(gap.second)] - q[:, m.joints.index(gap.first)]
        name = f"gap {gap.first}-{gap.second}"
        assert np.abs(row[:, m.limits.index(f"{name}.min")] - (apart - gap.low)).max() < 1e-9
        assert np.abs(row[:, m.limits.index(f"{name}.max")] - (gap.high - apart)).max() < 1e-9


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
@pytest.mark.parametrize("start", [0, 3])
def test_a_path_with_upright_poses_closes_everywhere(name, start):
    """Poses exactly on the pole between leaning ones: the joints that follow() gives make those poses."""
    m = load_shipped(name)
    lean = np.array([0.0, 0.0, 0.2, 0.1, 0.0, 0.0, 0.1, 0.3, 0.0])[start:]
    poses = np.tile(m.home, (len(lean), 1))
    poses[:, :3] += np.random.default_rng(4).uniform(-25, 25, (len(lean), 3))
    poses[:, 3], poses[:, 4] = lean, 2.1
    q = m.follow(poses)
    miss, tilt = Description.of(m.spec).misses(poses, q)
    assert miss.max() < 1e-9
    assert tilt.max() < 1e-9
    jumps = np.abs(np.diff(q[:, m.wrist.first]))
    assert jumps.max() < 1.2  # of the wrist between neighbours some 30 mm apart; half a turn would be 3.1
    assert (m.check(poses, q) == 0).all()
    assert np.abs(m.margins(poses, q) - m.margins(poses + [0, 0, 0, 1e-7, 0], q)).max() < 1e-1


@pytest.mark.parametrize("name", ["orthoglide5_head", "orthoglide5_table"])
def test_over_the_pole_the_first_joint_does_not_swing(name):
    m = load_shipped(name)
    lean = np.radians([-17.0, -11.0, -5.0, -1.0, 2.0, 7.0, 12.0, 17.0])
    poses = np.tile(m.home, (len(lean), 1))
    poses[:, 3], poses[:, 4] = np.abs(lean), np.where(lean < 0, np.pi, 0.0)
    q = m.follow(poses)
    first, serial = m.wrist.first, [3, 4]
    assert np.abs(np.diff(q[:, first])).max() < 1e-9
    second = next(i for i in serial if i != first)
    assert np.abs(np.diff(q[:, second])).max() < np.radians(6.5)
    assert np.sign(q[0, second]) == -np.sign(q[-1, second])
    back = m.forward(q, near=poses)
    assert back.converged.all()
    assert np.abs(back.poses - poses)[:, :4].max() < 1e-9
    alone = m.inverse(poses)
    assert np.abs(np.diff(alone[:, first])).max() > 3.0  # what was spared


def test_a_range_can_forbid_to_go_on_over_the_pole(tmp_path):
    shipped = next(p for p in (Path(pk.__file__).parent / "machines").iterdir() if p.stem == "tricept")
    text = shipped.read_text(encoding="utf-8")
    assert text.count("[-120 deg, 120 deg]") == 1
    path = tmp_path / "tricept.yaml"
    path.write_text(text.replace("[-120 deg, 120 deg]", "[-5 deg, 120 deg]"), encoding="utf-8")
    m = pk.load(path)
    lean = np.radians([-12.0, -7.0, -2.0, 2.0, 7.0, 12.0])
    poses = np.tile(m.home, (len(lean), 1))
    poses[:, 3], poses[:, 4] = np.abs(lean), np.where(lean < 0, np.pi, 0.0)
    assert (m.check(poses, m.follow(poses)) == 0).all()
    assert m.follow(poses)[:, 4].min() > 0.0
    assert load_shipped("tricept").follow(poses)[:, 4].min() < -0.2


def test_the_scissors_take_the_point_farther_from_the_origin():
    m = load_shipped("hbg80_2d")
    rng = np.random.default_rng(6)
    poses = rng.uniform(60.0, 390.0, (20000, 2))
    poses = poses[m.check(poses) == 0]
    assert len(poses) > 2000
    back = m.forward(m.inverse(poses))
    assert (back.converged == (m.sides(poses) * m.sides(m.home) > 0.0)).all()  # others are across the singularity
    assert 0.5 < back.converged.mean() < 0.9
    assert np.abs(back.poses - poses)[back.converged].max() < 1e-8
    across = [347.7178, 347.7178]
    assert m.forward([150.0, 150.0], near=across).poses == pytest.approx(across, abs=1e-3)
    assert not m.forward([150.0, 150.0]).converged
