"""An independent model of LinuxCNC 2.9's motion: from the words of a program to the axes' place in every cycle.

Here its words are read; motion_model.c plans and runs. A spindle is always at its speed, and dwells take no time.
"""

from __future__ import annotations

import configparser
import ctypes
import re
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

SOURCE = Path(__file__).with_suffix(".c")
FIELDS = "XYZABCUVW"
CYCLE = 1e-3  # s
STOP, EXACT, PARABOLIC = range(3)  # how a motion ends

_WORD = re.compile(r"([A-Z])\s*([-+.\d]+)")
_COMMENT = re.compile(r"\([^)]*\)")
_WAITS = {"M0", "M1", "M3", "M4", "M5", "M6", "M7", "M8", "M9", "G4"}  # the queue runs empty first


class Program(NamedTuple):
    """k motions of a program, straight in all axes. mm and degrees.

    ends : (k, 9) where each leads to
    rate : (k,) F, 1/min
    ending : (k,) STOP, EXACT or PARABOLIC
    tolerance : (k,) mm
    fresh : (k,) whether the machine stands still and has nothing to do when it comes
    line : (k,) counted from 1
    """

    ends: np.ndarray
    rate: np.ndarray
    ending: np.ndarray
    tolerance: np.ndarray
    fresh: np.ndarray
    line: np.ndarray


class AxisLimits(NamedTuple):
    """Speeds and accelerations (9,) of the axes, zero and of the tip; mm, degrees, s."""

    speed: np.ndarray
    acceleration: np.ndarray
    tip_speed: float


class Motion(NamedTuple):
    """n cycles: poses (n, 9) at their ends, and the program's motion (n,) that runs."""

    poses: np.ndarray
    motion: np.ndarray


def read_limits(ini):
    """Read the axes' limits for programs from the text of an ini file."""
    file = configparser.ConfigParser(strict=True, interpolation=None)
    file.optionxform = str
    file.read_string(ini)
    rates = np.zeros((2, 9))
    for axis in file["TRAJ"]["COORDINATES"].split():
        section = file[f"AXIS_{axis}"]
        rates[:, FIELDS.index(axis)] = [float(section[f"PROGRAM_MAX_{what}"]) for what in ("VELOCITY", "ACCELERATION")]
    return AxisLimits(*rates, float(file["TRAJ"]["MAX_LINEAR_VELOCITY"]))


def read_program(text, start):
    """Read a program of G53 G1 in inverse time that begins at ``start`` (9,)."""
    place, ending, tolerance, fresh, rows = np.array(start, float), PARABOLIC, 0.0, True, []
    for number, line in enumerate(text.splitlines(), 1):
        found = _WORD.findall(_COMMENT.sub("", line).upper())
        names = {letter + value for letter, value in found if letter in "GM"}
        values = {letter: float(value) for letter, value in found if letter not in "GM"}
        unknown = names - _WAITS - {"G21", "G90", "G17", "G40", "G49", "G93", "G61", "G64", "G53", "G1", "M2"}
        assert not unknown, line
        fresh |= bool(names & _WAITS)
        if "G61" in names:
            ending, tolerance = EXACT, 0.0
        if "G64" in names:
            ending, tolerance = PARABOLIC, values["P"]
            assert values["Q"] == 0.0
        if "G1" in names:
            assert "G53" in names
            for letter in set(values) & set(FIELDS):
                place[FIELDS.index(letter)] = values[letter]
            rows.append((place.copy(), values["F"], ending, tolerance, fresh, number))
            fresh = False
    columns = zip(*rows, strict=True)
    return Program(*(np.array(column) for column in columns))


def find_first_line(text):
    """The line (counted from 1) of a program with which the motion behind its first record begins."""
    return next(i for i, line in enumerate(text.split("\n"), 1) if line.startswith("G64")) + 1


class Model:
    """The planner, built by gcc in a folder."""

    def __init__(self, folder):
        library = Path(folder) / "motion_model.so"
        subprocess.run(
            ["gcc", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-o", library, SOURCE, "-lm"], check=True
        )
        self.function = ctypes.CDLL(str(library)).simulate_motions
        self.function.restype = ctypes.c_long

    def simulate(self, program, limits, start):
        """Simulate a program from ``start`` (9,)."""
        cuts, place, poses, motions = [*np.flatnonzero(program.fresh), len(program.rate)], np.array(start), [], []
        for begin, end in pairwise(cuts):
            rows, running = self._simulate_part(program, slice(begin, end), limits, place)
            poses.append(rows)
            motions.append(running + begin)
            place = program.ends[end - 1]
        return Motion(np.concatenate(poses), np.concatenate(motions))

    def _simulate_part(self, program, part, limits, start):
        """Simulate motions that are all in the queue at once."""
        ends, rates = np.ascontiguousarray(program.ends[part]), np.ascontiguousarray(program.rate[part])
        endings = np.ascontiguousarray(program.ending[part], np.int64)
        tolerances, bounds = np.ascontiguousarray(program.tolerance[part]), np.concatenate(limits, axis=None)
        room = int(4.0 * (60.0 / rates).sum() / CYCLE) + 10_000
        poses, motions = np.empty((room, 9)), np.empty(room, np.int64)
        arrays = [_pointer(array) for array in (ends, rates, endings, tolerances, np.array(start, float), bounds)]
        cycles = self.function(
            ctypes.c_long(len(rates)), *arrays, ctypes.c_long(room), _pointer(poses), _pointer(motions)
        )
        assert cycles >= 0, "it takes four times as long as it says"
        return poses[:cycles].copy(), motions[:cycles].copy()


def _pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)
