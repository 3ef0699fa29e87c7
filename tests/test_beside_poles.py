"""Tools that move and tilt by some µm and µrad beside the Tricept's middle, where the poles of wrist and pose meet.

What the check passes LinuxCNC's planner runs; what it can't is refused with its line.
"""

from __future__ import annotations

import io
import shutil
from itertools import pairwise

import numpy as np
import pytest
from shipped import load_shipped
from test_random_paths import build_controller, find_fault, read_program

import parakin as pk
from parakin.toolpath.linearise.continuation import MACHINE_FRAME
from parakin.toolpath.posting.frames import compute_poses
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import plan_trajectory
from parakin.toolpath.timing.pole_jumps import refuse_pole_jumps
from parakin.toolpath.timing.pole_pace import LEAST

pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="there is no gcc to build the planner with")
KINDS = ("stand", "crawl", "cross", "tilt", "star")


def make_path(seed):
    """The CL text of a path: its tip some µm off the middle, its axis as many µrad off Z, or tilting over it."""
    rng = np.random.default_rng([7, seed])
    digits, z = int(rng.choice([6, 7, 9])), -1655.0 + rng.uniform(-100.0, 100.0)
    lines = ["TOOL PATH/BESIDE", f"FEDRAT/{np.exp(rng.uniform(*np.log([50.0, 20_000.0]))):.1f},MMPM"]
    off, azimuth = 10.0 ** rng.uniform(-3.0, -1.7), rng.uniform(-np.pi, np.pi)
    middle = np.array([off * np.cos(azimuth), off * np.sin(azimuth), z])
    kind, count = rng.choice(KINDS), int(rng.choice([2, 3, 5, 12, 30]))
    azimuth = rng.uniform(-np.pi, np.pi)
    along = np.array([np.cos(azimuth), np.sin(azimuth)])
    across = np.array([-along[1], along[0]])
    for k, s in enumerate(np.linspace(-1.0, 1.0, count)):
        lean = 10.0 ** rng.uniform(-6.0, -4.7) if kind != "tilt" else 1e-5
        angle = rng.uniform(-np.pi, np.pi)
        to = np.array([np.cos(angle), np.sin(angle)])
        tip, axis = middle, lean * to
        if kind == "crawl":
            tip = middle + np.array([*rng.normal(size=2) * 5e-3, rng.normal() * 0.05])
        elif kind == "cross":
            tip = np.array([*(10.0 * s * along + off * across), z])
            axis = lean * (across * to[0] + along * to[1])
        elif kind == "tilt":
            tip = middle + np.array([0.0, 0.0, 0.5 * k * rng.choice([0, 1])])
            axis = along * rng.choice([2e-2, 0.3]) * s + across * 10.0 ** rng.uniform(-6.0, -4.7)
        elif kind == "star" and k % 2:
            tip = middle + np.array([*to * rng.choice([0.01, 1.0, 20.0]), 0.0])
            axis = to * rng.choice([2e-5, 1e-2, 0.3])
        words = [*tip, *axis, np.sqrt(1.0 - axis @ axis)]
        lines.append("GOTO/" + ",".join(f"{value:.{digits}f}" for value in words))
    return "\n".join([*lines, "FINI", ""])


@pytest.fixture(scope="module")
def controller(tmp_path_factory):
    return build_controller("tricept", tmp_path_factory.mktemp("tricept"))


def prepare(machine, seed, folder):
    (folder / "part.cls").write_text(make_path(seed), encoding="ascii")
    return pk.prepare(machine, pk.read_path(folder / "part.cls"))


@pytest.mark.parametrize("seed", [5, 19, 32, 46, 51, 61, 111, 142, 229, 1136, 1240, 2000024])
def test_what_runs_runs_in_the_planner(controller, seed, tmp_path):
    """Where both poles meet, even poses bend beside the circle on which the first joint stands: it is left straight.

    The last five once were refused: C of records that were put there was lost, a record on the rim of a hold held, or
    C turned too far from the rim to the next record inside.
    """
    job = prepare(controller.machine, seed, tmp_path)
    assert job.runs
    assert not find_fault(controller, job)


@pytest.fixture(scope="module")
def star(tmp_path_factory):
    """A job of two ways out of the middle and back: both poles lie on it, and stands a few µrad apart."""
    lines = make_path(5022).splitlines()
    file = tmp_path_factory.mktemp("star") / "part.cls"
    file.write_text("\n".join([*lines[:2], *lines[16:20], "FINI", ""]), encoding="ascii")
    return pk.prepare(load_shipped("tricept"), pk.read_path(file))


def test_a_stretch_on_the_pole_takes_cycles_enough(star):
    """In 7 to 9 ms the splines of a program took the first joint off by more than it may make up for in a cycle."""
    trajectory, wrist = star.trajectory, star.posted.machine.wrist
    ends = np.unique(
        np.concatenate([[0.0, trajectory.seconds], trajectory.profile.time[:-1][trajectory.profile.speed < 1e-9]])
    )
    on_pole = 0
    for begin, end in pairwise(ends.tolist()):
        if wrist.find_free(trajectory.at(np.linspace(begin, end, 50)).poses, 8e-6).any():
            on_pole += 1
            assert end - begin > 0.999 * LEAST
    assert on_pole > 1
    times = np.linspace(1e-5, trajectory.seconds - 1e-5, 5000)
    before, at, after = (trajectory.at(times + by) for by in (-1e-6, 0.0, 1e-6))
    assert np.abs((after.joints - before.joints) / 2e-6 - at.speeds).max() < 1e-3


def test_a_program_tells_the_wrist_as_the_trajectory_does(star):
    """Its tips are rounded to 1 nm, and held back where they creep; beside the pole that was 2e-4 rad of theta1."""
    file, machine = io.BytesIO(), star.posted.machine
    pk.make_linuxcnc_program(star.trajectory)(file)
    program = read_program(file.getvalue().decode("ascii"))
    rows = program.rows[program.timed]
    told = np.column_stack([rows[:, :3], np.radians(rows[:, 4:6])])
    poses = star.trajectory.at(np.cumsum(program.seconds[program.timed])).poses
    lean = np.sqrt(machine.wrist.measure_freedom(poses))
    beside = (lean > 8e-6) & (lean < 0.01)
    off = (machine.inverse(told) - machine.inverse(poses))[beside, machine.wrist.first]
    assert beside.sum() > 300
    assert np.abs(np.angle(np.exp(1j * off))).max() < 3e-5
    assert np.abs(told - poses)[:, :3].max() < 1e-4


def test_what_would_jump_is_refused(controller, tmp_path):
    """The first joint comes to the pole at another angle than the one at which it has to leave, and nothing led it."""
    tip = np.array([300.0, 0.0, -1650.0])
    pole, across = -tip / np.linalg.norm(tip), np.array([0.0, 1.0, 0.0])
    axes = np.cos(0.1) * pole + np.sin(0.1) * np.array([np.cross(across, pole), across])
    rows = [[*tip, *axis] for axis in (axes[0], pole, axes[1])]
    text = "".join("GOTO/" + ",".join(f"{value:.9f}" for value in row) + "\n" for row in rows)
    (tmp_path / "part.cls").write_text(f"TOOL PATH/CORNER\nFEDRAT/1000.0,MMPM\n{text}FINI\n", encoding="ascii")
    path = pk.read_path(tmp_path / "part.cls")
    assert pk.prepare(controller.machine, path).runs
    posted = post_path(controller.machine, path)
    with pytest.raises(pk.PoseError, match=r"part.cls:5, record 2: .* would have to jump by [0-9.]+°, where"):
        refuse_pole_jumps(plan_trajectory(posted, axis_tolerance=1e-4).joint_path)


def test_what_was_computed_tells_the_least_lean():
    """A file's digits tell no C where the tool leans less than 2 µrad; an axis that was computed does."""
    machine = load_shipped("tricept")
    lean, c = 5e-7, np.radians([10.0, 40.0, 130.0])
    axis = np.column_stack([lean * np.cos(c), lean * np.sin(c), np.ones(3)])
    tip = np.tile([0.0, 0.0, -1650.0], (3, 1))
    read = compute_poses(machine, tip, axis, MACHINE_FRAME)[0]
    exact = compute_poses(machine, tip, axis, MACHINE_FRAME, exact=np.array([True, True, False]))[0]
    assert (read[:, -1] == 0.0).all()
    assert np.degrees(exact[:, -1]) == pytest.approx([10.0, 40.0, 40.0], abs=1e-9)


@pytest.mark.parametrize(("tilt", "azimuth", "most"), [(4.0, 0.0, 0.5), (20.0, 2.5, 0.75)])
def test_a_motion_off_a_carried_pole_takes_its_time_however_dense_it_is(tmp_path, tilt, azimuth, most):
    """B and C that go evenly would lead the wrist's first joint aside between the records, and trembling takes time.

    It stands but for hundredths of a degree, by poses between the records. In 1 piece the motions took 1.20 and 1.44 s,
    in 200 1.41 and 1.22.
    """
    machine = load_shipped("tricept")
    tips = machine.home[:3] + np.array([[30.0, 20.0, 0.0], [35.0, 20.0, 0.0]])
    z = -tips / np.linalg.norm(tips, axis=1)[:, None]
    x = np.cross([0.0, 1.0, 0.0], z[1]) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], z[1]))
    lean = np.cos(azimuth) * x + np.sin(azimuth) * np.cross(z[1], x)
    end = np.cos(np.radians(tilt)) * z[1] + np.sin(np.radians(tilt)) * lean
    angle = np.arccos(z[0] @ end)
    seconds = []
    for count in (1, 33, 200):
        lines = ["TOOL PATH/TILT", "FEDRAT/2000.0,MMPM"]
        for s in np.linspace(0.0, 1.0, count + 1):
            axis = (np.sin((1.0 - s) * angle) * z[0] + np.sin(s * angle) * end) / np.sin(angle)
            words = [*(tips[0] + s * (tips[1] - tips[0])), *axis]
            lines.append("GOTO/" + ",".join(f"{value:.9f}" for value in words))
        (tmp_path / "part.cls").write_text("\n".join([*lines, "FINI", ""]), encoding="ascii")
        job = pk.prepare(machine, pk.read_path(tmp_path / "part.cls"))
        assert job.runs
        seconds.append(job.seconds)
        share = np.linspace(0.0, 1.0, 9)[:, None, None]
        poses = job.posted.poses
        between = (poses[:-1] + share * np.diff(poses, axis=0)).reshape(-1, 5)
        off = np.sin(2.0 * (machine.inverse(between)[:, 3] - job.posted.joints[0, 3]) / 2.0)  # in either mode
        far = machine.wrist.measure_freedom(between) > 1e-6
        assert np.abs(off[far]).max() < np.radians(0.05)
    assert max(seconds) < most and max(seconds) < 1.45 * min(seconds)
