"""Batches of rows through the kernels, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .tape import Tape

Rows = NDArray[np.float64]
SMALL = 4096  # rows below which a second thread costs more than it brings


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), thread_name_prefix="parakin")


if hasattr(os, "register_at_fork"):  # a forked child has the pool but none of its threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def still(rows: Rows) -> Rows:
    """A read-only view: to Numba that is a type of its own, and the kernels are compiled for it alone."""
    view = rows.view()
    view.flags.writeable = False
    return view


def split(count: int, work: Callable[[int, int], None]) -> None:
    """Run ``work(start, stop)`` over all rows; the kernels release the interpreter's lock."""
    parts = min(cores(), count // SMALL)
    if parts < 2:
        work(0, count)
        return
    edges = [count * i // parts for i in range(parts + 1)]
    for future in [_pool().submit(work, a, b) for a, b in pairwise(edges)]:
        future.result()


def run(tape: Tape, x: Rows, out: Rows, z: Rows | None = None, whole: bool = True) -> Rows:
    """Rows of ``x`` (N, i), followed by those of ``z``, through a tape into ``out`` (N, o).

    With ``whole`` a row of the answer is NaN as soon as one number of it, or of its inputs, is not finite.
    """
    from .blocks import evaluate

    given = np.empty((len(x), 0)) if z is None else z
    args = (*tape.parts, whole, still(x), still(given), out)
    split(len(x), lambda start, stop: evaluate(*args, start, stop))
    return out


@dataclass(frozen=True, eq=False)
class Roots:
    """What Newton's method ended with, a row a problem."""

    found: Rows  # what the last tape makes of the root
    residual: Rows  # the greatest closure left, mm
    steps: NDArray[np.int32]
    turned: Rows  # below 0 where the root is on the other side of a singularity; see :func:`solve`


def solve(
    tapes: tuple[Tape, Tape, Tape, Tape], near: Rows, q: Rows, caps: Rows, size: float, most: int, side: Rows
) -> Roots:
    """Newton from ``near`` (1 or N rows) for every row of ``q``; see :func:`parakin.kernels.newton.newton`."""
    from .newton import newton

    count = len(q)
    result = Roots(np.empty((count, tapes[3].outputs)), np.empty(count), np.empty(count, np.int32), np.empty(count))
    programs = [(tape.code, tape.imm) for tape in tapes]
    args = (*programs, max(tape.registers for tape in tapes), still(near), still(q), caps, size, most, side)
    into = (result.found, result.residual, result.steps, result.turned)
    split(count, lambda start, stop: newton(*args, *into, start, stop))
    return result


def run_checked(tape: Tape, x: Rows, out: Rows, z: Rows) -> Rows:
    """As :func:`run` for a tape that gives ``out``'s columns and then closures: the greatest of these, (N,) mm."""
    from .blocks import evaluate_checked

    worst = np.empty(len(x))
    args = (*tape.parts, still(x), still(z), out, worst)
    split(len(x), lambda start, stop: evaluate_checked(*args, start, stop))
    return worst


def first_negative(tape: Tape, x: Rows, z: Rows) -> NDArray[np.int64]:
    """0 where every output of the tape is ≥ 0, else 1 + the index of the first that is negative or NaN."""
    from .blocks import first_broken

    out = np.empty(len(x), np.int64)
    args = (*tape.parts, still(x), still(z), out)
    split(len(x), lambda start, stop: first_broken(*args, start, stop))
    return out
