"""Tools that move and tilt by some µm and µrad beside the Tricept's middle, where the poles of wrist and pose meet.

What the check passes LinuxCNC's planner runs; what it can't is refused with its line.
"""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from test_random_paths import build_controller, find_fault

import parakin as pk

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


@pytest.mark.parametrize("seed", [5, 19, 32, 46, 51, 61, 93, 111])
def test_what_runs_runs_in_the_planner(controller, seed, tmp_path):
    """Where both poles meet, even poses bend beside the circle on which the first joint stands: it is left straight."""
    job = prepare(controller.machine, seed, tmp_path)
    assert job.runs
    assert not find_fault(controller, job)


@pytest.mark.parametrize(("seed", "line"), [(142, 24), (229, 5), (253, 19)])
def test_what_would_jump_is_refused(controller, seed, line, tmp_path):
    """The first joint comes to the pole at another angle than the one at which the poses lead away from it."""
    job = prepare(controller.machine, seed, tmp_path)
    assert not job.runs and job.trajectory is None
    assert f"part.cls:{line}, record" in job.unplanned and "would have to jump" in job.unplanned
