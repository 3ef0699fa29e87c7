"""G-code programs: RS274/NGC as LinuxCNC 2.9 reads it, for a mill, without parameters, subroutines and cycles.

Runs of plain lines go through a fast reader; every other line goes through the block reader, which gives the same
records. What is not read is refused with its line.
"""

import io
import os

import numpy as np

from ....errors import InputError
from ...path import Event, Floats, ToolPath
from ..cl.reader import Progress, opened
from .motion import AXES, GcodeMotion
from .plain import plain_run
from .records import FEED, LINE, RAPID, SECONDS, SPINDLE
from .state import GcodeState
from .words import LONGEST, parse

_BLOCK = 1 << 20  # bytes read at a time


def read_gcode(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    workpiece: Floats | None = None,
    progress: Progress | None = None,
) -> ToolPath:
    """Read a G-code program.

    X, Y, Z are the tool's tip and A, B, C its turns, R = Rz(C)·Ry(B)·Rx(A); tool length offsets don't move the tip.
    The records begin where X, Y and Z are all known; a letter the file never gives is 0.

    Parameters
    ----------
    path : the file
    arc_tolerance : mm, the largest distance of the straight lines that replace an arc from it
    workpiece : (3, 4) rotation and origin (mm) of the work in the machine's coordinates, as the path will be placed on
        the machine; G53 needs it and is refused without
    progress : called now and then with the fraction read, 0 to 1

    Returns
    -------
    The tool path in the work system of the file. Lengths in the texts of its events are mm.

    Raises
    ------
    InputError : the file cannot be read, or a line holds what is not read here; one line with file and line number
    """
    if not 0.0 < arc_tolerance < float("inf"):
        raise InputError("expected a length above zero, in mm", "arc_tolerance")
    if workpiece is not None and (np.shape(workpiece) != (3, 4) or not np.isfinite(workpiece).all()):
        raise InputError("expected a transform of shape (3, 4)", "workpiece")
    source = os.fsdecode(path)
    with opened(path, source) as file, np.errstate(all="ignore"):
        size = os.fstat(file.fileno()).st_size
        return _Reader(source, size, arc_tolerance, workpiece).read(file, progress or (lambda fraction: None))


class _Reader:
    """Lines from a file, blocks from lines."""

    def __init__(self, source: str, size: int, arc_tolerance: float, workpiece: Floats | None = None):
        self.source = source
        self.size = size
        self.motion = GcodeMotion(arc_tolerance, workpiece)
        self.state = GcodeState(self.motion)
        self.line = 0  # lines completed
        self.started = False
        self.percent = False
        self.ended = False
        self.after_end = [0, 0]

    def fail(self, message: str, line: int | None) -> InputError:
        return InputError(message, self.source, line)

    def read(self, file: io.FileIO, progress: Progress) -> ToolPath:
        done, rest = 0, b""
        while data := self.fetch(file):
            if not done:
                data = data.removeprefix(b"\xef\xbb\xbf")  # a byte order mark
            done += len(data)
            *lines, rest = (rest + data).split(b"\n")
            self.lines(lines)
            if len(rest) > 4 * LONGEST:  # bytes, of which a character has at most four
                if not self.ended:
                    raise self.fail(
                        f"a line of more than {LONGEST} characters; expected a block of G-code", self.line + 1
                    )
                rest = rest[:LONGEST]
            progress(min(1.0, done / max(self.size, 1)))
        self.lines([rest])
        path = self.finish()
        progress(1.0)
        return path

    def fetch(self, file: io.FileIO) -> bytes:
        try:
            return file.read(_BLOCK) or b""
        except OSError as error:
            raise self.fail(f"cannot be read: {error.strerror}", None) from error

    def lines(self, lines: list[bytes]) -> None:
        """Whole lines, the next ones of the file."""
        first, at = self.line + 1, 0
        while at < len(lines):
            if self.ended:
                self.skip(lines[at], first + at)
                at += 1
                continue
            if self.started:
                at = plain_run(lines, at, first, self.motion)
                if at == len(lines):
                    break
            try:
                self.take(lines[at], first + at)
            except InputError as error:
                raise self.fail(error.message, first + at) from error
            at += 1
        self.line += len(lines)
        self.motion.rows.settle()

    def take(self, raw: bytes, line: int) -> None:
        """One line."""
        try:
            text = raw.decode()
        except UnicodeDecodeError:
            text = raw.decode("latin-1")
        bare = text.rstrip("\r").strip(" \t")
        if bare == "%" and (self.percent or not self.started):
            self.ended, self.started, self.percent = self.percent, True, True
            return
        if bare:
            self.started = True
            self.state.act(parse(bare), line)
            self.ended = self.state.finished

    def skip(self, raw: bytes, line: int) -> None:
        """A line behind the program's end."""
        if raw.strip(b" \t\r%\x1a\0"):
            self.after_end = [self.after_end[0] or line, self.after_end[1] + 1]

    def finish(self) -> ToolPath:
        motion, state = self.motion, self.state
        if not motion.rows.count:
            raise self.fail("no motion; expected at least one block such as G0 X0 Y0 Z0", None)
        columns = motion.rows.columns()
        dropped = self.place(columns)
        columns = columns[:, dropped:]
        if not state.units_given:
            motion.notes.add(0, "no G20 or G21: lengths are read as mm")
        if self.after_end[1]:
            motion.notes.add(self.after_end[0], "a line after the program's end, not read", self.after_end[1])
        elif not self.ended:
            motion.notes.add(0, "the program ends without M2, M30 or a second %")
        turns = np.radians(np.ascontiguousarray(columns[3:6].T))
        seconds = columns[SECONDS].copy()
        return ToolPath(
            source=self.source,
            tip=columns[:3].T.copy(),
            axis=axes_of(turns),
            line=columns[LINE].astype(np.int64),
            rapid=columns[RAPID] != 0.0,
            feed=columns[FEED].copy(),
            spindle=columns[SPINDLE].copy(),
            dialect="gcode",
            units=state.units,
            tool=state.tool,
            events=tuple(Event(max(0, e.record - dropped), e.line, e.text) for e in state.events),
            notes=motion.notes.notes(),
            turns=turns if any(motion.turned) else None,
            seconds=None if np.isnan(seconds).all() else seconds,
        )

    def place(self, columns: Floats) -> int:
        """Put a coordinate that is never given to 0; returns how many records there are before all are known."""
        unknown = np.zeros(columns.shape[1], bool)
        for letter, values in zip(AXES[:3], columns, strict=False):
            missing = np.isnan(values)
            if missing.all():
                values[:] = 0.0
                self.motion.notes.add(0, f"no {letter} word: {letter} is 0")
            elif missing.any():
                feeding = np.flatnonzero(missing & (columns[RAPID] == 0.0))
                if len(feeding):
                    given = int(columns[LINE, np.argmin(missing)])
                    message = f"a feed motion while {letter} is not known, which is first given in line {given}"
                    raise self.fail(f"{message}; expected it before", int(columns[LINE, feeding[0]]))
                unknown |= missing
        dropped = int(np.count_nonzero(unknown))
        if dropped:
            text = "a rapid motion before X, Y and Z are all known: the records begin behind it"
            self.motion.notes.add(int(columns[LINE, 0]), text, dropped)
        return dropped


def axes_of(turns: Floats) -> Floats:
    """The tool axes Rz(C)·Ry(B)·Rx(A)·z for turns A, B, C (n, 3) in rad: unit vectors (n, 3)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
    return np.column_stack([cc * sb * ca + sc * sa, sc * sb * ca - cc * sa, cb * ca])
