"""A trajectory as G-code for controllers without kinematics: every joint is an axis."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from ...arguments import check_arguments
from ...arrays import Writer
from ...errors import PoseError
from ...machine import Machine
from ...toolpath.posting.setup_texts import describe_setup
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from ..event_lines import check_events, format_events
from ..gcode_text import CHUNK, format_blocks, format_comments, join_lines, to_display

LINEAR, TURNING = "XYZUVW", "ABC"
_APPROACH_SPEED = 0.25  # fraction of the joints' speeds that is used on the way to the first record
_APPROACH_LEAST = 4.0  # s, for that way
_SHORTEST = 1e-3  # s


def assign_joint_letters(machine: Machine) -> tuple[str, ...]:
    """Assign a letter to each joint: linear ones X Y Z U V W, turning ones A B C, in their order.

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


@check_arguments
def make_joint_program(trajectory: Trajectory, *, forced: str | None = None) -> Writer:
    """Make the writer of a trajectory as a program in joint space, in mm, degrees and inverse time (G93).

    Parameters
    ----------
    trajectory : of a path that is dense enough for joints which move evenly from record to record
    forced : what is off limits, a line each, where the program is written all the same; its header says so

    Records at one place are written once. The joints are those of the posted path, their zeros the machine's: work and
    tool offsets have to be zero. The program begins with a slow motion to the first record.

    Raises :class:`PoseError` where there are more joints than letters.
    """
    letters = assign_joint_letters(trajectory.posted.machine)

    check_events(trajectory.posted.path)

    def write(file: BinaryIO) -> None:
        for text in _format_program(trajectory, letters, forced):
            file.write(text.encode("ascii"))

    return write


def _format_program(trajectory: Trajectory, letters: tuple[str, ...], forced: str | None) -> Iterator[str]:
    posted, path, machine = trajectory.posted, trajectory.posted.path, trajectory.posted.machine
    corner = trajectory.curve.corner_of_record
    kept = np.flatnonzero(np.diff(corner, prepend=-1))
    speeds = DriveLimits.of(machine).speed
    joints = posted.joints[kept]
    least = (np.abs(np.diff(joints, axis=0)) / speeds).max(1, initial=0.0)
    seconds = np.maximum(np.diff(trajectory.times[kept]), np.maximum(least, _SHORTEST))
    from_home = float((np.abs(joints[0] - machine.inverse(machine.home)) / speeds).max())
    approach = max(_APPROACH_LEAST, from_home / _APPROACH_SPEED)
    rows = to_display(joints, machine.joint_units)
    names = zip(letters, machine.joints, machine.joint_units, strict=True)
    head = [
        f"{path.source} on {machine.name}, mode {posted.mode}; joints, made by parakin",
        ", ".join(f"{letter} is {name} in {'deg' if unit == 'rad' else 'mm'}" for letter, name, unit in names),
        f"{seconds.sum():.3f} s from the first record on; {approach:.1f} s to it; F is the inverse of minutes",
        "work and tool offsets have to be zero",
        *describe_setup(posted),
        *(f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines()),
    ]
    yield join_lines(line for remark in head for line in format_comments(remark))
    yield "G21 G90 G17 G40 G49\n"
    events = format_events(path, [int(corner[event.record - 1]) if event.record else -1 for event in path.events])
    yield join_lines(events.pop(-1, []))
    yield "G93\n" + format_blocks("G1 ", letters, machine.joint_units, rows[:1], np.array([approach]))
    breaks = sorted({0, len(seconds), *events})
    for start, end in pairwise([*breaks, len(seconds)]):
        yield join_lines(events.get(start, []))
        for first in range(start, end, CHUNK):
            chunk = slice(first, min(first + CHUNK, end))
            yield format_blocks("G1 ", letters, machine.joint_units, rows[1:][chunk], seconds[chunk])
    yield "M2\n"
