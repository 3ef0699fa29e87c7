"""Read CL files, in the dialects of :mod:`.dialects`.

Bytes are read a block at a time. Runs of plain GOTO lines, nearly all of a large file, go through compiled code
(:mod:`.plain_lines`); every other line, and every line that code is not sure of, goes through :mod:`.line_reader`,
which gives the same records. The words are in the table of :mod:`.words`.
"""

import io
import math
import os
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ....arrays import Array, Progress
from ....errors import InputError
from ...path import ToolPath
from ..text import (
    BYTE_ORDER_MARK,
    READ_SIZE,
    check_arc_tolerance,
    check_tool_lengths,
    open_file,
    quote_short,
)
from .actions import ClActions
from .dialects import DIALECTS
from .line_reader import LONGEST, LineReader
from .motion import ClMotion

_BLOCK = READ_SIZE  # bytes read at a time, into the same buffer: it stays in the cache
_BULK_FROM = 1 << 18  # bytes of a file; loading the compiled code doesn't pay below
_PLAIN_STARTS = (b"G", b"g", b" ", b"\t", b"\n")  # first bytes of lines that are worth a call of the compiled code
_MODAL_LINES = 4096  # FEDRAT, RAPID and PAINT lines in one call of it
_BYTES_PER_RECORD = 48  # bytes a record takes in a usual file
_MOST_EXPECTED = 1 << 26  # records to reserve room for at first
_MOST_LISTED = 20  # words that only inform


def read_cl(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    frame: Literal["file", "ignore"] = "file",
    tools: Mapping[int, float] | None = None,
    progress: Progress | None = None,
) -> ToolPath:
    """Read a CL file.

    Parameters
    ----------
    path : the file
    arc_tolerance : mm, the largest distance of the straight lines that replace an arc from it
    frame : "file": the path's frame is the file's (MSYS, CSYS, CATIA's matrix); "ignore": it is None. Later frames of
        the file are brought into its first one either way
    tools : lengths of tools by number, mm, in place of the file's own
    progress : called now and then with the fraction read, 0 to 1

    Returns
    -------
    The tool path, in mm and in the workpiece frame of the file's first record.

    Raises
    ------
    InputError : the file cannot be read, or a line cannot be understood; one line with file and line number
    """
    check_arc_tolerance(arc_tolerance)
    if frame not in ("file", "ignore"):
        raise InputError('expected "file" or "ignore"', "frame")
    check_tool_lengths(tools)
    source = os.fsdecode(path)
    with open_file(path, source) as file, np.errstate(all="ignore"):
        size = os.fstat(file.fileno()).st_size
        reader = ClReader(source, size, arc_tolerance, ignore_frame=frame == "ignore", tools=tools)
        return reader.read(file, progress or (lambda fraction: None))


class ClReader:
    """Split a file into lines, read runs of plain ones by compiled code, and build the tool path.

    buffer : bytes of the file; the first ``kept`` of them are an unfinished line
    line : lines completed
    """

    def __init__(
        self,
        source: str,
        size: int,
        arc_tolerance: float,
        *,
        ignore_frame: bool = False,
        tools: Mapping[int, float] | None = None,
    ):
        self.source = source
        self.tools = tools
        self.ignore_frame = ignore_frame
        # columns for as many records as the file may well hold; the system gives memory when it is written to
        self.motion = ClMotion(min(size // _BYTES_PER_RECORD, _MOST_EXPECTED), arc_tolerance)
        self.actions = ClActions(self.motion)
        self.lines = LineReader(source, self.actions)
        self.bulk = size >= _BULK_FROM
        self.size = size
        self.buffer = bytearray(_BLOCK)
        self.kept = 0
        self.line = 0
        self.known_lines: dict[bytes, tuple[str, float, str | None]] = {}  # of runs: word, feed and its unit
        self.modal_lines = np.empty((_MODAL_LINES if self.bulk else 1, 4), np.int64)

    def _fail(self, message: str, line: int | None) -> InputError:
        return InputError(message, self.source, line)

    def read(self, file: io.FileIO, progress: Progress) -> ToolPath:
        """Read the whole file."""
        done = 0
        while count := self._fill_buffer(file):
            begin, end = self.kept, self.kept + count
            if not done and self.buffer.startswith(BYTE_ORDER_MARK):
                self.buffer[:3] = b"   "
            null = self.buffer.find(b"\0", begin, end)
            whole = self.buffer.rfind(b"\n", 0, end if null < 0 else null) + 1
            self._read_lines(whole)
            if null >= 0:
                raise self._fail("a NUL byte: a binary or UTF-16 file; expected plain text", self.line + 1)
            self._keep_unfinished_line(whole, end)
            done += count
            progress(min(1.0, done / max(self.size, 1)))
        if self.kept:
            self.buffer[self.kept : self.kept + 1] = b"\n"
            self._read_lines(self.kept + 1)
        self._check_end()
        path = self._build_path()
        progress(1.0)
        return path

    def _fill_buffer(self, file: io.FileIO) -> int:
        """Read bytes behind what is kept in the buffer; return how many."""
        try:
            return file.readinto(memoryview(self.buffer)[self.kept :]) or 0
        except OSError as error:
            raise self._fail(f"cannot be read: {error.strerror}", None) from error

    def _keep_unfinished_line(self, begin: int, end: int) -> None:
        """Move the start of an unfinished line to the front, and make room for the rest of it."""
        self.kept = end - begin
        if self.kept > LONGEST:
            raise self._fail(f"a line of more than {LONGEST} characters; expected a CL statement", self.line + 1)
        rest = self.buffer[begin:end]
        if len(self.buffer) < 2 * self.kept:
            self.buffer = bytearray(4 * self.kept)
        self.buffer[: self.kept] = rest

    # the end of the file

    def _check_end(self) -> None:
        """Refuse a file that ends within a statement, a matrix or an arc, or without motion."""
        self.lines.check_end()
        if self.motion.circle is not None:
            raise self._fail("CIRCLE: the file ends; expected the GOTO that ends the arc", self.motion.circle.line)
        try:
            self.motion.close_arc(None)
            self.actions.units.check()
        except InputError as error:
            raise self._fail(error.message, error.line) from error
        if not self.motion.records.n:
            raise self._fail("no motion; expected at least one record such as GOTO/x,y,z", None)

    def _build_path(self) -> ToolPath:
        motion, actions, records = self.motion, self.actions, self.motion.records
        motion.place_records()
        records.trim()
        first_skipped, skipped = self.lines.skipped
        if skipped:
            motion.notes.add(first_skipped, "a statement after FINI, not read", skipped)
        if motion.off_unit[0]:
            count, first, worst = motion.off_unit.tolist()
            text = f"a tool axis off unit length, normalised; the worst by {worst:.3g}"
            motion.notes.add(int(first), text, int(count))
        try:
            uses = actions.tools.list_uses(self.tools)
        except InputError as error:
            raise self._fail(error.message, error.line) from None
        frame = self._take_frame()
        if actions.dialect != "apt":
            motion.notes.add(actions.told_line, f"read as {DIALECTS[actions.dialect].title} writes it")
        if actions.informing:
            words = sorted(actions.informing)
            more = f" and {len(words) - _MOST_LISTED} more" if len(words) > _MOST_LISTED else ""
            shown = ", ".join(quote_short(word)[1:-1] for word in words[:_MOST_LISTED])
            motion.notes.add(min(actions.informing.values()), f"words that only inform: {shown}{more}")
        return ToolPath(
            source=self.source,
            tip=records.tip,
            axis=records.axis,
            line=records.line,
            rapid=records.rapid,
            feed=records.feed,
            spindle=records.spindle,
            frame=frame,
            dialect=actions.dialect,
            units=actions.units.name,
            tool=dict(uses[0].data) if uses else {},
            tools=uses,
            events=tuple(motion.events),
            notes=motion.notes.list_notes(),
        )

    def _take_frame(self) -> Array | None:
        """Return the workpiece's frame (3, 4) in the machine that the path has, named in a note."""
        motion = self.motion
        if motion.first_frame is None:
            return None
        first = motion.first_frame.scale_origin(motion.first_scale)
        frame = np.column_stack([first.rotation, first.origin]) + 0.0
        x, z = (", ".join(f"{value:.6g}" for value in frame[:, k]) for k in (0, 2))
        origin = ", ".join(f"{value:.6g}" for value in frame[:, 3])
        fate = ", ignored" if self.ignore_frame else ""
        motion.notes.add(motion.frame_line, f"the file's frame: origin {origin} mm, X along {x}, Z along {z}{fate}")
        return None if self.ignore_frame else frame

    # runs of plain lines

    def _read_lines(self, stop: int) -> None:
        """Read the whole lines in the buffer up to stop, where the last one ends."""
        text, numbers = self.buffer, np.frombuffer(self.buffer, np.uint8, stop)
        at = 0
        while at < stop:
            if self.bulk and text[at : at + 1] in _PLAIN_STARTS and self._may_read_plain_lines():
                at = self._read_plain_lines(numbers, at)
                if at == stop:
                    return
            end = text.find(b"\n", at)
            self.line += 1
            self.lines.read_line(text[at:end], self.line)
            at = end + 1

    def _may_read_plain_lines(self) -> bool:
        """Tell whether the next line depends on no line before it."""
        motion = self.motion
        within = self.lines.is_open or motion.circle or motion.cycle or motion.open_arc or motion.axis_is_open
        return not (within or self.actions.finished)

    def _read_plain_lines(self, buffer: NDArray[np.uint8], at: int) -> int:
        """Read a run of plain lines from a position in the buffer on; return where it ended."""
        from .plain_lines import AxisState, PlainRecords, read_goto_lines  # compiles, or loads what was compiled

        motion, records = self.motion, self.motion.records
        while True:
            records.reserve(_MODAL_LINES)
            start = records.n
            cursor = np.array([at, self.line + 1, start])
            state = AxisState(np.array(motion.axis), motion.off_unit)
            columns = PlainRecords(records.tip, records.axis, records.line)
            stepped_over = read_goto_lines(buffer, cursor, state, columns, self.modal_lines)
            at, end = int(cursor[0]), int(cursor[2])
            records.rapid[start:end] = False
            records.spindle[start:end] = motion.rpm
            for begin, stop, line, index in self.modal_lines[:stepped_over].tolist():
                self._complete_records(index)
                self._read_modal_line(bytes(self.buffer[begin:stop]), line)
            self._complete_records(end)
            self.line = int(cursor[1]) - 1
            if end > start:
                x, y, z = records.tip[end - 1].tolist()
                i, j, k = state.axis.tolist()
                motion.position, motion.axis, motion.tangent = (x, y, z), (i, j, k), None
            if stepped_over < len(self.modal_lines) and end < len(records.line):
                return at

    def _complete_records(self, end: int) -> None:
        """Count the records up to end in, with the feed in force and a pending RAPID."""
        motion, records = self.motion, self.motion.records
        start = records.n
        if end > start:
            records.feed[start:end] = motion.feed
            if not motion.feed > 0.0:
                cuts = start + int(motion.rapid or not start)
                if cuts < end:
                    self._refuse_feed(int(records.line[cuts]))
            if motion.rapid:
                records.rapid[start] = True
                motion.rapid = False
            records.n = end

    def _refuse_feed(self, line: int) -> None:
        self.motion.records.n = 1
        try:
            self.motion.require_feed(line, self.motion.feed, math.nan)
        except InputError as error:
            raise self._fail(f"GOTO: {error.message}", line) from error

    def _read_modal_line(self, text: bytes, line: int) -> None:
        """Read a FEDRAT, RAPID or PAINT line within a run; equal lines are parsed once."""
        known = self.known_lines.get(text)
        if known is None:
            word = self.lines.read_line(text, line)
            if len(self.known_lines) < _MODAL_LINES and word in ("FEDRAT", "RAPID", "PAINT"):
                unit = self.motion.feed_unit if b"," in text else None
                self.known_lines[text] = word, self.motion.feed_value, unit
            return
        word, value, unit = known
        if word == "FEDRAT":
            self.motion.take_feed(value, unit, line)
        elif word == "RAPID":
            self.motion.rapid = True
