"""Timing that can be compared: best of several runs, everything in one process, reported as ratios."""

from __future__ import annotations

import time
from collections.abc import Callable


def best(work: Callable[[], object], runs: int = 9, clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds of the quickest of ``runs`` runs, after one to warm up."""
    work()
    times = []
    for _ in range(runs):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


def table(title: str, columns: list[str], rows: list[list[str]]) -> str:
    """Plain text, right-aligned but for the first column."""
    widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
    lines = [title, ""]
    for row in [columns, ["-" * width for width in widths], *rows]:
        cells = enumerate(zip(row, widths, strict=True))
        lines.append("  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in cells))
    return "\n".join(lines) + "\n"
