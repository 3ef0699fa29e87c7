"""What a command prints: plain tables, JSON, a progress bar, a remark on what takes long."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from functools import cache
from types import TracebackType
from typing import TYPE_CHECKING, Any

from ..errors import make_printable
from ..export.json.text import format_json
from ..export.number_format import format_fixed
from ..kernels.compile_notice import call_at_first_compilation
from ..units import to_display

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from ..arrays import Array
    from ..machine import Machine

_QUIET = 1.0  # s of work before a bar appears


def measure_line(elsewhere: int = sys.maxsize) -> int:
    """Measure how many letters a line has: COLUMNS, or the terminal; in a file or a pipe, as it is given."""
    return shutil.get_terminal_size((elsewhere, 0)).columns


def format_table(rows: Sequence[Sequence[str]], header: Sequence[str], right: str = "") -> str:
    """Format columns side by side, two blanks apart; in ``right``, ``r`` stands for a column aligned right.

    A table that is wider than a line is turned: below each row's first cell, a line for each of its others.
    """
    everything = [header, *rows]
    widths = [max(len(line[c]) for line in everything) for c in range(len(header))]
    if sum(widths) + 2 * (len(widths) - 1) > measure_line():
        return "\n".join(line for row in rows for line in _turn_row(row, header))
    sides = right.ljust(len(header))
    return "\n".join(
        "  ".join(
            cell.rjust(width) if side == "r" else cell.ljust(width)
            for cell, width, side in zip(line, widths, sides, strict=True)
        ).rstrip()
        for line in everything
    )


def _turn_row(row: Sequence[str], header: Sequence[str]) -> list[str]:
    """Format a row as lines of a title and a cell; a cell without a title stays beside the one before it."""
    lines = [[row[0]]]
    width = max(map(len, header[1:]))
    for title, cell in zip(header[1:], row[1:], strict=True):
        if title:
            lines.append([f"  {title:{width}}"])
        if cell:
            lines[-1].append(cell)
    return ["  ".join(line) for line in lines if len(line) > 1 or line is lines[0]]


def format_pose(machine: Machine, pose: Array) -> str:
    """Format a pose, ``X=10.000 B=30.000``: mm and degrees."""
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return " ".join(f"{axis}={format_fixed(to_display(value, unit), 3, '')}" for axis, value, unit in values)


def print_remark(text: str) -> None:
    """Print a remark beside the command's output."""
    with suppress(OSError):  # a full disk behind stderr
        print(make_printable(text), file=sys.stderr)


def print_text(text: str) -> None:
    """Print a command's answer without characters that control the terminal."""
    print(make_printable(text))


def print_json(content: Mapping[str, Any]) -> None:
    """Print an object as JSON."""
    print(format_json(content))


@cache
def announce_compiling() -> None:
    """Say once that kernels are being compiled, if their cache is empty or out of date."""
    call_at_first_compilation(
        lambda: print_remark("compiling the kernels, once for each kind of work; some seconds ...")
    )


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Show a bar on a terminal's stderr after one second of work."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.bar: Bar | None = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.stop()

    def stage(self, what: str, begin: float, end: float) -> Callable[[float], None]:
        """Make the function to call with the fraction done of a stage, from ``begin`` to ``end`` of the whole work."""
        return lambda fraction: self._show(what, begin + (end - begin) * fraction)

    def _show(self, what: str, fraction: float) -> None:
        if self.bar is None:
            if time.monotonic() - self.started < _QUIET or not sys.stderr.isatty():
                return
            from rich.console import Console
            from rich.progress import Progress as Bar

            self.bar = Bar(console=Console(stderr=True), transient=True)
            self.bar.add_task(what, total=1.0)
            self.bar.start()
        self.bar.update(self.bar.task_ids[0], description=what, completed=fraction)
