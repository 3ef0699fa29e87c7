"""LinuxCNC's kinematics modules, a call a servo cycle along a path, against LinuxCNC's own genhexkins.

genhexkins solves the direct problem twice a call, once more for its picture's pins.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from measure import best, table

import parakin as pk

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "linuxcnc"))
from stub import Kinematics, Stub, outward, world

COUNT = 20_000
GENHEX = Path("/usr/lib/linuxcnc/modules/genhexkins.so")
MACHINES = ("tricept", "hexapod", "linear_delta")
BOUNDS = {"tricept": 0.25, "hexapod": 0.25}  # direct, times genhexkins


def path(machine: pk.Machine) -> np.ndarray:
    """Poses a millisecond apart at some 100 mm/s and 17°/s."""
    spread = np.where(np.array(machine.axis_units) == "mm", 100.0, 0.3)
    t = 1e-3 * np.arange(COUNT)[:, None]
    poses = machine.home + spread * np.sin(t + np.arange(len(spread)))
    if machine.axes == ("X", "Y", "Z", "B", "C"):
        poses[:, 3] = np.abs(poses[:, 3]) + 0.05
    return poses


def nanoseconds(work: Callable[[], object]) -> float:
    return 1e9 * best(work, 15) / COUNT


def genhexkins(stub: Stub) -> tuple[float, float]:
    """Inverse and direct of LinuxCNC's hexapod: the same joints as the one of parakin, in inches, without a tool."""
    kinematics = Kinematics(stub.library, GENHEX, 6)
    poses = world(pk.load("hexapod"), path(pk.load("hexapod")))
    poses[:, :3] /= 25.4
    poses[:, 2] -= poses[:, 2].mean() + 31.5
    joints, _ = kinematics.inverse(poses, np.zeros((COUNT, 6)))
    kinematics.forward(joints[:2], poses[:2])  # its first start is not the one it is given
    found, codes = kinematics.forward_path(joints, poses[0])
    assert not codes.any() and np.abs(found - poses).max() < 1e-6
    return (
        nanoseconds(lambda: kinematics.inverse_path(poses, joints[0])),
        nanoseconds(lambda: kinematics.forward_path(joints, poses[0])),
    )


def main() -> str:
    title = f"LinuxCNC's kinematics, {COUNT:,} cycles of a path, one core"
    if not shutil.which("gcc"):
        return f"{title}: there is no gcc to build it with\n"
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        stub, own = Stub(folder), None
        if GENHEX.exists():
            inverse, own = genhexkins(stub)
            rows.append(["genhexkins", f"{inverse:.0f}", f"{own:.0f}", "1.00", ""])
        for name in MACHINES:
            machine = pk.load(name)
            kinematics, poses = stub.built(machine), path(machine)
            rows_in, joints = world(machine, poses), outward(machine, machine.follow(poses))
            found, codes = kinematics.forward_path(joints, rows_in[0])
            assert not codes.any() and np.abs(found - rows_in).max() < 1e-6
            inverse = nanoseconds(lambda: kinematics.inverse_path(rows_in, joints[0]))  # noqa: B023
            direct = nanoseconds(lambda: kinematics.forward_path(joints, rows_in[0]))  # noqa: B023
            ratio = "" if own is None else f"{direct / own:.2f}"
            bound = f"≤ {BOUNDS[name]:g}" if own is not None and name in BOUNDS else ""
            rows.append([name, f"{inverse:.0f}", f"{direct:.0f}", ratio, bound])
    return table(title, ["module", "inverse, ns a call", "direct, ns a call", "times genhexkins", "bound"], rows)


if __name__ == "__main__":
    print(main())
