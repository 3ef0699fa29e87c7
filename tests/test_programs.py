"""Programs for controllers: what is written is read back, keeps the joints' speeds, and hides nothing."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from shipped import load_shipped

import parakin as pk
from parakin.controllers.joints.letters import assign_joint_letters
from parakin.controllers.linuxcnc.approach import plan_approach
from parakin.controllers.linuxcnc.knots import choose_knots
from parakin.toolpath.path import Event, ToolPath
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.posting.wrist_poses import find_pose_with_wrist
from parakin.toolpath.timing import plan_trajectory
from parakin.toolpath.timing.stops import find_stops

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import turbine_blade

PLACES = {
    "tricept": (None, False),
    "hexapod": (pk.workpiece(X=-60, Y=20, Z=710), False),
    "linear_delta": (pk.workpiece(X=-60, Y=45, Z=1920), True),
}
AS_IT_IS = np.hstack([np.eye(3), np.zeros((3, 1))])
HALF = 0.51e-6  # of the last digit, mm and degrees
every_place = pytest.mark.parametrize("name", PLACES)


@pytest.fixture(scope="module")
def trajectories(tmp_path_factory):
    """The trajectory of the example part on a machine, made when asked for."""
    folder, known = tmp_path_factory.mktemp("part"), {}

    def trajectory_of(name):
        if name not in known:
            place, upright = PLACES[name]
            lines = turbine_blade.nx_lines(turbine_blade.tool_path(400, upright), turbine_blade.FEEDS | {"cut": 1e4})
            (folder / "part.cls").write_text("\n".join(lines) + "\n", encoding="ascii")
            machine = load_shipped(name)
            path = pk.fit_tool_lengths(machine, pk.read_path(folder / "part.cls"), "machine")
            known[name] = plan_trajectory(post_path(machine, path, workpiece=place))
        return known[name]

    return trajectory_of


def text_of(writer):
    file = io.BytesIO()
    writer(file)
    return file.getvalue().decode("ascii")


def rim(values, units):
    return np.where(np.array(units) == "rad", np.degrees(values), values)


def path_of(tip, axis=None, **fields):
    count = len(tip)
    values = {"line": np.arange(1, count + 1), "rapid": np.zeros(count, bool), "feed": np.full(count, 3000.0)}
    values |= {"spindle": np.full(count, 12000.0)} | fields
    axis = np.tile([0.0, 0.0, 1.0], (count, 1)) if axis is None else axis
    return ToolPath("part.cls", np.asarray(tip, float), axis, **values)


def motion_lines(text):
    return [line for line in text.splitlines() if re.match(r"(G53 )?G1 ", line)]


# LinuxCNC


def read_knots(machine, text):
    """The poses (k, axes) of a program's timed motions, mm and rad, the s of each, and whether it stops at its end."""
    before, timed = text.split("M67 E63 Q1\n")
    rows, seconds, stops, exact = [], [], [], False
    for line in [motion_lines(before)[-1], *timed.splitlines()]:
        exact = {"G61.1": True, "G61": False}.get(line, exact)
        if line.startswith("G53"):
            *words, feed = [float(word[1:]) for word in line.split()[2:]]
            rows.append(words)
            seconds.append(60.0 / feed)
            stops.append(exact)
    rows = np.where(np.array(machine.axis_units) == "rad", np.radians(rows), rows)
    return rows, np.array([0.0, *seconds[1:]]), np.array([True, *stops[1:]])


@every_place
def test_a_spline_through_the_written_points_is_the_trajectory(trajectories, name):
    """Joints by the inverse, speeds and accelerations by differences: what LinuxCNC will command."""
    trajectory = trajectories(name)
    machine = trajectory.posted.machine
    rows, seconds, stops = read_knots(machine, text_of(pk.make_linuxcnc_program(trajectory)))
    times = np.cumsum(seconds)
    assert times[-1] == pytest.approx(trajectory.seconds, abs=1e-4) and stops[-1]
    assert np.abs(trajectory.at(times).poses - rows).max() < 1e-5  # the times are of few digits
    halts = np.flatnonzero(stops)
    speeds, accelerations = (np.array([getattr(d, rate) for d in machine.drives]) for rate in ("speed", "acceleration"))
    worst = 0.0
    for begin, end in pairwise(halts.tolist()):
        spline = CubicSpline(times[begin : end + 1], rows[begin : end + 1], bc_type="clamped")
        cycles = np.arange(times[begin], times[end], 1e-3)
        poses = spline(cycles)
        assert np.abs(poses - trajectory.at(cycles).poses)[:, :3].max() < 2e-3
        joints = machine.follow(poses, trajectory.posted.mode)
        worst = max(worst, (np.abs(np.diff(joints, axis=0)) / 1e-3 / speeds).max(initial=0.0))
        assert (np.abs(np.diff(joints, 2, axis=0)) / 1e-6 / accelerations).max(initial=0.0) <= 1.05
    assert 0.6 < worst <= 1.002


@pytest.mark.parametrize("lasts", [0.005, 0.02])
@pytest.mark.parametrize("at", [0.108, 0.358, 0.655, 0.748, 0.812, 0.85])
def test_a_spline_holds_where_an_acceleration_ceases(at, lasts):
    """A joint that leaves its limit of acceleration to go evenly, wherever that lies among the knots, and mirrored."""
    most, middle = 5.0, 1.0

    def find_poses(times):
        time = np.minimum(times, 2.0 * middle - np.asarray(times))
        since = [np.maximum(time - moment, 0.0) for moment in (at, at + lasts)]
        gone = most * (time**2 / 2.0 - (since[0] ** 3 - since[1] ** 3) / (6.0 * lasts))
        whole = 2.0 * most * (0.5 * middle**2 - ((middle - at) ** 3 - (middle - at - lasts) ** 3) / (6.0 * lasts))
        return np.where(times <= middle, gone, whole - gone)[:, None]

    drive = SimpleNamespace(speed=np.inf, acceleration=most, jerk=np.inf)
    trajectory = SimpleNamespace(
        posted=SimpleNamespace(
            machine=SimpleNamespace(axis_units=("mm",), drives=(drive,), follow=lambda poses, _: poses), mode=""
        ),
        at=lambda times: SimpleNamespace(poses=find_poses(np.clip(times, 0.0, 2.0 * middle))),
        profile=SimpleNamespace(time=np.array([0.0, middle, 2.0 * middle]), speed=np.array([0.0, most * at])),
        seconds=2.0 * middle,
    )
    knots = choose_knots(trajectory)
    spline = CubicSpline(knots.times, knots.poses[:, 0], bc_type="clamped")
    accelerations = np.diff(spline(np.arange(0.0, 2.0 * middle, 1e-3)), 2) / 1e-6
    assert np.abs(accelerations).max() < 1.025 * most


@every_place
def test_every_motion_is_in_machine_coordinates_and_inverse_time(trajectories, name):
    text = text_of(pk.make_linuxcnc_program(trajectories(name)))
    lines = motion_lines(text)
    axes = trajectories(name).posted.machine.axes
    letters = " ".join(rf"{axis}-?\d+\.\d{{{8 if axis in 'ABC' else 6}}}" for axis in axes)
    assert all(re.fullmatch(rf"G53 G1 {letters} F\d+\.\d{{6}}", line) for line in lines)
    assert len(lines) > 300
    assert max(map(len, text.splitlines())) < 250
    modes = text.index("G21 G90 G17 G40 G49\n"), text.index("G93"), text.index("G53")
    assert sorted(modes) == list(modes)
    assert "G94" not in text
    assert text.endswith("M2\n")
    head = text.splitlines()[:3]
    assert "turbine_blade" in head[0] or "part.cls" in head[0]
    assert f"{name}, mode {trajectories(name).posted.mode}" in head[0]
    assert f"{trajectories(name).seconds:.3f} s" in head[1]
    assert "OFF LIMITS" not in text


def test_where_the_trajectory_stands_still_linuxcnc_does_too():
    machine = load_shipped("linear_delta")
    path = path_of([[0.0, 0.0, 280.0], [40.0, 0.0, 280.0], [40.0, 40.0, 280.0], [80.0, 40.0, 280.0]])
    stopping, rounding = (
        text_of(pk.make_linuxcnc_program(plan_trajectory(post_path(machine, path), corners=c)))
        for c in ("stop", "round")
    )
    assert rounding.count("G61.1\n") == 2  # the way to the first record, and the end
    assert stopping.count("G61.1\n") == 4
    lines = stopping.splitlines()
    for corner in ("X40.000000 Y0.000000", "X40.000000 Y40.000000"):
        at = next(i for i, line in enumerate(lines) if corner in line)
        assert lines[at - 1] == "G61.1"
        assert lines[at + 1] == "G61"


@pytest.mark.parametrize("name", ["tricept", "orthoglide5_head", "orthoglide5_table"])
@pytest.mark.parametrize("mode", ["+", "-"])
def test_from_home_the_wrist_does_not_jump(name, mode):
    machine = load_shipped(name)
    mode = machine.mode[:-1] + mode
    first = machine.home + np.array([15.0, 10.0, -5.0, 0.4, 2.0])
    joints = machine.inverse(first, mode)
    poses, seconds = plan_approach(machine, first, joints, mode)
    assert np.abs(poses[-1] - first).max() == 0.0
    assert seconds[0] >= 4.0
    assert np.abs(poses[0][:3] - machine.home[:3]).max() < 1e-12
    assert poses[0][3] == 0.0  # upright, where a turn moves no joint
    way = np.concatenate([a + np.linspace(1e-6, 1.0, 4000)[:, None] * (b - a) for a, b in pairwise(poses)])
    rows = machine.follow(way, mode)
    wrist = machine.wrist.first
    at_home = machine.inverse(machine.home)[wrist]
    rows[:, wrist] += 2.0 * np.pi * np.round((at_home - rows[0, wrist]) / (2.0 * np.pi))
    assert rows[0, wrist] == pytest.approx(at_home, abs=1e-5)
    assert np.abs(np.diff(rows, axis=0))[:, wrist].max() < 0.01
    assert np.abs(rows[-1] - joints).max() < 1e-6  # on the turn that is planned, too
    other = joints + 2.0 * np.pi * (np.arange(len(joints)) == wrist)
    turned = plan_approach(machine, first, other, mode)[0]
    assert abs(turned[1][4] - poses[1][4]) == pytest.approx(2.0 * np.pi)


def test_what_linuxcnc_cant_follow_is_refused(trajectories):
    machine = load_shipped("linear_delta")
    trajectory = plan_trajectory(post_path(machine, path_of([[0.0, 0.0, 280.0], [1.0, 0.0, 280.0]])))
    other = next(mode for mode in machine.modes if mode != machine.mode)
    with pytest.raises(pk.PoseError, match="mode"):
        pk.make_linuxcnc_program(replace(trajectory, posted=replace(trajectory.posted, mode=other)))
    posted = trajectories("tricept").posted
    poses = posted.poses.copy()
    poses[:, 4] += 700.0
    with pytest.raises(pk.PoseError, match="C would turn"):
        pk.make_linuxcnc_program(replace(trajectories("tricept"), posted=replace(posted, poses=poses)))


def test_a_path_of_one_record(tmp_path):
    machine = load_shipped("hexapod")
    trajectory = plan_trajectory(post_path(machine, path_of([[0.0, 0.0, -940.0]] * 2)))
    lines = motion_lines(text_of(pk.make_linuxcnc_program(trajectory)))
    assert len(lines) == 1
    assert "Z-940.000000" in lines[0]
    (file,) = pk.write_files(tmp_path, {"one.ngc": pk.make_joint_program(trajectory)})
    assert len(pk.read_joint_program(file).joints) == 1


# Joints


@pytest.mark.parametrize("name", PLACES)
def test_what_is_written_in_joints_is_read_back(trajectories, name, tmp_path):
    trajectory = trajectories(name)
    machine = trajectory.posted.machine
    (file,) = pk.write_files(tmp_path, {"part.ngc": pk.make_joint_program(trajectory)})
    read = pk.read_joint_program(file)
    assert read.letters == assign_joint_letters(machine)
    kept = np.append(True, np.diff(trajectory.curve.corner_of_record) > 0)
    assert np.abs(read.joints - rim(trajectory.posted.joints[kept], machine.joint_units)).max() < HALF
    spans = np.diff(trajectory.times[kept])
    assert (read.seconds[1:] > spans - 1e-6).all()  # never less, and more only where a corner is not rounded here
    assert np.abs(read.seconds[1:] - spans).sum() < 1e-3
    limits = rim(np.array([drive.speed for drive in machine.model.drives]), machine.joint_units)
    assert (np.abs(np.diff(read.joints, axis=0)) / read.seconds[1:, None] <= limits * (1.0 + 1e-6)).all()
    lines = file.read_text().splitlines()
    assert all(re.match("[(]|G1 |G|S|M", lines[i - 1]) for i in read.line)
    for letter, joint in zip(read.letters, machine.joints, strict=True):
        assert f"{letter} is {joint} in" in lines[1]


def test_linear_joints_are_xyzuvw_and_turning_ones_abc():
    assert assign_joint_letters(load_shipped("hexapod")) == tuple("XYZUVW")
    assert assign_joint_letters(load_shipped("tricept")) == tuple("XYZAB")


def test_more_joints_than_letters(monkeypatch):
    machine = load_shipped("hexapod")
    monkeypatch.setitem(machine.__dict__, "joint_units", ("mm",) * 7)
    with pytest.raises(pk.PoseError, match="hexapod has 7 linear and 0 turning joints; G-code has letters for 6 and 3"):
        assign_joint_letters(machine)
    monkeypatch.setitem(machine.__dict__, "joint_units", ("rad",) * 4 + ("mm",))
    with pytest.raises(pk.PoseError, match="1 linear and 4 turning"):
        assign_joint_letters(machine)


HEAD = "G21 G90\nG93\n"


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("", None, "no motion"),
        ("( only a remark )\n", None, "no motion"),
        ("G21\nG1 X1 F1\n", 2, "before G90"),
        ("G21 G90\nG1 X1 F1\n", 2, "before G93"),
        ("G20 G90 G93\n", 1, "G20"),
        (HEAD + "G0 X1\n", 3, "G0"),
        (HEAD + "G91\n", 3, "G91"),
        (HEAD + "X1 F1\n", 3, "motion code"),
        (HEAD + "G1 X1\n", 3, "F above zero"),
        (HEAD + "G1 X1 F0\n", 3, "F above zero"),
        (HEAD + "G1 X1 Y2 F1\nX2 F1\n", 4, "same joints"),
        (HEAD + "G1 X1 F1\nX2 Y1 F1\n", 4, "same joints"),
        (HEAD + "G1 X1 F1 R2\n", 3, "R2"),
        (HEAD + "G1 X1 F1\nM2\nX2 F1\n", 5, "program's end"),
        (HEAD + "G1 X1 X2 F1\n", 3, "two X words"),
        (HEAD + "G1 U1 F1 (\n", 3, "comment"),
        (HEAD + "G1 XY F1\n", 3, ""),
    ],
)
def test_what_is_no_program_in_joints(tmp_path, text, line, word):
    file = tmp_path / "joints.ngc"
    file.write_text(text)
    with pytest.raises(pk.InputError) as caught:
        pk.read_joint_program(file)
    assert caught.value.line == line
    assert caught.value.source == str(file)
    assert word in caught.value.message
    assert "\n" not in str(caught.value)


def test_files_that_cant_be_read(tmp_path):
    with pytest.raises(pk.InputError, match="cannot be read"):
        pk.read_joint_program(tmp_path / "nothing.ngc")
    (tmp_path / "binary.ngc").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(pk.InputError, match="plain text"):
        pk.read_joint_program(tmp_path / "binary.ngc")


# What is not motion


def told(events, dialect="nx", writer=pk.make_linuxcnc_program, **fields):
    """The lines of a program of three records that are no motion and no mode, and where its motions are among them."""
    path = path_of([[0.0, 0.0, 280.0], [5.0, 0.0, 280.0], [5.0, 5.0, 280.0]], dialect=dialect, **fields)
    path = replace(path, events=tuple(Event(record, 10 * record + i, text) for i, (record, text) in enumerate(events)))
    trajectory = plan_trajectory(post_path(load_shipped("linear_delta"), path), stops=find_stops(path))
    return text_of(writer(trajectory)).splitlines()


@pytest.mark.parametrize("writer", [pk.make_linuxcnc_program, pk.make_joint_program])
@pytest.mark.parametrize(
    ("dialect", "text", "expected"),
    [
        ("nx", "SPINDL/RPM,12000,CLW", "S12000 M3"),
        ("nx", "SPINDL/RPM,12000,CCLW", "S12000 M4"),
        ("apt", "SPINDL/12000.0000,RPM,CLW", "S12000 M3"),
        ("apt", "SPINDL/ON", "S12000 M3"),
        ("apt", "SPINDL/OFF", "M5"),
        ("apt", "COOLNT/ON", "M8"),
        ("apt", "COOLNT/MIST", "M7"),
        ("apt", "COOLNT/OFF", "M9"),
        ("apt", "COOLNT/THRU", "( line 10: COOLNT/THRU )"),
        ("apt", "STOP", "M0"),
        ("apt", "OPSTOP", "M1"),
        ("apt", "DELAY/2.5", "G4 P2.5"),
        ("apt", "PPRINT (abort, now) ; 100%", "( line 10: PPRINT [abort, now] , 100? )"),
        ("apt", "abort, now", "( line 10: abort, now )"),
        ("apt", "PPRINT Stück", "( line 10: PPRINT St?ck )"),
        ("gcode", "M3", "M3"),
        ("gcode", "S800", "S800"),
        ("gcode", "M8", "M8"),
        ("gcode", "M1", "M1"),
        ("gcode", "G4 P1.5", "G4 P1.5"),
        ("gcode", "G54", "( line 10: G54 )"),
        ("gcode", "(msg, mind the (clamp)", "(MSG,mind the [clamp)"),
    ],
)
def test_events_in_words(writer, dialect, text, expected):
    lines = told([(1, text)], dialect, writer)
    assert lines.count(expected) == 1
    at = lines.index(expected)
    reached = [i for i, line in enumerate(lines) if re.search(r"^(G53 )?G1 ", line)]
    assert reached[0] < at < reached[-1]
    if writer is pk.make_linuxcnc_program:
        assert [i for i in reached if i < at] == reached[:1]


def test_where_events_go():
    lines = told([(0, "COOLNT/ON"), (2, "STOP"), (3, "COOLNT/OFF"), (3, "FINI")])
    at = [lines.index(line) for line in ("M8", "M0", "M9", "( line 33: FINI )", "M2")]
    motion = [i for i, line in enumerate(lines) if line.startswith("G53")]
    corner = next(i for i in motion if "X5.000000 Y0.000000" in lines[i])
    assert at[0] < motion[0] < corner < at[1] < motion[-1] < at[2] < at[3] < at[4]
    assert "M30" not in told([(3, "M30")], "gcode")


def test_a_spindle_goes_on_the_way_it_turned():
    lines = told([(0, "SPINDL/RPM,12000,CCLW"), (1, "SPINDL/OFF"), (2, "SPINDL/ON")])
    assert lines.count("S12000 M4") == 2
    lines = told([(1, "SPINDL/SFM,300,CLW")], spindle=np.full(3, np.nan))
    assert "( line 10: SPINDL/SFM,300,CLW )" in lines


def test_another_tool_stops_the_program():
    lines = told([(0, "LOAD/TOOL,1"), (2, "LOAD/TOOL,2")])
    assert lines.count("M0") == 1
    assert lines[lines.index("M0") - 1] == "( line 21: LOAD/TOOL,2 )"


@pytest.mark.parametrize("writer", [pk.make_linuxcnc_program, pk.make_joint_program])
def test_forced_it_says_so(trajectories, writer):
    offences = "part.cls:214: leg d2 would be 1,533.2 mm, limit 1,520\npart.cls:9: " + 60 * "very long "
    text = text_of(writer(trajectories("tricept"), forced=offences))
    head = text[: text.index("G21")].splitlines()
    assert "( OFF LIMITS: written with --force: part.cls:214: leg d2 would be 1,533.2 mm, limit 1,520 )" in head
    assert all(line.startswith("( ") and line.endswith(" )") and len(line) < 250 for line in head)
    assert "".join(line[2:-2] for line in head).count("very long") == 60


@pytest.mark.parametrize("mode", ["+", "-"])
@pytest.mark.parametrize("tilt", [0.0, 1e-4, 0.3])
def test_from_a_tilted_home_the_wrist_comes_to_either_mode(tmp_path, mode, tilt):
    text = (files("parakin") / "machines" / "tricept.yaml").read_text(encoding="utf-8")
    (tmp_path / "t.yaml").write_text(text.replace("B: 0 deg, C: 0 deg}", "B: 20 deg, C: 40 deg}"), encoding="utf-8")
    machine = pk.load(tmp_path / "t.yaml")
    wrist, mode = machine.wrist, machine.mode[:-1] + mode
    first = machine.home.copy()
    first[:2] = [40.0, 25.0]
    on_pole = machine.inverse(first, mode)
    on_pole[wrist.second] = 0.0
    on_pole[wrist.first] += 0.7
    first = find_pose_with_wrist(machine, first, wrist.tilt(on_pole, mode, tilt), mode)
    joints = machine.inverse(first, mode)
    if tilt == 0.0:
        joints = on_pole
    poses = plan_approach(machine, first, joints, mode)[0]
    way = [machine.home, *poses]
    dense = np.unique(
        np.concatenate([np.linspace(0, 1, 3000), np.geomspace(1e-7, 1, 600), 1 - np.geomspace(1e-7, 1, 600)])
    )
    line = np.concatenate([a + dense[:, None] * (b - a) for a, b in pairwise(way)])
    rows = machine.follow(line, machine.mode, 2e-6)[:, wrist.first]
    rows += machine.inverse(machine.home)[wrist.first] - rows[0]
    assert np.abs(np.diff(rows)).max() < 0.05  # nothing swings
    if tilt:
        assert rows[-1] == pytest.approx(joints[wrist.first], abs=1e-5)
