"""Machines with more drives than freedoms, against those that leaving drives out makes, and plain linear algebra."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import parakin as pk
from parakin.accuracy.worst_case import bound_worst_case
from parakin.controllers.linuxcnc.config import write_ini
from parakin.controllers.linuxcnc.homing.homing_plan import find_homing
from parakin.dynamics.inverse_dynamics import Dynamics, Motion
from parakin.errors import InputError, NoMethodError, SingularHomeWarning
from parakin.export.machine.scene import build_scene
from parakin.machine import Machine
from parakin.performance.certified.proofs import bracket_extremes, make_pose_box, prove_no_singularity
from parakin.performance.indices import compute_performance
from parakin.performance.jacobians import compute_scaled_rates
from parakin.performance.singularities import compute_singularity_margins
from parakin.stiffness.stiffness import analyse_stiffness
from parakin.synthesis.sweep import SweepEvaluator, SweepPlan

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from ini_file import read_ini

PLANAR = """\
name: planar_four
source: Sizes were chosen.
motion: tx ty rz
legs:
  kind: length
  joints: [d1, d2, d3, d4]
  foot: [[500 mm, 0 mm, 0 mm], [0 mm, 500 mm, 0 mm], [-500 mm, 0 mm, 0 mm], [0 mm, -500 mm, 0 mm]]
  platform: [[100 mm, 80 mm, 0 mm], [-80 mm, 100 mm, 0 mm], [-100 mm, 80 mm, 0 mm], [-80 mm, -100 mm, 0 mm]]
  range: [150 mm, 850 mm]
home: {X: 0 mm, Y: 0 mm, C: 0 deg}
"""
SEVEN = """\
name: seven_struts
source: Sizes were chosen.
motion: tx ty tz rz ry rx
legs:
  kind: length
  joints: [d1, d2, d3, d4, d5, d6, d7]
  foot:
    - [500 mm, 60 mm, 0 mm]
    - [-200 mm, 460 mm, 0 mm]
    - [-300 mm, 400 mm, 0 mm]
    - [-300 mm, -400 mm, 0 mm]
    - [-200 mm, -460 mm, 0 mm]
    - [500 mm, -60 mm, 0 mm]
    - [600 mm, 300 mm, 50 mm]
  platform:
    - [100 mm, 170 mm, 0 mm]
    - [90 mm, 180 mm, 0 mm]
    - [-200 mm, 20 mm, 0 mm]
    - [-200 mm, -20 mm, 0 mm]
    - [90 mm, -180 mm, 0 mm]
    - [100 mm, -170 mm, 0 mm]
    - [0 mm, 0 mm, 60 mm]
  range: [300 mm, 1100 mm]
home: {X: 0 mm, Y: 0 mm, Z: 600 mm, A: 0 deg, B: 0 deg, C: 0 deg}
"""
FOUR_ARMED_DELTA = """\
name: four_towers
source: Sizes were chosen.
motion: tx ty tz
legs:
  kind: slider
  joints: [q1, q2, q3, q4]
  rail: [0, 0, 1]
  foot: {circle: 400 mm, at: [0 deg, 90 deg, 180 deg, 270 deg]}
  platform: {circle: 80 mm, at: [0 deg, 90 deg, 180 deg, 270 deg]}
  rod: 600 mm
  branch: "+"
  range: [100 mm, 1100 mm]
home: {X: 0 mm, Y: 0 mm, Z: 200 mm}
"""
WRIST = """\
name: four_struts_and_wrist
source: Sizes were chosen.
motion: rx ry tz
legs:
  kind: length
  joints: [d1, d2, d3, d4]
  foot: {circle: 350 mm, at: [90 deg, 180 deg, 270 deg, 0 deg]}
  platform: {circle: 100 mm, at: [90 deg, 180 deg, 270 deg, 0 deg]}
  range: [934 mm, 1520 mm]
head:
  - tz: -300 mm
  - rz: {joint: theta1, range: [-200 deg, 200 deg]}
  - ry: {joint: theta2, range: [-100 deg, 100 deg]}
  - tz: -150 mm
home: {X: 0 mm, Y: 0 mm, Z: -1650 mm, B: 20 deg, C: 0 deg}
"""
TEXTS = {"planar_four": PLANAR, "seven_struts": SEVEN, "four_towers": FOUR_ARMED_DELTA, "four_struts_and_wrist": WRIST}
NAMES = [*TEXTS, "eclipse_overactuated"]
every = pytest.mark.parametrize("name", NAMES)


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    folder = tmp_path_factory.mktemp("redundant")

    def load(name):
        if name not in TEXTS:
            return pk.load(name)
        (folder / f"{name}.yaml").write_text(TEXTS[name])
        return pk.load(folder / f"{name}.yaml")

    return {name: load(name) for name in NAMES}


def poses_about(m, count, part=1.0):
    size = np.array([100.0 if unit == "mm" else 0.25 for unit in m.axis_units])
    return m.home + part * np.random.default_rng(0).uniform(-1, 1, (count, len(m.axes))) * size


def list_square_machines(m):
    """The machines that leave a drive or two out, with the columns of the joints that they have."""
    if m.name == "eclipse_overactuated":
        return [(pk.load("eclipse"), list(range(6)))]
    legs = m.spec.legs
    square = []
    for gone in range(len(legs)):
        kept = [leg for i, leg in enumerate(legs) if i != gone]
        own = Machine(replace(m.spec, legs=tuple(kept)))
        square.append((own, [m.joints.index(name) for name in own.joints]))
    return square


@every
def test_the_pose_is_that_of_the_machines_without_the_other_drives(name, machines):
    m = machines[name]
    assert len(m.joints) > len(m.axes)
    poses = poses_about(m, 300)
    joints = m.inverse(poses)
    for start in (None, poses + 1e-2):
        found = m.forward(joints, near=start)
        assert found.converged.mean() > (0.97 if start is None else 0.999)
        done = found.converged
        assert np.abs(found.poses - poses)[done].max() < 1e-9
        assert found.residual[done].max() < 1e-9
    for own, columns in list_square_machines(m):
        assert np.abs(own.inverse(poses) - joints[:, columns]).max() < 1e-9
        square = own.forward(joints[:, columns], near=poses + 1e-3)
        assert square.converged.mean() > 0.5
        assert np.abs(square.poses - found.poses)[square.converged].max() < 1e-6


@every
def test_joints_that_disagree_have_no_pose_but_that_of_least_squares(name, machines):
    m = machines[name]
    poses = poses_about(m, 20)
    off = m.inverse(poses)
    off[:, 0] += 1e-4 if m.joint_units[0] == "rad" else 0.05
    found = m.forward(off, near=poses)
    assert not found.converged.any()
    assert np.isnan(found.poses).all()
    assert {reason.split(" near")[0] for reason in found.reasons} == {"the joints do not agree with each other"}
    assert (found.residual > 1e-4).all()
    near = m.forward(off, near=poses, agreement=0.1)
    assert near.converged.all()
    assert (near.residual == found.residual).all()


def test_the_pose_of_least_squares_is_another_methods(machines):
    m = machines["planar_four"]
    feet, arms = (np.array([getattr(leg, what)[:2] for leg in m.legs]) for what in ("foot", "platform"))
    home = np.linalg.norm(arms - feet, axis=1)

    def close(pose, joints):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        struts = pose[:2] + arms @ np.array([[c, s], [-s, c]]) - feet
        return 0.5 * ((struts**2).sum(1) - joints**2) / home

    poses = poses_about(m, 5)
    joints = m.inverse(poses) + np.random.default_rng(1).normal(0.0, 0.5, (5, 4))
    found = m.forward(joints, near=poses, agreement=5.0)
    for pose, own in zip(found.poses, joints, strict=True):
        best = least_squares(close, pose + 0.01, args=(own,), xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        assert np.abs(best - pose).max() < 3e-5


@every
def test_rates_are_differences_and_amplification_is_that_of_the_pseudo_inverse(name, machines):
    m = machines[name]
    poses = poses_about(m, 50)
    a, b = m.jacobians(poses)
    assert a.shape == (50, len(m.joints), len(m.axes))
    back = np.linalg.solve(b, a)
    for column, step in enumerate(np.eye(len(m.axes)) * 1e-5):
        change = (m.inverse(poses + step) - m.inverse(poses - step)) / 2e-5
        assert change == pytest.approx(back[:, :, column], rel=1e-5, abs=1e-4)
    found = compute_performance(m, poses)
    rates = compute_scaled_rates(m, poses, found.length, m.mode)
    ways = np.linalg.solve(rates.b, rates.a)
    assert found.psi == pytest.approx(np.linalg.svd(np.linalg.pinv(ways), compute_uv=False), rel=1e-9)
    lengths = np.linalg.norm(ways @ found.directions.swapaxes(1, 2), axis=1)
    assert lengths * found.psi == pytest.approx(np.ones_like(found.psi), rel=1e-9)
    rows, columns = m.parallel_block
    block = rates.a[:, :rows, :columns]
    volume = np.sqrt(np.linalg.det(block.swapaxes(1, 2) @ block))
    assert compute_singularity_margins(m, poses)[:, 0] == pytest.approx(volume, rel=1e-9)


def test_a_machine_is_singular_where_the_rank_falls(tmp_path):
    """All four struts point to the middle, so that nothing holds the platform's turn."""
    radial = PLANAR.replace(
        PLANAR.split("  platform: ")[1].split("\n")[0], "{circle: 100 mm, at: [0 deg, 90 deg, 180 deg, 270 deg]}"
    )
    (tmp_path / "radial.yaml").write_text(radial)
    with pytest.warns(SingularHomeWarning, match="parallel singularity"):
        m = pk.load(tmp_path / "radial.yaml")
    assert m.sides(m.home[None]) == 0.0
    assert abs(compute_singularity_margins(m, m.home)[0]) < 1e-12
    assert compute_performance(m, m.home).greatest == np.inf
    assert m.forward(m.inverse(m.home), near=m.home).reasons.startswith("the start is a parallel singularity")
    turned = m.home + [0.0, 0.0, 0.3]
    assert m.forward(m.inverse(turned), near=turned).converged


@every
def test_all_poses_of_a_joint_vector(name, machines):
    m = machines[name]
    poses = poses_about(m, 3, 0.5)
    joints = m.inverse(poses)
    for pose, found in zip(poses, m.list_assemblies(joints), strict=True):
        assert found.complete == "all paths accounted for"
        assert np.abs(found.poses - pose).max(1).min() < 1e-9
        assert len(found) <= 2
        assert np.isfinite(found.radii).all()
    joints[:, 1] += 0.01
    assert [len(found) for found in m.list_assemblies(joints)] == [0, 0, 0]


def test_proofs_over_boxes(machines):
    m = machines["planar_four"]
    box = make_pose_box(pk.region(m, at={"C": 0.1}), {"X": (-20.0, 20.0), "Y": (-20.0, 20.0)})
    assert prove_no_singularity(box, "parallel").verdict == "proved"
    assert prove_no_singularity(box, "serial").verdict == "proved"
    least, greatest = bracket_extremes(box, tolerance=1e-3).brackets
    assert least.closed
    assert greatest.closed
    sampled = compute_performance(
        m, box.poses(np.random.default_rng(0).uniform(-20.0, 20.0, (2000, 2))), box.length.value
    )
    assert least.low <= sampled.least.min() <= least.high * 1.01
    assert greatest.low * 0.99 <= sampled.greatest.max() <= greatest.high


@pytest.mark.parametrize("name", ["seven_struts", "eclipse_overactuated"])
def test_drives_share_forces_of_the_least_squares(name, machines):
    """What they do along every motion is what the square machine's drives do, and no other share is smaller."""
    m = machines[name]
    poses = poses_about(m, 6, 0.5)
    a, b = m.jacobians(poses)
    ways = np.linalg.solve(b, a)
    twist = np.random.default_rng(2).normal(size=(6, len(m.axes))) * [50, 50, 50, 0.1, 0.1, 0.1]
    joints, speeds = m.inverse(poses), np.einsum("nij,nj->ni", ways, twist)
    step = 1e-4
    ends = [m.inverse(poses + way * step * twist) for way in (-1.0, 0.0, 1.0)]
    bends = (ends[0] - 2.0 * ends[1] + ends[2]) / step**2
    force = np.array([30.0, -20.0, -100.0])
    own = Dynamics(m).compute_forces(Motion(poses, joints, speeds, bends), force)
    square, columns = list_square_machines(m)[0]
    if name == "eclipse_overactuated":  # it has the same bodies
        given = Motion(poses, joints[:, columns], speeds[:, columns], bends[:, columns])
        other = Dynamics(square).compute_forces(given, force)
        power = np.einsum("nij,ni->nj", ways, own)
        assert power == pytest.approx(np.einsum("nij,ni->nj", ways[:, columns], other), rel=1e-5, abs=1e-3)
    arms = np.array(
        [m.leg_sizes[m.closure_joints.index(i)] if u == "rad" else 1.0 for i, u in enumerate(m.joint_units)]
    )
    idle = [np.linalg.svd((row * arms[:, None]).T)[2][len(m.axes) :] for row in ways]
    for row, ways_of_none in zip(own / arms, idle, strict=True):
        assert np.abs(ways_of_none @ row).max() < 1e-9 * np.abs(row).max()


def test_springs_hold_the_tool_together(machines):
    m = machines["seven_struts"]
    poses = poses_about(m, 10)
    found = analyse_stiffness(m, "100 N/um", "300 N/um", poses)
    a, b, _ = m.twist_rates(poses, m.inverse(poses))
    ways = np.linalg.solve(b, a)
    one = 1.0 / (1.0 / 100e3 + 1.0 / 300e3)
    assert found.matrices == pytest.approx(one * ways.swapaxes(1, 2) @ ways, rel=1e-9)
    assert found.drive_share == pytest.approx(0.75)


@pytest.mark.parametrize("name", ["seven_struts", "four_struts_and_wrist"])
def test_weight_moves_the_tool_to_where_the_energy_is_least(name, machines):
    """Against the drives' forces at rest, of any share, and the stiffness; and drives too soft to help are as none."""
    m = machines[name]
    poses = poses_about(m, 6, 0.5)
    springs = {
        joint: "100 N/um" if unit == "mm" else "20 kNm/rad" for joint, unit in zip(m.joints, m.joint_units, strict=True)
    }
    found = analyse_stiffness(m, springs, "rigid", poses)
    joints = m.inverse(poses)
    still = np.zeros_like(joints)
    forces = Dynamics(m).compute_forces(Motion(poses, joints, still, still))
    a, b, _ = m.twist_rates(poses, joints)
    pull = np.einsum("nij,ni->nj", np.linalg.solve(b, a), forces)
    assert found.sag() == pytest.approx(-np.einsum("nij,nj->ni", found.compliances, pull), rel=1e-6, abs=1e-9)


def test_soft_links_leave_the_weight_to_the_others(machines):
    m, square = machines["eclipse_overactuated"], pk.load("eclipse")
    poses = poses_about(square, 4, 0.5)
    springs = {
        joint: "100 N/um" if unit == "mm" else "20 kNm/rad"
        for joint, unit in zip(square.joints, square.joint_units, strict=True)
    }
    expected = analyse_stiffness(square, springs, "rigid", poses).sag()
    soft = {name: "0.001 Nm/rad" for name in m.joints if name not in square.joints}
    found = analyse_stiffness(m, springs | soft, "rigid", poses).sag()
    assert found == pytest.approx(expected, rel=1e-4)


@every
def test_sizes_that_are_off_move_the_tool_as_least_squares_do(name, machines):
    """Against the direct problem of machines whose sizes are drawn, which ends at the least squares of closures."""
    m = machines[name]
    poses = poses_about(m, 40, 0.5)
    found = pk.analyse_accuracy(m, {"feet" if name != "eclipse_overactuated" else "platform": "0.01 mm"}, poses)
    family = found.tolerances.family
    off = found.tolerances.halves * np.random.default_rng(3).uniform(-1.0, 1.0, (len(poses), len(family.names)))
    moved = family.forward(found.joints, family.nominal + off, near=poses)
    assert np.all(moved.converged)
    tip = [i for i, axis in enumerate(m.axes) if axis in "XYZ"]
    expected = np.einsum("nik,nk->ni", found.slopes[:, : len(tip)], off)
    assert (moved.poses - poses)[:, tip] == pytest.approx(expected, abs=3e-3 * np.abs(expected).max())


def test_calibration_finds_a_machines_numbers(machines):
    m = machines["seven_struts"]
    names = [p.name for p in m.parameters if p.group in ("feet", "joints")]
    family = pk.family(m, names)
    true = family.nominal + np.random.default_rng(4).uniform(-0.3, 0.3, len(names))
    poses = poses_about(m, 40)
    measured = pk.make_measurements(m, family.at(true).inverse(poses), poses)
    found = pk.calibrate(m, measured, free=names)
    values = dict(zip(names, true, strict=True))
    assert found.sizes == pytest.approx([values[name] for name in found.family.names], abs=1e-6)


def test_designs_are_worth_what_the_analyses_say(machines):
    m = machines["four_towers"]
    box = {"X": (-60.0, 60.0), "Y": (-60.0, 60.0), "Z": (180.0, 220.0)}
    springs, tolerances = {"drives": "100 N/um", "struts": "50 N/um"}, {"feet": "0.05 mm", "platform": "0.02 mm"}
    problem = pk.DesignProblem(
        m, {"legs.q1.rod": (450.0, 900.0)}, box, minimise=["condition"], fit_strokes=True, tolerances=tolerances,
        bounds={"stiffness": 1.5e4, "accuracy": 0.08, "amplification": 4.0, "stroke": 400.0}, **springs,
    )  # fmt: skip
    designs = pk.find_designs(problem)
    (design,) = designs.front
    own = design.machine
    poses = np.array(np.meshgrid(*(np.linspace(*box[axis], 5) for axis in "XYZ"))).reshape(3, -1).T
    assert (own.check(poses) == 0).all()
    performance = compute_performance(own, poses)
    compliances = analyse_stiffness(own, **springs, poses=poses).compliances
    for name, worst in (
        ("condition", performance.condition.max()),
        ("amplification", max(performance.greatest.max(), 1.0 / performance.least.min())),
        ("stiffness", 1.0 / np.linalg.eigvalsh(compliances).max()),
        ("accuracy", pk.analyse_accuracy(own, tolerances, poses).deviations.max()),
    ):
        assert design.values.get(name, worst) == pytest.approx(worst, rel=1e-5)
        sign = -1.0 if name == "stiffness" else 1.0
        assert sign * worst <= sign * design.proved[name] * (1.0 + 1e-9 * sign)


def test_sweeps_are_of_the_machines_own_checks(machines):
    m = machines["eclipse_overactuated"]
    free = {"R": (425.0, 600.0), "rod": (470.0, 660.0)}
    box = {"X": (-80.0, 80.0), "Y": 0.0, "Z": (90.0, 210.0)}
    plan = SweepPlan(pk.DesignProblem(m, free, box, minimise=["condition"]), 40, 16)
    chunk = SweepEvaluator(plan).evaluate(0)
    assert 0.2 < chunk.keeps.mean() < 1.0
    for numbers, allowed, (worst,) in list(zip(chunk.designs, chunk.allowed, chunk.values, strict=True))[:8]:
        own = m.replace_parameters(dict(zip(plan.problem.family.names, numbers.tolist(), strict=True)))
        poses = plan.problem.place_poses(numbers, plan.points)
        assert (own.check(poses) == 0).mean() == allowed
        condition = compute_performance(own, poses, plan.problem.tapes.length.value).condition.max()
        assert worst == pytest.approx(condition if np.isfinite(condition) else np.inf)


def test_what_drives_decide_together_is_refused(machines):
    m = machines["seven_struts"]
    accuracy = pk.analyse_accuracy(m, {"encoders": "2 um"}, m.home[None])
    for refused in (
        lambda: bound_worst_case(accuracy, {"X": (-1.0, 1.0)}),
        lambda: analyse_stiffness(m, "100 N/um", poses=m.home[None]).load(),
    ):
        with pytest.raises(NoMethodError, match="7 drives for 6 freedoms, which work against each other"):
            refused()


def test_every_drive_has_a_label(machines):
    for m in machines.values():
        assert sorted(", ".join(name for name, _ in build_scene(m).labels).split(", ")) == sorted(m.joints)


def test_no_joint_is_homed_by_itself(machines, tmp_path):
    assert all(joint.switch is None for joint in find_homing(machines["planar_four"]).joints)
    (tmp_path / "switches.yaml").write_text(PLANAR.replace("  range:", "  homing: 150 mm\n  range:"))
    with pytest.raises(InputError, match="joint d1 can't go to a switch by itself, there are 4 drives for 3 freedoms"):
        find_homing(pk.load(tmp_path / "switches.yaml"))


def test_no_leg_is_jogged_by_itself(machines):
    m = machines["four_struts_and_wrist"]
    ini = read_ini(write_ini(m))
    sequences = [int(ini[f"JOINT_{i}"]["HOME_SEQUENCE"]) for i in range(len(m.joints))]
    assert all(sequence < 0 for sequence in sequences[: m.leg_count])  # LinuxCNC jogs none of these
    assert all(sequence >= 0 for sequence in sequences[m.leg_count :])
