"""Performance and singularities against independent geometry; extremes and proofs against samples and real poses."""

import csv
import json

import numpy as np
import pytest
from drawn import draw, machine_of
from scipy.spatial.transform import Rotation

import parakin as pk
from parakin.cli import main
from parakin.performance.certified.interval_matrices import MatrixBounds
from parakin.performance.certified.proofs import (
    bracket_extremes,
    make_pose_box,
    prove_amplification,
    prove_no_singularity,
)
from parakin.performance.characteristic_length import choose_characteristic_length
from parakin.performance.extremes import MEASURES
from parakin.performance.indices import compute_performance
from parakin.performance.jacobians import list_twist_names
from parakin.performance.singularities import compute_singularity_margins, list_margin_names

NAMES = pk.machines()
everyone = pytest.mark.parametrize("m", [pk.load(name) for name in NAMES], ids=NAMES)


def twist_jacobians(machine, poses, mode=None):
    """A and B of the twist at poses (..., axes)."""
    poses = np.asarray(poses, float)
    rows, n = poses.reshape(-1, poses.shape[-1]), len(machine.axes)
    a, b, _ = machine.twist_rates(rows, machine.inverse(rows, mode))
    return a.reshape(*poses.shape[:-1], n, n), b.reshape(*poses.shape[:-1], n, n)


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
    m = pk.load("orthoglide5_table")
    a, _ = twist_jacobians(m, m.home)
    assert abs(np.linalg.det(m.jacobians(m.home)[0])) < 1e-6
    assert abs(np.linalg.det(a)) > 1e6


def test_performance_of_the_orthoglide_is_that_of_its_rods():
    m = pk.load("orthoglide")
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
    m = pk.load("orthoglide")
    t = 60.0
    v = t / np.sqrt(m.spec.sizes["L"] ** 2 - 2 * t * t)
    found = compute_performance(m, [t, t, t])
    assert found.condition == pytest.approx((1 + v) / (1 - 2 * v), rel=1e-12)
    assert found.psi == pytest.approx([1 / (1 - 2 * v), 1 / (1 + v), 1 / (1 + v)], rel=1e-12)


@pytest.mark.parametrize("name", ["orthoglide", "hbg80_3d"])
def test_isotropic_at_home(name):
    m = pk.load(name)
    found = compute_performance(m, m.home)
    assert found.psi == pytest.approx([1, 1, 1], abs=1e-12)
    assert found.margins == pytest.approx([1, 1, 1, 1], abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_singular_and_unreachable_poses_are_told_without_a_warning():
    m = pk.load("lambda6")
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
    m = pk.load("tricept")
    found = compute_performance(m, m.home)  # θ2 = 0
    assert found.least == 0.0
    assert found.condition == np.inf
    assert found.manipulability == 0.0
    assert np.isfinite(found.greatest)
    assert found.margins[-1] == 0.0
    assert compute_performance(m, np.zeros((0, 5))).psi.shape == (0, 5)


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head"])
def test_the_heads_margin_is_the_sine_of_its_second_angle(name):
    m = pk.load(name)
    poses = allowed_poses(m, 50)
    margins = compute_singularity_margins(m, poses)
    assert list_margin_names(m)[-1] == "serial theta1-theta2"
    assert np.allclose(margins[:, -1], np.abs(np.sin(m.inverse(poses)[:, -1])), atol=1e-12)


def test_the_parallel_margin_of_a_hexapod_is_that_of_its_lines():
    m = pk.load("hexapod")
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
    m = pk.load("hexapod")
    rule = choose_characteristic_length(m)
    corners = np.array([leg.platform for leg in m.spec.legs])
    assert rule.value == pytest.approx(np.sqrt(np.square(corners - corners.mean(0)).sum(1).mean()))
    pose = allowed_poses(m, 1)[0]
    one, two = compute_performance(m, pose, 100.0), compute_performance(m, pose, 200.0)
    assert two.manipulability / one.manipulability == pytest.approx(8.0)
    a, b = twist_jacobians(m, pose)
    j = np.diag([1, 1, 1, 100, 100, 100]) @ np.linalg.solve(a, b)
    assert one.psi == pytest.approx(np.linalg.svd(j, compute_uv=False))
    assert choose_characteristic_length(pk.load("tricept")).value == pytest.approx(150.0)
    assert choose_characteristic_length(pk.load("orthoglide5_table")).value == pytest.approx(100.0)
    assert choose_characteristic_length(pk.load("linear_delta")).value is None
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(pk.PoseError):
            compute_performance(m, pose, wrong)


# The atlas.


@pytest.mark.parametrize(("name", "count"), [("orthoglide", 2), ("hbg80_3d", 2)])
def test_isotropic_poses_of_the_workspace(name, count):
    m = pk.load(name)
    found = pk.atlas(pk.region(m))
    assert found.isolated
    assert len(found.isotropic) == count  # home, and its image beyond a parallel singularity
    assert np.abs(found.isotropic - m.home).max(1).min() < 1e-6
    assert (m.check(found.isotropic) == 0).all()
    assert np.allclose(compute_performance(m, found.isotropic).condition, 1.0, atol=1e-8)
    assert found.singular
    assert found.extreme("condition", "least").value == pytest.approx(1.0, abs=1e-9)
    assert found.extreme("condition", "greatest").value == np.inf
    assert found.extreme("parallel", "least").value == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("name", ["linear_delta", "hexapod"])
def test_no_sample_of_the_workspace_is_beyond_its_extremes(name):
    m = pk.load(name)
    found = pk.atlas(pk.region(m))
    assert np.array_equal(found.map.allowed, m.check(found.map.performance.poses) == 0)
    assert not found.singular
    assert len(found.isotropic) == 0
    poses = found.map.inside.poses
    rng = np.random.default_rng(8)
    samples = rng.uniform(poses.min(0) - 50, poses.max(0) + 50, (40_000, len(m.axes)))
    samples[:, 3:] = m.home[3:]
    samples = samples[m.check(samples) == 0]
    assert len(samples) > 4000
    told = compute_performance(m, samples)
    for extreme in found.extremes:
        assert m.check(extreme.pose) == 0
        at = compute_performance(m, extreme.pose)
        names = told.margin_names
        values, value = (
            (getattr(told, extreme.quantity), getattr(at, extreme.quantity))
            if extreme.quantity in MEASURES
            else (told.margins[:, names.index(extreme.quantity)], at.margins[names.index(extreme.quantity)])
        )
        assert extreme.value == pytest.approx(float(value), rel=1e-12)
        if extreme.side == "least":
            assert values.min() >= extreme.value - 1e-9
        else:
            assert values.max() <= extreme.value + 1e-9


def test_an_atlas_of_a_slice_and_questions_that_make_no_sense():
    m = pk.load("orthoglide")
    flat = pk.atlas(pk.region(m, at={"Z": -50.0}), step=25.0)
    assert flat.map.axes == ("X", "Y")
    assert flat.map.performance.psi.shape == (*flat.map.allowed.shape, 3)
    assert (flat.map.inside.poses[:, 2] == -50.0).all()
    wide = pk.atlas(pk.region(m, at={"Z": -50.0}, without=["*.max"]), step=25.0)
    assert wide.map.allowed.sum() > flat.map.allowed.sum()
    for wrong in ({"step": 0.0}, {"step": 1e-3}, {"length": -1.0}):
        with pytest.raises(pk.PoseError):
            pk.atlas(pk.region(m), **wrong)
    for wrong in ({"at": {"X": 900.0}}, {"mode": "?"}):
        with pytest.raises(pk.PoseError):
            pk.atlas(pk.region(m, **wrong))
    with pytest.raises(pk.PoseError, match="region: an atlas is of one orientation, B must not be swept"):
        pk.atlas(pk.region(pk.load("orthoglide5_head"), every={"B": (0.0, 0.1)}))


# Proofs.


def cube(m, low, high):
    return make_pose_box(m, dict.fromkeys(m.axes, (low, high)))


BOXES = {
    "hbg80_2d": {"X": (200, 260), "Y": (190, 230)},
    "hbg80_3d": {"X": (60, 120), "Y": (60, 100), "Z": (-150, -100)},
    "hexapod": {"X": (-20, 30), "Y": (10, 30), "A": (-0.1, 0.1), "C": (0.0, 0.1)},
    "lambda6": {"X": (-20, 30), "Z": (1380, 1420), "B": (-0.1, 0.1), "C": (0.4, 0.6)},
    "linear_delta": {"X": (-40, 40), "Y": (-40, 20), "Z": (260, 300)},
    "orthoglide": {"X": (-60, 40), "Y": (-40, 40), "Z": (-10, 40)},
    "orthoglide5_head": {"X": (-20, 20), "B": (0.3, 0.35), "C": (3.1, 3.2)},  # over the jump at 180°
    "orthoglide5_table": {"Y": (-10, 10), "B": (0.3, 0.33), "C": (-0.03, 0.02)},
    "tricept": {"X": (-320, -280), "Y": (-20, 20), "Z": (-1620, -1600)},
}


@everyone
def test_bounds_over_boxes_hold_the_rates_at_their_samples(m):
    box = make_pose_box(m, BOXES[m.name])
    points = np.random.default_rng(6).uniform(box.low, box.high, (500, len(box.spans)))
    scale = box.length.factor
    turns = len(m.structure.turns)
    columns = {
        "a": np.array([1.0] * (len(m.axes) - turns) + [1 / scale] * turns),
        "b": np.where(np.array(m.joint_units) == "rad", 1 / scale, 1.0),
    }
    for name, rates in zip("ab", twist_jacobians(m, box.poses(points)), strict=True):
        found = MatrixBounds(getattr(box, name), box.inputs, box.trace)(box.low[None], box.high[None])
        assert found.bounded.all()
        linear = found.middle[0] + np.einsum("nd,dij->nij", points - 0.5 * (box.low + box.high), found.slopes[0])
        size = np.abs(found.middle).max()
        assert (np.abs(rates * columns[name] - linear) <= found.rest[0] + 1e-12 * size).all()
        assert found.rest.max() < 0.3 * size  # and they tell something


@everyone
def test_brackets_hold_the_amplification_of_every_sample(m):
    box = make_pose_box(m, BOXES[m.name])
    found = bracket_extremes(box, tolerance=1e-3, boxes=6_000)
    points = np.random.default_rng(6).uniform(box.low, box.high, (5000, len(box.spans)))
    told = compute_performance(m, box.poses(points))
    least, greatest = found.brackets
    assert told.greatest.max() <= greatest.high
    assert told.least.min() >= least.low
    assert compute_performance(m, greatest.pose).greatest == pytest.approx(greatest.low)
    assert compute_performance(m, least.pose).least == pytest.approx(least.high)
    assert greatest.low >= told.greatest.max() * (1 - 1e-6)
    if m.name != "tricept":
        assert least.closed
        assert greatest.closed
        assert greatest.high <= greatest.low * 1.001
    for bracket in found.brackets:
        inside = [bracket.pose[m.axes.index(axis)] for axis in box.spans]
        assert (inside >= box.low).all()
        assert (inside <= box.high).all()


@everyone
def test_boxes_are_proved_free_of_singularities(m):
    box = make_pose_box(m, BOXES[m.name])
    for kind in ("parallel", "serial"):
        assert prove_no_singularity(box, kind).verdict == "proved"


def test_the_shipped_orthoglide_keeps_its_bounds_in_its_cube():
    m = pk.load("orthoglide")
    rod = m.spec.sizes["L"]
    low, high = -2 * rod / np.sqrt(17), rod / np.sqrt(11)
    proof = prove_amplification(cube(m, low, high), 1 / 3, 3)
    assert proof.verdict == "proved"
    assert proof.counterexample is None
    assert proof.tolerance == 1e-6
    least, greatest = proof.brackets
    assert greatest.low == pytest.approx(3, rel=1e-9)  # reached in both corners on the diagonal
    assert 3 <= greatest.high <= 3 * (1 + 1e-6)
    assert least.low <= 3 / 7 * (1 + 1e-12)
    assert least.high == pytest.approx(3 / 7, rel=1e-9)


def test_a_false_claim_on_the_amplification_is_refuted_by_a_pose():
    m = pk.load("orthoglide")
    for low, high, bounds in ((-100, 90, (1 / 3, 3)), (-100, 60, (0.6, 3)), (-123.4, 76, (1 / 3, 2.999))):
        proof = prove_amplification(cube(m, low, high), *bounds)
        assert proof.verdict == "refuted"
        psi = compute_performance(m, proof.counterexample).psi
        assert psi.max() > bounds[1] * (1 + 1e-6) or psi.min() < bounds[0] * (1 - 1e-6)
        assert ((proof.counterexample >= low) & (proof.counterexample <= high)).all()


def test_singularities_are_met():
    m = pk.load("orthoglide")
    proof = prove_no_singularity(cube(m, -100, 150), "parallel")
    assert proof.verdict == "refuted"
    assert abs(compute_singularity_margins(m, proof.counterexample)[0]) < 1e-12
    proof = prove_amplification(cube(m, -100, 150), 0.1, 100.0)
    assert proof.verdict == "refuted"
    assert compute_performance(m, proof.counterexample).greatest > 1e6
    m = pk.load("lambda6")
    for box in (make_pose_box(m, {"C": (-0.1, 0.3)}), make_pose_box(m, {}, at={"C": 0.0})):
        proof = prove_no_singularity(box, "parallel")
        assert proof.verdict == "refuted"
        assert abs(proof.counterexample[5]) < 1e-9
        assert prove_no_singularity(box, "serial").verdict == "proved"
    m = pk.load("tricept")
    box = make_pose_box(m, {"X": (-110, 90), "Y": (-130, 70), "Z": (-1650, -1500)})
    proof = prove_no_singularity(box, "serial")
    assert proof.verdict == "refuted"
    assert np.abs(proof.counterexample[:2]).max() < 1e-5  # the wrist stands straight
    assert prove_no_singularity(box, "parallel").verdict == "proved"


def test_a_box_out_of_reach_is_refuted_and_one_out_of_time_is_left_open():
    m = pk.load("orthoglide")
    proof = prove_no_singularity(cube(m, -100, 200), "serial")
    assert proof.verdict == "refuted"
    assert "does not reach" in proof.reason
    assert np.isnan(m.inverse(proof.counterexample)).all()
    proof = prove_no_singularity(cube(m, -120, 75), "parallel", boxes=2)
    assert proof.verdict == "undecided"
    assert proof.counterexample is not None
    proof = prove_amplification(cube(m, -120, 75), 0.4, 2.9999, boxes=10)
    assert proof.verdict == "undecided"
    assert "psi lies between" in proof.reason


def test_boxes_that_are_none():
    m = pk.load("tricept")
    wrong = [{"Q": (0, 1)}, {"X": (1, 0)}, {"X": (0, np.inf)}]
    for spans in wrong:
        with pytest.raises(pk.PoseError):
            make_pose_box(m, spans)
    for at in ({"X": 0.0}, {"Y": np.nan}, {"Q": 0.0}):
        with pytest.raises(pk.PoseError):
            make_pose_box(m, {"X": (0, 1)}, at)
    box = make_pose_box(m, {"X": (0, 1)})
    for bounds in ((-1, 2), (2, 1), (0, np.inf)):
        with pytest.raises(pk.PoseError):
            prove_amplification(box, *bounds)


# The command.


def told(capsys, *arguments, code=0):
    assert main(["atlas", *arguments]) == code
    return capsys.readouterr().out


def test_the_command_at_a_pose(capsys):
    said = json.loads(told(capsys, "tricept", "--pose", "X=100,Z=-1500,B=10", "--json"))
    assert said["schema"] == "parakin.atlas/1"
    m = pk.load("tricept")
    found = compute_performance(m, [100, 0, -1500, np.radians(10), 0])
    pose = said["pose"]
    assert pose["pose"] == pytest.approx({"X": 100, "Y": 0, "Z": -1500, "B": 10, "C": 0})
    assert pose["condition"] == pytest.approx(float(found.condition))
    assert [axis["psi"] for axis in pose["ellipsoid"]] == pytest.approx(found.psi.tolist())
    assert pose["length"]["value"] == pytest.approx(150)
    assert pose["margins"]["parallel"] == pytest.approx(float(found.margins[0]))
    assert said["region"] is None
    text = told(capsys, "tricept", "--pose", "X=100,Z=-1500,B=10")
    assert "characteristic length 150 mm" in text
    said = json.loads(told(capsys, "linear_delta", "--pose", "X=5000", "--json", code=3))
    assert said["verdict"] == "off limits"
    assert said["pose"]["condition"] is None


def test_the_command_over_the_workspace(capsys, tmp_path):
    said = json.loads(told(capsys, "orthoglide", "--json", "-o", str(tmp_path), "--step", "10", "--slice", "Z=-20"))
    assert said["region"]["isotropic"][0]["pose"] == pytest.approx({"X": 0, "Y": 0, "Z": 0}, abs=1e-6)
    assert said["region"]["singular"] == ["parallel"]
    assert said["region"]["step"] == 10
    table, picture = tmp_path / "orthoglide.atlas.csv", tmp_path / "orthoglide.atlas.Z-20.png"
    assert sorted(said["files"].values()) == sorted([str(table), str(picture)])
    assert picture.read_bytes().startswith(b"\x89PNG")
    with table.open() as file:
        rows = list(csv.DictReader(file))
    m = pk.load("orthoglide")
    poses = np.array([[float(row[f"{axis} [mm]"]) for axis in m.axes] for row in rows])
    assert (poses[:, 2] == -20).all()
    assert np.array_equal([row["allowed"] == "1" for row in rows], m.check(poses) == 0)
    values = np.array([float(row["condition number"]) for row in rows])
    assert np.allclose(values, compute_performance(m, poses).condition, rtol=1e-8)


def test_the_command_proves_and_refutes(capsys):
    box = "X=-100:70,Y=-100:70,Z=-100:70"
    said = json.loads(told(capsys, "orthoglide", "--box", box, "--amplification", "1/3:3", "--json"))
    assert [claim["verdict"] for claim in said["box"]["claims"]] == ["proved"] * 3
    assert said["box"]["psi"]["greatest"]["high"] < 3
    assert "proved" in told(capsys, "orthoglide", "--box", box)
    said = json.loads(told(capsys, "orthoglide", "--box", box, "--amplification", "1/2:2", "--json", code=3))
    assert said["verdict"] == "refuted"
    pose = said["box"]["claims"][2]["counterexample"]
    assert compute_performance(pk.load("orthoglide"), list(pose.values())).greatest > 2
    assert "refuted" in told(capsys, "orthoglide", "--box", box, "--amplification", "1/2:2", code=3)


@pytest.mark.parametrize(
    "arguments",
    [
        ("nothing",),
        ("orthoglide", "--box", "X=1"),
        ("orthoglide", "--box", "Q=1:2"),
        ("orthoglide", "--box", "X=3:2"),
        ("orthoglide", "--box", "X=1:2", "--at", "X=0"),
        ("orthoglide", "--amplification", "1:2"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "3"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "3:1"),
        ("orthoglide", "--box", "X=1:2", "--amplification", "a:b"),
        ("orthoglide", "--pose", "X=1,X=2"),
        ("orthoglide", "--pose", "1,2"),
        ("orthoglide", "--step", "0"),
        ("orthoglide", "--step", "0.001"),
        ("orthoglide", "--length", "-3"),
        ("orthoglide", "--slice", "Z=0"),
        ("orthoglide", "--slice", "Z=0", "--slice", "Z=0", "-o", "maps"),
        ("orthoglide", "--slice", "X=0", "--slice", "Z=0", "-o", "map.png"),
        ("orthoglide", "--slice", "Z=500", "-o", "map.png"),
        ("orthoglide", "--at", "X=900"),
        ("orthoglide", "-o", "map.pdf"),
        ("orthoglide", "--mode", "?"),
    ],
)
def test_bad_input_is_one_line(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["atlas", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not list(tmp_path.iterdir())
