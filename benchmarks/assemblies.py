"""All assemblies of a joint vector, of a general platform against PHCpack's black box where that is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from measure import best, table

import parakin as pk
from parakin.kernels.batch import count_cores

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from test_continuation import draw_platform, platform, write_phc_system

COUNT = 100
BOUND = 5.0  # ms a joint vector of a general platform, on two cores


def time_phcpack(folder: Path, feet: np.ndarray, corners: np.ndarray, lengths: np.ndarray) -> float | None:
    """Processor time, s, of one system in PHCpack; None where it is not installed."""
    phc = shutil.which("phc")
    if phc is None:
        return None
    system, out = folder / "platform.in", folder / "platform.out"
    system.write_text(write_phc_system(feet, corners, lengths / 1000.0))
    start = os.times().children_user
    subprocess.run([phc, "-b", system, out], check=True, capture_output=True)
    return os.times().children_user - start


def main() -> str:
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        feet, corners = draw_platform(rng)
        general = platform(folder, feet, corners, home=(0.1, 0.2, 1.2, 0.1, 0.2, 0.3))
        theirs = time_phcpack(folder, feet, corners, general.inverse(general.home))
        rows = []
        for title, machine, bound in (
            ("general platform, 40 paths", general, f"≤ {BOUND:g}"),
            ("hexapod", pk.load("hexapod"), ""),
            ("tricept", pk.load("tricept"), ""),
            ("rus6", pk.load("rus6"), ""),
            ("pentapod, 256 paths", pk.load("pentapod"), ""),
            ("linear_delta, closed form", pk.load("linear_delta"), ""),
        ):
            joints = machine.inverse(machine.home) * (1.0 + 0.002 * rng.normal(size=(COUNT, len(machine.joints))))
            answers = machine.list_assemblies(joints)
            assert not any(answer.lost_count for answer in answers)
            batch = best(lambda: machine.list_assemblies(joints), 3) / COUNT  # noqa: B023
            processor = best(lambda: machine.list_assemblies(joints), 3, time.process_time) / COUNT  # noqa: B023
            one = best(lambda: machine.assemblies(joints[0]), 9)  # noqa: B023
            ratio = f"{theirs / processor:.0f}" if theirs is not None and machine is general else ""
            rows.append([title, *(f"{1e3 * seconds:.2f}" for seconds in (one, batch, processor)), bound, ratio])
    title = f"All assemblies, ms a joint vector, {count_cores()} cores"
    return table(
        title, ["machine", "one alone", f"of {COUNT}", "processor time", "bound", "times as fast as PHCpack"], rows
    )


if __name__ == "__main__":
    print(main())
