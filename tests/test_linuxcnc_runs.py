"""The real LinuxCNC, headless: every configuration starts, homes and moves, and its joints are the library's."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from geometry import Description

import parakin as pk
from parakin.export.linuxcnc import configuration

HERE = Path(__file__).parent / "linuxcnc"
MODULES = Path("/usr/lib/linuxcnc/modules")
NOBODY = 65534
# LinuxCNC refuses root, wants fixed keys of shared memory and a lock in /tmp for itself, and ends processes by name.
ALONE = ["unshare", "--ipc", "--pid", "--mount", "--net", "--fork", "--mount-proc", "--kill-child"]
ALONE += ["sh", "-c", 'mount -t tmpfs -o mode=1777 none /tmp && exec "$@"', "sh"]
AS_NOBODY = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "env", "-i", "PATH=/usr/bin:/bin"]

DIGIT = 5e-7  # half a unit of the last digit that is sampled

sys.path.insert(0, str(HERE))
from stub import FIELDS, inward, outward, pose, world  # noqa: E402

# A move by hand, and moves that must be refused with a word: off a drive's range, off another limit of the machine's.
# These machines have a program of their own here; the others run the one they come with.
TASKS = {
    "linear_delta": ("G1 X50 Y-30 Z320 F30000", {"G0 Z600": "joint", "G0 X350 Y-330 Z100": "kinematicsInverse"}),
    "hexapod": ("G1 X30 Y20 Z-900 A5 B-5 C8 F9000", {"G0 X350 Z-1200": "joint", "G0 Z-1000 A60": "kinematicsInverse"}),
    "tricept": ("G1 X50 Y60 Z-1630 B15 C20 F9000", {"G0 Z-2090": "joint", "G0 X1500 Z-400": "kinematicsInverse"}),
}


def why_not():
    """Why LinuxCNC can't run here, in a few words; nothing if it can."""
    for tool in ("linuxcnc", "halcompile", "gcc", "unshare", "setpriv"):
        if not shutil.which(tool):
            return f"there is no {tool} (Debian's packages: linuxcnc-uspace, linuxcnc-uspace-dev)"
    if os.geteuid():
        return "only root can install a kinematics module"
    if subprocess.run([*ALONE, "true"], capture_output=True).returncode:
        return "there are no namespaces here, which keep LinuxCNC's runs apart"
    return ""


WHY_NOT = why_not()
pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


@pytest.fixture
def machine(request, tmp_path):
    """A shipped machine under another name, so that no module of the user's is replaced."""
    text = (Path(pk.__file__).parent / "machines" / f"{request.param}.yaml").read_text(encoding="utf-8")
    path = tmp_path / "trial.yaml"
    path.write_text(text.replace(f"name: {request.param}\n", f"name: trial_{request.param}\n"), encoding="utf-8")
    return pk.load(path)


@pytest.fixture
def folder(machine):
    """The configuration as it is written, with a script for its user interface and a sampler."""
    with tempfile.TemporaryDirectory(dir="/var/tmp") as name:  # pytest's own folders are closed to others
        folder, files = Path(name), configuration(machine)
        ini = files[f"{machine.name}.ini"].replace("DISPLAY = axis", "DISPLAY = ./ui.py")
        files[f"{machine.name}.ini"] = ini.replace("[KINS]", "HALFILE = sampler.hal\n\n[KINS]")
        for file, text in (files | {"sampler.hal": sampler(machine)}).items():
            (folder / file).write_text(text, encoding="utf-8")
        shutil.copy(HERE / "ui.py", folder)
        kinematics = f"{machine.name}_kins"
        try:
            subprocess.run(["halcompile", "--install", f"{kinematics}.c"], cwd=folder, check=True, capture_output=True)
            for path in (folder, *folder.iterdir()):
                os.chown(path, NOBODY, NOBODY)
            yield folder
        finally:
            (MODULES / f"{kinematics}.so").unlink(missing_ok=True)


def sampler(machine):
    """HAL that writes down, every cycle, whether the move is coordinated, the axes, and the joints."""
    pins = [f"axis.{axis.lower()}.pos-cmd" for axis in machine.axes]
    pins += [f"joint.{i}.coarse-pos-cmd" for i in range(len(machine.joints))]
    lines = [f"loadrt sampler depth=16000 cfg=b{'f' * len(pins)}", "addf sampler.0 servo-thread"]
    lines += [f"net sample-{i} {pin} => sampler.0.pin.{i}" for i, pin in enumerate(["motion.coord-mode", *pins])]
    return "\n".join([*lines, ""])


def run(machine, folder, task):
    """What the user interface saw, and the samples of coordinated moves: poses and joints, mm and degrees."""
    (folder / "task.json").write_text(json.dumps(task | {"joints": len(machine.joints)}))
    command = [*ALONE, *AS_NOBODY, f"HOME={folder}", "linuxcnc", "-r", str(folder / f"{machine.name}.ini")]
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert (folder / "seen.json").exists(), done.stdout + done.stderr
    seen = json.loads((folder / "seen.json").read_text())
    rows = np.loadtxt(folder / "samples.txt", comments="overrun")
    rows = rows[rows[:, 0] != 0][:, 1:]
    poses = np.zeros((len(rows), 9))
    poses[:, [FIELDS.index(axis) for axis in machine.axes]] = rows[:, : len(machine.axes)]
    return done, seen, poses, rows[:, len(machine.axes) :]


def expected(machine, poses, last):
    """The library's joints, mm and degrees: of both solutions of a wrist, and all turns, those nearest to the last."""
    given, last = pose(machine, poses), inward(machine, last)
    turning = np.array(machine.joint_units) == "rad"
    modes = [machine.mode] if not turning.any() else [machine.mode[:-1] + sign for sign in "+-"]
    found = np.stack([machine.inverse(given, mode) for mode in modes])
    found[..., turning] -= 2.0 * np.pi * np.round((found - last)[..., turning] / (2.0 * np.pi))
    nearest = np.abs(found - last)[..., turning].sum(-1).argmin(0)
    return outward(machine, found[nearest, np.arange(len(given))])


def read_to(machine, poses, joints):
    """How far the joints of sampled poses may be off, mm and degrees: the sampler writes six digits of all of them."""
    at, off = expected(machine, poses, joints), np.full(joints.shape, DIGIT)
    for letter in machine.axes:
        moved = poses.copy()
        moved[:, FIELDS.index(letter)] += DIGIT
        off += np.abs(expected(machine, moved, joints) - at)
    return 1.5 * off


def near_the_pole(machine, joints):
    """Where the first joint of a wrist is free or nearly so, (n,)."""
    first, last = machine.model.first_serial, len(machine.joints) - 1
    if first is None:
        return np.zeros(len(joints), bool)
    return np.abs(joints[:, last - 1 if first == last else last]) < 0.01


def words(block):
    return {word[0]: float(word[1:]) for word in block.split() if word[0] in FIELDS}


def away(machine):
    """A block that moves 20 mm and turns 10 degrees away from home along all axes."""
    home = world(machine, machine.home[None])[0]
    words = [f"{axis}{home[FIELDS.index(axis)] + (20.0 if axis in 'XYZ' else 10.0):.6f}" for axis in machine.axes]
    return " ".join(["G1", *words, "F9000"])


@pytest.mark.parametrize("machine", pk.machines(), indirect=True)
def test_it_starts_homes_and_moves(machine, folder):
    name = machine.name.removeprefix("trial_")
    by_hand, refused = TASKS.get(name, (away(machine), {}))
    if name in TASKS:
        shutil.copy(HERE / f"{name}.ngc", folder / f"{machine.name}.ngc")
    task = {"by hand": by_hand, "program": f"{machine.name}.ngc", "refused": list(refused)}
    done, seen, poses, joints = run(machine, folder, task)
    assert "told" not in seen, seen
    assert done.returncode == 0
    home = world(machine, machine.home[None])[0]
    assert np.abs(np.array(seen["home"]) - home).max() < 1e-6
    for letter, value in words(by_hand).items():
        assert abs(seen["by hand"][FIELDS.index(letter)] - value) < 1e-6
    counts = slice(5 if machine.axes[3:] == ("B", "C") else 9)  # upright, it may have any C
    assert np.abs(np.array(seen["program"]) - home)[counts].max() < 1e-6
    assert np.abs(np.array(seen["at last"]) - seen["program"]).max() < 1e-6  # it stayed where it was
    for block, word in refused.items():
        assert word in seen["refused"][block], seen["refused"]
    assert len(poses) > 300
    moved = np.ptp(pose(machine, poses), axis=0)
    assert (moved >= np.where(np.array(machine.axis_units) == "mm", 20.0, np.radians(10.0)) - 1e-6).all()
    turning = np.array(machine.joint_units) == "rad"
    off, read = np.abs(joints[1:] - expected(machine, poses[1:], joints[:-1])), read_to(machine, poses[1:], joints[:-1])
    free = near_the_pole(machine, joints)
    assert (off < read)[~free[1:]].all()
    assert off[~free[1:]][:, ~turning].max() < 8e-6
    miss, tilt = Description.of(machine.spec).misses(pose(machine, poses), inward(machine, joints))
    assert miss.max() < 1e-5
    assert tilt.max() < 1e-7
    assert np.abs(np.diff(joints, axis=0))[~free[:-1]].max() < 3.0  # nothing swings round
