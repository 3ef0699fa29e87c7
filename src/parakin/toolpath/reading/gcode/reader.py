"""Read G-code programs: RS274/NGC as LinuxCNC 2.9 reads it, for a mill, without parameters, subroutines and cycles.

Runs of plain lines go through a fast reader (:mod:`.plain_lines`); every other line goes through the block reader
(:mod:`.block`, :mod:`.execution`), which gives the same records. What is not read is refused with its line. The codes
are in the tables of :mod:`.codes`.
"""

import io
import os

import numpy as np

from ....arrays import Array, Progress
from ....errors import InputError
from ...path import Event, ToolPath
from ..text import BYTE_ORDER_MARK, READ_SIZE, check_arc_tolerance, decode_line, open_file
from .block import LONGEST, parse_block
from .execution import BlockExecutor
from .motion import AXES, GcodeMotion
from .plain_lines import read_plain_lines
from .records import FEED, LINE, RAPID, SECONDS, SPINDLE


def read_gcode(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    workpiece: Array | None = None,
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
    check_arc_tolerance(arc_tolerance)
    if workpiece is not None and (np.shape(workpiece) != (3, 4) or not np.isfinite(workpiece).all()):
        raise InputError("expected a transform of shape (3, 4)", "workpiece")
    source = os.fsdecode(path)
    with open_file(path, source) as file, np.errstate(all="ignore"):
        size = os.fstat(file.fileno()).st_size
        return GcodeReader(source, size, arc_tolerance, workpiece).read(file, progress or (lambda fraction: None))


class GcodeReader:
    """Split a file into lines, execute their blocks, and build the tool path.

    line : lines completed
    started : whether there was a line with something on it
    percent : whether the program began with %
    ended : whether the program has ended, by a code or a second %
    skipped : lines after the end: the first one's number and their count
    """

    def __init__(self, source: str, size: int, arc_tolerance: float, workpiece: Array | None = None):
        self.source = source
        self.size = size
        self.motion = GcodeMotion(arc_tolerance, workpiece)
        self.executor = BlockExecutor(self.motion)
        self.line = 0
        self.started = False
        self.percent = False
        self.ended = False
        self.skipped = [0, 0]

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
                if not self.ended:
                    raise self._fail(
                        f"a line of more than {LONGEST} characters; expected a block of G-code", self.line + 1
                    )
                rest = rest[:LONGEST]
            progress(min(1.0, done / max(self.size, 1)))
        self._read_lines([rest])
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
            if self.ended:
                self._skip_line(lines[at], first + at)
                at += 1
                continue
            if self.started:
                at = read_plain_lines(lines, at, first, self.motion)
                if at == len(lines):
                    break
            try:
                self._read_line(lines[at], first + at)
            except InputError as error:
                raise self._fail(error.message, first + at) from error
            at += 1
        self.line += len(lines)
        self.motion.records.compact()

    def _read_line(self, raw: bytes, line: int) -> None:
        """Read one line."""
        bare = decode_line(raw).rstrip("\r").strip(" \t")
        if bare == "%" and (self.percent or not self.started):
            self.ended, self.started, self.percent = self.percent, True, True
            return
        if bare:
            self.started = True
            self.executor.execute(parse_block(bare), line)
            self.ended = self.executor.finished

    def _skip_line(self, raw: bytes, line: int) -> None:
        """Count a line after the program's end."""
        if raw.strip(b" \t\r%\x1a\0"):
            self.skipped = [self.skipped[0] or line, self.skipped[1] + 1]

    def _build_path(self) -> ToolPath:
        motion, executor = self.motion, self.executor
        if not motion.records.count:
            raise self._fail("no motion; expected at least one block such as G0 X0 Y0 Z0", None)
        columns = motion.records.take_columns()
        dropped = self._complete_coordinates(columns)
        columns = columns[:, dropped:]
        if not executor.units_given:
            motion.notes.add(0, "no G20 or G21: lengths are read as mm")
        if self.skipped[1]:
            motion.notes.add(self.skipped[0], "a line after the program's end, not read", self.skipped[1])
        elif not self.ended:
            motion.notes.add(0, "the program ends without M2, M30 or a second %")
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
            tool=executor.tool,
            events=tuple(Event(max(0, e.record - dropped), e.line, e.text) for e in executor.events),
            notes=motion.notes.list_notes(),
            turns=turns if any(motion.turned) else None,
            seconds=None if np.isnan(seconds).all() else seconds,
        )

    def _complete_coordinates(self, columns: Array) -> int:
        """Set a coordinate that is never given to 0; return how many records come before X, Y and Z are all known."""
        unknown = np.zeros(columns.shape[1], bool)
        for letter, values in zip(AXES[:3], columns[:3], strict=True):
            missing = np.isnan(values)
            if missing.all():
                values[:] = 0.0
                self.motion.notes.add(0, f"no {letter} word: {letter} is 0")
            elif missing.any():
                feeding = np.flatnonzero(missing & (columns[RAPID] == 0.0))
                if len(feeding):
                    given = int(columns[LINE, np.argmin(missing)])
                    message = f"a feed motion while {letter} is not known, which is first given in line {given}"
                    raise self._fail(f"{message}; expected it before", int(columns[LINE, feeding[0]]))
                unknown |= missing
        dropped = int(np.count_nonzero(unknown))
        if dropped:
            text = "a rapid motion before X, Y and Z are all known: the records begin behind it"
            self.motion.notes.add(int(columns[LINE, 0]), text, dropped)
        return dropped


def compute_tool_axes(turns: Array) -> Array:
    """Compute the tool axes Rz(C)·Ry(B)·Rx(A)·z, unit vectors (n, 3), of turns A, B, C (n, 3) in rad."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
    return np.column_stack([cc * sb * ca + sc * sa, sc * sb * ca - cc * sa, cb * ca])
