"""The planner module without LinuxCNC: built by gcc against a stub of its headers, driven cycle by cycle."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from itertools import islice

import numpy as np
from stub import FIELDS, HERE, PLANNER_HEADERS, Stub, outward, world

from parakin.controllers.linuxcnc.model_header import name_model, write_model
from parakin.controllers.linuxcnc.planner import name_planner, write_planner

CYCLE = 1e-3  # s
ANY_SPEED = 1e9


@dataclass
class Run:
    """Every cycle of a run, from the pose before it to two cycles of rest after it.

    poses : (n, axes) mm and rad
    lines : (n,) of the motion that runs
    left : motions that were not taken
    """

    machine: object
    poses: np.ndarray
    lines: np.ndarray
    left: int

    def measure_shares(self, joints, apart=True):
        """The joints' greatest speed and acceleration over their limits, by differences; ``joints`` (n, joints).

        Accelerations count only between cycles ``apart`` (n,).
        """
        drives = self.machine.drives
        speeds = np.abs(np.diff(joints, axis=0)) / CYCLE / [drive.speed for drive in drives]
        rises = np.abs(np.diff(joints, 2, axis=0)) / CYCLE**2 / [drive.acceleration for drive in drives]
        apart = np.broadcast_to(apart, len(joints))
        return speeds.max(), rises[apart[:-2] & apart[1:-1] & apart[2:]].max(initial=0.0)

    @property
    def seconds(self):
        """From the first cycle that moves to the last."""
        moving = np.flatnonzero((np.abs(np.diff(self.poses, axis=0)) > 1e-12).any(axis=1))
        return CYCLE * (moving[-1] - moving[0] + 1)


class Planner:
    """A machine's planner. Poses are (axes,) in mm and rad, speeds mm/s, or degrees/s where X Y Z stand still."""

    def __init__(self, machine, folder):
        self.machine, stub, name = machine, Stub(folder), name_planner(machine)
        for header in PLANNER_HEADERS:
            (stub.folder / header).write_text('#include "stub_motion.h"\n')
        (stub.folder / name_model(machine)).write_text(write_model(machine))
        (stub.folder / f"{name}.c").write_text(write_planner(machine))
        options = [f'-DPLANNER_FILE="{name}.c"', "-Wl,-Bsymbolic"]
        stub.compile([*options, HERE / "planner_driver.c"], stub.folder / f"{name}.so")
        self.library = ctypes.CDLL(str(stub.folder / f"{name}.so"))
        self.library.get_told.restype = ctypes.c_char_p

    def _row(self, pose):
        return np.ascontiguousarray(world(self.machine, np.asarray(pose, float)[None])[0])

    def start(self, pose, joints=None):
        """Stand at a pose, with its joints."""
        machine = self.machine
        at = machine.inverse(pose) if joints is None else joints
        ends = [np.array([getattr(drive, end) for drive in machine.drives]) for end in ("low", "high")]
        rows = [self._row(pose), *(outward(machine, values[None])[0] for values in (at, *ends))]
        self.library.start(*(_point_to(row) for row in rows))
        self.pose, self.line = np.asarray(pose, float), 0

    def line_to(self, pose, speed, most=ANY_SPEED, waits=False):
        """Add a line; its number, or -1 where it is refused."""
        self.line += 1
        code = self.library.add_line(
            _point_to(self._row(pose)), ctypes.c_double(speed), ctypes.c_double(most), int(waits), self.line
        )
        return self.line if code >= 0 else -1

    def arc_to(self, pose, centre, normal, turns, speed):
        """Add an arc."""
        self.line += 1
        c, n = (np.array(v, float) for v in (centre, normal))
        row = self._row(pose)
        return self.library.add_arc(
            *map(_point_to, (row, c, n)), turns, ctypes.c_double(speed), ctypes.c_double(ANY_SPEED), self.line
        )

    def set_corners(self, stops=False, tolerance=0.0):
        self.library.set_corners(int(stops), ctypes.c_double(tolerance))

    def set_signal(self, index, value):
        self.library.set_signal(index, ctypes.c_double(value))

    @property
    def told(self):
        """The last that it said."""
        return self.library.get_told().decode()

    def run(self, motions, scale=lambda cycle: 1.0, act=lambda cycle: None, most=400_000):
        """Run motions, each a call that adds one, a motion a cycle, until nothing moves."""
        motions, poses, lines, row = iter(motions), [], [], np.zeros(9)
        for cycle in range(most):
            act(cycle)
            waiting = [] if self.library.is_full() else list(islice(motions, 1))
            if waiting and waiting[0]() < 0:
                motions, waiting = iter(()), []
            left = self.library.run_cycle(ctypes.c_double(scale(cycle)), _point_to(row))
            assert left >= 0, "the commanded pose is out of reach"
            poses.append(row.copy())
            lines.append(self.library.get_line())
            if not left and not waiting:
                break
        return self._make_run(np.array(poses), np.array(lines), left)

    def run_program(self, program):
        """Run a program, a motion sent a cycle; the :class:`Run`'s ``left`` is 0 if all have run."""
        count, most = len(program.seconds), int(program.seconds.sum() / CYCLE) * 2 + 2000
        poses, lines = np.zeros((most, 9)), np.zeros(most, np.int32)
        rows, flags = (
            np.ascontiguousarray(program.rows),
            [program.stops.astype(np.int32), program.timed.astype(np.int32)],
        )
        steps = np.diff(rows, axis=0, prepend=self._row(self.pose)[None])
        lengths, turns = (np.linalg.norm(steps[:, part], axis=1) for part in (slice(3), slice(3, 6)))
        speeds = np.where(lengths > 1e-7, lengths, turns) / program.seconds
        given = [rows, speeds, *flags]
        cycles = self.library.run_lines(count, *map(_point_to, given), most, _point_to(poses), _point_to(lines))
        done, cycles = cycles > 0, abs(cycles)
        return self._make_run(poses[:cycles], lines[:cycles], 0 if done and cycles < most else 1)

    def _make_run(self, poses, lines, left):
        columns = [FIELDS.index(axis) for axis in self.machine.axes]
        rows = np.where(np.array(self.machine.axis_units) == "rad", np.radians(poses[:, columns]), poses[:, columns])
        rows = np.concatenate([[self.pose] * 2, rows, [rows[-1]] * 2])
        return Run(self.machine, rows, lines, left)


@dataclass
class Program:
    """The motions of a program: (n, 9) poses in mm and degrees, s, stops and given times (n,) each."""

    rows: np.ndarray
    seconds: np.ndarray
    stops: np.ndarray
    timed: np.ndarray


def read_program(text):
    """Read the motions of a program, with nothing of parakin's own."""
    rows, seconds, stops, timed, stopping, given = [], [], [], [], False, False
    for line in text.splitlines():
        if line in ("G61.1", "G93 G61.1"):
            stopping = True
        elif line == "G61":
            stopping = False
        elif line.startswith("M67 E63 "):
            given = line.endswith("Q1")
        elif line.startswith("G53 G1 "):
            words = {word[0]: float(word[1:]) for word in line.split()[2:]}
            rows.append([words.get(letter, 0.0) for letter in FIELDS])
            seconds.append(60.0 / words["F"])
            stops.append(stopping)
            timed.append(given)
    return Program(np.array(rows), np.array(seconds), np.array(stops), np.array(timed))


def _point_to(array):
    return array.ctypes.data_as(ctypes.c_void_p)
