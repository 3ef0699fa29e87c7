"""A trajectory as G-code for controllers that know no kinematics: every joint is an axis."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from ...errors import PoseError
from ...machine import Machine
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from ..events import comments, spoken
from ..gcode_blocks import at_the_rim, blocks

Writer = Callable[[BinaryIO], None]

LINEAR, TURNING = "XYZUVW", "ABC"
_CHUNK = 1 << 16  # motions written at a time
_CALM, _LEAST = 0.25, 4.0  # of the joints' speeds, and s: how the joints are brought to the first record
_SHORTEST = 1e-3  # s


def joint_letters(machine: Machine) -> tuple[str, ...]:
    """The letter of each joint: linear ones X Y Z U V W, turning ones A B C, in their order.

    Raises :class:`PoseError` where there are more joints than letters.
    """
    free = {"mm": iter(LINEAR), "rad": iter(TURNING)}
    letters = [next(free[unit], "") for unit in machine.joint_units]
    if "" in letters:
        linear = machine.joint_units.count("mm")
        raise PoseError(
            f"{machine.name} has {linear} linear and {len(letters) - linear} turning joints; "
            f"G-code has letters for {len(LINEAR)} and {len(TURNING)}"
        )
    return tuple(letters)


def joint_program(trajectory: Trajectory, *, forced: str | None = None) -> Writer:
    """What writes a trajectory as a program in joint space, in mm, degrees and inverse time (G93).

    Parameters
    ----------
    trajectory : of a path that is dense enough for joints which move evenly from record to record
    forced : what is off limits, a line each, where the program is written all the same; its header says so

    Records at one place are written once. The joints are those of the posted path, their zeros the machine's: work and
    tool offsets have to be zero. The program begins with a slow motion to the first record.

    Raises :class:`PoseError` where there are more joints than letters.
    """
    letters = joint_letters(trajectory.posted.machine)

    def write(file: BinaryIO) -> None:
        for text in _program(trajectory, letters, forced):
            file.write(text.encode("ascii"))

    return write


def _program(trajectory: Trajectory, letters: tuple[str, ...], forced: str | None) -> Iterator[str]:
    posted, path, machine = trajectory.posted, trajectory.posted.path, trajectory.posted.machine
    place = trajectory.curve.corner_of_record
    kept = np.flatnonzero(np.diff(place, prepend=-1))
    speeds = DriveLimits.of(machine).speed
    joints = posted.joints[kept]
    moved = (np.abs(np.diff(joints, axis=0)) / speeds).max(1, initial=0.0)
    seconds = np.maximum(np.diff(trajectory.times[kept]), np.maximum(moved, _SHORTEST))
    begin = max(_LEAST, float((np.abs(joints[0] - machine.inverse(machine.home)) / speeds).max()) / _CALM)
    rows = at_the_rim(joints, machine.joint_units)
    names = zip(letters, machine.joints, machine.joint_units, strict=True)
    head = [
        f"{path.source} on {machine.name}, mode {posted.mode}; joints, made by parakin",
        ", ".join(f"{letter} is {name} in {'deg' if unit == 'rad' else 'mm'}" for letter, name, unit in names),
        f"{seconds.sum():.3f} s from the first record on; {begin:.1f} s to it; F is the inverse of minutes",
        "work and tool offsets have to be zero",
        *(f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines()),
    ]
    yield _lines(line for remark in head for line in comments(remark))
    yield "G21 G90 G17 G40 G49\n"
    said = spoken(path, [int(place[event.record - 1]) if event.record else -1 for event in path.events])
    yield _lines(said.pop(-1, []))
    yield "G93\n" + blocks("G1 ", letters, rows[:1], np.array([begin]))
    breaks = sorted({0, len(seconds), *said})
    for start, end in pairwise([*breaks, len(seconds)]):
        yield _lines(said.get(start, []))
        for first in range(start, end, _CHUNK):
            part = slice(first, min(first + _CHUNK, end))
            yield blocks("G1 ", letters, rows[1:][part], seconds[part])
    yield "M2\n"


def _lines(lines: Iterable[str]) -> str:
    return "".join(line + "\n" for line in lines)
