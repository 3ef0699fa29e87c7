"""Joint programs in the dialects of controls: run by interpreters after the controls' documents."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main
from parakin.controllers import load_controller
from parakin.controllers.joints.feeds import Feed, invert_minutes, keep_seconds, measure_speed
from parakin.controllers.joints.look_ahead import predict_planned_seconds, stretch_for_buffer
from parakin.toolpath.path import Event, ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import plan_trajectory
from parakin.toolpath.timing.stops import find_stops

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import turbine_blade
from independent import INVERSES
from joint_controls import (
    plan_as_grbl,
    read_twincat,
    run_fanuc,
    run_fluidnc,
    run_grbl,
    run_heidenhain,
    run_siemens,
)

PROGRAMS = Path(__file__).parent / "joint_programs"
RUNNERS = {"fluidnc": run_fluidnc, "fanuc": run_fanuc, "siemens": run_siemens, "heidenhain": run_heidenhain}
DIGIT = {"grbl": 1e-4, "fluidnc": 1e-4, "fanuc": 1e-3, "siemens": 1e-5, "heidenhain": 1e-4}
LEAST = {"grbl": 0.0065, "fluidnc": 0.011, "fanuc": 0.006, "siemens": 0.001, "heidenhain": 0.001}  # s, a block
PLACES = {
    "tricept": (None, False),
    "hexapod": (pk.workpiece(X=-60, Y=20, Z=710), False),
    "linear_delta": (pk.workpiece(X=-60, Y=45, Z=1920), True),
}
CASES = [(name, target) for name in PLACES for target in RUNNERS] + [("linear_delta", "grbl")]
every_case = pytest.mark.parametrize(("name", "target"), CASES)


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """The example part made ready for a machine, by what its controller moves evenly."""
    folder, known = tmp_path_factory.mktemp("part"), {}

    def job_of(name, interpolation="joints"):
        if (name, interpolation) not in known:
            place, upright = PLACES[name]
            lines = turbine_blade.nx_lines(turbine_blade.tool_path(150, upright), turbine_blade.FEEDS | {"cut": 1e4})
            (folder / "part.cls").write_text("\n".join(lines) + "\n", encoding="ascii")
            machine = load_shipped(name)
            path = pk.fit_tool_lengths(machine, pk.read_path(folder / "part.cls"), "machine")
            known[name, interpolation] = pk.prepare(machine, path, workpiece=place, interpolation=interpolation)
        return known[name, interpolation]

    return job_of


def text_of(trajectory, target, forced=None):
    file = io.BytesIO()
    load_controller(target).build_run(trajectory).make_program(forced, 0.005)(file)
    return file.getvalue().decode("ascii")


def run(trajectory, target):
    return (RUNNERS | {"grbl": run_grbl})[target](text_of(trajectory, target))


def degrees(rows, machine):
    return np.where(np.array(machine.joint_units) == "rad", np.degrees(rows), rows)


def kept_records(trajectory):
    return np.flatnonzero(np.diff(trajectory.curve.corner_of_record, prepend=-1))


def match_rows(rows, wanted, near):
    """For each wanted row, in their order, the number of the row that it is, or of the last one."""
    at, found = 0, []
    for row in wanted:
        if at + 1 < len(rows) and np.abs(rows[at + 1] - row).max() < np.abs(rows[at] - row).max():
            at += 1
        assert np.abs(rows[at] - row).max() < near
        found.append(at)
    return np.array(found)


@every_case
def test_the_control_goes_through_every_record_in_its_time(jobs, name, target):
    trajectory = jobs(name).trajectory
    machine, kept = trajectory.posted.machine, kept_records(trajectory)
    ran = run(trajectory, target)
    near = 0.51 * DIGIT[target] + 1e-4 * (target in ("grbl", "fluidnc"))  # single precision
    found = match_rows(ran.rows, degrees(trajectory.posted.joints[kept], machine), near)
    assert found[-1] == len(ran.rows) - 1 and len(set(found)) > 0.9 * len(kept)
    first = np.searchsorted(found, np.arange(len(ran.rows)))  # the record at which each row is reached
    spans, told = np.diff(trajectory.times[kept][first]), ran.seconds[1:]
    assert (told > spans * (1.0 - 1e-5)).all()
    assert told.sum() < 1.001 * np.maximum(spans, LEAST[target]).sum() + (target == "heidenhain") * 1e-3 * len(told)
    limits = degrees(np.array([drive.speed for drive in machine.model.drives]), machine)
    steps = np.abs(np.diff(ran.rows, axis=0))
    assert (steps <= limits * told[:, None] * (1.0 + 1e-5) + 2.0 * (near - 0.5 * DIGIT[target])).all()
    assert not ran.seconds[0] < 4.0


@every_case
def test_the_positions_are_those_of_the_papers_formulas(jobs, name, target):
    """At the knots: by the second inverse of the tests, with a wrist's angles but for whole turns."""
    trajectory = jobs(name).trajectory
    machine = trajectory.posted.machine
    kept = kept_records(trajectory)
    ran = run(trajectory, target)
    own = INVERSES[name](machine.spec.sizes, trajectory.posted.poses[kept])
    wanted = degrees(own, machine)
    linear = np.array(machine.joint_units) == "mm"
    near = 0.51 * DIGIT[target] + 1e-4 * (target in ("grbl", "fluidnc"))
    shown = degrees(trajectory.posted.joints[kept], machine)
    found = match_rows(ran.rows, shown, near)
    assert np.abs(ran.rows[found][:, linear] - wanted[:, linear]).max() < near
    turn = np.radians(ran.rows[found][:, ~linear] - wanted[:, ~linear])
    assert np.abs(np.sin(0.5 * turn)).max(initial=0.0) < 1e-4


@every_case
def test_the_tip_keeps_to_the_programmed_path(jobs, name, target):
    """Linear in joints between the blocks' ends: tips by the forward problem, five to a block, of 10 µm."""
    job = jobs(name)
    trajectory = job.trajectory
    machine = trajectory.posted.machine
    ran = run(trajectory, target)
    joints = np.where(np.array(machine.joint_units) == "rad", np.radians(ran.rows), ran.rows)
    shares = np.linspace(0.0, 1.0, 6)[:-1, None]
    dense = np.concatenate([a + shares * (b - a) for a, b in pairwise(joints)])
    kept = kept_records(trajectory)
    found = match_rows(ran.rows, degrees(trajectory.posted.joints[kept], machine), 1e-3)
    starts = np.repeat(trajectory.posted.poses[kept[np.searchsorted(found, np.arange(len(joints) - 1))]], 5, axis=0)
    solution = machine.forward(dense, near=starts)
    assert solution.converged.all()
    tips, corners = solution.poses[:, :3], job.programmed.poses[:, :3]
    assert distances(tips, corners).max() < 0.01


def distances(points, corners):
    """From points to a polyline."""
    start, way = corners[:-1], np.diff(corners, axis=0)
    best = np.full(len(points), np.inf)
    for a, u in zip(start, way, strict=True):
        share = np.clip((points - a) @ u / max(u @ u, 1e-30), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - share[:, None] * u, axis=1))
    return best


READ = [("linear_delta", "grbl"), ("linear_delta", "joints"), ("tricept", "fluidnc")]


@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC's interpreter is not installed")
@pytest.mark.parametrize(("name", "target"), READ)
def test_the_interpreter_of_linuxcnc_reads_the_same(jobs, name, target, tmp_path):
    """LinuxCNC's own, whose language grbl and FluidNC take: places, and times as its feeds along X, Y and Z."""
    trajectory = jobs(name).trajectory
    (tmp_path / "part.ngc").write_text(text_of(trajectory, target), encoding="ascii")
    made = subprocess.run(["rs274", "-g", str(tmp_path / "part.ngc")], capture_output=True, text=True, check=True)
    pattern = r"SET_FEED_RATE\(([\d.]+)\)\s+\d+ N\.+\s+STRAIGHT_FEED\((.*)\)"
    feeds, rows = zip(*re.findall(pattern, made.stdout), strict=True)
    rows = np.array([[float(value) for value in row.split(",")] for row in rows])
    shown = degrees(trajectory.posted.joints[kept_records(trajectory)], trajectory.posted.machine)
    found = match_rows(rows[:, : shown.shape[1]], shown, 1.1e-4)
    assert found[-1] == len(rows) - 1
    if name == "linear_delta":
        seconds = 60.0 * np.linalg.norm(np.diff(rows, axis=0), axis=1) / np.array(feeds[1:], float)
        assert trajectory.seconds < seconds.sum() < 1.05 * trajectory.seconds


# TwinCAT


@pytest.mark.parametrize("name", PLACES)
def test_a_table_of_positions_follows_the_path(jobs, name):
    """Moved evenly from line to line: within the joints' speeds, the tip within 10 µm, speeds as the differences."""
    job = jobs(name, "pose")
    machine, table = job.posted.machine, read_twincat(text_of(job.trajectory, "beckhoff"))
    count = len(machine.joints)
    assert len(table.names) == 1 + 2 * count
    time, joints, speeds = table.rows[:, 0], table.rows[:, 1 : 1 + count], table.rows[:, 1 + count :]
    assert np.abs(np.diff(time) - 0.001).max() < 1e-9
    assert job.trajectory.seconds <= time[-1] < job.trajectory.seconds + 0.0011
    moved = np.diff(joints, axis=0) / 0.001
    limits = degrees(np.array([drive.speed for drive in machine.model.drives]), machine)
    assert (np.abs(moved) <= limits * (1.0 + 1e-3)).all()
    mean = 0.5 * (speeds[1:] + speeds[:-1])
    accelerations = degrees(np.array([drive.acceleration for drive in machine.model.drives]), machine)
    assert (np.abs(mean - moved) <= 0.001 * accelerations)[:-1].all()
    assert np.abs(speeds[[0, -1]]).max() < 1e-6
    rows = np.where(np.array(machine.joint_units) == "rad", np.radians(joints), joints)
    halves = 0.5 * (rows[1:] + rows[:-1])
    near = job.trajectory.at(time[:-1] + 0.0005).poses
    solution = machine.forward(halves, near=near)
    assert solution.converged.all()
    assert distances(solution.poses[:, :3], job.programmed.poses[:, :3]).max() < 0.01


def test_a_table_waits_where_the_program_does_and_refuses_what_it_cannot_say():
    waiting = square([(2, "DELAY/0.25"), (0, "SPINDL/RPM,9000,CLW"), (4, "COOLNT/OFF"), (2, "PPRINT HALF WAY")])
    text = text_of(waiting, "beckhoff")
    table = read_twincat(text)
    still = (np.abs(np.diff(table.rows[:, 1:4], axis=0)).max(axis=1) == 0.0).sum()
    assert 250 <= still <= 252
    assert "# before: S9000 M3" in table.head and "# after: M9" in table.head
    assert "# on the way: wait 0.25 s" in table.head
    moving = plan_trajectory(waiting.posted)
    with pytest.raises(
        pk.PoseError, match=r"part\.cls:20: the trajectory does not stand still where the program waits"
    ):
        text_of(moving, "beckhoff")
    for statement in ("COOLNT/ON", "STOP", "SPINDL/OFF", "AUXFUN/12", "LOAD/TOOL,2"):
        with pytest.raises(pk.PoseError, match=r"part\.cls:\d+: a table of positions has no place for M"):
            text_of(square([(2, statement)]), "beckhoff")


# What is not motion


def square(events, dialect="nx", scale=1.0):
    tip = np.array([[0.0, 0.0, 280.0], [5.0, 0.0, 280.0], [5.0, 5.0, 280.0], [0.0, 5.0, 280.0]])
    path = ToolPath(
        "part.cls", tip * [scale, scale, 1.0], np.tile([0.0, 0.0, 1.0], (4, 1)), np.arange(1, 5), np.zeros(4, bool),
        np.full(4, 3000.0), np.full(4, 9000.0), dialect=dialect,
        events=tuple(Event(record, 10 * record + i, text) for i, (record, text) in enumerate(events)),
    )  # fmt: skip
    return plan_trajectory(post_path(load_shipped("linear_delta"), path), stops=find_stops(path))


TARGETS = ["grbl", "fluidnc", "siemens", "heidenhain", "fanuc"]
SAID = [
    ("nx", "SPINDL/RPM,9000,CLW", ["speed 9000", "M3"]),
    ("nx", "SPINDL/RPM,9000,CCLW", ["speed 9000", "M4"]),
    ("nx", "SPINDL/OFF", ["M5"]),
    ("nx", "COOLNT/ON", ["M8"]),
    ("nx", "COOLNT/OFF", ["M9"]),
    ("nx", "STOP", ["M0"]),
    ("nx", "DELAY/2.5", ["dwell 2.5"]),
    ("nx", "LOAD/TOOL,2", ["M5", "M9", "M0"]),
    ("nx", "PPRINT (abort! now) ; 100% ~", []),
    ("gcode", "S800", ["speed 800"]),
    ("gcode", "M8", ["M8"]),
    ("gcode", "G4 P1.5", ["dwell 1.5"]),
    ("gcode", "G54", []),
]


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(("dialect", "text", "actions"), SAID)
def test_events_in_every_dialect(target, dialect, text, actions):
    ran = run(square([(2, text)], dialect), target)
    ends = {"grbl": "M2", "fluidnc": "M2"}.get(target, "M30")
    assert [action for _, action in ran.actions] == [*actions, ends]
    places = {place for place, action in ran.actions[:-1]}
    assert not places or places == {int(np.abs(ran.rows - at_corner(1)).sum(1).argmin()) + 1}
    if target in ("siemens", "fanuc") and actions and text != "S800":  # a speed alone stops nothing
        assert ran.exact[places.pop() - 1]


def at_corner(number):
    """The joints at a corner of the square, by the formula of the machine's sliders."""
    machine = load_shipped("linear_delta")
    tips = np.array([[0.0, 0.0, 280.0], [5.0, 0.0, 280.0], [5.0, 5.0, 280.0], [0.0, 5.0, 280.0]])
    return INVERSES["linear_delta"](machine.spec.sizes, tips)[number]


SWITCHES = [
    ("nx", "OPSTOP", "M1", {"siemens", "heidenhain", "fanuc"}, {"grbl", "fluidnc"}),
    ("nx", "COOLNT/MIST", "M7", {"fluidnc", "siemens", "heidenhain", "fanuc"}, set()),
    ("nx", "AUXFUN/21", "M21", {"siemens", "heidenhain", "fanuc"}, set()),
    ("nx", "AUXFUN/128", "M128", {"siemens", "fanuc"}, set()),  # TCPM of a TNC
    ("nx", "AUXFUN/17", "M17", {"heidenhain", "fanuc"}, set()),  # the end of a Sinumerik's subprogram
    ("nx", "AUXFUN/97", "M97", {"siemens"}, set()),  # a Fanuc's macro interrupt, a TNC's contour steps
    ("gcode", "M64 P1", "M64 P1", {"fluidnc"}, set()),
    ("gcode", "M50", "M50", set(), set()),
    ("gcode", "M110", "M110", {"siemens", "fanuc"}, set()),
    ("gcode", "M110 P2", "M110 P2", set(), set()),
]


@pytest.mark.parametrize(("dialect", "text", "word", "told", "commented"), SWITCHES)
def test_what_a_control_has_no_word_for_is_refused(dialect, text, word, told, commented):
    for target in TARGETS:
        if target in told | commented:
            said = [action for _, action in run(square([(2, text)], dialect), target).actions[:-1]]
            assert said == ([word] if target in told else [])
        else:
            title = load_controller(target).title
            with pytest.raises(pk.PoseError, match=rf"part\.cls:20: {title} has no word for {word}"):
                text_of(square([(2, text)], dialect), target)


def test_messages_are_shown_where_there_is_a_word():
    trajectory = square([(2, '(msg, mind the "clamp"! (now))')], "gcode")
    shown = {target: [a for _, a in run(trajectory, target).actions if a.startswith("message")] for target in TARGETS}
    assert shown.pop("siemens") == ["message mind the 'clamp'! [now]"]
    assert shown.pop("fluidnc") == ['message mind the "clamp". [now]']
    assert not any(shown.values())
    assert all("MIND THE" in text_of(trajectory, target).upper() for target in TARGETS)


@pytest.mark.parametrize("target", [*TARGETS, "beckhoff"])
def test_forced_its_head_says_so(target):
    text = text_of(square([]), target, "part.cls:3: tower_a would be 1,400 mm, limit 1,300").upper()
    assert "OFF LIMITS: WRITTEN WITH --FORCE: PART.CLS:3: TOWER" in text


def test_more_joints_than_axes(jobs):
    with pytest.raises(pk.PoseError, match="tricept has 3 linear and 2 turning joints; grbl has letters for 3 in all"):
        text_of(jobs("tricept").trajectory, "grbl")


@pytest.mark.parametrize(
    ("source", "name"),
    [("a/teil 7.cls", "TEIL_7"), ("7.cls", "P_7"), ("ä" * 40, "P_" + 24 * "_")],
)
def test_programs_have_names_that_controls_take(source, name):
    trajectory = square([])
    path = replace(trajectory.posted.path, source=source)
    named = replace(trajectory, posted=replace(trajectory.posted, path=path))
    assert text_of(named, "siemens").startswith(f"%_N_{name}_MPF\n")
    assert text_of(named, "heidenhain").endswith(f"END PGM {name} MM\n")
    assert f"O0001 ({name.replace('_', ' ')})" in text_of(named, "fanuc").replace("_", " ")


def test_what_can_not_be_a_program_still_has_a_table_and_a_report(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.ngc").write_text(GOLDEN, encoding="ascii")
    for machine, target, why in (
        ("linear_delta", "beckhoff", "part.ngc:9: a table of positions has no place for M9 on the way"),
        ("tricept", "grbl", "tricept has 3 linear and 2 turning joints; grbl has letters for 3 in all"),
    ):
        place = ["--workpiece", "0,0,-1880"] if machine == "tricept" else []
        assert main(["post", "part.ngc", "-m", machine, "-o", machine, "--target", target, *place]) == 3
        assert f"no program: {why}" in capsys.readouterr().out
        assert sorted(path.name for path in Path(machine).iterdir()) == ["part.joints.csv", "part.report.html"]


def test_a_motion_that_is_slower_than_a_word_can_say():
    slow = Feed("FT", keep_seconds, 3, 999.999, "", grows=True)
    assert slow.compute_values(np.ones(3), np.array([0.0012, 999.999, 2.0])).tolist() == [0.002, 999.999, 2.0]
    with pytest.raises(pk.PoseError, match="takes 1000 s, which is slower than FT can say"):
        slow.compute_values(np.ones(2), np.array([1.0, 1000.0]))
    inverse = Feed("F", invert_minutes, 3, 9999.999, "")
    assert inverse.compute_values(np.ones(3), np.array([4.0, 0.001, 7.0])).tolist() == [15.0, 9999.999, 8.571]
    with pytest.raises(pk.PoseError, match="slower than F can say"):
        inverse.compute_values(np.ones(1), np.array([70000.0]))
    speed = Feed("F", measure_speed, 3, 99999.0, "")
    assert speed.compute_values(np.array([1.0, 2.0]), np.array([0.07, 0.001])).tolist() == [857.142, 99999.0]


# Buffers and planners


def dense(tip, feed=6000.0):
    count = len(tip)
    path = replace(
        square([]).posted.path, tip=tip, axis=np.tile([0.0, 0.0, 1.0], (count, 1)), line=np.arange(1, count + 1),
        rapid=np.zeros(count, bool), feed=np.full(count, feed), spindle=np.full(count, np.nan),
    )  # fmt: skip
    return plan_trajectory(post_path(load_shipped("linear_delta"), path))


@pytest.mark.parametrize(("target", "shortest"), [("grbl", 0.005), ("fluidnc", 0.008), ("fanuc", 0.006)])
def test_records_closer_than_a_control_takes_blocks_become_fewer(target, shortest):
    """On a circle, 75 µm apart: all records lie within 0.5 µm of the even motions, by linear interpolation in time."""
    angle = np.linspace(0.0, 2.0, 1600)
    trajectory = dense(np.column_stack([60.0 * np.cos(angle), 60.0 * np.sin(angle), np.full(1600, 300.0)]), 3000.0)
    ran, posted = run(trajectory, target), trajectory.posted.joints
    apart = np.abs(ran.rows[:, None] - posted).max(axis=2)
    records = apart.argmin(axis=1)
    assert (np.diff(records) > 0).all() and records[0] == 0 and records[-1] == 1599
    assert apart.min(axis=1).max() < 0.51 * DIGIT[target] + 1e-4
    between = [np.interp(trajectory.times, trajectory.times[records], posted[records, i]) for i in range(3)]
    assert np.abs(np.column_stack(between) - posted).max() < 5.0001e-4
    assert np.median(ran.seconds) > 0.9 * shortest
    assert trajectory.seconds - 1e-3 < ran.seconds[1:].sum() < 1.1 * trajectory.seconds
    assert len(run(trajectory, "siemens").rows) == 1600


def test_grbl_is_not_told_more_than_its_line_carries():
    zigzag = (
        np.linspace([0.0, 0.0, 280.0], [5.0, 0.0, 280.0], 2000) + [0.0, 0.003, 0.0] * (np.arange(2000) % 2)[:, None]
    )
    trajectory = dense(zigzag)
    for target, line_seconds in (("grbl", 0.005), ("fluidnc", 0.008)):
        seconds = run(trajectory, target).seconds[1:]
        assert len(seconds) > 1990
        assert np.convolve(seconds, np.ones(15), "valid").min() > 15 * line_seconds * 0.999
        controlled = load_controller(target).build_run(trajectory)
        assert controlled.seconds > 1990 * line_seconds
        assert trajectory.seconds > 5.0 or "its planner holds few lines" in controlled.notes[0].text
        assert controlled.notes[0].line > 0


def test_a_buffer_stretches_only_what_would_run_it_dry():
    seconds = np.concatenate([np.full(40, 0.1), np.full(30, 0.001), np.full(40, 0.1)])
    stretched = stretch_for_buffer(seconds, 10, 0.005)
    assert (stretched >= seconds).all() and (stretched[:30] == seconds[:30]).all()
    assert stretched[50] == pytest.approx(0.005)
    assert stretch_for_buffer(seconds, 10, 0.0) is seconds


@pytest.mark.parametrize("seed", range(6))
def test_the_planners_time_is_that_of_a_simulated_one(seed):
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.normal(0.0, [0.02, 0.2, 1.0][seed % 3], (120, 1)), axis=0)
    sizes = rng.uniform(0.05, 2.0, (120, 1))
    steps = sizes * np.hstack([np.cos(turns), np.sin(turns), 0.3 * np.sin(2.0 * turns)])
    steps[60] = -steps[59]  # straight back
    steps[80] = steps[79]  # straight on
    seconds = np.linalg.norm(steps, axis=1) / rng.uniform(5.0, 80.0, 120)
    accelerations = np.array([500.0, 800.0, 300.0])
    for blocks in (3, 15):
        told = predict_planned_seconds(steps, seconds, np.zeros(120, bool), accelerations, blocks).sum()
        assert told == pytest.approx(plan_as_grbl(steps, seconds, accelerations, 0.01, blocks), rel=1e-9)
    parts = (slice(50), slice(50, 120))
    halves = [plan_as_grbl(steps[part], seconds[part], accelerations, 0.01, 15) for part in parts]
    halt = np.arange(120) == 49
    told = predict_planned_seconds(steps, seconds, halt, accelerations, 15).sum()
    assert told == pytest.approx(sum(halves), rel=1e-9)


# The command, and golden files


GOLDEN = """\
G21 G90 G17
S9000 M3
G0 X0 Y0 Z280
M8
G1 X5 F3000
(msg, half way)
G4 P0.5
G1 Y5
M9
M0
G1 X0
M5
M30
"""


@pytest.mark.parametrize("target", [*TARGETS, "beckhoff"])
def test_the_command_writes_golden_programs(target, tmp_path, capsys, monkeypatch):
    """``tests/joint_programs`` was read beside the controls' documents."""
    monkeypatch.chdir(tmp_path)
    text = "G0 X0 Y0 Z280\nG1 X0.05 F3000\nG4 P0.004\nM30\n" if target == "beckhoff" else GOLDEN
    Path("part.ngc").write_text(text, encoding="ascii")
    options = ["-m", "linear_delta", "-o", "out", "--target", target, "--tolerance", "0.05"]
    assert main(["post", "part.ngc", *options]) == 0
    written = Path("out") / f"part.{target}{load_controller(target).suffix}"
    golden = PROGRAMS / written.name
    assert written.read_bytes() == golden.read_bytes()
    capsys.readouterr()
    assert main(["post", str(written), "-m", "linear_delta", "-o", "out"]) == 2
    assert "a program of joint positions" in capsys.readouterr().err
