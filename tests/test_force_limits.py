"""Drives' forces as a limit of the feed, against toppra's; and the keys of machine files that say them."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import parakin as pk
from parakin.cli import main
from parakin.dynamics.inverse_dynamics import Dynamics, Motion
from parakin.dynamics.masses import sum_masses

MACHINE = """name: heavy
source: Sizes were chosen.
motion: tx ty tz
legs:
  kind: slider
  joints: [x, y, z]
  foot: [[0, -50 mm, 0], [0, 0, 0], [0, 0, 0]]
  rail: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
  rod: 300 mm
  platform: [[0, -50 mm, 0], [0, 0, 0], [0, 0, 0]]
  range: [-500 mm, 500 mm]
  speed: 60 m/min
  acceleration: 10 m/s2
  force: [1.2 kN, 1 kN, 1.8 kN]
  rated: 2 kN
  power: 2 kW
  inertia: 30 kg
  stiffness: 100 N/um
bodies:
  rod: {diameter: 30 mm, wall: 4 mm, rods: 2, modulus: 210 GPa}
  carriage: {mass: 25 kg}
  platform: {mass: 80 kg}
home: {X: 0 mm, Y: 0 mm, Z: 0 mm}
"""
PART = """UNITS/MM
FEDRAT/9000,MMPM
RAPID
GOTO/-60,-40,30
GOTO/-60,-40,-20
GOTO/60,-40,-20
GOTO/60,40,-20
RAPID
GOTO/-60,-40,30
FINI
"""


def load(folder, *changes):
    text = MACHINE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "heavy.yaml"
    path.write_text(text, encoding="utf-8")
    return pk.load(path)


def prepare(folder, machine, part=PART, cutting_force=(0.0, 0.0, 0.0)):
    path = folder / "part.apt"
    path.write_text(part, encoding="utf-8")
    return pk.prepare(machine, replace(pk.read_path(path), cutting_force=cutting_force))


def test_as_quick_as_toppra(tmp_path):
    """One rapid motion at the limits of forces that weight, inertia and centrifugal forces take."""
    toppra = pytest.importorskip("toppra")
    logging.getLogger("toppra").setLevel(logging.ERROR)
    machine = load(tmp_path)
    job = prepare(tmp_path, machine, "UNITS/MM\nRAPID\nGOTO/-120,-80,60\nRAPID\nGOTO/120,90,-50\nFINI\n")
    rows = job.trajectory.joint_path
    s = np.append(0.0, np.cumsum(rows.step))
    dynamics, drives = Dynamics(machine), machine.drives

    def ask(q, speeds, accelerations):
        pose = machine.forward(q).poses
        return dynamics.compute_forces(Motion(*(row[None] for row in (pose, q, speeds, accelerations))))[0]

    forces = np.array([drive.force for drive in drives])
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.array([[-d.speed, d.speed] for d in drives])),
        toppra.constraint.JointAccelerationConstraint(np.array([[-d.acceleration, d.acceleration] for d in drives])),
        toppra.constraint.JointTorqueConstraint(ask, np.column_stack([-forces, forces]), np.zeros(len(drives))),
    ]
    path = toppra.SplineInterpolator(s, rows.joints, bc_type="natural")
    theirs = toppra.algorithm.TOPPRA(constraints, path, gridpoints=s[::2], solver_wrapper="seidel").compute_trajectory()
    assert job.seconds == pytest.approx(theirs.duration, rel=2e-3)
    used = pk.compute_drive_forces(job.trajectory).force_use
    assert used.max() == pytest.approx(1.0, abs=1e-3)
    assert any(name.endswith(".force") for name in job.trajectory.binding_fractions)


@pytest.mark.parametrize("jerk", ["", "\n  jerk: 200 m/s3"])
def test_the_feed_keeps_the_forces(jerk, tmp_path):
    strong = load(tmp_path, ("m/s2", f"m/s2{jerk}"), ("[1.2 kN, 1 kN, 1.8 kN]", "9 kN"))
    weak = load(tmp_path, ("m/s2", f"m/s2{jerk}"), ("[1.2 kN, 1 kN, 1.8 kN]", "[0.7 kN, 0.6 kN, 1.6 kN]"))
    quick, slow = prepare(tmp_path, strong), prepare(tmp_path, weak)
    assert quick.runs and slow.runs
    peaks = pk.compute_drive_forces(quick.trajectory).peaks
    assert (peaks > [700.0, 600.0, 1600.0]).all()
    used = pk.compute_drive_forces(slow.trajectory).force_use
    assert (used < 1.001).all()
    assert (used > 0.99).all()
    assert slow.seconds > quick.seconds
    fractions = slow.trajectory.binding_fractions
    assert {"x.force", "y.force", "z.force"} <= set(fractions)
    assert not any(name.endswith(".force") for name in quick.trajectory.binding_fractions)


def integrate_quickest(machine, rows, acting, powers):
    """The time of one motion by both passes of steps in the phase plane, each force and power tried as it is."""
    s = np.append(0.0, np.cumsum(rows.step))
    at = np.linspace(0.0, s[-1], 2001)
    joints = CubicSpline(s, rows.joints)
    q, slopes, bends = joints(at), joints(at, 1), joints(at, 2)
    poses = machine.forward(q, near=machine.home).poses
    own = Dynamics(machine).compute_path_forces(poses, q, slopes, bends, np.broadcast_to(acting, (len(at), 3)))
    force, speed, most = (
        np.array([getattr(d, key) for d in machine.drives]) for key in ("force", "speed", "acceleration")
    )
    h = at[1] - at[0]

    def bound(k, x):
        """The least and the greatest s̈ at places, (..., 1) each."""
        able = np.minimum(force, powers / np.maximum(np.abs(slopes[k]) * np.sqrt(x), 1e-9))
        rest = own.weight[k] + own.centrifugal[k] * x
        rates = np.concatenate([own.inertia[k], slopes[k]], -1)
        low = np.concatenate([-able - rest, -most - bends[k] * x], -1) / rates
        high = np.concatenate([able - rest, most - bends[k] * x], -1) / rates
        return np.minimum(low, high).max(-1), np.maximum(low, high).min(-1)

    every, ceiling = np.arange(len(at)), np.min((speed / np.abs(slopes)) ** 2, axis=1)
    below, above = np.zeros(len(at)), ceiling
    for _ in range(50):  # beyond some speed no s̈ keeps all
        middle = 0.5 * (below + above)
        low, high = bound(every, middle[:, None])
        below, above = np.where(low <= high, [middle, above], [below, middle])
    ceiling = below
    ahead, back = np.zeros(len(at)), np.zeros(len(at))
    for k in range(len(at) - 1):
        ahead[k + 1] = min(max(ahead[k] + 2.0 * h * bound(k, ahead[k])[1], 1e-6), ceiling[k + 1])
    for k in range(len(at) - 1, 0, -1):
        back[k - 1] = min(max(back[k] - 2.0 * h * bound(k, back[k])[0], 1e-6), ceiling[k - 1])
    v = np.sqrt(np.minimum(ahead, back))
    return float((2.0 * h / (v[1:] + v[:-1])).sum())


@pytest.mark.parametrize("acting", [(0.0, 0.0, 0.0), (-150.0, 80.0, -200.0)])
def test_powers_and_cutting_are_kept_and_cost_no_more_than_they_must(acting, tmp_path):
    machine = load(tmp_path, ("2 kW", "0.35 kW"))
    job = prepare(tmp_path, machine, "UNITS/MM\nFEDRAT/90000,MMPM\nGOTO/-120,-80,60\nGOTO/120,90,-50\nFINI\n", acting)
    forces = pk.compute_drive_forces(job.trajectory)
    assert (forces.power_use < 1.001).all()
    assert (forces.force_use < 1.001).all()
    assert forces.power_use.max() > 0.99
    assert any(name.endswith(".power") for name in job.trajectory.binding_fractions)
    best = integrate_quickest(machine, job.trajectory.joint_path, acting, 350e3)
    assert job.seconds == pytest.approx(best, rel=1e-2)


def test_the_feed_keeps_forces_with_that_of_cutting(tmp_path):
    machine = load(tmp_path)
    free, cutting = prepare(tmp_path, machine), prepare(tmp_path, machine, PART, (0.0, 0.0, -500.0))
    assert pk.compute_drive_forces(free.trajectory, {"Z": -500.0}).force_use.max() > 1.05
    assert pk.compute_drive_forces(cutting.trajectory).force_use.max() < 1.001
    assert cutting.seconds > free.seconds
    too_much = prepare(tmp_path, machine, PART, (0.0, 0.0, -1000.0))
    assert "z can't hold the weight and the cutting force: its force is too small" in too_much.unplanned


def test_the_report_tells_the_forces(tmp_path, capsys):
    load(tmp_path)
    (tmp_path / "part.apt").write_text(PART, encoding="utf-8")
    words = ["post", str(tmp_path / "part.apt"), "--machine", str(tmp_path / "heavy.yaml"), "-o", str(tmp_path)]
    assert main([*words, "--cutting-force", "Z=-200N"]) == 0
    report = (tmp_path / "part.report.html").read_text("utf-8")
    assert "Forces of the drives" in report
    assert "with a force of Z -200 N on the tip where it cuts" in report
    capsys.readouterr()
    assert main([*words, "--cutting-force", "W=-200N"]) == 2
    assert "--cutting-force" in capsys.readouterr().err


def test_a_weight_that_no_drive_holds_is_said(tmp_path, capsys):
    job = prepare(tmp_path, load(tmp_path, ("[1.2 kN, 1 kN, 1.8 kN]", "[1.2 kN, 1 kN, 0.9 kN]")))
    assert not job.runs
    assert "z can't hold the weight: its force is too small" in job.unplanned
    assert main(["forces", str(tmp_path / "heavy.yaml"), str(tmp_path / "part.apt")]) == 3
    said = capsys.readouterr()
    assert not said.out
    assert "z can't hold the weight" in said.err


@pytest.mark.parametrize("way", [2, 6, 30])
def test_a_power_that_is_not_reached_costs_no_time_at_short_corners(way, tmp_path):
    """A tangent at the corner's slow row bounded the long step beside it: to hours, and to infinite time."""
    corners = ((0, 0, 0), (way, 0, 0), (way, way, 0), (way, way, way))
    part = "UNITS/MM\n" + "".join(f"RAPID\nGOTO/{x},{y},{z}\n" for x, y, z in corners) + "FINI\n"
    kept, free = (
        prepare(tmp_path, load(tmp_path, ("  power: 2 kW\n", line)), part) for line in ("  power: 9 kW\n", "")
    )
    assert kept.seconds == pytest.approx(free.seconds, rel=1e-3)


@pytest.mark.parametrize("acting", [(0.0, 0.0, 0.0), (-150.0, 80.0, 0.0)])
def test_the_whole_takes_longer_for_what_the_rms_may_be(acting, tmp_path):
    free = prepare(tmp_path, load(tmp_path, ("rated: 2 kN", "rated: 9 kN")), PART, acting)
    kept = prepare(tmp_path, load(tmp_path, ("rated: 2 kN", "rated: [260 N, 9 kN, 9 kN]")), PART, acting)
    assert pk.compute_drive_forces(free.trajectory).rms[0] > 300.0
    assert kept.trajectory.binding_fractions["x.rated"] > 0.99
    steps, dynamics = kept.trajectory.sample(20_000.0), Dynamics(kept.posted.machine)
    cuts = ~kept.posted.path.rapid[
        np.searchsorted(kept.trajectory.times, steps.times).clip(0, len(kept.posted.path) - 1)
    ]
    motion = Motion(steps.poses, steps.joints, steps.speeds, steps.accelerations)
    rms = np.sqrt(np.mean(dynamics.compute_forces(motion, cuts[:, None] * np.array(acting)) ** 2, 0))
    assert rms[0] == pytest.approx(260.0, rel=2e-3)
    quickest = free.trajectory.at(steps.times * free.seconds / kept.seconds)
    assert np.abs(quickest.joints - steps.joints).max() < 1e-6
    assert pk.compute_drive_forces(kept.trajectory).overloaded == ()


def test_the_command_tells_what_the_rms_costs(tmp_path, capsys):
    load(tmp_path, ("rated: 2 kN", "rated: [260 N, 9 kN, 9 kN]"))
    (tmp_path / "part.apt").write_text(PART, encoding="utf-8")
    assert main(["forces", str(tmp_path / "heavy.yaml"), str(tmp_path / "part.apt")]) == 0
    said = capsys.readouterr().out
    assert "260.0 of 260 N" in said
    assert "as thick as drawn" not in said
    load(tmp_path, ("rated: 2 kN", "rated: 0.9 kN"))
    assert main(["forces", str(tmp_path / "heavy.yaml"), str(tmp_path / "part.apt")]) == 3
    said = capsys.readouterr().err
    assert "z can't bear weight and cutting for long: its rated force is too small" in said


def test_what_the_file_says_is_kept_to_the_last_bit(tmp_path):
    machine = load(tmp_path)
    again = tmp_path / "again.yaml"
    again.write_text(machine.format_yaml(), encoding="utf-8")
    copy = pk.load(again)
    assert copy.drives == machine.drives
    assert copy.bodies == machine.bodies


def test_masses_follow_what_the_file_says(tmp_path):
    masses = sum_masses(load(tmp_path))
    tube = np.pi * (15.0**2 - 11.0**2) * 300.0 + 4.0 / 3.0 * np.pi * 15.0**3  # with the balls at its ends
    assert masses == pytest.approx({"platform": 80.0, "carriage": 75.0, "rod": 3 * 2 * 7850e-9 * tube})


def test_a_motor_asks_for_its_inertia_times_the_acceleration(tmp_path):
    still, rates = np.zeros((1, 3)), np.array([[900.0, -400.0, 250.0]])
    bare, whole = (load(tmp_path, ("inertia: 30 kg", text)) for text in ("inertia: 1e-9 kg", "inertia: 30 kg"))
    asked = [Dynamics(m).compute_forces(Motion(still, m.inverse(still), 2.0 * rates, rates)) for m in (bare, whole)]
    assert asked[1] - asked[0] == pytest.approx(30.0 * rates * 1e-3, rel=1e-9)


def test_stiffness_is_what_the_file_says(tmp_path):
    machine = load(tmp_path)
    poses = [[0.0, 0.0, 0.0], [60.0, -30.0, 20.0]]
    stated = pk.analyse_stiffness(machine, poses=poses)
    rods = {"diameter": "30 mm", "wall": "4 mm", "rods": "2", "modulus": "210 GPa"}
    given = pk.analyse_stiffness(machine, "100 N/um", rods, poses)
    assert stated.compliances == pytest.approx(given.compliances, rel=1e-12)
    assert stated.drive_share.max() < 1.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("power: 2 kW", "power: 2 kN", ':16: power: "2 kN" is a force, expected a power (W, kW)'),
        ("rated: 2 kN", "rated: 1", ':15: rated: "1" needs a unit: N, kN'),
        ("inertia: 30 kg", "inertia: 1 kg m2", "is a moment of inertia, expected a mass"),
        ("rated: 2 kN", "rated: -1 kN", "is out of range, expected more than 0 (N, kN)"),
        ("wall: 4 mm", "wall: 16 mm", "expected a diameter of at least twice as much"),
        ("rods: 2", "rods: 2.5", "a whole number from 1 to 9 expected"),
        ("carriage:", "cariage:", 'unknown key "cariage" in bodies'),
        ("80 kg", "80 mm", 'mass: "80 mm" is a length, expected a mass (kg, g, t)'),
    ],
)
def test_bad_keys_are_refused_in_one_line(old, new, message, tmp_path, capsys):
    (tmp_path / "heavy.yaml").write_text(MACHINE.replace(old, new), encoding="utf-8")
    assert main(["show", str(tmp_path / "heavy.yaml")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert message in said
    assert Path(said.split(":", 1)[0]).name == "heavy.yaml"
