"""The real LinuxCNC, headless: it starts, homes and moves, its joints are the library's, and it runs what is posted.

Its drives follow within their own limits, with 2 % to spare: what they could not follow would be a following error.
"""

from __future__ import annotations

import io
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_paths import PathMaker
from shipped import CONFIGURED, EVERYTHING, load_shipped

import parakin as pk
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import plan_trajectory

HERE = Path(__file__).parent / "linuxcnc"

sys.path.insert(0, str(HERE))
sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import turbine_blade  # noqa: E402
from cycles import RISE, SPEED, check_joints, find_near_pole, measure_use, write_move_away  # noqa: E402
from planner import Planner, read_program  # noqa: E402
from simulation import CYCLE, as_programmed, first_line, simulated, why_not  # noqa: E402
from stub import FIELDS, outward, pose, world  # noqa: E402

# A move by hand, and moves that must be refused with a word: off a drive's range, off another limit of the machine's.
# These machines have a program of their own here; the others run the one they come with.
TASKS = {
    "linear_delta": ("G1 X50 Y-30 Z320 F30000", {"G0 Z600": "joint", "G0 X350 Y-330 Z100": "kinematicsInverse"}),
    "hexapod": ("G1 X30 Y20 Z-900 A5 B-5 C8 F9000", {"G0 X350 Z-1200": "joint", "G0 Z-1000 A60": "kinematicsInverse"}),
    "tricept": ("G1 X50 Y60 Z-1630 B-15 C20 F9000", {"G0 Z-2090": "joint", "G0 X1500 Z-400": "kinematicsInverse"}),
}
# Where the example part lies, on top of its own frame, and whether its tool stays upright.
PLACES = {
    "tricept": (None, False),
    "hexapod": (pk.workpiece(X=-60, Y=20, Z=710), False),
    "linear_delta": (pk.workpiece(X=-60, Y=45, Z=1920), True),
}
RESERVE = 0.02  # of the drives' speeds and accelerations
FEED = 10_000.0  # mm/min, in the cut: ball mill of 10 mm, four teeth, aluminium

WHY_NOT = why_not()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


@pytest.fixture
def machine(request):
    return load_shipped(request.param)


@pytest.fixture
def linuxcnc(machine):
    with simulated(machine, reserve=RESERVE) as simulation:
        yield simulation


def words(block):
    return {word[0]: float(word[1:]) for word in block.split() if word[0] in FIELDS}


@pytest.mark.parametrize("machine", CONFIGURED, indirect=True)
def test_it_starts_homes_and_moves(machine, linuxcnc):
    by_hand, refused = TASKS.get(machine.name, (write_move_away(machine), {}))
    if machine.name in TASKS:
        shutil.copy(HERE / f"{machine.name}.ngc", linuxcnc.folder)
    run = linuxcnc.run(
        {"by hand": [by_hand], "override": 4.0, "program": f"{machine.name}.ngc", "refused": list(refused)}
    )
    seen, poses, joints = run.seen, run.poses, run.joints
    assert "told" not in seen, seen
    assert run.done.returncode == 0
    home = world(machine, find_home_pose(machine)[None])[0]
    assert np.abs(np.array(seen["home"]) - home).max() < 1e-6
    for letter, value in words(by_hand).items():
        assert abs(seen["by hand"][0][FIELDS.index(letter)] - value) < 1e-6
    counts = slice(5 if machine.axes[3:] == ("B", "C") else 9)  # upright, it may have any C
    assert np.abs(np.array(seen["program"]) - home)[counts].max() < 1e-6
    assert np.abs(np.array(seen["at last"]) - seen["program"]).max() < 1e-6  # it stayed where it was
    for block, word in refused.items():
        assert word in seen["refused"][block], seen["refused"]
    assert len(poses) > 300
    moved = np.ptp(pose(machine, poses), axis=0)
    assert (moved >= np.where(np.array(machine.axis_units) == "mm", 20.0, np.radians(10.0)) - 1e-6).all()
    check_joints(machine, poses, joints)
    free = find_near_pole(machine, joints)
    assert np.abs(np.diff(joints, axis=0))[~free[:-1]].max() < 3.0  # nothing swings round


# Programs


def first_passes(machine, folder, feed=FEED, count=60):
    """The first passes of the example part on a machine."""
    place, upright = PLACES[machine.name]
    path = turbine_blade.tool_path(2000, upright)
    file = folder / "turbine_blade.cls"
    feeds = turbine_blade.FEEDS | {"cut": feed}
    file.write_text("\n".join(turbine_blade.nx_lines(path, feeds)) + "\n", encoding="ascii")
    read, part = pk.read_path(file), slice(count)
    events = tuple(event for event in read.events if event.record < count)
    arrays = {name: getattr(read, name)[part] for name in ("tip", "axis", "line", "rapid", "feed", "spindle")}
    path = pk.fit_tool_lengths(machine, replace(read, events=events, **arrays), "machine")
    return pk.prepare(machine, path, workpiece=place)


def written(trajectory):
    """The program, with four times its feeds on the way to the first record: here it is known where the tool is."""
    file = io.BytesIO()
    pk.make_linuxcnc_program(trajectory)(file)
    approach, timed, rest = file.getvalue().decode("ascii").partition("\nM67")
    return re.sub(r"(?<= F)[\d.]+$", lambda feed: f"{4.0 * float(feed[0]):.6f}", approach, flags=re.M) + timed + rest


@pytest.mark.parametrize("machine", PLACES, indirect=True)
def test_a_posted_program_keeps_the_joints_limits_and_its_time(machine, linuxcnc, tmp_path):
    job = first_passes(machine, tmp_path)
    assert job.runs
    posted, trajectory = job.posted, job.trajectory
    text = written(trajectory)
    run = linuxcnc.run({"program": "part.ngc", "override": 1.5}, {"part.ngc": text})
    assert "told" not in run.seen, run.seen
    check_joints(machine, run.poses, run.joints)
    speed, rise = measure_use(machine, run.joints)  # from home on
    assert 0.6 < speed <= SPEED and 0.9 < rise <= RISE
    part = run.part(first_line(text), world(machine, posted.poses[:1])[0])
    assert (part.stop - part.start - 1) * CYCLE == pytest.approx(trajectory.seconds, rel=0.01)
    ends = world(machine, posted.poses[[0, -1]])
    assert np.abs(run.poses[-1] - ends[1]).max() < 2e-6
    assert np.abs(run.poses[part.start] - ends[0]).max() < 1e-4  # it stands there for less than a cycle
    assert aside(run.poses[part][:, :3], world(machine, posted.poses)[:, :3]).max() < 0.005 + 2e-3  # as asked for


@pytest.mark.parametrize("machine", ["tricept"], indirect=True)
def test_overrides_and_pauses_keep_the_joints_limits(machine, linuxcnc, tmp_path):
    job = first_passes(machine, tmp_path)
    text = written(job.trajectory)
    before = float(read_program(text).seconds[~read_program(text).timed].sum())
    changes = [
        [0.4, "feedrate", 0.3],
        [1.2, "feedrate", 1.0],
        [1.5, "auto", "AUTO_PAUSE"],
        [1.8, "auto", "AUTO_RESUME"],
    ]
    changes += [
        [2.2, "feedrate", 0.0],
        [2.5, "feedrate", 1.0],
        [2.8, "auto", "AUTO_PAUSE"],
        [3.1, "auto", "AUTO_RESUME"],
    ]
    during = [[before + at, *rest] for at, *rest in changes]
    run = linuxcnc.run({"program": "part.ngc", "during": during}, {"part.ngc": text})
    assert "told" not in run.seen, run.seen
    speed, rise = measure_use(machine, run.joints)
    assert speed <= SPEED and rise <= RISE
    part = run.part(first_line(text), world(machine, job.posted.poses[:1])[0])
    assert (part.stop - part.start - 1) * CYCLE > job.trajectory.seconds + 1.2
    assert np.abs(run.poses[-1] - world(machine, job.posted.poses[-1:])[0]).max() < 2e-6


@pytest.mark.parametrize("machine", ["tricept"], indirect=True)
def test_a_foreign_program_is_slowed_where_a_joint_would_pass_its_limits(machine, linuxcnc, tmp_path):
    """With the programmed feeds and rapids, which nobody has fitted to the machine."""
    job = first_passes(machine, tmp_path)
    text = as_programmed(job.posted, written(job.trajectory))
    run = linuxcnc.run({"program": "part.ngc"}, {"part.ngc": text})
    assert "told" not in run.seen, run.seen
    speed, rise = measure_use(machine, run.joints)
    assert 0.95 < speed <= SPEED and 0.95 < rise <= RISE
    check_joints(machine, run.poses, run.joints)
    part = run.part(first_line(text), world(machine, job.posted.poses[:1])[0])
    path = world(machine, job.posted.poses)[:, :3]
    assert aside(run.poses[part][:, :3], path).max() < 0.005 + 1e-4
    assert np.abs(run.poses[-1] - world(machine, job.posted.poses[-1:])[0]).max() < 2e-6


# Random paths


SEEDS = {"orthoglide5_head": 20, "orthoglide5_table": 3, "hexapod": 1}  # stars, starts and turns on the pole, a circle


@pytest.mark.parametrize("machine", SEEDS, indirect=True)
def test_random_paths_run_as_the_planner_does_alone(machine, linuxcnc, tmp_path):
    """The poses that the same planner commands without LinuxCNC, from which its time is told, but for a few cycles."""
    planner = Planner(machine, tmp_path)
    for seed in range(21) if EVERYTHING else [SEEDS[machine.name]]:
        (tmp_path / "part.cls").write_text(PathMaker(machine, seed).make(), encoding="ascii")
        job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
        if not job.runs:  # some lead out of the workspace
            assert job.posted.first is not None and seed != SEEDS[machine.name]
            continue
        text = written(job.trajectory)
        run = linuxcnc.run({"program": "part.ngc"}, {"part.ngc": text})
        assert "told" not in run.seen, run.seen
        assert measure_use(machine, run.joints)[0] <= SPEED
        planner.start(find_home_pose(machine))
        alone = world(machine, planner.run_program(read_program(text)).poses)
        first, moving = (int(np.flatnonzero((np.diff(p, axis=0) != 0.0).any(1))[0]) for p in (run.poses, alone))
        count = min(len(run.poses) - first, len(alone) - moving)
        assert count > len(alone) - moving - 10
        assert lag(run.poses[first : first + count], alone[moving : moving + count]).max() < 1e-3


def lag(poses, alone, cycles=4):
    """How far poses (n, axes) are from a polyline (n, axes) as it runs a few cycles before and after, (n,)."""
    least = np.full(len(poses), np.inf)
    for shift in range(-cycles, cycles + 1):
        cycle = np.clip(np.arange(len(poses)) + shift, 0, len(alone) - 2)
        start, step = alone[cycle], alone[cycle + 1] - alone[cycle]
        share = np.clip(((poses - start) * step).sum(1) / np.maximum((step * step).sum(1), 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.abs(poses - start - share[:, None] * step).max(1))
    return least


def aside(points, path):
    """How far points (n, 3) are from a polyline, (n,)."""
    least = np.full(len(points), np.inf)
    for start, step in zip(path[:-1], np.diff(path, axis=0), strict=True):
        share = np.clip((points - start) @ step / max(float(step @ step), 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(points - start - share[:, None] * step, axis=1))
    return least


@pytest.mark.parametrize("machine", ["tricept"], indirect=True)
def test_a_wrist_goes_on_in_its_other_mode_and_stops_are_kept(machine, linuxcnc, tmp_path):
    posted = post_path(machine, first_passes(machine, tmp_path, feed=2500.0, count=25).programmed.path, mode="-")
    trajectory = plan_trajectory(posted, corners="stop")
    text = written(trajectory)
    run = linuxcnc.run({"program": "part.ngc"}, {"part.ngc": text})
    assert "told" not in run.seen, run.seen
    speed, rise = measure_use(machine, run.joints)
    assert speed <= SPEED and rise <= RISE
    part = run.part(first_line(text), world(machine, posted.poses[:1])[0])
    assert np.abs(run.joints[part][-1] - outward(machine, posted.joints[-1:])[0]).max() < 2e-6
    halts = trajectory.curve.corner[1:-1][trajectory.curve.parted[1:-1]]
    assert len(halts) > 2
    for row in world(machine, halts):
        assert np.abs(run.poses - row).max(1).min() < 1e-4  # it stands there for less than a cycle
