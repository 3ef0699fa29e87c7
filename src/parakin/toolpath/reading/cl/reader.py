"""CL files, in the APT dialect CATIA writes and the one of Siemens NX.

Lines are read a block at a time. Runs of plain GOTO lines, nearly all of a large file, go through a compiled kernel;
every other line, and every line the kernel is not sure of, goes through the line reader, which gives the same records.
"""

import io
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError
from ...path import ToolPath
from .motion import Motion
from .statements import Statements, ends_text
from .tokens import is_number, number, quoted

_BLOCK = 1 << 20  # bytes read at a time, into the same buffer: it stays in the cache
_LONGEST = 4_000_000  # characters in one statement
_BULK_FROM = 1 << 18  # bytes; the kernel's loading doesn't pay below
_PLAIN_STARTS = (b"G", b"g", b" ", b"\t", b"\n")  # of lines worth the call of the kernel
_ASIDES = 4096
_HEADER = re.compile(r"\$\$\s*\*\s*CATIA0\b", re.IGNORECASE)

Progress = Callable[[float], None]


def read_cl(path: str | os.PathLike[str], *, arc_tolerance: float = 0.01, progress: Progress | None = None) -> ToolPath:
    """Read a CL file.

    Parameters
    ----------
    path : the file
    arc_tolerance : mm, the largest distance of the straight lines that replace an arc from it
    progress : called now and then with the fraction read, 0 to 1

    Returns
    -------
    The tool path, in mm and in the workpiece frame of the file's first record.

    Raises
    ------
    InputError : the file cannot be read, or a line cannot be understood; one line with file and line number
    """
    if not 0.0 < arc_tolerance < float("inf"):
        raise InputError("expected a length above zero, in mm", "arc_tolerance")
    source = os.fsdecode(path)
    with opened(path, source) as file, np.errstate(all="ignore"):
        size = os.fstat(file.fileno()).st_size
        return _Reader(source, size, arc_tolerance).read(file, progress or (lambda fraction: None))


def opened(path: str | os.PathLike[str], source: str) -> io.FileIO:
    """The file, unbuffered; an InputError if it cannot be opened."""
    try:
        return Path(path).open("rb", buffering=0)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source) from error
    except ValueError as error:
        raise InputError("cannot be read: a null character in the name", quoted(source)) from error


class _Reader:
    """Lines from blocks, statements from lines."""

    def __init__(self, source: str, size: int, arc_tolerance: float):
        self.source = source
        # columns for as many records as the file may well hold; memory not written to is not taken
        self.motion = Motion(min(size // 48, 1 << 26), arc_tolerance)
        self.statements = Statements(self.motion)
        self.bulk = size >= _BULK_FROM
        self.size = size
        self.buffer = bytearray(_BLOCK)
        self.kept = 0  # bytes of an unfinished line, at the buffer's front
        self.line = 0  # lines completed
        self.held: list[str] = []
        self.held_from = 0
        self.held_length = 0
        self.rows: list[list[float]] | None = None
        self.rows_from = 0
        self.after_fini = [0, 0]
        self.seen: dict[bytes, tuple[str, float, str | None]] = {}
        self.asides = np.empty((_ASIDES if self.bulk else 1, 4), np.int64)

    def fail(self, message: str, line: int | None) -> InputError:
        return InputError(message, self.source, line)

    def read(self, file: io.FileIO, progress: Progress) -> ToolPath:
        done = 0
        while got := self.fetch(file):
            begin, end = self.kept, self.kept + got
            if not done and self.buffer.startswith(b"\xef\xbb\xbf"):
                self.buffer[:3] = b"   "  # a byte order mark
            null = self.buffer.find(b"\0", begin, end)
            whole = self.buffer.rfind(b"\n", 0, end if null < 0 else null) + 1
            self.lines(whole)
            if null >= 0:
                raise self.fail("a NUL byte: a binary or UTF-16 file; expected plain text", self.line + 1)
            self.keep(whole, end)
            done += got
            progress(min(1.0, done / max(self.size, 1)))
        if self.kept:
            self.buffer[self.kept : self.kept + 1] = b"\n"
            self.lines(self.kept + 1)
        path = self.finish()
        progress(1.0)
        return path

    def fetch(self, file: io.FileIO) -> int:
        """Bytes read into the buffer, behind what is kept there."""
        try:
            return file.readinto(memoryview(self.buffer)[self.kept :]) or 0
        except OSError as error:
            raise self.fail(f"cannot be read: {error.strerror}", None) from error

    def keep(self, begin: int, end: int) -> None:
        """Move the start of an unfinished line to the front, and make room for the rest of it."""
        self.kept = end - begin
        if self.kept > _LONGEST:
            raise self.fail(f"a line of more than {_LONGEST} characters; expected a CL statement", self.line + 1)
        rest = self.buffer[begin:end]
        if len(self.buffer) < 2 * self.kept:
            self.buffer = bytearray(4 * self.kept)
        self.buffer[: self.kept] = rest

    def finish(self) -> ToolPath:
        if self.held:
            raise self.fail("continued by $, but the file ends; expected the statement's next line", self.held_from)
        if self.rows is not None:
            raise self.fail("expected three rows of four numbers after $$*CATIA0", self.rows_from)
        motion, said = self.motion, self.statements
        if motion.circle is not None:
            raise self.fail("CIRCLE: the file ends; expected the GOTO that ends the arc", motion.circle[0])
        if not motion.records.n:
            raise self.fail("no motion; expected at least one record such as GOTO/x,y,z", None)
        motion.settle()
        records = motion.records
        records.trim()
        if self.after_fini[1]:
            motion.notes.add(self.after_fini[0], "a statement after FINI, not read", self.after_fini[1])
        if motion.off_unit[0]:
            count, first, worst = motion.off_unit.tolist()
            text = f"a tool axis off unit length, normalised; the worst by {worst:.3g}"
            motion.notes.add(int(first), text, int(count))
        frame = None
        if motion.first_frame is not None:
            first_frame = motion.first_frame.scaled(motion.first_scale)
            frame = np.column_stack([first_frame.rotation, first_frame.origin])
        return ToolPath(
            source=self.source,
            tip=records.tip,
            axis=records.axis,
            line=records.line,
            rapid=records.rapid,
            feed=records.feed,
            spindle=records.spindle,
            frame=frame,
            dialect=said.dialect,
            units=said.units,
            tool=said.tool,
            events=tuple(said.events),
            notes=motion.notes.notes(),
        )

    def lines(self, stop: int) -> None:
        """The whole lines in the buffer up to stop, where the last one ends."""
        text, numbers = self.buffer, np.frombuffer(self.buffer, np.uint8, stop)
        at = 0
        while at < stop:
            if self.bulk and text[at : at + 1] in _PLAIN_STARTS and self.plain():
                at = self.run(numbers, at)
                if at == stop:
                    return
            end = text.find(b"\n", at)
            self.line += 1
            self.take(text[at:end], self.line)
            at = end + 1

    def plain(self) -> bool:
        """Whether the next line stands for itself."""
        motion = self.motion
        return not (self.held or self.rows is not None or motion.circle or motion.cycle or self.statements.finished)

    def run(self, buffer: NDArray[np.uint8], at: int) -> int:
        """A run of plain GOTO lines through the kernel; returns where it ended."""
        from .bulk import goto_run  # compiles, or loads what was compiled: only for files it is worth it

        motion, records = self.motion, self.motion.records
        while True:
            records.reserve(_ASIDES)
            start = records.n
            cursor = np.array([at, self.line + 1, start])
            axis = np.array(motion.axis)
            asides = goto_run(
                buffer, cursor, axis, motion.off_unit, records.tip, records.axis, records.line, self.asides
            )
            at, end = int(cursor[0]), int(cursor[2])
            records.rapid[start:end] = False
            records.spindle[start:end] = motion.rpm
            for begin, stop, line, index in self.asides[:asides].tolist():
                self.fill(index)
                self.aside(bytes(self.buffer[begin:stop]), line)
            self.fill(end)
            self.line = int(cursor[1]) - 1
            if end > start:
                x, y, z = records.tip[end - 1].tolist()
                i, j, k = axis.tolist()
                motion.position, motion.axis, motion.tangent = (x, y, z), (i, j, k), None
            if asides < len(self.asides) and end < len(records.line):
                return at

    def fill(self, end: int) -> None:
        """Count the records up to end in, with the feed in force and a pending RAPID."""
        motion, records = self.motion, self.motion.records
        start = records.n
        if end > start:
            records.feed[start:end] = motion.feed
            if motion.feed != motion.feed:
                for line in records.line[start:end].tolist():
                    motion.check_feed(line, motion.feed, motion.feed_value)
            if motion.rapid:
                records.rapid[start] = True
                motion.rapid = False
            records.n = end

    def aside(self, text: bytes, line: int) -> None:
        """A FEDRAT, RAPID or PAINT line within a run; they repeat, so each is parsed once."""
        known = self.seen.get(text)
        if known is None:
            word = self.take(text, line)
            if len(self.seen) < _ASIDES and word in ("FEDRAT", "RAPID", "PAINT"):
                unit = self.motion.feed_unit if b"," in text else None
                self.seen[text] = word, self.motion.feed_value, unit
            return
        word, value, unit = known
        if word == "FEDRAT":
            self.motion.set_feed(value, unit)
        elif word == "RAPID":
            self.motion.rapid = True

    def take(self, raw: bytes | bytearray, line: int) -> str:
        """One line; returns the word of the statement it completes, or nothing."""
        try:
            text = raw.decode().strip()
        except UnicodeDecodeError:
            text = raw.decode("latin-1").strip()
        if self.rows is not None:
            self.row(text, line)
            return ""
        if "$" in text:
            if _HEADER.match(text):
                self.rows, self.rows_from = [], line
                return ""
            text = text.partition("$$")[0].rstrip()
        if not text:
            return ""
        if self.held and ends_text(self.held[0], text):
            self.state("".join(self.held), self.held_from)
            self.held, self.held_length = [], 0
        if text.endswith("$"):
            self.hold(text[:-1], line)
            return ""
        if self.held:
            self.hold(text, line)
            text, line = "".join(self.held), self.held_from
            self.held, self.held_length = [], 0
        return self.state(text, line)

    def state(self, text: str, line: int) -> str:
        """A whole statement; returns its word."""
        if self.statements.finished:
            self.after_fini = [self.after_fini[0] or line, self.after_fini[1] + 1]
            return ""
        try:
            return self.statements.take(text, line)
        except InputError as error:
            raise self.fail(error.message, line) from error

    def hold(self, text: str, line: int) -> None:
        if not self.held:
            self.held_from = line
        self.held.append(text)
        self.held_length += len(text)
        if self.held_length > _LONGEST:
            raise self.fail(f"a statement of more than {_LONGEST} characters", self.held_from)

    def row(self, text: str, line: int) -> None:
        """A row of the matrix after $$*CATIA0. Comments, such as the axis system's name, may come before the first."""
        assert self.rows is not None
        fields = text.removeprefix("$$").replace(",", " ").split()
        if len(fields) == 4 and all(is_number(f) for f in fields):
            try:
                self.rows.append([number(f) for f in fields])
                if len(self.rows) == 3:
                    rows, self.rows = self.rows, None
                    self.statements.matrix(rows, line)
            except InputError as error:
                raise self.fail(error.message, line) from error
        elif self.rows or not (text.startswith("$$") or not text):
            raise self.fail(f"{quoted(text)}; expected a row of four numbers of the matrix after $$*CATIA0", line)
