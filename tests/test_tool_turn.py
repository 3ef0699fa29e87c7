"""The turn about the tool's axis, chosen along a path: against brute force, and against margins sampled densely."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from dense_deviations import axis_of, path_of
from scipy.spatial.transform import Rotation
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.toolpath.tool_turn.lattice_search import StepCosts, find_quickest_way, find_widest_margin
from parakin.toolpath.tool_turn.turned_placement import find_turned_placements

STEEPEST = 2


def ways(stations, turns):
    """All ways through a small lattice that change by STEEPEST turns a step."""
    for way in itertools.product(range(turns), repeat=stations):
        if np.abs(np.diff(way)).max() <= STEEPEST:
            yield np.array(way)


@pytest.mark.parametrize("seed", range(20))
def test_the_search_finds_the_best_of_all_ways(seed):
    rng = np.random.default_rng(seed)
    margins, joints = rng.uniform(-0.2, 1.0, (5, 6)), rng.normal(size=(5, 6, 3))
    seconds, row = rng.uniform(0.0, 1.0, 4), np.arange(5)
    every = list(ways(5, 6))
    widest = max(margins[row, way].min() for way in every)
    assert find_widest_margin(margins, STEEPEST) == widest

    def cost(way):
        moves = np.diff(joints[row, way], axis=0)
        moves[:, 2] -= 1.5 * np.round(moves[:, 2] / 1.5)
        moves = np.abs(moves).max(axis=1)
        return np.maximum(moves, seconds).sum() + 0.05 * (np.diff(way) ** 2).sum()

    level = 0.8 * widest
    least = min(cost(way) for way in every if margins[row, way].min() >= level)
    found = find_quickest_way(margins >= level, StepCosts(seconds, joints, np.array([0.0, 0.0, 1.5]), 0.05), STEEPEST)
    assert margins[row, found].min() >= level and np.abs(np.diff(found)).max() <= STEEPEST
    assert cost(found) == pytest.approx(least, abs=1e-12)


def spans_of(machine):
    """What each limit's margin is relative to: half a range, or the size of an only bound; 0 for a mere reach."""
    bounds = {}
    for limit in machine.limit_definitions:
        if limit.side != "reach":
            bounds.setdefault(limit.name.removesuffix(f".{limit.side}"), {})[limit.side] = limit.bound
    spans = []
    for limit in machine.limit_definitions:
        both = list(bounds.get(limit.name.removesuffix(f".{limit.side}"), {}).values())
        finite = [bound for bound in both if np.isfinite(bound)]
        half = 0.5 * abs(finite[0] - finite[1]) if len(finite) == 2 else abs(finite[0]) if finite else 0.0
        spans.append(0.0 if limit.side == "reach" else half)
    return np.array(spans)


def least_margins(machine, poses):
    """The least margin of each pose, each over its limit's span."""
    spans = spans_of(machine)
    return (machine.margins(poses)[:, spans > 0.0] / spans[spans > 0.0]).min(axis=1)


def find_best_margin(machine, tip, axis, step):
    """The best least margin that any turn of the tool leaves at a place; turns ``step`` deg apart."""
    c = np.radians(np.arange(-180.0, 180.0, step))
    k = Rotation.from_euler("z", -c[:, None]).apply(axis)
    a, b = np.arcsin(-k[:, 1]), np.arctan2(k[:, 0], k[:, 2])
    poses = np.column_stack([np.tile(tip, (len(c), 1)), a, b, c])
    with np.errstate(invalid="ignore"):
        margins = np.nan_to_num(least_margins(machine, poses), nan=-1.0)
        margins[machine.sides(poses) * machine.sides(machine.home[None]) <= 0.0] = -1.0
        margins[machine.check(poses) != 0] = -1.0
    return margins.max()


def dense(rows, count=25):
    """Rows evenly between rows."""
    share = np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
    return np.vstack([a + share * (b - a) for a, b in itertools.pairwise(rows)] + [rows[-1:]])


def wave(machine, offset, count=60, tilt=14.0):
    """Beside home: a closed curve of the tip, and an axis that goes round on a cone."""
    way = np.linspace(0.0, 2.0 * np.pi, count)
    tip = machine.home[:3] + offset + np.column_stack([60.0 * np.cos(way), 60.0 * np.sin(way), 20.0 * np.sin(2 * way)])
    return path_of(tip, axis_of(tilt, np.degrees(2 * way)))


OFFSETS = {"hexapod": [120.0, -150.0, 150.0], "lambda6": [-80.0, 40.0, 60.0]}


@pytest.mark.parametrize("tilted", [False, True])
@pytest.mark.parametrize("name", OFFSETS)
def test_the_chosen_turn_keeps_the_axis_and_leaves_more_margin(name, tilted):
    machine = load_shipped(name)
    path = wave(machine, OFFSETS[name])
    frame = pk.workpiece(X=3.0, A=0.4, B=-0.3) if tilted else pk.workpiece()
    path = path_of((path.tip - frame[:, 3]) @ frame[:, :3], path.axis @ frame[:, :3])  # the same path on the machine
    turn = pk.choose_tool_turn(machine, path, workpiece=frame)
    job = pk.prepare(machine, turn.path, workpiece=frame)
    home = pk.prepare(machine, path, workpiece=frame)
    assert job.runs
    at_home = least_margins(machine, dense(home.posted.poses)).min()
    poses = dense(job.posted.poses)
    assert turn.home_margin == pytest.approx(at_home, abs=2e-3)
    assert turn.margin == pytest.approx(least_margins(machine, poses).min(), abs=2e-3)
    assert turn.margin > at_home + 0.01
    # nearly as much as the best turn of each record leaves by itself, which no way of turns passes
    records = zip(path.tip @ frame[:, :3].T + frame[:, 3], path.axis @ frame[:, :3].T, strict=True)
    best = min(find_best_margin(machine, tip, axis, 3.0) for tip, axis in records)
    assert 0.94 * best <= turn.margin <= best + 1e-3
    # the same side of all singularities, C continuous and in the range that is told
    assert (machine.sides(poses) * machine.sides(machine.home[None]) > 0.0).all()
    assert turn.low - 1e-12 <= poses[:, 5].min() and poses[:, 5].max() <= turn.high + 1e-12
    assert np.abs(np.diff(poses[:, 3:], axis=0)).max() < np.radians(0.5)
    # tip and axis as programmed, at the records that were there and between them
    tips = dense(path.tip @ frame[:, :3].T + frame[:, 3], 400)
    axes = dense(path.axis @ frame[:, :3].T, 400)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tools = Rotation.from_euler("xyz", poses[::7, 3:]).apply([0.0, 0.0, 1.0])
    for pose, tool in zip(poses[::7], tools, strict=True):
        nearest = np.linalg.norm(tips - pose[:3], axis=1).argmin()
        assert np.linalg.norm(tips[nearest] - pose[:3]) < 0.05
        assert np.linalg.norm(axes[nearest] - tool) < 2e-3


@pytest.mark.parametrize("name", OFFSETS)
def test_at_one_place_the_turn_is_the_best_of_all(name):
    machine = load_shipped(name)
    tip = machine.home[:3] + OFFSETS[name] + np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])
    axis = axis_of(17.0, 40.0)
    turn = pk.choose_tool_turn(machine, path_of(tip, np.tile(axis, (2, 1))))
    best = find_best_margin(machine, tip[0], axis, 0.25)
    assert 0.9 * best <= turn.margin <= best + 1e-3


def test_a_path_that_only_another_turn_can_follow():
    machine = load_shipped("hexapod")
    turned = pk.prepare_turned(machine, wave(machine, [170.0, 120.0, 150.0]))
    assert turned.is_chosen and turned.job.runs and not turned.home.runs


def test_the_same_path_gives_the_same_turn():
    machine = load_shipped("lambda6")
    path = wave(machine, OFFSETS["lambda6"])
    first, second = (pk.choose_tool_turn(machine, path) for _ in range(2))
    assert (first.path.turns == second.path.turns).all()


def test_dense_and_sparse_records_give_nearly_the_same_turn():
    machine = load_shipped("lambda6")
    few, many = (pk.choose_tool_turn(machine, wave(machine, OFFSETS["lambda6"], count)) for count in (400, 4000))
    assert few.margin == pytest.approx(many.margin, abs=0.01)
    assert (few.low, few.high) == pytest.approx((many.low, many.high), abs=np.radians(3.0))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_short_paths(count):
    machine = load_shipped("hexapod")
    path = path_of(machine.home[:3] + np.arange(count)[:, None] * [0.0, 0.0, 0.0])
    turned = pk.prepare_turned(machine, path)
    assert turned.job.runs


def test_axes_that_turn_to_their_opposites():
    machine = load_shipped("hexapod")
    path = path_of(np.tile(machine.home[:3], (2, 1)), [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert pk.choose_tool_turn(machine, path) is None
    assert "opposite" in pk.prepare_turned(machine, path).job.unplanned


def test_a_longer_tool_keeps_its_own_tip():
    machine = load_shipped("hexapod")
    path = wave(machine, OFFSETS["hexapod"])
    longer = pk.fit_tool_lengths(machine, path, 170.0)
    posted = pk.prepare(machine, pk.choose_tool_turn(machine, longer).path).posted
    tools = Rotation.from_euler("xyz", posted.poses[:, 3:]).apply([0.0, 0.0, 1.0])
    tips = dense(path.tip, 400)
    own = posted.poses[:, :3] - 20.0 * tools  # 170 mm are 20 mm more than the machine's own tool
    assert max(np.linalg.norm(tips - tip, axis=1).min() for tip in own) < 0.05


def test_a_programs_own_turns_with_a_longer_tool_need_few_records():
    machine = load_shipped("hexapod")
    path = wave(machine, OFFSETS["hexapod"])
    k = path.axis
    turns = np.column_stack([np.arcsin(-k[:, 1]), np.arctan2(k[:, 0], k[:, 2]), np.zeros(len(k))])
    job = pk.prepare(machine, pk.fit_tool_lengths(machine, replace(path, turns=turns), 170.0))
    # 20 mm more, and 2.9 deg a motion: an arc of 20 mm * 0.05**2 / 8 = 0.006 mm off its chord, a quarter of it off two
    assert job.runs and job.inserted == len(path) - 1


def test_where_no_turn_is_free():
    machine = load_shipped("tricept")
    path = path_of(np.tile(machine.home[:3], (2, 1)))
    with pytest.raises(pk.PoseError, match="tricept does not turn the tool three ways"):
        pk.choose_tool_turn(machine, path)
    hexapod = load_shipped("hexapod")
    path = path_of(np.tile(hexapod.home[:3], (2, 1)), turns=np.zeros((2, 3)))
    with pytest.raises(pk.PoseError, match="the program gives A, B and C itself"):
        pk.prepare_turned(hexapod, path)


def test_where_no_turn_keeps_the_limits():
    machine = load_shipped("hexapod")
    turned = pk.prepare_turned(machine, path_of(machine.home[:3] + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 5000.0]])))
    assert not turned.is_chosen and not turned.job.runs


def hexa(shift):
    """Six arms that turn: their angles are counted from a direction ``shift`` rad before the radial one."""
    lines = ["name: hexa", "title: Hexa", "source: test", "motion: tx ty tz rz ry rx", "legs:"]
    for number in range(6):
        pair, side = np.radians(120 * (number // 2)), 2 * (number % 2) - 1
        pivot, platform = pair + side * np.radians(12), pair + side * np.radians(50)
        radial = np.array([np.cos(pair), np.sin(pair), 0.0])
        zero = np.cos(shift) * radial + np.sin(shift) * np.array([0.0, 0.0, 1.0])  # 0 0 1 is radial x axis
        lines += [
            f"  - {{kind: crank, joints: [q{number}], arm: 200 mm, rod: 600 mm,",
            f"     pivot: [{300 * np.cos(pivot):.9f} mm, {300 * np.sin(pivot):.9f} mm, 0],",
            f"     platform: [{150 * np.cos(platform):.9f} mm, {150 * np.sin(platform):.9f} mm, 0],",
            f"     axis: [{-radial[1]:.15f}, {radial[0]:.15f}, 0], zero: [{', '.join(f'{v:.15f}' for v in zero)}],",
            f"     range: [{np.degrees(shift) - 90:.9f} deg, {np.degrees(shift) + 90:.9f} deg],",
            "     speed: 200 deg/s, acceleration: 2000 deg/s2}",
        ]
    return "\n".join([*lines, "home: {X: 0 mm, Y: 0 mm, Z: -550 mm, A: 0 deg, B: 0 deg, C: 0 deg}\n"])


def test_arms_that_turn_over_half_a_turn(tmp_path):
    turns = []
    for shift in (0.0, 150.0):  # the arms' angles begin at 26 and at 176 degrees
        (tmp_path / "hexa.yaml").write_text(hexa(np.radians(shift)))
        machine = pk.load(tmp_path / "hexa.yaml")
        turned = pk.prepare_turned(machine, wave(machine, [120.0, 100.0, -40.0], tilt=10.0))
        assert turned.is_chosen and turned.job.runs
        turns.append(turned)
    assert turns[0].margin == pytest.approx(turns[1].margin, abs=1e-6)
    assert turns[0].job.seconds == pytest.approx(turns[1].job.seconds, abs=1e-4)


def test_a_placement_with_its_turn_leaves_more_margin():
    machine = load_shipped("lambda6")
    path = wave(machine, [0.0, 0.0, 60.0], count=20)
    bounds = {"X": (-60.0, 60.0), "Y": (-60.0, 60.0), "Z": (-100.0, 100.0)}
    placements = find_turned_placements(machine, path, bounds)
    home = pk.find_placement(machine, path, bounds)
    turned = pk.prepare_turned(machine, path, workpiece=placements[0].workpiece)
    assert turned.job.runs and turned.margin > 1.1 * home.margin
    assert home.values in [placement.values for placement in placements]


def run(capsys, *arguments, code=0):
    assert main(["post", *map(str, arguments)]) == code
    return capsys.readouterr()


def test_the_command_tells_the_turn(tmp_path, capsys):
    machine = load_shipped("lambda6")
    path = wave(machine, OFFSETS["lambda6"])
    part = tmp_path / "part.cls"
    rows = np.column_stack([path.tip, path.axis]).tolist()
    part.write_text("UNITS/MM\nFEDRAT/3000\n" + "".join(f"GOTO/{','.join(f'{v:.9f}' for v in row)}\n" for row in rows))
    options = (part, "-m", "lambda6", "-o", tmp_path)
    said = json.loads(run(capsys, *options, "--turn", "free", "--json").out)
    turn = said["turn"]
    assert turn["chosen"] and turn["margin"] > turn["home_margin"] and said["verdict"] == "ok"
    home = json.loads(run(capsys, *options, "--json").out)
    assert home["turn"] is None and home["seconds"] == turn["home_seconds"]
    assert home["records"] - home["inserted"] == said["records"] - said["inserted"] == len(path)
    text = run(capsys, *options, "--turn", "free").out
    low, high = turn["C"]
    assert f"turn about the tool chosen, C from {low:.1f} to {high:.1f}°: {turn['margin']:.1%} of half a range" in text
    assert "turn about the tool" not in run(capsys, *options).out
    assert "--turn: tricept does not turn" in run(capsys, part, "-m", "tricept", "--turn", "free", code=2).err
