"""Calibration against simulated machines, the Cramér-Rao bound by differences, and what measurements can't tell."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.calibration import calibration
from parakin.calibration.calibration import choose_family
from parakin.calibration.measurement_plan import choose_rows
from parakin.calibration.setups import InstrumentFrame, UnknownPlane
from parakin.cli import main
from parakin.errors import PoseError
from parakin.workspaces.sampled.allowed_poses import sample_allowed_poses

MACHINES = ["tricept", "hexapod", "orthoglide", "lambda6"]
NOISE = pk.Noise(0.01, 2e-5)


class Simulated:
    """A machine whose numbers are off, with measured and held-out poses."""

    def __init__(self, name, seed=0, count=40, held_out=100, frame="machine"):
        self.machine = load_shipped(name)
        self.rng = np.random.default_rng(seed)
        family = choose_family(self.machine, None, frame).family
        deviations = np.array([0.2 if p.unit == "mm" else 3e-4 for p in family.parameters])
        self.family = family
        self.true = family.nominal + self.rng.normal(size=len(deviations)) * deviations
        poses = sample_allowed_poses(self.machine, count + held_out, 7 + seed)
        self.joints = family.inverse(poses, self.true)
        self.poses, self.held_poses = poses[:count], poses[count:]
        self.joints, self.held_joints = self.joints[:count], self.joints[count:]
        self.tip = [i for i, axis in enumerate(self.machine.axes) if axis in "XYZ"]

    def measure(self):
        """The poses with noise: of the tip's length, and of small turns of the tool."""
        measured = self.poses + self.rng.normal(0.0, NOISE.length, self.poses.shape)
        turning = [i for i, unit in enumerate(self.machine.axis_units) if unit == "rad"]
        measured[:, turning] = self.poses[:, turning] + self.rng.normal(0.0, NOISE.angle, (len(measured), len(turning)))
        if self.machine.has_direction:
            b, c = self.machine.direction
            off = (measured[:, c] - self.poses[:, c]) / np.sin(self.poses[:, b])
            measured[:, c] = self.poses[:, c] + off
        return measured

    def measure_error(self, machine):
        """The tip's error at the held-out joints, root mean square over poses, mm."""
        solution = machine.forward(self.held_joints, near=self.held_poses)
        assert solution.converged.all()
        return np.sqrt(((solution.poses - self.held_poses)[:, self.tip] ** 2).sum(1).mean())


def bound_error(simulated):
    """The Cramér-Rao bound of the tip's error at the held-out poses, mm, from differences of the direct problem."""
    family, true = simulated.family, simulated.true
    steps = np.array([1e-3 if p.unit == "mm" else 1e-6 for p in family.parameters])

    def differentiate(joints, near):
        slopes = []
        for i, step in enumerate(steps):
            ends = []
            for sign in (1.0, -1.0):
                sizes = true.copy()
                sizes[i] += sign * step
                ends.append(family.forward(joints, sizes, near=near).poses)
            slopes.append((ends[0] - ends[1]) / (2.0 * step))
        return np.stack(slopes, 2)

    machine = simulated.machine
    deviations = np.where(np.array(machine.axis_units) == "mm", NOISE.length, NOISE.angle)
    weights = np.broadcast_to(1.0 / deviations, simulated.poses.shape).copy()
    if machine.has_direction:
        weights[:, machine.direction.c] *= np.sin(simulated.poses[:, machine.direction.b])
    slopes = differentiate(simulated.joints, simulated.poses)
    if len(machine.axes) == 6:  # small turns about M's axes by the rates of A, B and C
        a, b, c = simulated.poses[:, 3:].T
        zero, one = np.zeros_like(a), np.ones_like(a)
        cosine, sine = np.cos, np.sin
        first = [cosine(c) * cosine(b), -sine(c), zero]
        turn = np.array([first, [sine(c) * cosine(b), cosine(c), zero], [-sine(b), zero, one]])
        slopes[:, 3:] = np.einsum("ijn,njk->nik", turn, slopes[:, 3:])
    weighed = (slopes * weights[:, :, None]).reshape(-1, len(steps))
    covariance = np.linalg.inv(weighed.T @ weighed)
    held = differentiate(simulated.held_joints, simulated.held_poses)[:, simulated.tip]
    return np.sqrt(np.einsum("nik,kl,nil->n", held, covariance, held).mean())


@pytest.mark.parametrize("name", MACHINES)
def test_the_error_left_is_the_cramer_rao_bound(name):
    """Of three draws of the noise: root mean square within 1.2 of the bound, and what is predicted is what is found."""
    simulated = Simulated(name)
    before, errors, predicted, ratios = simulated.measure_error(simulated.machine), [], [], []
    for _ in range(3):
        rows = pk.make_measurements(simulated.machine, simulated.joints, simulated.measure(), noise=NOISE)
        result = pk.calibrate(simulated.machine, rows)
        solution = result.family.forward(simulated.held_joints, result.sizes, near=simulated.held_poses)
        errors.append(((solution.poses - simulated.held_poses)[:, simulated.tip] ** 2).sum(1).mean())
        predicted.append((result.predict_deviations(simulated.held_poses)[:, simulated.tip] ** 2).sum(1).mean())
        ratios.append(result.fit)
    error = np.sqrt(np.mean(errors))
    bound = bound_error(simulated)
    assert error < 1.2 * bound
    assert error > 0.5 * bound  # a bound that is too great would hide a poor fit
    assert np.sqrt(np.mean(predicted)) == pytest.approx(bound, rel=0.15)
    assert error < 0.05 * before
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)
    assert simulated.measure_error(result.machine) == pytest.approx(np.sqrt(errors[-1]), rel=1e-6)


def measure_bed(machine, spread=120.0):
    """Joints where the tip touches a bed."""
    grid = np.linspace(-spread, spread, 9)
    x, y = (values.ravel() for values in np.meshgrid(grid, grid))
    inside = np.hypot(x, y) < 1.05 * spread
    poses = np.stack([x[inside], y[inside], np.full(inside.sum(), machine.home[2])], 1)
    return machine.inverse(poses), poses


@pytest.mark.parametrize("name", ["linear_delta", "rotary_delta"])
def test_probing_a_bed_tells_not_radius_from_rod(name):
    """What delta printers' users meet: the answer is a refusal that names the measurement that would tell."""
    machine = load_shipped(name)
    joints, poses = measure_bed(machine)
    free = ["rods", "encoders", "feet"]
    probed = pk.make_measurements(machine, joints, poses[:, 2:], axes="Z", noise=pk.Noise(0.02))
    with pytest.raises(pk.UnidentifiableError) as refusal:
        pk.calibrate(machine, probed, free)
    assert str(refusal.value).startswith("57 measurements of Z can't tell")
    assert "measure X, Y, Z of the tool" in str(refusal.value)
    whole = pk.make_measurements(machine, joints, poses, noise=pk.Noise(0.02))
    assert pk.calibrate(machine, whole, free).fit < 1e-3


@pytest.mark.parametrize(
    ("name", "free"),
    [("linear_delta", ["tower", "rod", "encoders"]), ("rotary_delta", ["R", "rod", "arm", "encoders"])],
)
def test_a_radius_and_rods_of_one_length_neither(name, free):
    """Tools that guess find rods of 281 mm where they are 272 mm: some 9 mm is what such probing leaves open."""
    machine = load_shipped(name)
    joints, poses = measure_bed(machine)
    probed = pk.make_measurements(machine, joints, poses[:, 2:], axes="Z", noise=pk.Noise(0.02))
    with pytest.raises(pk.UnidentifiableError, match="measure X of the tool") as refusal:
        pk.calibrate(machine, probed, free)
    assert {"rod", "arm"} & set(re.findall(r"\w+", str(refusal.value)))
    assert {"tower", "R"} & set(re.findall(r"\w+", str(refusal.value)))
    both = pk.make_measurements(machine, joints, poses[:, [0, 2]], axes="X Z", noise=pk.Noise(0.02))
    assert pk.calibrate(machine, both, free).fit < 1e-3


def test_what_is_measured_already_is_not_advised(monkeypatch):
    machine = load_shipped("linear_delta")
    joints, poses = measure_bed(machine)
    whole = pk.make_measurements(machine, joints, poses, noise=pk.Noise(0.02))
    free = ["rods", "encoders", "feet"]
    amplified = pk.calibrate(machine, whole, free).combinations[0].amplification
    monkeypatch.setattr(calibration, "AMPLIFIED", 0.9 * amplified)  # measured twice, it would be below
    with pytest.raises(pk.UnidentifiableError, match="measure at more joints, farther apart"):
        pk.calibrate(machine, whole, free)


def test_probing_a_bed_tells_the_endstops():
    machine = load_shipped("linear_delta")
    family = pk.family(machine, ["encoders"])
    true = family.nominal + [0.4, -0.3, 0.9]
    _, poses = measure_bed(machine)
    rng = np.random.default_rng(3)
    heights = poses[:, 2:] + rng.normal(0.0, 0.02, (len(poses), 1))
    probed = pk.make_measurements(machine, family.inverse(poses, true), heights, axes="Z", noise=pk.Noise(0.02))
    result = pk.calibrate(machine, probed, ["encoders"])
    deviations = np.array([p.deviation for p in result.parameters])
    assert np.abs(result.sizes - true).max() < 4.0 * deviations.max() < 0.05
    assert result.held_out == pytest.approx(1.0, abs=0.2)


def test_a_ball_bar_whose_end_is_not_known():
    simulated = Simulated("orthoglide", 2, 120)
    point = np.array([30.0, -20.0, -250.0])
    lengths = np.linalg.norm(simulated.poses - point, axis=1) + simulated.rng.normal(0.0, 0.002, 120)
    noise = pk.Noise(0.002)
    rows = pk.make_measurements(simulated.machine, simulated.joints, distances=lengths, noise=noise)
    free = ["rods", "encoders"]
    family = pk.family(simulated.machine, free)
    true = family.nominal + np.array([0.1, -0.2, 0.05, 0.3, -0.1, 0.2])
    joints = family.inverse(simulated.poses, true)
    rows = pk.make_measurements(simulated.machine, joints, distances=lengths[:, None], noise=noise)
    result = pk.calibrate(simulated.machine, rows, free)
    assert np.abs(result.centre - point).max() < 0.5
    assert result.fit == pytest.approx(1.0, abs=0.2)
    solution = result.family.forward(joints, result.sizes, near=simulated.poses)
    differences = np.linalg.norm(solution.poses - result.centre, axis=1) - np.linalg.norm(
        simulated.poses - point, axis=1
    )
    assert np.sqrt((differences**2).mean()) < 0.002


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [1e-8, 0.0, 2e-8], [0.4, -1.1, 0.7], [2.0, 2.0, 1.2]])
def test_what_measures_and_its_derivatives_are_differences(turn):
    rng = np.random.default_rng(3)
    tips = rng.uniform(-200.0, 200.0, (12, 3))
    frame = np.concatenate([[300.0, -40.0, 120.0], turn])
    values = Rotation.from_rotvec(turn).inv().apply(tips - frame[:3])
    instrument = InstrumentFrame(tips, values)
    assert instrument.predict(tips, instrument.begin).values == pytest.approx(values, abs=1e-9)
    normal = np.array([0.1, 0.2, -0.97]) / np.linalg.norm([0.1, 0.2, -0.97])
    plane = UnknownPlane(tips, tips @ normal - 12.0)
    assert np.abs(plane.find_normal(plane.begin) - normal).max() < 1e-9
    for setup, unknown in ((instrument, frame), (plane, plane.begin + [0.5, 0.03, -0.02])):
        told = setup.predict(tips, unknown)
        for i in range(len(unknown)):
            step = 1e-6 * np.eye(len(unknown))[i]
            ends = [setup.predict(tips, unknown + sign * step).values for sign in (1.0, -1.0)]
            assert told.by_unknown[:, :, i] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-5)
        for i in range(3):
            step = 1e-4 * np.eye(3)[i]
            ends = [setup.predict(tips + sign * step, unknown).values for sign in (1.0, -1.0)]
            assert told.by_tips[:, :, i] == pytest.approx((ends[0] - ends[1]) / 2e-4, abs=1e-6)


TRACKER = np.array([1500.0, -800.0, 400.0, 0.4, -1.1, 0.7])  # its origin, mm, and the vector of its turn


def see_from_tracker(tips, frame=TRACKER):
    return Rotation.from_rotvec(frame[3:]).inv().apply(tips - frame[:3])


@pytest.mark.parametrize("name", ["orthoglide", "linear_delta"])
def test_a_tracker_in_its_own_frame(name):
    """Within 1.2 of the Cramér-Rao bound, by differences, of places that it sees later; the machine's frame is kept."""
    simulated = Simulated(name, 3, 60, frame="instrument")
    family, tip, noise = simulated.family, simulated.tip, pk.Noise(0.01)
    k, squares, ratios = len(family.names), [], []
    for _ in range(3):
        values = see_from_tracker(simulated.poses[:, tip]) + simulated.rng.normal(0.0, noise.length, (60, 3))
        setup = pk.MeasuringSetup("instrument")
        rows = pk.make_measurements(simulated.machine, simulated.joints, values, "X Y Z", setup=setup, noise=noise)
        result = pk.calibrate(simulated.machine, rows)
        assert result.family.names == family.names
        ratios.append(result.fit)
        found = result.family.forward(simulated.held_joints, result.sizes, near=simulated.held_poses).poses[:, tip]
        back = (found - result.frame[:, 3]) @ result.frame[:, :3]
        squares.append(((back - see_from_tracker(simulated.held_poses[:, tip])) ** 2).sum(1).mean())
    steps = np.concatenate([[1e-3 if p.unit == "mm" else 1e-6 for p in family.parameters], [1e-3] * 3, [1e-6] * 3])

    def see(joints, near, unknown):
        poses = family.forward(joints, simulated.true + unknown[:k], near=near).poses
        return see_from_tracker(poses[:, tip], TRACKER + unknown[k:]).ravel()

    slopes = [
        np.column_stack([(see(*at, step) - see(*at, -step)) / (2.0 * step.max()) for step in np.diag(steps)])
        for at in ((simulated.joints, simulated.poses), (simulated.held_joints, simulated.held_poses))
    ]
    covariance = np.linalg.inv(slopes[0].T @ slopes[0]) * noise.length**2
    bound = np.sqrt(3.0 * np.einsum("nk,kl,nl->n", slopes[1], covariance, slopes[1]).mean())
    assert 0.5 * bound < np.sqrt(np.mean(squares)) < 1.2 * bound
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


def test_the_command_finds_a_trackers_frame(tmp_path, capsys):
    simulated = Simulated("orthoglide", 6, 50, frame="instrument")
    values = see_from_tracker(simulated.poses) + simulated.rng.normal(0.0, 0.01, (50, 3))
    write_csv(tmp_path / "seen.csv", simulated.machine, simulated.joints, values, ("X", "Y", "Z"))
    words = ["calibrate", "orthoglide", str(tmp_path / "seen.csv"), "--frame", "instrument"]
    assert main([*words, "--json"]) == 0
    frame = np.array(json.loads(capsys.readouterr().out)["frame"])
    assert np.abs(frame[:, 3] - TRACKER[:3]).max() < 0.2
    assert np.abs(frame[:, :3] - Rotation.from_rotvec(TRACKER[3:]).as_matrix()).max() < 1e-4
    assert main(words) == 0
    assert re.search(r"the instrument's zero is at 1,(500|499)\.\d+, -[78]", capsys.readouterr().out)
    write_csv(tmp_path / "few.csv", simulated.machine, simulated.joints, values[:, :2], ("X", "Y"))
    assert main(["calibrate", "orthoglide", str(tmp_path / "few.csv"), "--frame", "instrument"]) == 2
    assert (
        "few.csv: frame: an instrument's own frame is found from X Y Z of the tip, not from X Y"
        in capsys.readouterr().err
    )


def test_a_flat_artefact_whose_place_is_not_known():
    """Blocks of known heights on a plane tell the rods; not what moves the machine along the plane."""
    simulated = Simulated("orthoglide", 5, 80)
    family = pk.family(simulated.machine, ["rods"])
    true = family.nominal + np.array([0.15, -0.1, 0.2])
    normal = np.array([0.05, -0.03, 1.0]) / np.linalg.norm([0.05, -0.03, 1.0])
    joints, heights = family.inverse(simulated.poses, true), simulated.poses @ normal + 55.0
    heights += simulated.rng.normal(0.0, 0.002, len(heights))
    rows = pk.make_measurements(simulated.machine, joints, heights=heights, noise=pk.Noise(0.002))
    result = pk.calibrate(simulated.machine, rows, ["rods"])
    deviations = np.array([p.deviation for p in result.parameters])
    assert np.abs(result.sizes - true).max() < 4.0 * deviations.max() < 0.05
    with pytest.raises(pk.UnidentifiableError, match="measurements of height can't tell legs"):
        pk.calibrate(simulated.machine, rows, ["feet"])


def test_a_tip_held_in_one_place(tmp_path, capsys):
    """A tool that turns about its tip in a ball socket tells a hexapod's rods without any instrument."""
    machine, rng = load_shipped("hexapod"), np.random.default_rng(8)
    poses = np.tile(machine.home, (60, 1))
    poses[:, 3:] += rng.uniform(-0.25, 0.25, (60, 3))
    family = pk.family(machine, ["encoders"])
    true = family.nominal + rng.normal(0.0, 0.1, len(family.names))
    joints = family.inverse(poses, true)
    rows = pk.make_measurements(machine, joints, setup=pk.MeasuringSetup(pinned=True), noise=pk.Noise(0.002))
    result = pk.calibrate(machine, rows, ["encoders"])
    assert np.abs(result.sizes - true).max() < 1e-3
    write_csv(tmp_path / "held.csv", machine, joints, np.empty((60, 0)), ())
    assert main(["calibrate", "hexapod", str(tmp_path / "held.csv"), "--pinned", "--free", "encoders"]) == 0
    assert "60 measurements of one place" in capsys.readouterr().out
    assert main(["calibrate", "hexapod", str(tmp_path / "held.csv")]) == 2
    assert "its header names nothing measured" in capsys.readouterr().err


def test_outliers_are_told_and_do_not_pull():
    simulated = Simulated("orthoglide", 4)
    measured = simulated.measure()
    measured[5, 0] += 3.0
    measured[17, 2] -= 1.0
    rows = pk.make_measurements(simulated.machine, simulated.joints, measured, noise=NOISE)
    robust, plain = (pk.calibrate(simulated.machine, rows, loss=loss) for loss in ("soft_l1", "linear"))
    assert {5, 17} <= set(robust.outliers)
    errors = [simulated.measure_error(result.machine) for result in (robust, plain)]
    assert errors[0] < 0.03 < errors[1]


def test_noise_of_the_drives_counts_too():
    simulated = Simulated("linear_delta", 1)
    given = simulated.joints + simulated.rng.normal(0.0, 0.05, simulated.joints.shape)
    for stated, fit in ((0.05, 1.0), (0.0, 4.0)):
        noise = pk.Noise(0.01, 2e-5, stated)
        rows = pk.make_measurements(simulated.machine, given, simulated.poses, noise=noise)
        result = pk.calibrate(simulated.machine, rows, ["encoders", "rods"])
        assert result.fit == pytest.approx(fit, rel=0.35) or (stated == 0.0 and result.fit > fit)


def test_the_chosen_rows_have_the_greatest_determinant():
    """Of few rows all choices are compared."""
    from itertools import combinations

    slopes = np.random.default_rng(1).normal(size=(12, 2, 3)) * np.linspace(0.5, 2.0, 12)[:, None, None]

    def measure(rows):
        return np.linalg.det(sum(slopes[i].T @ slopes[i] for i in rows))

    best = max(measure(rows) for rows in combinations(range(12), 4))
    assert measure(choose_rows(slopes, 4)) > 0.95 * best
    assert len(set(choose_rows(slopes, 4))) == 4


def test_a_plan_beats_poses_at_random():
    machine = load_shipped("hexapod")
    plan = pk.plan_measurements(machine, 12)
    assert (machine.check(plan.poses) == 0).all()
    assert np.array_equal(plan.joints, machine.inverse(plan.poses))
    poses = sample_allowed_poses(machine, 12, 9)
    rows = pk.make_measurements(machine, machine.inverse(poses), poses)
    at_random = pk.calibrate(machine, rows).combinations
    assert plan.error < 0.8 * np.sqrt(sum(c.amplification**2 for c in at_random)) * 0.01


def write_csv(path, machine, joints, values, axes):
    def show(array, units):
        return np.where(np.array(units) == "rad", np.degrees(array), array).tolist()

    axis_units = [unit for axis, unit in zip(machine.axes, machine.axis_units, strict=True) if axis in axes]
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*machine.joints, *axes])
        rows = zip(show(joints, machine.joint_units), show(values, axis_units), strict=True)
        writer.writerows([*one, *other] for one, other in rows)


def test_the_command(tmp_path, capsys):
    simulated = Simulated("tricept")
    path, made = tmp_path / "measured.csv", tmp_path / "calibrated.yaml"
    write_csv(path, simulated.machine, simulated.joints, simulated.measure(), simulated.machine.axes)
    picture = tmp_path / "residuals.png"
    arguments = ["calibrate", "tricept", path, "-o", made, "--picture", picture, "--angle-noise", "0.00115deg"]
    assert main([str(a) for a in arguments]) == 0
    said = capsys.readouterr().out
    assert "24 numbers from 40 measurements of X Y Z B C" in said
    assert "kept, for others replace them: head.1.tz" in said
    machine = pk.load(made)  # it posts and runs as any other
    assert simulated.measure_error(machine) < 0.02
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "# legs.d1.foot.x: " in made.read_text(encoding="utf-8")
    assert main([str(a) for a in arguments[:3]] + ["--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == "parakin.calibration/1"
    assert len(answer["parameters"]) == 24


def test_the_command_plans(tmp_path, capsys):
    path = tmp_path / "plan.csv"
    assert main(["calibrate", "orthoglide", "--plan", "10", "-o", str(path)]) == 0
    assert "10 poses to measure X Y Z" in capsys.readouterr().out
    assert path.read_text().count("\n") == 11
    assert main(["calibrate", "orthoglide", "--plan", "10", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["poses"]) == 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "a CSV file of measurements expected, or --plan"),
        (["MISSING"], "cannot be read"),
        (["FEW"], "few.csv: 3 measurements of 9 numbers for 18 unknown ones, 6 or more expected"),
        (["JOINTS"], "its header names nothing measured"),
        (["FEW", "--noise", "10"], '--noise: "10" needs a unit'),
        (["FEW", "--noise", "-1um"], "--noise"),
        (["FEW", "--free", "legs.rho_x.rood"], 'free: unknown "legs.rho_x.rood", did you mean "legs.rho_x.rod"'),
        (["FEW", "--centre", "1,2,3"], "--centre: goes with a column distance"),
        (["FEW", "-o", "x.csv"], "expected a file name that ends in .yaml"),
        (["FEW", "--measure", "Z"], "--measure: goes with --plan"),
        (["--plan", "3"], "numbers for 18 unknown ones"),
        (["--plan", "0"], "--plan: a number from 1 to 400 expected"),
        (["--plan", "10", "--measure", "Q"], "--measure: unknown Q"),
        (["--plan", "10", "--measure", "X X"], "--measure: X X, each once expected"),
        (["--plan", "10", "--noise", "1e308um"], "--noise: noise length: a number from 1e-09 to"),
        (["--plan", "40", "--measure", "Z"], "can't tell"),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(tmp_path, capsys, arguments, message):
    machine = load_shipped("orthoglide")
    poses = machine.home + np.array([[10.0, 0.0, 0.0], [0.0, 10.0, 5.0], [3.0, 3.0, -20.0]])
    few, joints = tmp_path / "few.csv", tmp_path / "joints.csv"
    write_csv(few, machine, machine.inverse(poses), poses, machine.axes)
    write_csv(joints, machine, machine.inverse(poses), np.empty((3, 0)), ())
    files = {"FEW": few, "JOINTS": joints, "MISSING": tmp_path / "missing.csv"}
    assert main(["calibrate", "orthoglide", *(str(files.get(a, a)) for a in arguments)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert message in said.err


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "calibration.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    errors = [float(word) for word in re.findall(r"is ([0-9.]+) um off", done.stdout)]
    assert len(errors) == 2
    assert errors[1] < 15.0 < 100.0 < errors[0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["calibration.png", "tricept_calibrated.yaml"]


def test_joints_without_a_pose_are_named():
    machine = load_shipped("orthoglide")
    poses = machine.home + np.random.default_rng(0).uniform(-50.0, 50.0, (20, 3))
    joints = machine.inverse(poses)
    joints[7] = 5000.0
    rows = pk.make_measurements(machine, joints, poses[:, 2:], axes="Z")
    with pytest.raises(PoseError, match="joints: row 8 has no pose"):
        pk.calibrate(machine, rows, ["encoders"])
