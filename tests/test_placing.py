"""Where to put the part: against grids of placements each posted as a whole, and where symmetry tells the answer."""

import itertools
import math
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.commands.workpiece import parse_bounds
from parakin.toolpath.path import ToolPath
from parakin.toolpath.placing.placement import bound_near_home, find_placement
from parakin.toolpath.posting.frames import build_frame_from_angles
from parakin.toolpath.posting.post import post_path

DEGREE = math.pi / 180.0


def path_of(tip, axis=None):
    tip = np.atleast_2d(np.asarray(tip, float))
    n = len(tip)
    axis = np.tile([0.0, 0.0, 1.0], (n, 1)) if axis is None else axis
    return ToolPath("part", tip, axis, np.arange(1, n + 1), np.zeros(n, bool), np.full(n, 1e3), np.full(n, np.nan))


def test_bounds_near_home_bring_the_middle_of_a_part_there():
    machine = load_shipped("orthoglide")
    path = path_of([[-30.0, 400.0, 7.0], [70.0, 440.0, 7.0], [10.0, 410.0, 107.0]])
    assert bound_near_home(machine, path, 25.0) == {"X": (-45.0, 5.0), "Y": (-445.0, -395.0), "Z": (-82.0, -32.0)}


def axis_of(b, c):
    b, c = np.radians(b), np.radians(c)
    return np.column_stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)])


def scattered(seed, count, size, tilt=0.0):
    rng = np.random.default_rng(seed)
    tip = rng.uniform(-1.0, 1.0, (count, 3)) * size
    return path_of(tip, axis_of(rng.uniform(0, tilt, count), rng.uniform(-60, 60, count)))


def least(machine, path, workpiece, mode=None):
    """The least margin over half its range, reckoned from the drives and limits one by one; NaN where a leg fails."""
    posted = post_path(machine, path, workpiece=workpiece, mode=mode)
    if any(offence.limit in ("tilt", "X", "Y", "Z") for offence in posted.offences):
        return math.nan
    margins = machine.margins(posted.poses, posted.joints, posted.mode).min(axis=0)
    by_name = dict(zip(machine.limits, machine.limit_definitions, strict=True))
    found = []
    for (name, limit), margin in zip(by_name.items(), margins, strict=True):
        if limit.side == "reach":
            if not margin >= 0.0:
                return math.nan
            continue
        stem = name.rpartition(".")[0] if name.endswith((".min", ".max")) else name
        ends = [by_name[f"{stem}.{side}"].bound for side in ("min", "max") if f"{stem}.{side}" in by_name]
        found.append(margin / (0.5 * (ends[1] - ends[0]) if len(ends) == 2 else abs(limit.bound)))
    return min(found)


def on_grid(machine, path, bounds, each):
    """The best of all placements of a grid over the bounds."""
    axes = [np.linspace(low, high, each if high > low else 1) for low, high in bounds.values()]
    best = -math.inf
    for values in itertools.product(*axes):
        named = dict(zip(bounds, values, strict=True))
        worth = least(machine, path, build_frame_from_angles(*(named.get(letter, 0.0) for letter in "XYZABC")))
        best = max(best, -math.inf if math.isnan(worth) else worth)
    return best


CASES = [
    ("hbg80_2d", scattered(1, 40, [80, 80, 0]), "X=0:400,Y=0:400", 21, 0.03),
    ("hbg80_2d", scattered(2, 30, [90, 50, 0]), "X=0:400,Y=0:400,C=-180:180", 9, 0.08),
    ("linear_delta", scattered(3, 40, [120, 90, 40]), "X=-100:100,Y=-100:100,Z=100:450", 7, 0.06),
    ("tricept", scattered(4, 40, [150, 100, 40], 30), "X=-300:300,Y=-300:300,Z=-2000:-1400", 7, 0.08),
    ("tricept", scattered(5, 40, [150, 100, 40], 30), "X=-50:50,Y=0,Z=-1800:-1500,C=-180:180", 7, 0.08),
    ("orthoglide5_table", scattered(6, 40, [50, 40, 40], 30), "X=-60:60,Y=10,Z=-60:60,C=-180:180", 7, 0.1),
]


@pytest.mark.parametrize(("name", "path", "text", "each", "near"), CASES)
def test_no_placement_of_a_grid_is_better(name, path, text, each, near):
    machine, bounds = load_shipped(name), parse_bounds(text)
    found = find_placement(machine, path, bounds)
    best = on_grid(machine, path, bounds, each)
    assert best > 0.2
    assert best - 1e-9 <= found.margin <= best + near  # and not more than the grid is coarse
    assert found.allowed
    assert least(machine, path, found.workpiece, found.mode) == pytest.approx(found.margin, abs=1e-12)
    assert list(found.values) == list(bounds)
    assert all(low <= found.values[axis] <= high for axis, (low, high) in bounds.items())
    values = [found.values.get(letter, 0.0) for letter in "XYZABC"]
    np.testing.assert_array_equal(found.workpiece, build_frame_from_angles(*values))
    posted = post_path(machine, path, workpiece=found.workpiece, mode=found.mode)
    margin = machine.margins(posted.poses, posted.joints, posted.mode)[:, machine.limits.index(found.limit)]
    assert margin.argmin() == found.record


def test_a_round_part_belongs_in_the_middle():
    angle = np.arange(24) * 15 * DEGREE
    path = path_of(150.0 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]))
    found = find_placement(load_shipped("linear_delta"), path, parse_bounds("X=-90:120,Y=-110:80,Z=280"))
    assert abs(found.values["X"]) < 1e-3
    assert abs(found.values["Y"]) < 1e-3
    assert found.values["Z"] == 280.0


def test_a_square_part_belongs_on_the_diagonal_of_two_equal_drives():
    path = path_of([[x, y, 0.0] for x in (-90, 90) for y in (-90, 90)])
    found = find_placement(load_shipped("hbg80_2d"), path, parse_bounds("X=0:400,Y=50:390"))
    assert found.values["X"] == pytest.approx(found.values["Y"], abs=1e-4)


def test_the_same_again():
    machine, path, bounds = load_shipped("tricept"), scattered(7, 80, [50, 50, 20], 10), parse_bounds(CASES[4][2])
    one, two = (find_placement(machine, path, bounds) for _ in range(2))
    assert one.values == two.values
    assert (one.margin, one.limit, one.record, one.tried) == (two.margin, two.limit, two.record, two.tried)


def test_on_top_of_the_files_own_frame():
    machine, path = load_shipped("linear_delta"), scattered(8, 40, [100, 90, 40])
    bounds = parse_bounds("X=-100:100,Y=-100:100,Z=150:450")
    shifted = replace(path, frame=build_frame_from_angles(30.0, -20.0, 10.0, 0.0, 0.0, 0.0))
    one, two = (find_placement(machine, each, bounds) for each in (path, shifted))
    assert one.margin == pytest.approx(two.margin, abs=1e-6)
    assert post_path(machine, shifted, workpiece=two.workpiece).broken_record_count == 0
    assert two.values["X"] + 30.0 == pytest.approx(one.values["X"], abs=0.1)


def test_a_record_that_is_not_on_the_outside():
    # Of 5,000 records one, amid the part, leans far more than the others.
    rng = np.random.default_rng(9)
    tip, lean = np.sort(rng.uniform(-100, 100, (5000, 3)), axis=0), np.linspace(2.0, 8.0, 5000)
    spread = path_of(tip, axis_of(lean, 20.0 + lean))
    lean[2345] = 70.0
    path = path_of(tip, axis_of(lean, 20.0 + lean))
    machine, bounds = load_shipped("tricept"), parse_bounds("X=-200:200,Y=-200:200,Z=-2000:-1400")
    found = find_placement(machine, path, bounds)
    assert found.record == 2345
    assert found.margin < find_placement(machine, spread, bounds).margin - 0.05
    assert least(machine, path, found.workpiece, found.mode) == pytest.approx(found.margin, abs=1e-12)
    for way in itertools.product((-3.0, 0.0, 3.0), repeat=3):
        near = found.workpiece.copy()
        near[:, 3] += way
        if (np.abs(near[:2, 3]) <= 200.0).all():
            assert least(machine, path, near) <= found.margin + 1e-6


def test_turns_of_the_path_as_a_whole_count():
    # C goes from 0 to 640 deg; the plate has 720. From where the part lies follows where it begins and ends.
    machine = load_shipped("orthoglide5_table")
    c = np.linspace(0.0, 640.0, 300)
    path = path_of(np.zeros((300, 3)), axis_of(np.full(300, 10.0), c))
    bounds = parse_bounds("C=-180:180")
    found = find_placement(machine, path, bounds, mode=machine.mode)
    assert found.margin == pytest.approx(40.0 / 360.0, abs=1e-4)
    assert found.limit in ("c.min", "c.max")


def test_none_where_the_part_is_too_large():
    machine = load_shipped("linear_delta")
    path = path_of([[x, y, 0.0] for x in (-400, 400) for y in (-400, 400)])
    bounds = parse_bounds("X=-100:100,Y=-100:100,Z=0:500")
    with pytest.raises(pk.PoseError, match="no placement within these bounds is allowed; the nearest is X="):
        find_placement(machine, path, bounds)
    found = pk.find_placements(machine, path, bounds)[0]
    assert not found.allowed
    assert found.margin < 0.0
    posted = post_path(machine, path, workpiece=found.workpiece, mode=found.mode)
    assert posted.broken[found.record]
    assert found.limit in {offence.limit for offence in posted.offences}


def test_none_where_the_tool_would_have_to_lean():
    path = path_of([[0, 0, 0], [20, 0, 0]], axis_of([0.0, 10.0], [0.0, 0.0]))
    found = pk.find_placements(load_shipped("linear_delta"), path, parse_bounds("X=-50:50,Z=250:300"))[0]
    assert (found.limit, found.record) == ("tilt", 1)
    assert found.margin == pytest.approx(1e-4 - 10 * DEGREE, abs=1e-9)


def test_found_from_far_off():
    machine, path = load_shipped("linear_delta"), scattered(3, 40, [80, 80, 20])
    found = find_placement(machine, path, parse_bounds("X=-4m:4m,Y=-4m:4m,Z=-3m:3m"))
    assert found.margin == pytest.approx(
        find_placement(machine, path, parse_bounds("X=-99:99,Y=-99:99,Z=99:499")).margin, abs=1e-6
    )
    tilted = find_placement(machine, path, parse_bounds("X=-1m:1m,Y=-1m:1m,Z=-1m:1m,A=-9:7"))  # upright to 1e-4 rad
    assert tilted.allowed
    assert abs(tilted.values["A"]) <= 1.01e-4


def test_a_single_placement():
    machine, path = load_shipped("tricept"), scattered(10, 50, [100, 100, 30], 20)
    found = find_placement(machine, path, parse_bounds("X=10,Z=-1650"))
    assert found.values == {"X": 10.0, "Z": -1650.0}
    assert found.margin == pytest.approx(least(machine, path, pk.workpiece(X=10, Z=-1650)), abs=1e-12)


def test_the_other_mode_where_the_default_allows_none(tmp_path):
    text = (files("parakin") / "machines" / "orthoglide5_head.yaml").read_text(encoding="utf-8")
    (file := tmp_path / "head.yaml").write_text(text.replace("[-100 deg, 100 deg]", "[-100 deg, 5 deg]"))
    machine, path = pk.load(file), scattered(11, 30, [30, 30, 30], 30)
    bounds = parse_bounds("X=-50:50,Y=-50:50,Z=-150:-50")
    found = find_placement(machine, path, bounds)
    assert found.allowed
    assert found.mode == machine.mode[:-1] + "-"
    assert not pk.find_placements(machine, path, bounds, mode=machine.mode)[0].allowed


def test_progress():
    said = []
    find_placement(
        load_shipped("linear_delta"), scattered(3, 40, [80, 80, 20]), parse_bounds("X=-9:9,Z=280"), progress=said.append
    )
    assert said == sorted(said)
    assert said[-1] == 1.0


def test_questions_that_make_no_sense():
    machine, path = load_shipped("linear_delta"), path_of([0, 0, 0])
    for bounds in ({"Q": (0.0, 1.0)}, {"X": (1.0, 0.0)}, {"X": (0.0, math.inf)}, {"X": (math.nan, 1.0)}):
        with pytest.raises(pk.PoseError, match="bounds: "):
            find_placement(machine, path, bounds)
    with pytest.raises(pk.PoseError, match="no records"):
        find_placement(machine, path_of(np.empty((0, 3))), {"X": (0.0, 1.0)})
    with pytest.raises(pk.PoseError, match="mode"):
        find_placement(machine, path, {"X": (0.0, 1.0)}, mode="?")


def test_the_other_maxima_come_after_the_best():
    machine, path = load_shipped("tricept"), scattered(4, 40, [150, 100, 40], 30)
    bounds = parse_bounds("X=-300:300,Y=-300:300,Z=-2000:-1400")
    placements = pk.find_placements(machine, path, bounds)
    margins = [placement.margin for placement in placements]
    assert len(placements) > 1 and margins == sorted(margins, reverse=True)
    np.testing.assert_array_equal(placements[0].workpiece, pk.find_placement(machine, path, bounds).workpiece)
    for placement in placements:
        assert least(machine, path, placement.workpiece, placement.mode) == pytest.approx(placement.margin, abs=1e-12)


def test_the_command_takes_a_placement_at_which_the_whole_job_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "a.apt").write_text("UNITS/MM\nFEDRAT/600,MMPM\nGOTO/0,0,0\nGOTO/40,0,0\nFINI\n")
    found = pk.find_placements(load_shipped("tricept"), pk.read_path(tmp_path / "a.apt"), {"Z": (-1600, -1500)})
    outside = replace(found[0], workpiece=pk.workpiece(Z=500.0))
    arguments = [
        "post",
        str(tmp_path / "a.apt"),
        "--machine",
        "tricept",
        "--place",
        "Z=-1600:-1500",
        "-o",
        str(tmp_path),
    ]
    for placements, code in (([outside, found[0]], 0), ([outside], 3)):
        monkeypatch.setattr("parakin.toolpath.placing.placement.find_placements", lambda *_, p=placements, **__: p)
        assert main(arguments) == code
    assert "outside" in capsys.readouterr().out


def test_turns_that_the_job_does_not_make_do_not_count():
    """Three turns about the pole: within the angle tolerance the joint stands still, farther off it is rewound."""
    machine, azimuth = load_shipped("orthoglide5_head"), np.linspace(0.1, 6.0 * np.pi + 0.1, 61)
    tip = np.column_stack([5.0 * np.cos(azimuth), 5.0 * np.sin(azimuth), np.full(61, -100.0)])
    bounds = parse_bounds("X=-5:5,Y=-5:5")
    path = path_of(tip, axis_of(np.full(61, 0.02), np.degrees(azimuth)))
    found = find_placement(machine, path, bounds)
    assert found.allowed
    assert pk.prepare(machine, path, workpiece=found.workpiece, mode=found.mode).runs
    path = path_of(tip, axis_of(np.full(61, 2.0), np.degrees(azimuth)))
    assert not pk.find_placements(machine, path, bounds)[0].allowed
    found = find_placement(machine, path, bounds, rewinds=True)
    assert found.allowed
    rewound = pk.rewind_path(machine, path, pk.Clearance(retract=20.0), workpiece=found.workpiece, mode=found.mode)
    assert pk.prepare(machine, rewound.path, workpiece=found.workpiece, mode=found.mode).runs
