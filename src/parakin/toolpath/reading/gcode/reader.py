"""Read G-code programs: RS274/NGC as LinuxCNC 2.9 reads it, for a mill.

Runs of plain lines go through a fast reader (:mod:`.plain_lines`); every other line goes through the block reader
(:mod:`.block`, :mod:`.execution`), which gives the same records. From the first O word on, the rest of the file is
kept and executed as its conditions, loops and subroutines say (:mod:`.control_flow`). What is not read is refused with
its line. The codes are in the tables of :mod:`.codes`.
"""

import io
import math
import os
from collections.abc import Mapping

import numpy as np

from ....arrays import Array, Progress
from ....errors import InputError
from ...path import Event, ToolPath
from ...programmed_path import compute_tool_axes
from ..text import (
    BYTE_ORDER_MARK,
    READ_SIZE,
    check_arc_tolerance,
    check_numbers,
    check_tool_lengths,
    decode_line,
    open_file,
)
from .block import LONGEST, VALUES, check_text, parse_block
from .control_flow import ControlFlow, ControlLine, find_control
from .controls import name_control, recognise_block
from .execution import BlockExecutor
from .motion import AXES, GcodeMotion
from .plain_lines import read_plain_lines
from .records import FEED, LINE, RAPID, SECONDS, SPINDLE, WIDTH
from .tool_uses import find_other_lengths, list_tool_uses
from .work_systems import apply_frames

_MOST_BLOCKS = 150_000  # executed again in loops and calls, some 4 s of work; a long line counts as several
_PLAIN_AS_ONE = 6  # plain lines that are read together are so much quicker
_COUNTED_AS_ONE = 32  # characters
_HEADER_LINES = 200  # lines in which a file may name its control
_ROTARY_NOTE = (
    "A, B or C without tool centre point control (G43.4): X, Y and Z are read as the tool's tip, "
    "A, B and C as its orientation there"
)


def read_gcode(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    workpiece: Array | None = None,
    start: Mapping[str, float] | None = None,
    tools: Mapping[int, float] | None = None,
    reference: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> ToolPath:
    """Read a G-code program.

    X, Y, Z are the controlled point in the first work system in force and A, B, C its turns, R = Rz(C)·Ry(B)·Rx(A).
    A tool length offset of a known length shifts the controlled point from the tool's holder, as in LinuxCNC; where the
    length is not known every point is read as the tool's tip. The records begin where X, Y and Z are all known; a
    letter the file never gives is 0.

    Parameters
    ----------
    path : the file
    arc_tolerance : mm, the largest distance of the straight lines that replace an arc from it
    workpiece : (3, 4) rotation and origin (mm) of the work in the machine's coordinates, as the path will be placed on
        the machine; G53 needs it and is refused without
    start : where the program takes the tool to be at its beginning: X to C in the work system, mm and degrees
    tools : lengths of tools by number, mm, for G43
    reference : X to C of the machine's reference point (G28) in the machine, mm and degrees
    progress : called now and then with the fraction read, 0 to 1

    Returns
    -------
    The tool path in the work system of the file. Lengths in the texts of its events are mm.

    Raises
    ------
    InputError : the file cannot be read, or a line holds what is not read here; one line with file and line number
    """
    check_arc_tolerance(arc_tolerance)
    if workpiece is not None and (np.shape(workpiece) != (3, 4) or not np.isfinite(workpiece).all()):
        raise InputError("expected a transform of shape (3, 4)", "workpiece")
    for name, axes in (("start", start), ("reference", reference)):
        check_numbers(axes, AXES, name, "numbers for some of X, Y, Z, A, B and C")
    check_tool_lengths(tools)
    source = os.fsdecode(path)
    with open_file(path, source) as file, np.errstate(all="ignore"):
        size = os.fstat(file.fileno()).st_size
        reader = GcodeReader(source, size, arc_tolerance, workpiece, tools, reference)
        reader.set_start(start or {})
        return reader.read(file, progress or (lambda fraction: None))


class GcodeReader:
    """Split a file into lines, execute their blocks, and build the tool path.

    line : lines completed
    started : whether there was a line with something on it
    percent : whether the program began with %
    ended : whether the program has ended, by a code or a second %
    skipped : lines after the end: the first one's number and their count
    kept : the lines from the first O word on, which are executed when all are read; None before it
    control : the other control that the file's beginning names
    """

    def __init__(
        self,
        source: str,
        size: int,
        arc_tolerance: float,
        workpiece: Array | None = None,
        tools: Mapping[int, float] | None = None,
        reference: Mapping[str, float] | None = None,
    ):
        self.source = source
        self.tools = tools
        self.size = size
        self.motion = GcodeMotion(arc_tolerance, workpiece)
        self.executor = BlockExecutor(self.motion, tools, reference)
        self.kept: list[bytes] | None = None
        self.kept_from = 0  # the number of the first kept line
        self.control: str | None = None
        self.start: list[float] | None = None
        self.line = 0
        self.started = False
        self.percent = False
        self.ended = False
        self.skipped = [0, 0]

    def set_start(self, start: Mapping[str, float]) -> None:
        """Let the tool be at a place (X to C, mm and degrees) before the program."""
        for k, letter in enumerate(AXES):
            if letter in start:
                self.motion.here[k] = float(start[letter])
                if k >= len("XYZ"):
                    self.motion.turned[k - 3] = True
        if not any(math.isnan(value) for value in self.motion.here):
            self.start = list(self.motion.here)

    def _fail(self, message: str, line: int | None) -> InputError:
        return InputError(message, self.source, line)

    def read(self, file: io.FileIO, progress: Progress) -> ToolPath:
        """Read the whole file."""
        done, rest = 0, b""
        while data := self._read_bytes(file):
            if not done:
                data = data.removeprefix(BYTE_ORDER_MARK)
            done += len(data)
            *lines, rest = (rest + data).split(b"\n")
            self._read_lines(lines)
            if len(rest) > 4 * LONGEST:  # bytes, of which a character has at most four
                if not self.ended or self.kept is not None:
                    raise self._fail(
                        f"a line of more than {LONGEST} characters; expected a block of G-code", self.line + 1
                    )
                rest = rest[:LONGEST]
            progress(min(1.0, done / max(self.size, 1)))
        self._read_lines([rest])
        if self.kept is not None:
            self._execute_kept(self.kept)
        path = self._build_path()
        progress(1.0)
        return path

    def _read_bytes(self, file: io.FileIO) -> bytes:
        try:
            return file.read(READ_SIZE) or b""
        except OSError as error:
            raise self._fail(f"cannot be read: {error.strerror}", None) from error

    def _read_lines(self, lines: list[bytes]) -> None:
        """Read whole lines, the next ones of the file."""
        first, at = self.line + 1, 0
        while at < len(lines):
            if self.kept is not None:
                self.kept += lines[at:]
                break
            if self.ended:
                self._skip_line(lines[at], first + at)
                at += 1
                continue
            if self.started:
                at = read_plain_lines(lines, at, first, self.motion)
                if at == len(lines):
                    break
            if self._read_line(lines[at], first + at):
                at += 1
            else:
                self.kept, self.kept_from = [], first + at
        self.line += len(lines)
        self.motion.records.compact()

    def _read_line(self, raw: bytes, line: int) -> bool:
        """Read one line; return False for one with an O word, which is not executed here."""
        bare = decode_line(raw).rstrip("\r").strip(" \t")
        if bare == "%":
            self.ended, self.started, self.percent = self.percent or self.started, True, True
            return True
        if not bare:
            return True
        self.executor.parameters.line = line
        if self.control is None and line <= _HEADER_LINES:
            self.control = recognise_block(bare)
        try:
            if self._find_control(bare) is not None:
                return False
            self.started = True
            self.executor.execute(parse_block(bare, VALUES, self.executor.parameters), line)
        except InputError as error:
            raise self._fail(name_control(error.message, self.control, bare), line) from error
        self.ended = self.executor.finished
        return True

    def _find_control(self, bare: str) -> ControlLine | None:
        """Find an O word in a line without blanks around it."""
        if bare[0] not in "oOnN/":
            return None
        check_text(bare)
        return find_control(bare, self.executor.parameters)

    def _execute_kept(self, lines: list[bytes]) -> None:
        """Execute the lines from the first O word on, in the order that conditions, loops and calls give."""
        flow, first = ControlFlow(self.executor.parameters), self.kept_from
        work = -sum(1 + len(line) // _COUNTED_AS_ONE for line in lines)
        index, last = 0, 0
        while index < len(lines) and not self.ended:
            before = index
            if flow.skipping is None and self.started:
                index = read_plain_lines(lines, index, first, self.motion)
            work += (index - before) // _PLAIN_AS_ONE
            if index < len(lines):
                work += 1 + len(lines[index]) // _COUNTED_AS_ONE
                index = self._execute_kept_line(lines, index, flow)
            last = max(last, index)
            if work > _MOST_BLOCKS:
                raise self._fail(
                    f"more than {_MOST_BLOCKS} blocks executed again in loops and calls; expected a program that ends",
                    first + min(before, len(lines) - 1),
                )
            self.motion.records.compact()
        open_at = None if self.ended else flow.find_open_end()
        if open_at is not None:
            raise self._fail("an O word without its end in this file; expected it", first + open_at)
        for k in range(last if self.ended else len(lines), len(lines)):
            self._skip_line(lines[k], first + k)

    def _execute_kept_line(self, lines: list[bytes], index: int, flow: ControlFlow) -> int:
        """Execute one kept line; return the index of the line to go on with."""
        line = self.kept_from + index
        if flow.skipping is None and self._read_line(lines[index], line):
            return index + 1
        bare = decode_line(lines[index]).rstrip("\r").strip(" \t")
        try:
            control = self._find_control(bare) if bare else None
            if control is None:
                return index + 1
            self.executor.parameters.line = line
            return flow.execute(bare, control, index)
        except InputError as error:
            raise self._fail(name_control(error.message, self.control, bare), line) from error

    def _skip_line(self, raw: bytes, line: int) -> None:
        """Count a line after the program's end."""
        if raw.strip(b" \t\r%\x1a\0"):
            self.skipped = [self.skipped[0] or line, self.skipped[1] + 1]

    def _build_path(self) -> ToolPath:
        motion, executor = self.motion, self.executor
        if not motion.records.count:
            raise self._fail("no motion; expected at least one block such as G0 X0 Y0 Z0", None)
        columns = motion.records.take_columns()
        if motion.was_shifted:
            apply_frames(columns, motion.frames)
        begun = 0
        if self.start is not None:
            begun, columns = 1, np.concatenate([self._write_start(columns)[:, None], columns], axis=1)
        dropped = self._complete_coordinates(columns)
        columns = columns[:, dropped:]
        if self.tools is not None and not executor.tools.uses and not executor.offsets.lengths:
            motion.notes.add(0, "the program names no tool: the tool table is not used")
        if motion.untipped_line:
            motion.notes.add(motion.untipped_line, _ROTARY_NOTE)
        if not executor.units_given:
            motion.notes.add(0, "no G20 or G21: lengths are read as mm")
        if self.skipped[1]:
            motion.notes.add(self.skipped[0], "a line after the program's end, not read", self.skipped[1])
        elif not self.ended:
            motion.notes.add(0, "the program ends without M2, M30 or a second %")
        try:
            uses = list_tool_uses(executor.tools, executor.offsets.lengths, self.tools)
        except InputError as error:
            raise self._fail(error.message, error.line) from None
        uses = tuple(use._replace(record=max(0, use.record + begun - dropped)) for use in uses)
        cuts, read_offset = columns[RAPID] == 0.0, executor.offsets.read_tool_offset
        for line, text in find_other_lengths(uses, cuts, lambda number: read_offset(number)[2]):
            motion.notes.add(line, text)
        turns = np.radians(np.ascontiguousarray(columns[3:6].T))
        seconds = columns[SECONDS].copy()
        return ToolPath(
            source=self.source,
            tip=columns[:3].T.copy(),
            axis=compute_tool_axes(turns),
            line=columns[LINE].astype(np.int64),
            rapid=columns[RAPID] != 0.0,
            feed=columns[FEED].copy(),
            spindle=columns[SPINDLE].copy(),
            dialect="gcode",
            units=executor.units,
            tool=self._describe_tool(),
            tools=uses,
            events=tuple(Event(max(0, e.record + begun - dropped), e.line, e.text) for e in executor.events),
            notes=motion.notes.list_notes(),
            turns=turns if any(motion.turned) else None,
            seconds=None if np.isnan(seconds).all() else seconds,
        )

    def _describe_tool(self) -> dict[str, float | str]:
        """Return the number of the first tool, and its length where the table has it."""
        data = self.executor.tools.data
        number = data.get("number")
        if self.tools is not None and isinstance(number, float) and number in self.tools:
            data["length"] = float(self.tools[int(number)])
        return data

    def _write_start(self, columns: Array) -> Array:
        """Write the record of the start, (WIDTH,), with the line of the first motion."""
        row = np.full(WIDTH, np.nan)
        row[:6], row[RAPID], row[LINE] = self.start, 1.0, columns[LINE, 0]
        return row

    def _complete_coordinates(self, columns: Array) -> int:
        """Set a coordinate that is never given to 0; return how many records come before X, Y and Z are all known."""
        unknown = np.zeros(columns.shape[1], bool)
        # a first Z alone, from wherever X and Y are, is no path yet
        plunging = np.isnan(columns[0]) & np.isnan(columns[1]) & ~np.isnan(columns[2])
        for letter, values in zip(AXES[:3], columns[:3], strict=True):
            missing = np.isnan(values)
            if missing.all():
                values[:] = 0.0
                self.motion.notes.add(0, f"no {letter} word: {letter} is 0")
            elif missing.any():
                feeding = np.flatnonzero(missing & (columns[RAPID] == 0.0) & ~plunging)
                if len(feeding):
                    given = int(columns[LINE, np.argmin(missing)])
                    message = f"a feed motion while {letter} is not known, which is first given in line {given}"
                    raise self._fail(
                        f"{message}; expected it before, or a stated start", int(columns[LINE, feeding[0]])
                    )
                unknown |= missing
        dropped = int(np.count_nonzero(unknown))
        if dropped:
            text = "a motion before X, Y and Z are all known: the records begin behind it"
            self.motion.notes.add(int(columns[LINE, 0]), text, dropped)
        return dropped
