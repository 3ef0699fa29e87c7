"""Batches of rows through the kernels, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .tape import Tape

Rows = NDArray[np.float64]
SMALL = 4096  # rows below which a second thread costs more than it brings
NOTHING = np.empty((0, 0))


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), thread_name_prefix="parakin")


def split(count: int, work: Callable[[int, int], None]) -> None:
    """Run ``work(start, stop)`` over all rows; the kernels release the interpreter's lock."""
    parts = min(cores(), count // SMALL)
    if parts < 2:
        work(0, count)
        return
    edges = [count * i // parts for i in range(parts + 1)]
    for future in [_pool().submit(work, a, b) for a, b in zip(edges, edges[1:], strict=False)]:
        future.result()


def run(tape: Tape, x: Rows, out: Rows, z: Rows | None = None) -> Rows:
    """Rows of ``x`` (N, i), followed by those of ``z``, through a tape into ``out`` (N, o)."""
    from .blocks import evaluate

    given = np.empty((len(x), 0)) if z is None else z
    args = (tape.code, tape.imm, tape.inputs, tape.outputs, tape.registers, x, given, out)
    split(len(x), lambda start, stop: evaluate(*args, start, stop))
    return out


def solve(tape: Tape, y0: Rows, q: Rows, caps: Rows, most: int) -> tuple[Rows, Rows, NDArray[np.int64], Rows]:
    """Newton from ``y0`` (1 or N, m) for every row of ``q``: coordinates, residuals (mm), steps, determinants."""
    from .newton import newton

    count, m = len(q), y0.shape[1]
    y, residual, sign = np.empty((count, m)), np.empty(count), np.empty(count)
    steps = np.empty(count, np.int64)
    args = (tape.code, tape.imm, tape.inputs, tape.outputs, tape.registers, y0, q, caps, most, y, residual, steps, sign)
    split(count, lambda start, stop: newton(*args, start, stop))
    return y, residual, steps, sign


def first_negative(tape: Tape, x: Rows, z: Rows) -> NDArray[np.int64]:
    """0 where every output of the tape is ≥ 0, else 1 + the index of the first that is negative or NaN."""
    from .blocks import first_broken

    out = np.empty(len(x), np.int64)
    args = (tape.code, tape.imm, tape.inputs, tape.outputs, tape.registers, x, z, out)
    split(len(x), lambda start, stop: first_broken(*args, start, stop))
    return out


def run_loose(tape: Tape, x: Rows, out: Rows, z: Rows) -> Rows:
    """As :func:`run`, but a number that is not finite spoils only itself, not its row."""
    from .blocks import evaluate_loose

    args = (tape.code, tape.imm, tape.inputs, tape.outputs, tape.registers, x, z, out)
    split(len(x), lambda start, stop: evaluate_loose(*args, start, stop))
    return out
