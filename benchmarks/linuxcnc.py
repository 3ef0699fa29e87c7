"""LinuxCNC's kinematics modules, a call a servo cycle along a path: parakin's and LinuxCNC's own, without guards.

In a cycle LinuxCNC asks for both, the inverse of the commanded pose and the pose of the joints; so their sum counts.
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
MODULES = Path("/usr/lib/linuxcnc/modules")
# LinuxCNC's own with the sizes that they have, for paths that swing about a pose: joints, pose, swing, in their units
OWN = {
    "genhexkins": (6, (0.0, 0.0, 31.5, 0.0, 0.0, 0.0), (4.0, 4.0, 4.0, 17.0, 17.0, 17.0)),
    "pentakins": (5, (0.0, 0.0, 300.0, 5.0, 5.0), (50.0, 50.0, 50.0, 3.0, 3.0)),
    "lineardeltakins": (9, (0.0, 0.0, 100.0), (50.0, 50.0, 100.0)),
    "rotarydeltakins": (9, (0.0, 0.0, -12.0), (2.0, 2.0, 2.0)),
}
PEERS = {  # a machine's peer, if it has one, and the bound on the sum of both calls in times the peer's
    "tricept": ("genhexkins", 0.25),
    "hexapod": ("genhexkins", 0.25),
    "lambda6": ("genhexkins", 0.25),
    "linear_delta": ("lineardeltakins", None),
}


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


def measure(kinematics: Kinematics, poses: np.ndarray, joints: np.ndarray) -> tuple[float, float]:
    """Inverse and direct, ns a call, along poses (n, 9) whose first joints are near ``joints``."""
    found, codes = kinematics.inverse_path(poses, joints)
    assert not codes.any()
    kinematics.forward(found[:2], poses[:2])  # the first start of some is not the one that is given
    again, codes = kinematics.forward_path(found, poses[0])
    assert not codes.any() and np.abs(again - poses).max() < 1e-6
    return (
        nanoseconds(lambda: kinematics.inverse_path(poses, found[0])),
        nanoseconds(lambda: kinematics.forward_path(found, poses[0])),
    )


def measure_own(stub: Stub, name: str) -> tuple[float, float]:
    """Measure a module of LinuxCNC's."""
    width, middle, swing = OWN[name]
    poses = np.zeros((COUNT, 9))
    poses[:, : len(middle)] = middle + np.array(swing) * np.sin(
        1e-3 * np.arange(COUNT)[:, None] + np.arange(len(middle))
    )
    return measure(Kinematics(stub.library, MODULES / f"{name}.so", width), poses, np.zeros(width))


def main() -> str:
    title = f"LinuxCNC's kinematics, {COUNT:,} cycles of a path, one core"
    if not shutil.which("gcc"):
        return f"{title}: there is no gcc to build it with\n"
    rows, sums = [], dict[str, float]()
    with tempfile.TemporaryDirectory() as folder:
        stub = Stub(folder)
        for name in OWN:
            if (MODULES / f"{name}.so").exists():
                inverse, direct = measure_own(stub, name)
                sums[name] = inverse + direct
                rows.append([name, f"{inverse:.0f}", f"{direct:.0f}", f"{sums[name]:.0f}", "", ""])
        for name, (peer, bound) in PEERS.items():
            machine = pk.load(name)
            joints = outward(machine, machine.follow(path(machine)))
            inverse, direct = measure(stub.built(machine), world(machine, path(machine)), joints[0])
            ratio = f"{(inverse + direct) / sums[peer]:.2f} {peer}" if peer in sums else ""
            limit = f"≤ {bound:g}" if bound and ratio else ""
            rows.append([name, f"{inverse:.0f}", f"{direct:.0f}", f"{inverse + direct:.0f}", ratio, limit])
    columns = ["module", "inverse, ns a call", "direct, ns a call", "both", "times", "bound"]
    return table(title, columns, rows)


if __name__ == "__main__":
    print(main())
