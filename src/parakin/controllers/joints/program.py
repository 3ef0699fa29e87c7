"""A trajectory as a program for a control without kinematics: every joint is an axis."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import PurePath
from typing import BinaryIO

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Writer
from ...errors import PoseError
from ...toolpath.path import Note
from ...toolpath.posting.setup_texts import describe_setup
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from ..controller import Controller, ControllerRun, refuse_run
from ..event_commands import Command
from ..gcode_text import CHUNK, ROWS, join_lines, to_display
from .dialect import JointDialect
from .feeds import Feed
from .gcode import GCODE
from .joint_motions import FIRST, JointMotions, build_joint_motions
from .letters import assign_joint_letters, describe_letters
from .look_ahead import find_halts, predict_planned_seconds, stretch_for_buffer

_ROUNDING = 1e-9  # s
_LONGER = 1.2  # times the trajectory's time, from which on a control's is noted


@dataclass(frozen=True, eq=False)
class _Program:
    """A joint program before it is written.

    pattern : of a block
    values : (k,) of the blocks' feed words, and ``approach`` that of the way to the first row
    times : (k,) s, when the trajectory is at each block's end
    """

    trajectory: Trajectory
    dialect: JointDialect
    letters: tuple[str, ...]
    motions: JointMotions
    feed: Feed
    pattern: str
    values: Array
    approach: float
    times: Array

    @property
    def seconds(self) -> float:
        """What the control is told to take from the first record on."""
        return float(self.feed.compute_seconds(self.motions.lengths, self.values).sum())


def describe_joint_control(dialect: JointDialect, suffix: str) -> Controller:
    """Describe a control that runs joint programs in a dialect."""
    return Controller(dialect.title, "joints", lambda trajectory: build_joint_run(trajectory, dialect), suffix)


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
    return _make_writer(_build_program(trajectory, GCODE), forced)


def build_joint_run(trajectory: Trajectory, dialect: JointDialect) -> ControllerRun:
    """Build how a control runs a trajectory as straight motions of the joints.

    There is no program for more joints than axes, and for what the control has no word for.
    """
    try:
        program = _build_program(trajectory, dialect)
    except PoseError as error:
        return refuse_run(error)
    seconds, notes = program.seconds, list[Note]()
    each = program.feed.compute_seconds(program.motions.lengths, program.values)
    if dialect.buffer > 1:
        each = _predict_seconds(program, each)
        seconds = float(each.sum())
    if seconds > _LONGER * trajectory.seconds:
        why = "its planner holds few lines" if dialect.buffer > 1 else "its blocks can't be shorter"
        text = f"{dialect.title} takes {seconds:.1f} s for {trajectory.seconds:.1f} s: {why}; most of it is lost here"
        notes.append(Note(_find_slowest_line(program, each), text))
    return ControllerRun(lambda forced, tolerance: _make_writer(program, forced), seconds, tuple(notes))


def _build_program(trajectory: Trajectory, dialect: JointDialect) -> _Program:
    machine, path = trajectory.posted.machine, trajectory.posted.path
    letters = assign_joint_letters(machine, dialect.axes, dialect.title)
    motions = build_joint_motions(trajectory, dialect.digits, dialect.shortest)
    times = np.cumsum(motions.seconds)
    stretched = stretch_for_buffer(motions.seconds, dialect.buffer, dialect.line_seconds)
    motions = replace(motions, seconds=stretched)
    for commands in motions.commands.values():
        for command in commands:
            dialect.format_command(command, path.source)  # raises for what there is no word for
    feed = dialect.choose_feed(machine)
    values = feed.compute_values(motions.lengths, motions.seconds)
    way = np.array([motions.approach])
    approach = float(feed.compute_values(motions.slow_speed * way, way)[0])
    pattern = dialect.make_pattern(letters, machine)
    return _Program(trajectory, dialect, letters, motions, feed, pattern, values, approach, times)


def _find_slowest_line(program: _Program, seconds: Array) -> int:
    """Find the line of the part on which blocks that take so many seconds (k,) lose most against the trajectory."""
    trajectory = program.trajectory
    lost = seconds - np.diff(program.times, prepend=0.0)
    record = np.searchsorted(trajectory.times, program.times - _ROUNDING).clip(0, len(trajectory.times) - 1)
    lines, number = np.unique(trajectory.posted.path.line[record], return_inverse=True)
    return int(lines[np.bincount(number, lost).argmax()])


def _predict_seconds(program: _Program, seconds: Array) -> Array:
    """Predict what the control takes for blocks that are told to take so many seconds (k,)."""
    machine, motions = program.trajectory.posted.machine, program.motions
    limits = DriveLimits.of(machine).acceleration[None]
    accelerations = to_display(limits, machine.joint_units, {"mm": 9, "rad": 9})[0]
    halt = find_halts(len(motions.seconds), motions.commands)
    return predict_planned_seconds(motions.steps, seconds, halt, accelerations, program.dialect.buffer)


def _make_writer(program: _Program, forced: str | None) -> Writer:
    def write(file: BinaryIO) -> None:
        texts = _format_program(program, forced)
        for text in _number_lines(texts) if program.dialect.numbered else texts:
            file.write(text.encode("ascii"))

    return write


def _number_lines(texts: Iterator[str]) -> Iterator[str]:
    """Put the numbers of lines before them, from 0 on."""
    first = 0
    for text in texts:
        lines = text.splitlines()
        yield join_lines(f"{number} {line}" for number, line in enumerate(lines, first))
        first += len(lines)


def _format_program(program: _Program, forced: str | None) -> Iterator[str]:
    dialect, motions, source = program.dialect, program.motions, program.trajectory.posted.path.source
    name = _name_program(source)

    def format_commands(commands: list[Command]) -> str:
        return join_lines(line for command in commands for line in dialect.format_command(command, source))

    yield join_lines(line.format(name=name) for line in dialect.begin)
    yield join_lines(line for remark in _describe(program, forced) for line in dialect.format_remark(remark))
    yield join_lines(dialect.modes)
    yield format_commands(motions.commands.get(FIRST, []))
    yield join_lines(dialect.start)
    yield program.pattern % (*motions.rows[0].tolist(), program.approach)
    exact = set(np.flatnonzero(motions.halt).tolist()) if dialect.exact else set[int]()
    places = {place for place in motions.commands if place != FIRST}
    count = len(motions.seconds)
    breaks = sorted({0, count} | places | exact | {place + 1 for place in exact})
    for begin, end in pairwise([*breaks, count]):
        yield format_commands(motions.commands.get(begin, []))
        for start in range(begin, end, CHUNK):
            yield (dialect.exact if begin in exact else "") + _format_blocks(program, start, min(start + CHUNK, end))
    yield join_lines(line.format(name=name) for line in dialect.end)


def _name_program(source: str) -> str:
    """Name a program after its file: capitals, digits and underscores, two letters first."""
    name = re.sub(r"\W", "_", PurePath(source).stem, flags=re.ASCII)[:24].upper()
    return name if re.match("[A-Z]{2}", name) else f"P_{name}"


def _format_blocks(program: _Program, begin: int, end: int) -> str:
    table = np.column_stack([program.motions.rows[1:][begin:end], program.values[begin:end]])
    chunks = [table[start : start + ROWS] for start in range(0, len(table), ROWS)]
    return "".join(program.pattern * len(chunk) % tuple(chunk.ravel().tolist()) for chunk in chunks)


def _describe(program: _Program, forced: str | None) -> list[str]:
    """Describe the program for its head, a remark each."""
    posted, dialect = program.trajectory.posted, program.dialect
    return [
        f"{posted.path.source} on {posted.machine.name}, mode {posted.mode}; joints, made by parakin",
        describe_letters(program.letters, posted.machine),
        f"{program.seconds:.3f} s from the first record on; {program.motions.approach:.1f} s to it",
        program.feed.text,
        *dialect.notes,
        *describe_setup(posted),
        *(f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines()),
    ]
