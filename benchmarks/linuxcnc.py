"""Against LinuxCNC's own kinematics: a call of the C a servo cycle, along a path, and the library's batches.

In a cycle LinuxCNC asks for both, the inverse of the commanded pose and the pose of the joints; so their sum counts.
The modules are as a configuration has them: outside of the box for moves by hand, where that is proved, each pose is
held against all limits and singularities; theirs hold it against none. genhexkins solves the direct problem twice a
call, once more for its picture's pins.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from kinematics import poses_around_home
from measure import best, table

import parakin as pk
from parakin.controllers.linuxcnc.hand_box import find_hand_box
from parakin.kernels.batch import count_cores

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "linuxcnc"))
from stub import Kinematics, Stub, outward, world

COUNT = 4_000  # cycles: some ms, so that the quickest run of many is not interrupted
RUNS = 40
MODULES = Path("/usr/lib/linuxcnc/modules")
# LinuxCNC's own with the sizes that they have, for paths that swing about a pose: joints, pose, swing, in their units
OWN = {
    "genhexkins": (6, (0.0, 0.0, 31.5, 0.0, 0.0, 0.0), (4.0, 4.0, 4.0, 17.0, 17.0, 17.0)),
    "pentakins": (5, (0.0, 0.0, 300.0, 5.0, 5.0), (50.0, 50.0, 50.0, 3.0, 3.0)),
    "lineardeltakins": (9, (0.0, 0.0, 100.0), (50.0, 50.0, 100.0)),
    "rotarydeltakins": (9, (0.0, 0.0, -12.0), (2.0, 2.0, 2.0)),
}
PEERS = {  # a machine's peer, and the bound on the sum of both calls in times the peer's
    "tricept": ("genhexkins", 0.25),
    "hexapod": ("genhexkins", 0.25),
    "lambda6": ("genhexkins", 0.25),
    "pentapod": ("pentakins", 1.0),
    "rotary_delta": ("rotarydeltakins", 1.0),
    "linear_delta": ("lineardeltakins", 1.0),
}
BATCHES = {"hexapod": (20, 40), "pentapod": (15, 20), "linear_delta": (3, 3)}  # at least, times as fast as the peer


def path(machine: pk.Machine) -> np.ndarray:
    """Poses a millisecond apart at some 100 mm/s and 17°/s."""
    spread = np.where(np.array(machine.axis_units) == "mm", 100.0, 0.3)
    t = 1e-3 * np.arange(COUNT)[:, None]
    poses = machine.home + spread * np.sin(t + np.arange(len(spread)))
    if machine.axes == ("X", "Y", "Z", "B", "C"):
        poses[:, 3] = np.abs(poses[:, 3]) + 0.05
    return poses


def path_in_box(machine: pk.Machine) -> np.ndarray:
    """Poses a millisecond apart all over the box for moves by hand."""
    box = find_hand_box(machine)
    swing = 0.49 * np.sin(1e-3 * np.arange(COUNT)[:, None] + np.arange(len(box.low)))
    return box.low + (box.high - box.low) * (0.5 + swing)


def nanoseconds(work: Callable[[], object]) -> float:
    return 1e9 * best(work, RUNS, time.thread_time) / COUNT


def measure(kinematics: Kinematics, poses: np.ndarray, joints: np.ndarray) -> tuple[float, float]:
    """Inverse and direct, ns a call, along poses (n, 9) whose first joints are near ``joints``."""
    found, codes = kinematics.inverse_path(poses, joints)
    assert not codes.any()
    kinematics.forward(found[:2], poses[:2])  # the first start of some is not the one that is given
    again, codes = kinematics.forward_path(found, poses[0])
    assert not codes.any() and np.abs(again - poses).max() < 1e-5  # next to upright C is told to 1e-6°
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


def measure_batches(machine: pk.Machine) -> tuple[float, float]:
    """Inverse and direct from 1 mm and 0.5° off, ns a pose: processor time over all cores, which are at it alike."""
    poses = poses_around_home(machine, np.random.default_rng(1))
    joints = machine.inverse(poses)
    off = np.where(np.array(machine.axis_units) == "mm", 1.0 / np.sqrt(3.0), np.deg2rad(0.5))
    near = poses + off * np.random.default_rng(2).choice([-1.0, 1.0], poses.shape)
    works = (lambda: machine.inverse(poses, out=joints)), (lambda: machine.forward(joints, near))
    inverse, direct = (1e9 * best(work, clock=time.process_time) / len(poses) / count_cores() for work in works)
    return inverse, direct


def main() -> str:
    title = f"LinuxCNC's kinematics, {COUNT:,} cycles of a path, one core"
    if not shutil.which("gcc"):
        return f"{title}: there is no gcc to build it with\n"
    rows, times = [], dict[str, tuple[float, float]]()
    with tempfile.TemporaryDirectory() as folder:
        stub = Stub(folder)
        for name in OWN:
            if (MODULES / f"{name}.so").exists():
                inverse, direct = times[name] = measure_own(stub, name)
                rows.append([name, f"{inverse:.0f}", f"{direct:.0f}", f"{inverse + direct:.0f}", "", ""])
        for name, (peer, bound) in PEERS.items():
            machine = pk.load(name)
            module = stub.built(machine, box=find_hand_box(machine))
            for where, poses in (("", path(machine)), (", in its box", path_in_box(machine))):
                joints = outward(machine, machine.follow(poses))
                inverse, direct = measure(module, world(machine, poses), joints[0])
                ratio = f"{(inverse + direct) / sum(times[peer]):.2f} {peer}" if peer in times else ""
                limit = f"≤ {bound:g}" if ratio else ""
                numbers = [f"{inverse:.0f}", f"{direct:.0f}", f"{inverse + direct:.0f}"]
                rows.append([f"{name}{where}", *numbers, ratio, limit])
    columns = ["module", "inverse, ns a call", "direct, ns a call", "both", "times", "bound"]
    calls = table(title, columns, rows)
    rows = []
    for name, bounds in BATCHES.items():
        peer = PEERS[name][0]
        for problem, own, other, bound in zip(
            ("inverse", "direct"), measure_batches(pk.load(name)), times.get(peer, (np.nan,) * 2), bounds, strict=True
        ):
            cells = [f"{own:.1f}", f"{other / own:.1f} {peer}" if peer in times else "", f"≥ {bound}"]
            rows.append([f"{name}, {problem}", *cells])
    title = f"Batches of parakin against a call of LinuxCNC's, {count_cores()} cores"
    return f"{calls}\n{table(title, ['machine', 'ns a pose', 'times as fast as', 'bound'], rows)}"


if __name__ == "__main__":
    print(main())
