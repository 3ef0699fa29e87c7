"""Random paths through poles, corners, reversals, tiny and huge steps, run by a model of LinuxCNC's motion.

No joint passes its speed in any cycle, every record is passed, and the time is the one that is told. PARAKIN_PATHS sets
how many paths there are, PARAKIN_SEED where they begin. What fails is left in the folder that PARAKIN_FAULTS names.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from random_paths import REACH, PathMaker

import parakin as pk

sys.path.insert(0, str(Path(__file__).parent / "linuxcnc"))
from motion_model import CYCLE, AxisLimits, Model, Motion, Program, find_first_line, read_limits, read_program
from stub import Kinematics, Stub, outward, world

COUNT = -(-int(os.environ.get("PARAKIN_PATHS", "100")) // len(REACH))  # a machine
FIRST = int(os.environ.get("PARAKIN_SEED", "0"))
TIP = 0.01  # mm, tolerance of prepare; LinuxCNC's own is in it
_DIGITS = 1e-4  # mm, of tips in cycles and of held tips
_FASTEST = 1.0  # of a joint's speed
_REFUSED = 0.25  # of the paths: tips go farther than some machines reach

pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build the kinematics with")


class Controller(NamedTuple):
    """A machine under the model of LinuxCNC."""

    machine: pk.Machine
    kinematics: Kinematics
    limits: AxisLimits
    model: Model


class Simulated(NamedTuple):
    """A program that was run: joints (n, joints) of every cycle as LinuxCNC has them, and the cycles of the path."""

    program: Program
    motion: Motion
    joints: np.ndarray
    codes: np.ndarray
    on_path: np.ndarray


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The stub of the HAL and the model, which are built once."""
    folder = tmp_path_factory.mktemp("controller")
    return Stub(folder), Model(folder)


MACHINES = list(REACH)


@pytest.fixture(params=MACHINES)
def controller(request, built):
    machine, (stub, model) = pk.load(request.param), built
    ini = pk.make_linuxcnc_configuration(machine)[f"{machine.name}.ini"]
    return Controller(machine, stub.built(machine), read_limits(ini), model)


def simulate_job(controller, job):
    file = io.BytesIO()
    pk.make_linuxcnc_program(job.trajectory)(file)
    text, machine = file.getvalue().decode("ascii"), controller.machine
    home, at_home = world(machine, machine.home[None])[0], outward(machine, machine.inverse(machine.home))
    program = read_program(text, home)
    motion = controller.model.simulate(program, controller.limits, home)
    joints, codes = controller.kinematics.inverse_path(motion.poses, at_home)
    on_path = program.line[motion.motion] >= find_first_line(text)
    return Simulated(program, motion, np.vstack([at_home, joints]), codes, on_path)


def measure_speeds(machine, joints):
    """Speeds of the joints as shares of their limits, every cycle."""
    limits = outward(machine, np.array([[drive.speed for drive in machine.drives]]))
    return np.abs(np.diff(joints, axis=0)) / CYCLE / limits


def find_missed(points, path, within):
    """The first of points (n, 3) that a polyline (m, 3) does not pass in their order; None if it passes them all."""
    at, step = 0, np.diff(path, axis=0)
    square = np.maximum((step**2).sum(1), 1e-30)
    for i, point in enumerate(points):
        share = np.clip(((point - path[at:-1]) * step[at:]).sum(1) / square[at:], 0.0, 1.0)
        near = np.flatnonzero(np.linalg.norm(path[at:-1] + share[:, None] * step[at:] - point, axis=1) <= within)
        if not len(near):
            return i
        at += int(near[0])
    return None


def find_fault(controller, job):
    """What is wrong with a job in LinuxCNC, in a few words; nothing if all is well."""
    run, machine = simulate_job(controller, job), controller.machine
    if run.codes.any():
        return f"out of reach in cycle {int(np.flatnonzero(run.codes)[0])}"
    speeds = measure_speeds(machine, run.joints)
    if speeds.max() > _FASTEST:
        cycle, joint = np.unravel_index(speeds.argmax(), speeds.shape)
        line = run.program.line[run.motion.motion[cycle]]
        return f"{machine.joints[joint]} at {speeds.max():.2f} of its speed in line {line}"
    ends = outward(
        machine, np.array([[drive.low for drive in machine.drives], [drive.high for drive in machine.drives]])
    )
    if (run.joints < ends[0] - 1e-6).any() or (run.joints > ends[1] + 1e-6).any():
        return "a joint passes the end of its range"
    seconds, told = run.on_path.sum() * CYCLE, pk.predict_linuxcnc_seconds(job.trajectory)
    if abs(seconds - told) > 0.05 + 0.02 * told:
        return f"it takes {seconds:.3f} s, {told:.3f} s are told"
    tips = job.programmed.poses[1:, :3]
    missed = find_missed(tips, run.motion.poses[run.on_path][:, :3], TIP + _DIGITS) if len(tips) else None
    return "" if missed is None else f"record {missed + 1} is not passed"


def keep_fault(machine, seed, text):
    folder = os.environ.get("PARAKIN_FAULTS")
    if folder:
        (Path(folder) / f"{machine.name}_{seed}.cls").write_text(text, encoding="ascii")


def test_random_paths_keep_the_joints_speeds(controller, tmp_path):
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
def test_a_star_where_the_poles_of_wrist_and_pose_meet(built, tmp_path, feed):
    """Both poles would lead the path over themselves, and the ways differ: it takes one, and C turns upright."""
    stub, model = built
    machine = pk.load("tricept")
    ini = pk.make_linuxcnc_configuration(machine)["tricept.ini"]
    controller = Controller(machine, stub.built(machine), read_limits(ini), model)
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


def test_jitter_on_a_pole_that_moves_needs_no_records_between(built, tmp_path):
    """The tool follows the pole of the wrist over 30 mm, 1e-4 rad off it in all directions, and over B = 0 as well."""
    stub, model = built
    machine = pk.load("tricept")
    ini = pk.make_linuxcnc_configuration(machine)["tricept.ini"]
    controller = Controller(machine, stub.built(machine), read_limits(ini), model)
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


@pytest.mark.parametrize(
    ("name", "seed"),
    [("tricept", 46), ("tricept", 51), ("tricept", 344), ("orthoglide5_table", 8), ("orthoglide5_table", 276)],
)
def test_random_paths_that_were_hard(built, tmp_path, name, seed):
    """Blends in one cycle or two, two records on a pole that moves, a single motion through the circle about a pole."""
    stub, model = built
    machine = pk.load(name)
    ini = pk.make_linuxcnc_configuration(machine)[f"{name}.ini"]
    controller = Controller(machine, stub.built(machine), read_limits(ini), model)
    (tmp_path / "part.cls").write_text(PathMaker(machine, seed).make(), encoding="ascii")
    job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
    assert job.runs
    assert not find_fault(controller, job)
