"""Beckhoff TwinCAT: a table of positions and speeds at even times, as a FIFO group of the NC takes it from a file.

From Beckhoff's Information System: the FIFO holds a set position of each axis for every *FIFO cycle time* and moves
evenly between them; the axes have to stand at the first line when it starts (TS5060, *FIFO Parameters and the FIFO*,
*Sequence and the Generation of Set Values*). That time is 1 ms here, so the NC's own cycle should be no longer.
``FB_CSVMemBufferReader`` wants semicolons between fields and CRLF after lines (Tc2_Utilities). A table has no words:
what has to be switched before or after it stands in its head, for the PLC.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from ..arrays import Array, Writer
from ..errors import PoseError
from ..toolpath.posting.setup_texts import describe_setup
from ..toolpath.timing.trajectory import Trajectory
from .controller import Controller, ControllerRun, refuse_run
from .event_commands import Command, list_commands
from .gcode_text import DIGITS, make_plain, to_display

CYCLE = 1e-3  # s, between two lines; at twice that rapid corners would be cut by more than the tolerance
_CHUNK = 1 << 14  # lines written at a time


def _build_run(trajectory: Trajectory) -> ControllerRun:
    """Build how TwinCAT runs a trajectory; there is no table for what would have to be switched on the way."""
    try:
        commands = _list_commands(trajectory)
    except PoseError as error:
        return refuse_run(error)
    return ControllerRun(lambda forced, tolerance: _make_writer(trajectory, commands, forced))


def _list_commands(trajectory: Trajectory) -> dict[int, list[Command]]:
    """List what the path says besides motion, by the number of records before it; 0 and all at the table's ends."""
    path, parted, corner = trajectory.posted.path, trajectory.curve.parted, trajectory.curve.corner_of_record
    reached = [int(corner[event.record - 1]) if event.record else -1 for event in path.events]
    ends = {-1: 0, 0: 0, int(corner[-1]): len(path)}
    commands = list_commands(path, [ends.get(at, e.record) for at, e in zip(reached, path.events, strict=True)])
    for place in sorted(set(commands) & set(range(1, len(path)))):
        for command in commands[place]:
            where = f"{path.source}:{command.line}"
            if command.kind in ("code", "own"):
                raise PoseError(f"{where}: a table of positions has no place for {command.text} on the way")
            if command.kind == "dwell" and not parted[corner[place - 1]]:
                raise PoseError(f"{where}: the trajectory does not stand still where the program waits")
    return commands


def _make_writer(trajectory: Trajectory, commands: dict[int, list[Command]], forced: str | None) -> Writer:
    def write(file: BinaryIO) -> None:
        for text in _format_table(trajectory, commands, forced):
            file.write(text.encode("ascii"))

    return write


def _format_table(trajectory: Trajectory, commands: dict[int, list[Command]], forced: str | None) -> Iterator[str]:
    machine = trajectory.posted.machine
    head = [make_plain(line) for line in _describe(trajectory, commands, forced)]
    yield f"# {len(head) + 2} lines of head, the last of them with the columns' names\r\n"
    yield "".join(f"# {line}\r\n" for line in head)
    units = ["deg" if unit == "rad" else "mm" for unit in machine.joint_units]
    named = list(zip(machine.joints, units, strict=True))
    names = [f"{joint} [{unit}]" for joint, unit in named] + [f"{joint} [{unit}/s]" for joint, unit in named]
    yield ";".join(["time [s]", *names]) + "\r\n"
    digits = [DIGITS[unit] for unit in machine.joint_units] * 2
    pattern = ";".join(["%.6f", *(f"%.{digit}f" for digit in digits)]) + "\r\n"
    first = 0
    for times in _list_times(trajectory, commands):
        setpoints = trajectory.at(times)
        columns = [to_display(rows, machine.joint_units) for rows in (setpoints.joints, setpoints.speeds)]
        table = np.column_stack([CYCLE * np.arange(first, first + len(times)), *columns])
        first += len(times)
        yield pattern * len(table) % tuple(table.ravel().tolist())


def _list_times(trajectory: Trajectory, commands: dict[int, list[Command]]) -> Iterator[Array]:
    """List the trajectory's times of all lines in chunks; it stands still at a dwell, which repeats its time."""
    last = len(trajectory.posted.path)
    waits = {place: _sum_waits(there) for place, there in commands.items() if 0 < place < last}
    stops = {float(trajectory.times[place - 1]): wait for place, wait in sorted(waits.items()) if wait}
    yield np.zeros(1)
    for begin, end in pairwise(sorted({0.0, trajectory.seconds, *stops})):
        count = int(np.ceil((end - begin) / CYCLE - 1e-9))
        for start in range(0, count, _CHUNK):
            lines = np.arange(start + 1, min(start + _CHUNK, count) + 1)
            yield np.minimum(begin + CYCLE * lines, end)
        yield np.full(int(np.ceil(stops.get(end, 0.0) / CYCLE)), end)


def _sum_waits(commands: list[Command]) -> float:
    return sum(float(command.text) for command in commands if command.kind == "dwell")


def _describe(trajectory: Trajectory, commands: dict[int, list[Command]], forced: str | None) -> Iterator[str]:
    """Describe a table for its head."""
    posted = trajectory.posted
    yield f"{posted.path.source} on {posted.machine.name}, mode {posted.mode}; joints, made by parakin"
    yield f"a line each {CYCLE:g} s; {trajectory.seconds:.3f} s and dwells; the axes have to stand at the first line"
    yield from describe_setup(posted)
    yield from (f"OFF LIMITS: written with --force: {line}" for line in (forced or "").splitlines())
    for place, there in sorted(commands.items()):
        when = "before" if place == 0 else "after" if place == len(posted.path) else "on the way"
        for command in there:
            words = {"dwell": f"wait {command.text} s"}.get(command.kind, command.text)
            yield f"{when}: {words}"


CONTROLLER = Controller(title="TwinCAT", interpolation="pose", build_run=_build_run, suffix=".csv")
