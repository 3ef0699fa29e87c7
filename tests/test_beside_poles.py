"""Tools that move and tilt by some µm and µrad beside the Tricept's middle, where the poles of wrist and pose meet.

What the check passes LinuxCNC's planner runs; what it can't is refused with its line.
"""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from test_random_paths import build_controller, find_fault

import parakin as pk
from parakin.toolpath.linearise.continuation import MACHINE_FRAME
from parakin.toolpath.posting.frames import compute_poses
from parakin.toolpath.posting.post import post_path
from parakin.toolpath.timing import plan_trajectory
from parakin.toolpath.timing.pole_jumps import refuse_pole_jumps

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


@pytest.mark.parametrize("seed", [5, 19, 32, 46, 51, 61, 93, 111, 142, 229, 1136, 1240])
def test_what_runs_runs_in_the_planner(controller, seed, tmp_path):
    """Where both poles meet, even poses bend beside the circle on which the first joint stands: it is left straight.

    The last four once were refused: C of records that were put there was lost, or a record on the rim of a hold held.
    """
    job = prepare(controller.machine, seed, tmp_path)
    assert job.runs
    assert not find_fault(controller, job)


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
    machine = pk.load("tricept")
    lean, c = 5e-7, np.radians([10.0, 40.0, 130.0])
    axis = np.column_stack([lean * np.cos(c), lean * np.sin(c), np.ones(3)])
    tip = np.tile([0.0, 0.0, -1650.0], (3, 1))
    read = compute_poses(machine, tip, axis, MACHINE_FRAME)[0]
    exact = compute_poses(machine, tip, axis, MACHINE_FRAME, exact=np.array([True, True, False]))[0]
    assert (read[:, -1] == 0.0).all()
    assert np.degrees(exact[:, -1]) == pytest.approx([10.0, 40.0, 40.0], abs=1e-9)
