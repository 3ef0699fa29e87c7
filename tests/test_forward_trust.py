"""The direct problem's promise: the working mode, the start's own side of the singularities, one row at a time."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from direct_problems import measure_sides
from shipped import load_shipped

import parakin as pk
from parakin.errors import SingularHomeWarning
from parakin.kinematics.solution import (
    ANSWERED,
    ON_ANOTHER_SIDE,
    OPEN,
    OTHER_MODE,
    REASONS,
    SINGULAR_ANSWER,
    SINGULAR_START,
    SINGULAR_WAY,
)

RAILS = (Path(__file__).parent / "machines" / "six_vertical_rails.yaml").read_text(encoding="utf-8")
PRR = """\
name: prr
source: Sizes were chosen.
motion: tx ty rz
legs:
  kind: slider
  joints: [q1, q2, q3]
  foot: {circle: 300 mm, at: [210 deg, 330 deg, 90 deg]}
  rail: [[cos(60 deg), -sin(60 deg), 0], [cos(60 deg), sin(60 deg), 0], [-1, 0, 0]]
  rod: 350 mm
  branch: "-"
  platform: {circle: 80 mm, at: [210 deg, 330 deg, 90 deg]}
  range: [-1 m, 1 m]
home: {X: 0 mm, Y: 0 mm, C: 5 deg}
"""

CONGRUENT = """\
name: congruent
source: Congruent triangles.
motion: tx ty rz
legs:
  kind: length
  joints: [d1, d2, d3]
  foot: {circle: 200 mm, at: [90 deg, 210 deg, 330 deg]}
  platform: {circle: 200 mm, at: [90 deg, 210 deg, 330 deg]}
  range: [10 mm, 650 mm]
home: {X: 100 mm, Y: 50 mm, C: 10 deg}
"""

HEXAGONS = """\
name: hexagons
source: Regular hexagons joined corner to corner are singular everywhere.
sizes: {R: 400 mm, r: 200 mm}
motion: tx ty tz rz ry rx
legs:
  kind: length
  joints: [a, b, c, d, e, f]
  foot: {circle: R, at: [0 deg, 60 deg, 120 deg, 180 deg, 240 deg, 300 deg]}
  platform: {circle: r, at: [0 deg, 60 deg, 120 deg, 180 deg, 240 deg, 300 deg]}
  range: [300 mm, 1500 mm]
home: {X: 0 mm, Y: 0 mm, Z: -800 mm, A: 0 deg, B: 0 deg, C: 0 deg}
"""


@pytest.fixture
def load(tmp_path):
    def loaded(text):
        path = tmp_path / "machine.yaml"
        path.write_text(text)
        return pk.load(path)

    return loaded


def draw(machine, count, spread=(250.0, 0.5), seed=0):
    """Reachable poses about home."""
    size = np.array([spread[axis in "ABC"] for axis in machine.axes])
    poses = machine.home + np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(size))) * size
    return poses[np.isfinite(machine.inverse(poses)).all(1)]


def twist_side(poses):
    """The determinant of the default hexapod's struts as screws: it knows no angles of a pose."""
    inch = 25.4
    foot = np.array([[-22.95, 13.25, 0], [22.95, 13.25, 0], [22.95, 13.25, 0], [0, -26.5, 0], [0, -26.5, 0]])
    foot = np.vstack([foot, [-22.95, 13.25, 0]]) * inch
    plate = np.array([[-1, 11.5, 0], [1, 11.5, 0], [10.459, -4.884, 0], [9.459, -6.616, 0], [-9.459, -6.616, 0]])
    plate = np.vstack([plate, [-10.459, -4.884, 0]]) * inch + [0, 0, 150.0]
    sides = []
    for pose in poses:
        (sa, sb, sc), (ca, cb, cc) = np.sin(pose[3:]), np.cos(pose[3:])
        turn = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        arms = plate @ (turn @ np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])).T
        rods = pose[:3] + arms - foot
        rods /= np.linalg.norm(rods, axis=1)[:, None]
        sides.append(np.linalg.det(np.hstack([rods, np.cross(arms, rods) / 300.0])))
    return np.array(sides)


def test_an_answer_is_in_the_working_mode(load):
    machine = load(RAILS)
    joints = machine.inverse(draw(machine, 20_000))
    found = machine.forward(joints)
    assert len(joints) > 800
    assert found.converged.mean() > 0.99
    off = machine.inverse(found.poses[found.converged]) - joints[found.converged]
    assert np.abs(off).max() < 1e-6


@pytest.mark.parametrize(
    "name", ["lambda6", "hbg80_2d", "hbg80_3d", "orthoglide", "linear_delta", "hexapod", "tricept"]
)
@pytest.mark.parametrize("far", [0.0, 1.0, 100.0])
def test_an_answers_inverse_is_the_joints(name, far):
    machine = load_shipped(name)
    poses = draw(machine, 3000, (200.0, 0.4))
    joints = machine.inverse(poses)
    step = np.array([far if unit == "mm" else far * 3e-3 for unit in machine.axis_units])
    near = poses + np.random.default_rng(1).uniform(-1.0, 1.0, poses.shape) * step
    # Without a mode a near pose may tell another one by its own joints; far away that is chance.
    for kwargs in ({"near": near} if far < 10.0 else {}, {"near": near, "mode": machine.mode}, {}):
        found = machine.forward(joints, **kwargs)
        back = machine.inverse(found.poses[found.converged]) - joints[found.converged]
        turning = np.array(machine.joint_units) == "rad"
        back[:, turning] = (back[:, turning] + np.pi) % (2.0 * np.pi) - np.pi
        pole = np.abs(found.poses[found.converged][:, 3]) < 1e-6 if machine.has_direction else np.zeros(len(back), bool)
        legs = back[:, : machine.leg_count]
        assert np.abs(legs[~pole]).max(initial=0.0) < 1e-6
        assert found.converged.mean() > 0.7


def test_the_side_is_the_near_poses_own(load):
    machine = load(PRR)
    truth = np.array([-140.0, -129.0, np.radians(-9.0)])
    joints = machine.inverse(truth)
    for near in (None, machine.home, truth + [1.0, -1.0, 0.01]):
        found = machine.forward(joints, near=near)
        assert found.converged
        np.testing.assert_allclose(found.poses, truth, atol=1e-7)


def measure_planar_sides(machine, poses, joints):
    """The determinants of a planar 3-PRR's rods as lines about its tool, (N,), by its legs' points alone."""
    x, y, turn = poses.T
    rows = []
    for leg, joint in zip(machine.spec.legs, joints.T, strict=True):
        px, py, _ = leg.platform
        at = np.cos(turn) * px - np.sin(turn) * py, np.sin(turn) * px + np.cos(turn) * py
        rod = [x + at[0] - leg.foot[0] - joint * leg.rail[0], y + at[1] - leg.foot[1] - joint * leg.rail[1]]
        rows.append(np.stack([*rod, at[0] * rod[1] - at[1] * rod[0]], axis=1))
    return np.linalg.det(np.stack(rows, axis=1))


@pytest.mark.parametrize(("mode", "told"), [("++-", True), ("-++", True), ("++-", False)])
def test_the_side_is_that_of_the_starts_own_joints_in_every_mode(mode, told):
    """Across a singular line from the start the rods turn as the sliders move, not only as the platform does."""
    machine, rng = load_shipped("prr3"), np.random.default_rng(1)
    poses = machine.home + rng.uniform(-1.0, 1.0, (3000, 3)) * [120.0, 120.0, 0.25]
    near = poses + rng.uniform(-1.0, 1.0, poses.shape) * [1.0, 1.0, 0.005]
    joints, own = machine.inverse(poses, mode), machine.inverse(near, mode)
    reached = np.isfinite(joints).all(1) & np.isfinite(own).all(1)
    poses, near, joints, own = (rows[reached] for rows in (poses, near, joints, own))
    found = machine.forward(joints, near=near, mode=mode if told else None)
    start, goal = measure_planar_sides(machine, near, own), measure_planar_sides(machine, poses, joints)
    done = found.converged
    assert (start[done] * measure_planar_sides(machine, found.poses[done], joints[done]) > 0.0).all()
    assert done[start * goal > 0.0].mean() > 0.999
    assert (start * goal < 0.0).any()


def test_sides_know_no_angles_of_the_pose():
    machine = load_shipped("hexapod")
    poses = draw(machine, 400, (200.0, 0.5), 3)
    rng = np.random.default_rng(4)
    near = poses + rng.uniform(-1.0, 1.0, poses.shape) * [400.0, 400.0, 400.0, 1.4, 1.4, 1.4]
    twin = np.column_stack([near[:, :3], near[:, 3] + np.pi, np.pi - near[:, 4], near[:, 5] + np.pi])
    assert (np.abs(near[:, 4]) > 0.5 * np.pi).any()
    for start in (near, twin):  # the same poses, written otherwise
        found = machine.forward(machine.inverse(poses), near=start)
        done = found.converged
        assert done.mean() > 0.5
        assert (twist_side(found.poses[done]) * twist_side(start[done]) > 0.0).all()


@pytest.mark.parametrize("name", ["hexapod", "lambda6", "tricept"])
def test_a_row_hangs_on_itself_alone(name):
    machine = load_shipped(name)
    poses = draw(machine, 1500, (250.0, 0.6), 5)
    rng = np.random.default_rng(6)
    step = np.array([200.0 if unit == "mm" else 0.5 for unit in machine.axis_units])
    near = poses + rng.uniform(-1.0, 1.0, poses.shape) * step
    joints = machine.inverse(poses)
    together, order = machine.forward(joints, near=near), rng.permutation(len(poses))
    shuffled = machine.forward(joints[order], near=near[order])
    np.testing.assert_array_equal(shuffled.poses, together.poses[order])
    np.testing.assert_array_equal(shuffled.why, together.why[order])
    for row in range(0, len(poses), 150):
        np.testing.assert_array_equal(machine.forward(joints[row], near=near[row]).poses, together.poses[row])


def test_why_there_is_no_answer(load):
    machine = load_shipped("hexapod")
    found = machine.forward(machine.inverse(machine.home) + [5000.0, -5000.0, 5000.0, -5000.0, 5000.0, -5000.0])
    assert (found.converged, found.why) == (False, SINGULAR_WAY)  # where its root meets another and both end
    assert {REASONS[why] for why in (OPEN, ON_ANOTHER_SIDE, OTHER_MODE)} and REASONS[ANSWERED] == ""
    across = load_shipped("hbg80_2d")
    poses = draw(across, 2000)
    far = poses[across.sides(poses) * across.sides(across.home[None]) < 0.0]
    found = across.forward(across.inverse(far), method="newton")
    assert len(far) > 100 and not found.converged.any()
    assert np.isin(found.why, (ON_ANOTHER_SIDE, OTHER_MODE, OPEN)).all()


def test_starts_that_lie_a_mm_off_across_a_singularity_say_so():
    """The pentapod's close starts that were refused since "the legs do not close near the start": they do, across."""
    machine = load_shipped("pentapod")
    poses = np.array([
        [-160.258453, -46.011684, 82.349898, 0.207942, -0.908815],
        [-122.127259, -90.736228, 145.499216, 0.284223, -0.587466],
        [-79.197392, -89.018647, 240.240812, 0.210584, -0.879235],
    ])  # fmt: skip
    starts = np.array([
        [-159.729314, -46.834252, 82.141584, 0.21665, -0.909388],
        [-122.550426, -89.830423, 145.478063, 0.279332, -0.594693],
        [-79.18721, -89.034283, 239.240986, 0.217606, -0.874053],
    ])  # fmt: skip
    assert (measure_sides(machine, poses) * measure_sides(machine, starts) < 0.0).all()
    found = machine.forward(machine.inverse(poses), near=starts)
    assert np.isin(found.why, (SINGULAR_WAY, ON_ANOTHER_SIDE)).all()


def test_a_continuum_is_named(load):
    machine = load(CONGRUENT)
    with pytest.raises(pk.NoMethodError, match="continuum"):
        machine.assemblies([150.0, 150.0, 150.0])
    assert 0 < len(machine.assemblies([150.0, 150.0, 151.0])) <= 6


def test_one_pose_of_a_continuum_is_no_answer(load):
    """Struts of one length let a congruent triangle go round a circle without a turn: no start tells where it is."""
    machine = load(CONGRUENT)
    angles = np.random.default_rng(0).uniform(-np.pi, np.pi, 200)
    poses = np.stack([150.0 * np.cos(angles), 150.0 * np.sin(angles), np.zeros(200)], 1)
    joints = machine.inverse(poses)
    assert joints == pytest.approx(150.0)
    starts = poses + np.random.default_rng(1).normal(size=poses.shape) * [10.0, 10.0, 0.1]
    for method in ("newton", "constant"):
        found = machine.forward(joints, near=starts, method=method)
        assert not found.converged.any()
        assert np.isin(found.why, (SINGULAR_ANSWER, ON_ANOTHER_SIDE, OPEN)).all()
    found = machine.forward(joints, near=starts)
    assert (found.why == SINGULAR_ANSWER).mean() > 0.9
    beside = machine.forward(machine.inverse(poses + [0.0, 0.0, 0.05]), near=poses + [0.0, 0.0, 0.1])
    assert beside.converged.all()


def test_a_machine_singular_everywhere_is_warned_of_and_finds_nothing(load):
    with pytest.warns(SingularHomeWarning, match="all poses about it are a parallel singularity .* architecturally"):
        machine = load(HEXAGONS)
    poses = draw(machine, 100, (50.0, 0.2))
    joints = machine.inverse(poses)
    assert not machine.forward(joints).converged.any()
    assert not machine.forward(joints, near=poses + 1e-4).converged.any()


def test_shipped_homes_are_no_singularities():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in pk.machines():
            load_shipped(name)


# Truths and starts of a hexapod; the starts' B is near or beyond 90°, where the angles' determinant changes its sign.
FLIPS = [
    ([67.823, -151.594, -1040.477, -0.4475, 0.5308, -0.1403], [-186.923, 372.852, -1182.113, -0.158, 1.7116, -0.8268]),
    ([64.689, 55.217, -936.349, -0.0563, 0.1412, 0.1853], [471.666, -219.043, -591.164, -0.3646, 0.9203, 1.3023]),
]


@pytest.mark.parametrize(("truth", "near"), FLIPS)
def test_a_start_beyond_a_right_angle_keeps_its_assembly(truth, near):
    machine = load_shipped("hexapod")
    truth, near = np.array(truth), np.array(near)
    twin = near + [0.0, 0.0, 0.0, np.pi, 0.0, np.pi]
    twin[4] = np.pi - near[4]
    joints = machine.inverse(truth)
    for start in (near, twin):
        found = machine.forward(joints, near=start)
        assert not found.converged or twist_side([found.poses])[0] * twist_side([near])[0] > 0.0


def test_beside_a_singularity_lambda6_is_found_from_home():
    machine = load_shipped("lambda6")
    poses = np.array(
        [
            [-268.31694, -126.046312, 1493.387614, -0.17854, 0.372856, -0.011269],
            [155.374986, -160.397423, 1472.985467, 0.375375, -0.233839, -0.058943],
            [-207.10782, 291.169798, 1413.448643, -0.116869, 0.388643, -0.046525],
            [-43.056845, 85.459287, 1405.972218, -0.197918, 0.202377, -0.018491],
        ]
    )
    joints = machine.inverse(poses)
    found = machine.forward(joints)
    assert found.converged.all()
    assert (machine.sides(found.poses) * machine.sides(machine.home[None]) > 0.0).all()
    assert np.abs(machine.inverse(found.poses) - joints).max() < 1e-8


def test_a_tripod_on_one_foot_is_warned_of_and_finds_nothing(load):
    text = (Path(pk.__file__).parent / "machines" / "tricept.yaml").read_text().replace("R: 350 mm", "R: 1e-300 mm")
    assert "1e-300" in text
    with pytest.warns(SingularHomeWarning, match="all poses about it are a parallel singularity"):
        machine = load(text)
    poses = machine.home + np.random.default_rng(0).uniform(0.0, 1.0, (100, 5)) * [50.0, 50.0, 50.0, 0.2, 0.2]
    joints = machine.inverse(poses)
    for near in (None, poses + 1e-4):
        found = machine.forward(joints, near=near)
        assert not found.converged.any()
        assert (found.why == SINGULAR_START).all()


COAXIAL = """\
name: coaxial
source: Sizes were chosen.
motion: tx ty tz
legs:
  kind: length
  joints: [a, b, c]
  foot: [[{x} mm, 0 mm, 0 mm], [0 mm, 0 mm, 0 mm], [0 mm, 0 mm, 0 mm]]
  platform: [[0 mm, 0 mm, 0 mm], [0 mm, 0 mm, 0 mm], [0 mm, 0 mm, 0 mm]]
  range: [10 mm, 3 m]
home: {{X: 0 mm, Y: 0 mm, Z: -500 mm}}
"""


@pytest.mark.parametrize("x", [0, 100])
@pytest.mark.filterwarnings("ignore::parakin.errors.SingularHomeWarning")
def test_spheres_about_one_line_share_a_continuum_or_nothing(load, x):
    machine = load(COAXIAL.format(x=x))
    joints = machine.inverse(machine.home)
    for method in ("closed", "newton", "constant"):
        for near in (None, machine.home):
            found = machine.forward(joints, near=near, method=method)
            assert (found.converged, found.why) == (False, SINGULAR_START)
    with pytest.raises(pk.NoMethodError, match="continuum"):
        machine.assemblies(joints)
    assert len(machine.assemblies(joints + [0.0, 50.0, 0.0])) == 0


@pytest.mark.parametrize("name", ["linear_delta", "orthoglide", "lambda6", "orthoglide5_table"])
def test_a_pose_in_another_mode_than_the_machines_says_so(name):
    """The joints of the first leg's other solution lead back to the pose near by, and the answer says in which mode."""
    machine = load_shipped(name)
    pose = machine.home + 0.1
    other = ("-" if machine.mode[0] == "+" else "+") + machine.mode[1:]
    joints = np.stack([machine.inverse(pose, mode) for mode in (machine.mode, other)])
    solution = machine.forward(joints, near=pose)
    assert solution.converged.all()
    assert solution.in_other_mode.tolist() == [False, True]
    assert "another working mode" in repr(solution)
    np.testing.assert_allclose(machine.inverse(solution.poses[1], other), joints[1], atol=1e-6)
    assert not machine.forward(joints[1], near=pose, mode=machine.mode).in_other_mode


@pytest.mark.parametrize("name", ["linear_delta", "hbg80_2d", "hbg80_3d", "orthoglide5_head", "orthoglide5_table"])
def test_closed_forms_answer_on_the_side_of_starts_at_any_distance(name):
    """The side by the determinant of the twist, with the start's own joints; poses up to the rim of reach."""
    machine, rng = load_shipped(name), np.random.default_rng(7)
    spread = np.where(np.array(machine.axis_units) == "mm", max(machine.leg_sizes), 0.5)
    poses = machine.home + rng.uniform(-1.0, 1.0, (30_000, len(spread))) * spread
    starts = poses + spread * rng.normal(size=poses.shape) * 10.0 ** rng.uniform(-4.0, 0.0, (len(poses), 1))
    found = machine.forward(machine.inverse(poses), near=starts, mode=machine.mode)
    told = found.converged & np.isfinite(machine.inverse(starts)).all(1)
    assert told.sum() > 8000
    assert (machine.sides(starts[told]) * machine.sides(found.poses[told]) > 0.0).all()
