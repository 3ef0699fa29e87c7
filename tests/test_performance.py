"""Jacobians of the twist, performance indices and singularity margins against independent geometry."""

import numpy as np
import pytest
from drawn import draw, machine_of
from scipy.spatial.transform import Rotation
from shipped import REPRESENTATIVES, load_shipped

import parakin as pk
from parakin.performance.characteristic_length import choose_characteristic_length
from parakin.performance.indices import compute_performance
from parakin.performance.jacobians import list_twist_names
from parakin.performance.singularities import compute_singularity_margins, list_margin_names

NAMES = REPRESENTATIVES
everyone = pytest.mark.parametrize("m", [load_shipped(name) for name in NAMES], ids=NAMES)


def twist_jacobians(machine, poses, mode=None):
    """A and B of the twist at poses (..., axes)."""
    poses = np.asarray(poses, float)
    rows, n, m = poses.reshape(-1, poses.shape[-1]), len(machine.axes), len(machine.joints)
    a, b, _ = machine.twist_rates(rows, machine.inverse(rows, mode))
    return a.reshape(*poses.shape[:-1], m, n), b.reshape(*poses.shape[:-1], m, m)


def allowed_poses(m, count, seed=0):
    """Poses about home where the machine is allowed, at all orientations not far from home's."""
    rng = np.random.default_rng(seed)
    spread = np.where(np.array(m.axis_units) == "rad", 0.3, 80.0)
    poses = m.home + rng.uniform(-1, 1, (40 * count, len(m.axes))) * spread
    if m.axes[3:] == ("B", "C"):  # the tool's axis any way within a cone
        poses[:, 3], poses[:, 4] = rng.uniform(0.15, 0.7, len(poses)), rng.uniform(-3, 3, len(poses))
    found = poses[m.check(poses) == 0][:count]
    assert len(found) > 0.5 * count
    return found


def moved(m, poses, component, step):
    """The poses after the tool has gone on by a step of one component of the twist, by geometry of their own."""
    poses = poses.copy()
    name = list_twist_names(m)[component]
    if name in "XYZ":
        poses[:, m.axes.index(name)] += step
    elif name in ("w1", "w2"):
        b, c = poses[:, 3], poses[:, 4]
        k = np.stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], 1)
        e1 = np.stack([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), -np.sin(b)], 1)
        way = e1 if name == "w1" else np.cross(k, e1)
        k = k * np.cos(step) + way * np.sin(step)
        poses[:, 3] = np.arctan2(np.hypot(k[:, 0], k[:, 1]), k[:, 2])
        poses[:, 4] = np.arctan2(k[:, 1], k[:, 0])
    elif len(m.axes) < 6:
        poses[:, m.axes.index("ABC"["xyz".index(name[1])])] += step
    else:
        turn = Rotation.from_rotvec(step * np.eye(3)["xyz".index(name[1])])
        poses[:, 3:] = (turn * Rotation.from_euler("xyz", poses[:, 3:])).as_euler("xyz")
    return poses


def differences(m, poses, component, step, mode):
    """∂q by one component of the twist, (N, joints), by central differences of fourth order."""
    turning = np.array(m.joint_units) == "rad"
    q = [m.inverse(moved(m, poses, component, k * step), mode) for k in (-2, -1, 1, 2)]
    near, far = q[2] - q[1], q[3] - q[0]
    for d in (near, far):
        d[:, turning] = (d[:, turning] + np.pi) % (2 * np.pi) - np.pi
    return (8 * near - far) / (12 * step)


def check_rates(m, poses, mode=None):
    """A t' = B q' against differences of the inverse, where two step widths agree."""
    a, b = twist_jacobians(m, poses, mode)
    for component, name in enumerate(list_twist_names(m)):
        h = 1e-2 if name in "XYZ" else 1e-4
        slopes, other = (differences(m, poses, component, step, mode) for step in (h, 0.5 * h))
        good = np.abs(slopes - other).max(1) < 1e-7 * (1 + np.abs(slopes).max(1))
        assert good.mean() > 0.5
        rates = np.linalg.solve(b, a)[good, :, component]
        assert (np.abs(rates - slopes[good]).max(1) < 1e-6 * (1 + np.abs(slopes[good]).max(1))).all(), name


@everyone
def test_rates_of_the_twist_are_those_of_the_inverse(m):
    poses = allowed_poses(m, 40)
    for mode in m.modes[:2]:
        good = np.isfinite(m.inverse(poses, mode)).all(1)
        check_rates(m, poses[good], mode)


@everyone
def test_rates_of_the_twist_and_of_the_pose_go_by_the_angles_rates(m):
    poses = allowed_poses(m, 40, seed=1)
    (a, b), (pose_a, pose_b) = twist_jacobians(m, poses), m.jacobians(poses)
    n = len(m.axes)
    by_angles = np.tile(np.eye(n), (len(poses), 1, 1))
    if m.axes[3:] == ("B", "C"):
        by_angles[:, 4, 4] = np.sin(poses[:, 3])
    elif n == 6:
        c = Rotation.from_euler("z", poses[:, [5]]).as_matrix()
        cb = c @ Rotation.from_euler("y", poses[:, [4]]).as_matrix()
        by_angles[:, 3:, 3:] = np.stack([cb[:, :, 0], c[:, :, 1], np.tile([0.0, 0.0, 1.0], (len(poses), 1))], -1)
    size = np.abs(pose_a).max()
    assert np.abs(a @ by_angles - pose_a).max() < 1e-12 * size
    assert np.abs(b - pose_b).max() < 1e-12 * np.abs(pose_b).max()


@pytest.mark.parametrize("family", ["six", "columns", "any", "carried", "central", "rolling", "planar", "plane"])
def test_rates_of_drawn_machines(family, tmp_path):
    d, poses = draw(family, 5, 20)
    m = machine_of(d, tmp_path)
    for mode in m.modes[:3]:
        good = np.isfinite(m.inverse(poses, mode)).all(1)
        check_rates(m, poses[good], mode)


def test_the_jacobians_of_a_rolling_platform_hold_in_the_wrists_other_mode(tmp_path):
    d, poses = draw("rolling", 3, 10)
    m = machine_of(d, tmp_path)
    mode = m.mode[:-1] + "-"
    a, b = m.jacobians(poses, mode)
    h = np.where(np.array(m.axis_units) == "rad", 1e-5, 1e-3)
    slopes = [(m.inverse(poses + e, mode) - m.inverse(poses - e, mode)) / (2 * e.max()) for e in np.diag(h)]
    expected = np.stack(slopes, -1)
    assert np.abs(np.linalg.solve(b, a) - expected).max() < 1e-5 * np.abs(expected).max()


def test_where_the_poses_angle_is_free_the_twist_is_regular():
    m = load_shipped("orthoglide5_table")
    a, _ = twist_jacobians(m, m.home)
    assert abs(np.linalg.det(m.jacobians(m.home)[0])) < 1e-6
    assert abs(np.linalg.det(a)) > 1e6


def test_performance_of_the_orthoglide_is_that_of_its_rods():
    m = load_shipped("orthoglide")
    poses = np.random.default_rng(4).uniform(-110, 70, (50, 3))
    rods = poses[:, None, :] - m.inverse(poses)[:, :, None] * np.eye(3)
    j = np.linalg.inv(rods / np.einsum("nii->ni", rods)[:, :, None])
    found = compute_performance(m, poses.reshape(5, 10, 3))
    psi = np.linalg.svd(j, compute_uv=False).reshape(5, 10, 3)
    assert np.allclose(found.psi, psi, rtol=1e-12)
    assert np.allclose(found.condition, psi[..., 0] / psi[..., 2])
    assert np.allclose(found.manipulability, np.abs(np.linalg.det(j)).reshape(5, 10))
    assert np.allclose(found.force, 1 / psi)
    assert np.allclose(found.least, psi[..., 2])
    assert found.length.value is None
    # J Jᵀ u = psi² u: the directions are those of the ellipsoid's semi-axes.
    ways = found.directions.reshape(50, 3, 3)
    assert np.allclose(np.einsum("nij,nkj->nki", j @ j.swapaxes(1, 2), ways), psi.reshape(50, 3, 1) ** 2 * ways)
    cosines = np.abs(np.einsum("nii->ni", rods)) / np.linalg.norm(rods, axis=2)
    parallel = np.abs(np.linalg.det(rods / np.linalg.norm(rods, axis=2)[:, :, None]))
    assert np.allclose(found.margins.reshape(50, 4), np.column_stack([parallel, cosines]))
    assert found.margin_names == ("parallel", "serial rho_x", "serial rho_y", "serial rho_z")


def test_the_condition_number_takes_no_root_of_its_own():
    """On the diagonal psi are 1/(1 + v), twice, and 1/(1 - 2v)."""
    m = load_shipped("orthoglide")
    t = 60.0
    v = t / np.sqrt(m.spec.sizes["L"] ** 2 - 2 * t * t)
    found = compute_performance(m, [t, t, t])
    assert found.condition == pytest.approx((1 + v) / (1 - 2 * v), rel=1e-12)
    assert found.psi == pytest.approx([1 / (1 - 2 * v), 1 / (1 + v), 1 / (1 + v)], rel=1e-12)


@pytest.mark.parametrize("name", ["orthoglide", "hbg80_3d"])
def test_isotropic_at_home(name):
    m = load_shipped(name)
    found = compute_performance(m, m.home)
    assert found.psi == pytest.approx([1, 1, 1], abs=1e-12)
    assert found.margins == pytest.approx([1, 1, 1, 1], abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_singular_and_unreachable_poses_are_told_without_a_warning():
    m = load_shipped("lambda6")
    centre = m.home * [1, 1, 1, 1, 1, 0]
    found = compute_performance(m, [centre, m.home, [9e3, 0, 0, 0, 0, 0]])
    assert found.greatest[0] == found.condition[0] == np.inf
    assert abs(found.margins[0, 0]) < 1e-14
    assert found.margins[1, 0] > 0.5
    assert np.isnan(found.psi[2]).all()
    assert np.isnan(found.margins[2]).all()
    assert np.isfinite(found.psi[1]).all()
    beyond = centre - [0, 0, 0, 0, 0, 0.3]
    assert compute_singularity_margins(m, beyond)[0] < 0
    m = load_shipped("tricept")
    found = compute_performance(m, m.home)  # θ2 = 0
    assert found.least == 0.0
    assert found.condition == np.inf
    assert found.manipulability == 0.0
    assert np.isfinite(found.greatest)
    assert found.margins[-1] == 0.0
    assert compute_performance(m, np.zeros((0, 5))).psi.shape == (0, 5)


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head"])
def test_the_heads_margin_is_the_sine_of_its_second_angle(name):
    m = load_shipped(name)
    poses = allowed_poses(m, 50)
    margins = compute_singularity_margins(m, poses)
    assert list_margin_names(m)[-1] == "serial theta1-theta2"
    assert np.allclose(margins[:, -1], np.abs(np.sin(m.inverse(poses)[:, -1])), atol=1e-12)


def test_the_parallel_margin_of_a_hexapod_is_that_of_its_lines():
    m = load_shipped("hexapod")
    poses = allowed_poses(m, 20)
    length = 250.0
    turns = Rotation.from_euler("xyz", poses[:, 3:]).as_matrix()
    lines = []
    for leg in m.spec.legs:
        arm = turns @ (np.array(leg.platform) + [0, 0, m.spec.sizes["tool"]])  # from the tip
        rod = poses[:, :3] + arm - leg.foot
        unit = rod / np.linalg.norm(rod, axis=1, keepdims=True)
        lines.append(np.concatenate([unit, np.cross(arm, unit) / length], 1))
    det = np.linalg.det(np.stack(lines, 1))
    assert (np.sign(det) == np.sign(det[0])).all()
    assert np.allclose(compute_singularity_margins(m, poses, length)[:, 0], np.abs(det), rtol=1e-9)


def test_the_length_makes_angles_millimetres():
    m = load_shipped("hexapod")
    rule = choose_characteristic_length(m)
    corners = np.array([leg.platform for leg in m.spec.legs])
    assert rule.value == pytest.approx(np.sqrt(np.square(corners - corners.mean(0)).sum(1).mean()))
    pose = allowed_poses(m, 1)[0]
    one, two = compute_performance(m, pose, 100.0), compute_performance(m, pose, 200.0)
    assert two.manipulability / one.manipulability == pytest.approx(8.0)
    a, b = twist_jacobians(m, pose)
    j = np.diag([1, 1, 1, 100, 100, 100]) @ np.linalg.solve(a, b)
    assert one.psi == pytest.approx(np.linalg.svd(j, compute_uv=False))
    assert choose_characteristic_length(load_shipped("tricept")).value == pytest.approx(150.0)
    assert choose_characteristic_length(load_shipped("orthoglide5_table")).value == pytest.approx(100.0)
    assert choose_characteristic_length(load_shipped("linear_delta")).value is None
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(pk.PoseError):
            compute_performance(m, pose, wrong)
