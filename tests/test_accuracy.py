"""Accuracy against direct problems of drawn machines, and bounds that none of them breaks."""

import json
import math
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.accuracy.tolerances import make_tolerance_family, read_tolerances
from parakin.accuracy.worst_case import list_directions
from parakin.cli import main
from parakin.errors import PoseError

TOLERANCES = {
    "tricept": {"feet": "0.05 mm", "platform": "0.03 mm", "encoders": "2 um", "joints.theta*.offset": "0.002 deg"},
    "hexapod": {"feet": "0.05 mm", "encoders": "2 um"},
    "orthoglide": {"feet": "0.05 mm", "rods": "0.02 mm", "rails": "0.01 deg", "encoders": "2 um"},
    "lambda6": {"feet": "0.05 mm", "rods": "0.02 mm", "encoders": "2 um"},
    "rpr3": {"feet": "0.05 mm", "platform": "0.03 mm"},
}


def pick_pose(machine):
    """A pose where the tool is inclined."""
    pose = machine.home + np.where(np.array(machine.axis_units) == "mm", 20.0, 0.2)
    assert machine.check(pose) == 0
    return pose


def draw_errors(within, pose, sizes):
    family = within.family
    joints = family.machine.inverse(pose)
    solution = family.forward(joints, sizes, near=pose)
    assert solution.converged.all()
    tip = [i for i, axis in enumerate(family.machine.axes) if axis in "XYZ"]
    return np.linalg.norm((solution.poses - pose)[:, tip], axis=1)


@pytest.mark.parametrize("name", TOLERANCES)
def test_drawn_machines_err_as_predicted(name):
    """A hundred thousand machines with numbers evenly within the tolerances, each by its own direct problem."""
    machine = load_shipped(name)
    pose = pick_pose(machine)
    accuracy = pk.analyse_accuracy(machine, TOLERANCES[name], pose[None])
    within = accuracy.tolerances
    rng = np.random.default_rng(0)
    sizes = within.family.nominal + rng.uniform(-1.0, 1.0, (100_000, len(within.halves))) * within.halves
    errors = draw_errors(within, pose, sizes)
    assert np.sqrt((errors**2).mean()) == pytest.approx(accuracy.deviations[0], rel=0.01)
    corners = within.family.nominal + rng.choice([-1.0, 1.0], (5_000, len(within.halves))) * within.halves
    worst = max(errors.max(), draw_errors(within, pose, corners).max())
    ranges = {axis: (value, value) for axis, value in zip(machine.axes, pose.tolist(), strict=True)}
    bound = pk.bound_worst_case(accuracy, ranges)
    assert worst <= min(1.001 * bound.attained, bound.bound)
    assert bound.attained <= bound.bound < 1.01 * bound.attained
    assert accuracy.greatest[0] > 0.99 * bound.attained


@pytest.mark.parametrize(("name", "ranges"), [("orthoglide", "XYZ"), ("rpr3", "XY"), ("tricept", "XB")])
def test_no_machine_breaks_the_bound_over_a_box(name, ranges):
    machine = load_shipped(name)
    accuracy = pk.analyse_accuracy(machine, TOLERANCES[name], samples=20)
    pose = pick_pose(machine)
    size = {"mm": 15.0, "rad": 0.03}
    units = zip(machine.axes, machine.axis_units, strict=True)
    ways = {axis: size[unit] if axis in ranges else 0.0 for axis, unit in units}
    box = {axis: (x - ways[axis], x + ways[axis]) for axis, x in zip(machine.axes, pose.tolist(), strict=True)}
    proved = pk.bound_worst_case(accuracy, box, seconds=30.0)
    assert proved.attained <= proved.bound < 1.3 * proved.attained
    within, rng = accuracy.tolerances, np.random.default_rng(2)
    poses = pose + rng.uniform(-1.0, 1.0, (2_000, len(pose))) * np.array(list(ways.values()))
    sizes = within.family.nominal + rng.choice([-1.0, 1.0], (2_000, len(within.halves))) * within.halves
    moved = within.family.forward(machine.inverse(poses), sizes, near=poses)
    tip = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
    errors = np.linalg.norm((moved.poses - poses)[:, tip], axis=1)
    assert 0.4 * proved.attained < errors.max() <= proved.bound


@pytest.mark.parametrize(
    ("name", "pose"),
    [
        ("rus6", (-59.115, -143.487, -424.663, -0.208, -0.326, 0.127)),  # thin cranks, near a singularity
        ("cmw_300", (20.0, 20.0, -970.0, 0.2, 0.2, 0.2)),
        ("five_bar", (100.0, 300.0)),
    ],
)
def test_at_one_pose_the_bound_is_close(name, pose):
    """Against machines that are bettered number by number from the worst of some at ends, by their direct problems."""
    machine, pose = load_shipped(name), np.array(pose)
    groups = {parameter.group for parameter in machine.parameters if parameter.unit == "mm"}
    accuracy = pk.analyse_accuracy(machine, dict.fromkeys(sorted(groups - {"sizes"}), "0.05 mm"), pose[None])
    ranges = {axis: (value, value) for axis, value in zip(machine.axes, pose.tolist(), strict=True)}
    proved, within = pk.bound_worst_case(accuracy, ranges), accuracy.tolerances

    def err(ends):
        return draw_errors(within, pose, within.family.nominal + ends * within.halves)

    ends = np.random.default_rng(0).choice([-1.0, 1.0], (1_000, len(within.halves)))
    worst = ends[err(ends).argmax()]
    for _ in range(4):
        turned = np.where(np.eye(len(worst), dtype=bool), -worst, worst)
        worst = np.where(err(turned) > err(worst[None]), -worst, worst)
    assert 0.9 * proved.attained < err(worst[None])[0] <= proved.bound
    assert proved.attained <= proved.bound < 1.02 * proved.attained


def test_what_is_singular_is_unproved(capsys):
    machine = load_shipped("tricept")
    accuracy = pk.analyse_accuracy(machine, {"feet": "0.05 mm"}, samples=10)
    proved = pk.bound_worst_case(accuracy, {})
    assert proved.bound == np.inf  # the tool lies along the wrist's first axis
    assert proved.unproved.tolist() == machine.home.tolist()
    assert main(["accuracy", "tricept", "--tolerance", "feet=0.05mm", "--samples", "10", "--over", "X=0:0"]) == 0
    said = capsys.readouterr().out
    assert "no bound of their error was found at these tolerances about X=0.000 Y=0.000 Z=-1650.000" in said
    assert "singular" not in said


@pytest.mark.parametrize("finer", [1, 4])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_the_directions_are_as_near_as_they_say(size, finer):
    directions, cosine = list_directions(size, finer)
    directions = directions.reshape(-1, size)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    drawn = np.random.default_rng(0).normal(size=(2_000, size))
    drawn /= np.linalg.norm(drawn, axis=1)[:, None]
    assert np.abs(drawn @ directions.T).max(1).min() >= cosine


def test_shares_add_up_and_rank():
    accuracy = pk.analyse_accuracy(load_shipped("orthoglide"), TOLERANCES["orthoglide"])
    assert np.allclose(accuracy.shares.sum(1), 1.0)
    means = [mean for _, mean, _ in accuracy.budget]
    assert means == sorted(means, reverse=True)
    alone = pk.analyse_accuracy(accuracy.machine, {"feet": "0.05 mm"}, accuracy.poses)
    share = dict(zip([t.name for t in accuracy.tolerances.tolerances], accuracy.shares.T, strict=True))["feet"]
    assert np.allclose(alone.deviations**2, share * accuracy.deviations**2)


def test_a_named_size_has_its_share_beside_its_followers():
    """Errors of a size and of the numbers that follow it are independent, so their squares add up."""
    machine = load_shipped("tricept")
    size, own = {"R": "1 mm"}, {"feet": "0.05 mm"}
    pose = pick_pose(machine)[None]
    both, alone, rest = (pk.analyse_accuracy(machine, each, pose) for each in (size | own, size, own))
    assert alone.deviations[0] > 0.2 * rest.deviations[0]
    assert both.deviations[0] == pytest.approx(np.hypot(alone.deviations[0], rest.deviations[0]), rel=1e-9)
    assert both.shares[0, 0] == pytest.approx((alone.deviations[0] / both.deviations[0]) ** 2, rel=1e-9)
    ranges = {axis: (value, value) for axis, value in zip(machine.axes, pose[0].tolist(), strict=True)}
    bounds = [pk.bound_worst_case(each, ranges).bound for each in (both, rest)]
    assert bounds[0] > bounds[1] + alone.greatest[0] / 2.0
    family = both.tolerances.family
    sizes = family.nominal + both.tolerances.halves * np.where(np.arange(len(family.names)) % 2, -1.0, 1.0)
    assert family.at(sizes).inverse(pose[0]) == pytest.approx(family.inverse(pose[0], sizes), abs=1e-9)


def test_allowed_tolerances_are_the_cheapest():
    """Against a lattice of all tolerances that keep the error, and against the closed form of one pose."""
    accuracy = pk.analyse_accuracy(load_shipped("orthoglide"), {"feet": "0.05 mm", "rods": "0.02 mm"})
    costs = {"feet": 2.0, "rods": 1.0}
    allowed = {each.name: each.value for each in pk.allocate_tolerances(accuracy, 0.05, costs)}
    again = pk.analyse_accuracy(
        accuracy.machine, {name: f"{value!r} mm" for name, value in allowed.items()}, accuracy.poses
    )
    assert again.percentile(100) == pytest.approx(0.05, rel=1e-6)

    counts = {"feet": 9, "rods": 3}

    def price(feet, rods):
        return costs["feet"] * counts["feet"] / feet + costs["rods"] * counts["rods"] / rods

    variances = (accuracy.shares * accuracy.deviations[:, None] ** 2) / np.array([0.05, 0.02]) ** 2
    names = [t.name for t in accuracy.tolerances.tolerances]
    lattice = np.geomspace(1e-3, 0.2, 300)
    prices = [
        price(feet, rods)
        for feet, rods in product(lattice, lattice)
        if (variances @ [{"feet": feet, "rods": rods}[name] ** 2 for name in names]).max() <= 0.05**2
    ]
    assert price(**allowed) <= min(prices) * (1.0 + 1e-9)
    assert price(**allowed) > 0.95 * min(prices)


def test_allowed_tolerances_of_one_name_are_those_of_lengths_and_of_angles():
    """Slides and turns of a Tricept have each their own, and what cannot move the tip costs nothing."""
    tricept = load_shipped("tricept")
    pairs = [("encoders", "4 um"), ("encoders", "0.01 deg"), ("feet", "0.05 mm")]
    accuracy = pk.analyse_accuracy(tricept, pairs, samples=50)
    allowed = pk.allocate_tolerances(accuracy, 0.05)
    assert [(each.name, each.unit) for each in allowed] == [("encoders", "mm"), ("encoders", "rad"), ("feet", "mm")]
    again = [(each.name, f"{each.value!r} {each.unit}") for each in allowed]
    assert pk.analyse_accuracy(tricept, again, accuracy.poses).percentile(100) == pytest.approx(0.05, rel=1e-6)
    flat = pk.analyse_accuracy(load_shipped("rpr3"), {"feet": "0.05 mm", "encoders": "0.01 mm"}, samples=50)
    by_coordinate = pk.analyse_accuracy(
        flat.machine, {"legs.*.foot.x": "0.05 mm", "legs.*.foot.y": "0.05 mm", "encoders": "0.01 mm"}, flat.poses
    )
    *_, alone = pk.allocate_tolerances(by_coordinate, 0.05, {"legs.*.foot.x": 1.0, "legs.*.foot.y": 1.0})
    *_, grouped = pk.allocate_tolerances(flat, 0.05)
    assert grouped.value == pytest.approx(alone.value, rel=0.05)  # not as if there were nine coordinates in the plane


def test_the_command(tmp_path, capsys):
    path = tmp_path / "map.png"
    words = ["accuracy", "orthoglide", "--tolerance", "feet=0.05mm,rods=0.02mm,encoders=2um", "--samples", "100"]
    assert main([*words, "--error", "0.05mm", "--over", "X=-20:20", "-o", str(path)]) == 0
    said = capsys.readouterr().out
    assert "at 100 poses of the workspace" in said
    assert "no machine within them is off by more than" in said
    assert path.read_bytes().startswith(b"\x89PNG")
    assert main(words) == 0
    table = capsys.readouterr().out.rstrip().splitlines()[-4:]
    assert [line.split()[0] for line in table] == ["tolerance", "feet", "rods", "encoders"]
    assert "allowed" not in table[0]
    assert main([*words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == "parakin.accuracy/1"
    assert [row["name"] for row in answer["budget"]] == ["feet", "rods", "encoders"]
    assert answer["worst_case"] is None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--tolerance", "feet"], "expected NAME=VALUE, such as feet=0.05mm"),
        (["--tolerance", "feet=0.05"], 'tolerance feet: "0.05" needs a unit'),
        (["--tolerance", "feet=-1mm"], "expected more than 0"),
        (["--tolerance", "feet=1deg"], "--tolerance feet: legs.rho_x.foot.x is a length"),
        (["--tolerance", "foot=1mm"], '--tolerance foot: unknown "foot"'),
        (["--tolerance", "feet=1mm,legs.rho_x.foot.x=2mm"], "legs.rho_x.foot.x has one already, of feet"),
        (["--tolerance", "feet=1mm", "--error", "5"], '--error: "5" needs a unit'),
        (["--tolerance", "feet=1mm", "--cost", "feet=1"], "--cost: goes with --error"),
        (["--tolerance", "feet=1mm", "--error", "5um", "--cost", "rods=1"], "--cost: unknown rods"),
        (["--tolerance", "feet=1mm", "--over", "Q=1:2"], 'unknown axis "Q"'),
        (["--tolerance", "feet=1mm", "--samples", "0"], "--samples: a number from 1"),
        (["--tolerance", "feet=1mm", "-o", "x.gif"], "expected a file name that ends in .png, .pdf, .svg"),
        ([], "--tolerance"),
    ],
)
def test_what_is_mistaken_is_said_in_one_line(words, message, capsys):
    assert main(["accuracy", "orthoglide", *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert message in said.err


def test_the_example_runs(tmp_path):
    script = Path(__file__).parents[1] / "examples" / "accuracy.py"
    done = subprocess.run([sys.executable, script, "-o", tmp_path], capture_output=True, text=True, check=True)
    assert "in the cube of 100 mm no machine within them is off by more than" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["accuracy.png"]


def test_a_tolerance_takes_the_numbers_of_its_unit():
    within = make_tolerance_family(
        load_shipped("tricept"), read_tolerances([("encoders", "2 um"), ("encoders", "0.001 deg")])
    )
    assert [len(columns) for columns in within.groups] == [3, 2]
    with pytest.raises(PoseError, match="at least one expected"):
        read_tolerances({})


def test_mistaken_costs_and_ranges_in_python():
    result = pk.analyse_accuracy(load_shipped("orthoglide"), {"feet": "0.05 mm"}, samples=5)
    for cost in ("x", 0.0, -1.0, math.nan, None):
        with pytest.raises(pk.PoseError, match="costs feet: a number above 0 expected"):
            pk.allocate_tolerances(result, 0.05, {"feet": cost})
    for ends in (5, "0:1", (1,), (1.0, 0.0), (0.0, math.nan), ("0 deg", "1 deg"), None):
        with pytest.raises(pk.PoseError, match="ranges: X"):
            pk.bound_worst_case(result, {"X": ends})
    told = pk.bound_worst_case(result, {"X": ("-1 cm", "10 mm")}, 0.5)
    assert told.bound == pk.bound_worst_case(result, {"X": (-10.0, 10.0)}, 0.5).bound
