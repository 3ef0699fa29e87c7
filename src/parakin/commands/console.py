"""What a command says: plain tables, JSON, a progress bar, a word on what takes long."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import cache
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

_QUIET = 1.0  # seconds of work before a bar appears


def table(rows: Sequence[Sequence[str]], header: Sequence[str], right: str = "") -> str:
    """Columns side by side, two blanks apart; in ``right``, ``r`` stands for a column set right."""
    everything = [header, *rows]
    widths = [max(len(line[c]) for line in everything) for c in range(len(header))]
    sides = right.ljust(len(header))
    return "\n".join(
        "  ".join(
            cell.rjust(width) if side == "r" else cell.ljust(width)
            for cell, width, side in zip(line, widths, sides, strict=True)
        ).rstrip()
        for line in everything
    )


def say(text: str) -> None:
    """A remark beside the command's output."""
    print(text, file=sys.stderr)


def print_json(content: Mapping[str, Any]) -> None:
    print(json_text(content))


def json_text(content: Mapping[str, Any]) -> str:
    """Numbers that are not finite become null."""
    return json.dumps(_finite(content), indent=2, allow_nan=False)


def _finite(content: Any) -> Any:
    if isinstance(content, float):
        return content if math.isfinite(content) else None
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, Sequence) and not isinstance(content, str):
        return [_finite(value) for value in content]
    return content


def fixed(value: float, digits: int, thousands: str = ",") -> str:
    """A number in fixed digits; nought has no sign."""
    return format(round(value, digits) + 0.0, f"{thousands}.{digits}f")


def rim(value: float, unit: str) -> float:
    """mm stay, rad become degrees."""
    return math.degrees(value) if unit == "rad" else value


def rim_unit(unit: str) -> str:
    return "deg" if unit == "rad" else unit


@cache
def announce_compiling() -> None:
    """Say once if kernels must be compiled, which takes a while: their cache is empty or out of date."""
    from numba.core import event

    class Announcement(event.Listener):  # type: ignore[misc]
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                say("compiling the kernels, once for each kind of work; some seconds ...")

        def on_end(self, event: object) -> None:
            pass

    event.register("numba:compile", Announcement())


class Progress(AbstractContextManager["Progress"]):
    """A bar on a terminal's stderr from one second of work on."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.bar: Bar | None = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.stop()

    def part(self, what: str, begin: float, end: float) -> Callable[[float], None]:
        """What to call with the fraction done of a part of the work, which goes from ``begin`` to ``end`` of it all."""
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
