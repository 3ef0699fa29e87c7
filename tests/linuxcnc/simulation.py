"""A machine under the real LinuxCNC: headless, apart from everything else here, every servo cycle written down."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from running import run_linuxcnc

import parakin as pk

HERE = Path(__file__).parent
NOBODY = 65534
CYCLE = 1e-3  # s
# LinuxCNC refuses root, wants fixed keys of shared memory and a lock in /tmp for itself, and ends processes by name.
# Ahead of others, lest on a busy computer a program runs out of motions that are planned. The modules of the folder
# stand beside LinuxCNC's own for this run alone.
ALONE = ["nice", "-n", "-15", "unshare", "--ipc", "--pid", "--mount", "--net", "--fork", "--mount-proc", "--kill-child"]
ALONE += [
    "sh",
    "-c",
    """\
mount -t tmpfs -o mode=1777 none /tmp && cp -r /usr/lib/linuxcnc/modules /tmp &&
find . -maxdepth 1 -name '*.so' -exec cp {} /tmp/modules ';' &&
mount --bind /tmp/modules /usr/lib/linuxcnc/modules && exec "$@"
""",
    "sh",
]
AS_NOBODY = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "env", "-i", "PATH=/usr/bin:/bin"]
FIELDS = "XYZABCUVW"


def why_not():
    """Why LinuxCNC can't run here, in a few words; nothing if it can."""
    for tool in ("linuxcnc", "halcompile", "gcc", "unshare", "setpriv"):
        if not shutil.which(tool):
            return f"there is no {tool} (Debian's packages: linuxcnc-uspace, linuxcnc-uspace-dev)"
    if os.geteuid():
        return "only root can keep LinuxCNC's runs apart"
    if subprocess.run([*ALONE, "true"], capture_output=True).returncode:
        return "there are no namespaces here, which keep LinuxCNC's runs apart"
    return ""


@dataclass
class Run:
    """What came of a run.

    done : the process
    seen : what the user interface saw
    line : (n,) of the program, 0 where none runs
    poses : (n, 9) X Y Z A B C U V W and joints (n, joints), every cycle of coordinated motion, mm and degrees
    """

    done: subprocess.CompletedProcess
    seen: dict
    line: np.ndarray
    poses: np.ndarray
    joints: np.ndarray

    def part(self, first, start):
        """The cycles from those on in which it stands at ``start`` (9,), before a program's line ``first``: a slice."""
        told = int(np.argmax(self.line >= first))  # some cycles late
        moving = np.flatnonzero((np.diff(self.poses, axis=0) != 0.0).any(1))
        return slice(int(np.abs(self.poses[:told] - start).max(1).argmin()), int(moving[-1]) + 2)


def as_programmed(posted, text):
    """A posted path as G-code, as a plain post writes it: its own feeds, and rapids at the axes' speeds.

    Its first record is come to as in the text of its program, which parakin made: on a wrist not every way leads there.
    """
    machine = posted.machine
    rows = np.where(np.array(machine.axis_units) == "rad", np.degrees(posted.poses), posted.poses).tolist()
    lines = [*text.split("\nM67")[0].splitlines(), "G94", "G64 P0.005 Q0"]
    for row, rapid, feed in zip(rows, posted.path.rapid.tolist(), posted.path.feed.tolist(), strict=True):
        words = " ".join(f"{axis}{value:.6f}" for axis, value in zip(machine.axes, row, strict=True))
        lines.append(f"G53 G0 {words}" if rapid else f"G53 G1 {words} F{feed:g}")
    return "\n".join([*lines, "M2", ""])


def first_line(text):
    """The line (1-based) of a program with which the motion behind its first record begins."""
    return next(i for i, line in enumerate(text.split("\n"), 1) if line.startswith(("M67", "G64"))) + 1


class Simulation:
    """A configuration as it is written, with a script for its user interface and a sampler."""

    def __init__(self, machine, folder):
        self.machine, self.folder = machine, Path(folder)

    def run(self, task, programs=None, seconds=200):
        """Do a task (see ui.py), with G-code programs by their names."""
        for name, text in (programs or {}).items():
            path = self.folder / name
            path.write_bytes(text) if isinstance(text, bytes) else path.write_text(text, encoding="utf-8")
            os.chown(path, NOBODY, NOBODY)
        (self.folder / "task.json").write_text(json.dumps(task | {"joints": len(self.machine.joints)}))
        seen, rows, done = self._start(seconds)
        rows = rows[rows[:, 0] != 0][:, 1:]
        axes = len(self.machine.axes)
        poses = np.zeros((len(rows), 9))
        poses[:, [FIELDS.index(axis) for axis in self.machine.axes]] = rows[:, 1 : 1 + axes]
        return Run(done, seen, rows[:, 0].astype(int), poses, rows[:, 1 + axes :])

    def operate(self, steps, programs=None, seconds=300):
        """Do an operator's steps (see operator_ui.py); return what was seen, and every cycle's samples.

        The samples are whether the move is coordinated, the program's line, the axes, the joints.
        """
        for name, text in (programs or {}).items():
            (self.folder / name).write_text(text, encoding="utf-8")
            os.chown(self.folder / name, NOBODY, NOBODY)
        task = {"joints": len(self.machine.joints), "steps": steps}
        (self.folder / "task.json").write_text(json.dumps(task))
        shutil.copy(HERE / "operator_ui.py", self.folder / "ui.py")
        seen, rows, done = self._start(seconds)
        assert done.returncode == 0, done.stdout + done.stderr
        return seen["steps"], rows

    def show(self, steps, programs=None, seconds=300, screen="axis"):
        """Do an operator's steps on a screen (see screen_ui.py), pictures too; it opens the last of the programs."""
        opened = f"{self.machine.name}.ngc"
        for opened, text in (programs or {}).items():
            (self.folder / opened).write_text(text, encoding="utf-8")
        task = {"machine": self.machine.name, "joints": len(self.machine.joints), "steps": steps}
        task |= {"ini": "screen.ini", "screen": screen}
        (self.folder / "task.json").write_text(json.dumps(task))
        files, settings = make_configuration(self.machine, None, screen), f"{self.machine.name}_{screen}.py"
        (self.folder / settings).write_text(files[settings], encoding="utf-8")
        ini = files[f"{self.machine.name}.ini"]
        ini = ini.replace(f"OPEN_FILE = ./{self.machine.name}.ngc", f"OPEN_FILE = ./{opened}")
        (self.folder / "screen.ini").write_text(ini, encoding="utf-8")
        for file in ("operator_ui.py", "screen_ui.py", "hang_dump.py"):
            shutil.copy(HERE / file, self.folder)
        for path in self.folder.iterdir():
            os.chown(path, NOBODY, NOBODY)
        command = [*ALONE, *AS_NOBODY, f"HOME={self.folder}", "python3", "screen_ui.py"]
        done = run_linuxcnc(command, self.folder, seconds)
        log = (self.folder / "linuxcnc.log").read_text(errors="replace")
        assert done.returncode == 0, done.stdout + done.stderr + log
        return json.loads((self.folder / "seen.json").read_text())

    def _start(self, seconds):
        (self.folder / "seen.json").unlink(missing_ok=True)
        command = [*ALONE, *AS_NOBODY, f"HOME={self.folder}", "linuxcnc", "-r"]
        command.append(str(self.folder / f"{self.machine.name}.ini"))
        done = run_linuxcnc(command, self.folder, seconds)
        assert (self.folder / "seen.json").exists(), done.stdout + done.stderr
        seen = json.loads((self.folder / "seen.json").read_text())
        if "hung" in seen:
            dump = Path(tempfile.gettempdir()) / f"{self.machine.name}_hung.json"
            dump.write_text(json.dumps(seen | {"output": done.stdout + done.stderr}, indent=1))
            raise AssertionError(f"{say_why(done.stdout)}, see {dump}: {seen['hung']}")
        assert "overrun" not in (self.folder / "samples.txt").read_text(), "cycles are missing"
        return seen, np.loadtxt(self.folder / "samples.txt"), done


def say_why(output):
    """Say what LinuxCNC's own output tells of why a run hung."""
    if "USRMOT: ERROR: command timeout" in output:
        return "hung, for LinuxCNC dropped a command that its servo thread had not taken within [EMCMOT] COMM_TIMEOUT"
    return "hung"


@cache
def make_configuration(machine, hardware=None, screen="axis"):
    """The files of a machine's configuration, made once: {file: text}."""
    return pk.make_linuxcnc_configuration(machine, hardware, screen)


@cache
def compile_modules(sources):
    """Compile the C among files ((file, text), ...) by halcompile, once: ((file, bytes), ...)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources:
            (folder / file).write_text(text, encoding="utf-8")
        modules = [Path(file) for file, _ in sources if file.endswith(".c")]
        for module in modules:
            command = ["halcompile", "--compile", str(module)]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        return tuple((f"{module.stem}.so", (folder / f"{module.stem}.so").read_bytes()) for module in modules)


@contextmanager
def simulated(machine, reserve=None, stock=False):
    """A :class:`Simulation`, with kinematics and planner.

    reserve : by which the drives' limits are above the description's; None: drives without limits
    stock : with LinuxCNC's own planner, which knows the axes' limits only
    """
    with tempfile.TemporaryDirectory(dir="/var/tmp") as name:  # pytest's own folders are closed to others
        folder, files = Path(name), dict(make_configuration(machine))
        if reserve is not None:
            files[f"{machine.name}.hal"] = limit_drives(machine, files[f"{machine.name}.hal"], 1.0 + reserve)
        if stock:
            use_stock_planner(machine, files)
        ini = files[f"{machine.name}.ini"].replace("DISPLAY = axis", "DISPLAY = ./ui.py")
        files[f"{machine.name}.ini"] = ini.replace("[KINS]", "HALFILE = sampler.hal\n\n[KINS]")
        write_folder(folder, files | {"sampler.hal": sampler(machine)}, HERE / "ui.py")
        yield Simulation(machine, folder)


def write_folder(folder, files, ui):
    """Write files that LinuxCNC reads as nobody, its user interface, and the modules that halcompile makes of the C."""
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    for file, code in compile_modules(tuple((file, files[file]) for file in files if file.endswith((".c", ".h")))):
        (folder / file).write_bytes(code)
    shutil.copy(ui, folder / "ui.py")
    shutil.copy(HERE / "hang_dump.py", folder)
    for path in (folder, *folder.iterdir()):
        os.chown(path, NOBODY, NOBODY)


# What LinuxCNC's own planner gets of the drives' least rates, or it would crawl: it begins and ends every motion that
# turns the tool with half of its acceleration, as if it stood still there.
STOCK = {"VELOCITY": {"mm": 1.0, "rad": 4.0}, "ACCELERATION": {"mm": 6.0, "rad": 12.0}}


def use_stock_planner(machine, files):
    """Take the planner out of a configuration, and give the axes rates that LinuxCNC's own one can work with."""
    hal, ini = f"{machine.name}.hal", re.sub(r"\nTPMOD = .*", "", files[f"{machine.name}.ini"])
    files[hal] = re.sub(r"\nnet \S+(?=\n)", "", re.sub(r" => planner\.\S+", "", files[hal]))
    for axis, unit in zip(machine.axes, machine.axis_units, strict=True):
        head, section = ini.split(f"[AXIS_{axis}]")
        for rate, factors in STOCK.items():
            drives = [getattr(d, rate.lower().replace("velocity", "speed")) for d in machine.drives if d.unit == unit]
            if not drives:
                continue  # where struts turn the tool the axes have no drives of their own
            value = factors[unit] * min(drives) * (180.0 / np.pi if unit == "rad" else 1.0)
            section = re.sub(rf"PROGRAM_MAX_{rate} = .*", f"PROGRAM_MAX_{rate} = {value:.6f}", section, count=1)
        ini = f"{head}[AXIS_{axis}]{section}"
    files[f"{machine.name}.ini"] = ini


def limit_drives(machine, hal, factor):
    """HAL in which every joint's loop is a drive that follows within so much of its speed and acceleration."""
    lines = [line for line in hal.split("\n") if not line.startswith("net joint-")]
    lines.append(f"loadrt limit3 count={len(machine.joints)}")
    for i, drive in enumerate(machine.drives):
        scale = 180.0 / np.pi if drive.unit == "rad" else 1.0
        lines += [f"addf limit3.{i} servo-thread", f"setp limit3.{i}.maxv {factor * drive.speed * scale:.9f}"]
        lines += [f"setp limit3.{i}.maxa {factor * drive.acceleration * scale:.9f}"]
        lines += [f"net command-{i} joint.{i}.motor-pos-cmd => limit3.{i}.in"]
        lines += [f"net joint-{i} limit3.{i}.out => joint.{i}.motor-pos-fb"]
    return "\n".join([*lines, ""])


def sampler(machine):
    """HAL that writes down, every cycle, whether the move is coordinated, the program's line, the axes, the joints."""
    signals = {"motion.coord-mode": "coordinated", "motion.program-line": "program-line"}  # the first has one already
    signals |= {f"axis.{letter}.pos-cmd": f"{letter}-position" for letter in "".join(machine.axes).lower()}
    signals |= {f"joint.{i}.coarse-pos-cmd": f"coarse-{i}" for i in range(len(machine.joints))}
    lines = [f"loadrt sampler depth=16000 cfg=bs{'f' * (len(signals) - 2)}", "addf sampler.0 servo-thread"]
    lines += [f"net {name} {pin} => sampler.0.pin.{i}" for i, (pin, name) in enumerate(signals.items())]
    return "\n".join([*lines, ""])
