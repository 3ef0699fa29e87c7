"""Random paths through poles, corners, reversals, tiny and huge steps, run by the planner that LinuxCNC loads.

No joint passes its speed or its acceleration in any cycle, every record is passed, and the time is the one told.
PARAKIN_PATHS sets how many paths there are, PARAKIN_SEED where they begin. What fails is left in the folder that
PARAKIN_FAULTS names.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from random_paths import REACH, PathMaker
from shipped import load_shipped

import parakin as pk
from parakin.controllers.linuxcnc.home_pose import find_home_pose
from parakin.controllers.linuxcnc.knots import Knots, _drop_creeping

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from planner import CYCLE, Planner, read_program
from stub import Kinematics, Stub, inward, outward, world

COUNT = -(-int(os.environ.get("PARAKIN_PATHS", "100")) // len(REACH))  # a machine
FIRST = int(os.environ.get("PARAKIN_SEED", "0"))
TIP = 0.01  # mm, tolerance of prepare
_SPLINE = 2e-3  # mm, of a spline through the knots
_FASTEST, _STRONGEST = 1.02, 1.05  # of a joint's speed and acceleration
POLE = 1e-3  # rad from a wrist's pole, where digits and not limits bound its accelerations
_REFUSED = 0.25  # of the paths: tips go farther than some machines reach

pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build the planner with")


class Controller(NamedTuple):
    """A machine's planner and its kinematics, as LinuxCNC loads them."""

    machine: pk.Machine
    planner: Planner
    kinematics: Kinematics

    def follow(self, poses):
        """The joints (n, joints) of every cycle, mm and rad, by the kinematics module, from home on."""
        at_home = outward(self.machine, self.machine.inverse(find_home_pose(self.machine)))
        joints, codes = self.kinematics.inverse_path(world(self.machine, poses), at_home)
        assert not codes.any()
        return inward(self.machine, joints)


def build_controller(name, folder):
    machine = load_shipped(name)
    return Controller(machine, Planner(machine, folder), Stub(folder).built(machine))


@pytest.fixture(params=REACH, scope="module")
def controller(request, tmp_path_factory):
    return build_controller(request.param, tmp_path_factory.mktemp(request.param))


def find_missed(points, path, within):
    """The first of points (n, 3) that a polyline (m, 3) does not pass in their order; None if it passes them all."""
    path = np.concatenate([path, path[-1:]])  # a tool that stands still has one point
    at, step = 0, np.diff(path, axis=0)
    square = np.maximum((step**2).sum(1), 1e-30)
    for i, point in enumerate(points):
        share = np.clip(((point - path[at:-1]) * step[at:]).sum(1) / square[at:], 0.0, 1.0)
        near = np.flatnonzero(np.linalg.norm(path[at:-1] + share[:, None] * step[at:] - point, axis=1) <= within)
        if not len(near):
            return i
        at += int(near[0])
    return None


def find_apart(machine, poses):
    """The cycles in which a wrist is apart from its pole; on it digits tell where it turns."""
    if machine.wrist is None:
        return np.ones(len(poses), bool)
    return ~machine.wrist.find_free(poses, POLE)


def find_fault(controller, job):
    """What is wrong with a job in LinuxCNC, in a few words; nothing if all is well."""
    machine, planner, file = controller.machine, controller.planner, io.BytesIO()
    pk.make_linuxcnc_program(job.trajectory)(file)
    program = read_program(file.getvalue().decode("ascii"))
    planner.start(find_home_pose(machine))
    run = planner.run_program(program)
    if run.left:
        return f"stops in cycle {len(run.lines)}: {planner.told}"
    joints = controller.follow(run.poses)
    speed, rise = run.measure_shares(joints, apart=find_apart(machine, run.poses))
    if speed > _FASTEST or rise > _STRONGEST:
        return f"a joint at {speed:.3f} of its speed or {rise:.3f} of its acceleration"
    ends = [np.array([getattr(drive, end) for drive in machine.drives]) for end in ("low", "high")]
    if (joints < ends[0] - 1e-6).any() or (joints > ends[1] + 1e-6).any():
        return "a joint passes the end of its range"
    first = int(np.flatnonzero(program.timed)[0]) if program.timed.any() else len(program.timed)
    on_path = run.poses[2:-2][run.lines >= first] if first < len(program.timed) else run.poses[-1:]
    seconds, told = len(on_path) * CYCLE, job.trajectory.seconds
    if abs(seconds - told) > 0.05 + 0.01 * told:
        return f"it takes {seconds:.3f} s, {told:.3f} s are told"
    tips = job.programmed.poses[1:, :3]
    missed = find_missed(tips, on_path[:, :3], TIP + _SPLINE) if len(tips) else None
    return "" if missed is None else f"record {missed + 1} is not passed"


def keep_fault(machine, seed, text):
    folder = os.environ.get("PARAKIN_FAULTS")
    if folder:
        (Path(folder) / f"{machine.name}_{seed}.cls").write_text(text, encoding="ascii")


def test_random_paths_keep_the_joints_limits(controller, tmp_path):
    machine, faults, refused = controller.machine, [], []
    for seed in range(FIRST, FIRST + COUNT):
        maker = PathMaker(machine, seed)
        text = maker.make()
        (tmp_path / "part.cls").write_text(text, encoding="ascii")
        job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
        if job.runs:
            fault = find_fault(controller, job)
        else:
            refused.append(seed)
            first = job.posted.first
            fault = (
                ""
                if (first and first.text and first.line > 0) or re.search(r"cls:\d+", job.unplanned)
                else "refused without a reason"
            )
        if fault:
            keep_fault(machine, seed, text)
            faults.append(f"seed {seed}, {' '.join(maker.recipes)}: {fault}")
    assert not faults, "\n".join(faults)
    assert len(refused) <= max(_REFUSED * COUNT, 3), refused


@pytest.mark.parametrize("feed", [60.0, 20_000.0])
def test_a_star_where_the_poles_of_wrist_and_pose_meet(tmp_path, feed):
    """Both poles would lead the path over themselves, and the ways differ: it takes one, and C turns upright."""
    controller = build_controller("tricept", tmp_path)
    machine = controller.machine
    lines, tilt = ["TOOL PATH/STAR", f"FEDRAT/{feed:.1f},MMPM"], np.radians(20.0)
    for azimuth in 2.5 * np.arange(5):
        to = np.array([np.cos(azimuth), np.sin(azimuth)])
        lines.append("GOTO/0.0,0.0,-1655.0,0.0,0.0,1.0")
        words = [*(30.0 * to), -1655.0, *(np.sin(tilt) * to), np.cos(tilt)]
        lines.append("GOTO/" + ",".join(f"{value:.6f}" for value in words))
    (tmp_path / "part.cls").write_text("\n".join([*lines, "FINI", ""]), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
    assert job.runs
    assert not find_fault(controller, job)


def test_jitter_on_a_pole_that_moves_needs_no_records_between(tmp_path):
    """The tool follows the pole of the wrist over 30 mm, 1e-4 rad off it in all directions, and over B = 0 as well."""
    controller = build_controller("tricept", tmp_path)
    machine = controller.machine
    rng, lines = np.random.default_rng(3), ["TOOL PATH/JITTER", "FEDRAT/20000.0,MMPM"]
    for x in np.linspace(0.0, 29.5, 60):
        tip = np.array([x, 0.0, -1655.0])
        axis = -tip / np.linalg.norm(tip) + np.append(rng.uniform(-1.0, 1.0, 2), 0.0) * 5e-5
        words = [*tip, *(axis / np.linalg.norm(axis))]
        lines.append("GOTO/" + ",".join(f"{value:.6f}" for value in words))
    (tmp_path / "part.cls").write_text("\n".join([*lines, "FINI", ""]), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
    assert job.runs
    assert len(job.posted.path) < 70
    assert np.ptp(job.posted.joints[:, machine.wrist.first]) < np.radians(1.0)
    assert not find_fault(controller, job)


@pytest.mark.parametrize("kind", ["noise", "beside", "tilting"])
@pytest.mark.parametrize("off", [1e-4, 3e-3, 0.3])
def test_a_tool_beside_the_middle_needs_no_turn(tmp_path, kind, off):
    """The wrist's pole passes a tool that is on Z, where C is free, or tilts over it: both poles within some µrad.

    The first joint turns by no more than the straight way past the pole asks for within the axis's tolerance, and C
    does not follow the noise of the last digit; so the time is that of the feed and of the joints' acceleration.
    """
    controller = build_controller("tricept", tmp_path)
    machine = controller.machine
    rng, lines = np.random.default_rng(5), ["TOOL PATH/MIDDLE", "FEDRAT/2000.0,MMPM"]
    for s in np.linspace(-1.0, 1.0, 2 if kind == "tilting" else 21):
        tip, axis = np.array([15.0 * s, off, -1655.0]), np.zeros(2)
        if kind == "noise":
            tip[:2] += 1e-4 * rng.integers(-1, 2, 2)
            axis = 1e-4 * rng.integers(-1, 2, 2)
        if kind == "tilting":
            axis = np.array([0.02 * s, 0.0])
        words = [*tip, *axis, np.sqrt(1.0 - axis @ axis)]
        lines.append("GOTO/" + ",".join(f"{value:.7f}" for value in words))
    (tmp_path / "part.cls").write_text("\n".join([*lines, "FINI", ""]), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
    assert job.runs
    assert not find_fault(controller, job)
    if kind != "tilting":
        assert not any("swings" in note.text for note in job.posted.path.notes)
        assert np.ptp(job.posted.joints[:, machine.wrist.first]) < np.radians(10.0)
        assert job.seconds < 1.5 * 0.9  # s of the feed


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        ("tricept", 46),
        ("tricept", 51),
        ("tricept", 344),
        ("orthoglide5_table", 8),
        ("orthoglide5_table", 276),
        ("orthoglide5_table", 910000),
        ("tricept", 30049),
        ("tricept", 30185),
        ("sprint_z3", 920036),
    ],
)
def test_random_paths_that_were_hard(tmp_path, name, seed):
    """What went wrong once: blends in a cycle or two, a moving pole with two records on it, motions through its circle.

    Also a step of the planner whose half jumps, a way from home beside a moving pole that leaves a joint's range,
    legs that roundings of a table's turn beside the pole took off by some nm, and C that turns far while joints hardly
    move.
    """
    controller = build_controller(name, tmp_path)
    machine = controller.machine
    (tmp_path / "part.cls").write_text(PathMaker(machine, seed).make(), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
    assert job.runs
    assert not find_fault(controller, job)


def test_linuxcnc_takes_a_turn_of_a_tool_that_hardly_moves_in_its_time(tmp_path):
    """Its interp_inverse.cc makes motions in inverse time no slower than 0.1 mm/min, of X Y Z if they move at all."""
    machine = load_shipped("orthoglide5_table")
    (tmp_path / "part.cls").write_text(PathMaker(machine, 20).make(), encoding="ascii")
    file = io.BytesIO()
    pk.make_linuxcnc_program(pk.prepare(machine, pk.read_path(tmp_path / "part.cls")).trajectory)(file)
    blocks = file.getvalue().decode("ascii").split("\nM67 E63 Q1\nG61\n")[1].split("\nG61.1\n")[0].splitlines()
    values = np.array([[float(word[1:]) for word in block.split()[2:]] for block in blocks])
    moves, turns = (np.linalg.norm(np.diff(values[:, part], axis=0), axis=1) for part in (slice(3), slice(3, 5)))
    rates = np.where(moves > 0.0, moves, turns) * values[1:, 5]
    assert (rates >= 0.1).all()
    assert (moves[turns > 1e-3] > 0.0).any()


def test_a_tip_that_crept_catches_up_gently():
    """It stands or is as fast as LinuxCNC obeys, and never much faster than it is told; it was 14 times as fast."""
    slowest, machine = 0.11 / 60.0, load_shipped("tricept")  # mm/s
    times = np.concatenate([np.arange(0.0, 0.16, 0.016), 0.16 + 1e-3 * np.arange(200)])
    poses = np.tile(machine.home, (len(times), 1))
    poses[:, 0] += 0.005 * times**2
    poses[:, 4] = times
    stands = np.zeros(len(times), bool)
    trajectory = SimpleNamespace(posted=SimpleNamespace(machine=machine))
    knots = _drop_creeping(trajectory, Knots(times, poses, stands))
    assert len(knots.times) == len(times)
    speeds, told = (np.diff(rows[:, 0]) / np.diff(times) for rows in (knots.poses, poses))
    assert ((speeds == 0.0) | (speeds > 0.999 * slowest)).all()
    assert (speeds < 1.001 * np.maximum(slowest, told + 0.25 * slowest)).all()
    assert (np.abs(knots.poses - poses)[:, 0] < 5e-5).all()
    assert np.abs(knots.poses - poses)[-1, 0] < slowest * 1e-3
