"""Batches of rows through the kernels, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Flags, Indices
from .tape import NewtonTapes, Tape

FEW = 64  # rows for which no kernel of their own is compiled
SMALL = 4096  # rows below which a second thread costs more than it brings


def count_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _make_pool() -> ThreadPoolExecutor:
    """Make the threads of this process, one a core."""
    return ThreadPoolExecutor(count_cores(), thread_name_prefix="parakin")


if hasattr(os, "register_at_fork"):  # a forked child has the pool but none of its threads
    os.register_at_fork(after_in_child=_make_pool.cache_clear)


def freeze_rows(rows: Array) -> Array:
    """Return a read-only view; Numba compiles the kernels for read-only arrays alone."""
    view = rows.view()
    view.flags.writeable = False
    return view


def run_in_threads(count: int, work: Callable[[int, int], None], small: int = SMALL) -> None:
    """Run ``work(start, stop)`` over all rows, some in each thread; the kernels release the interpreter's lock.

    small : rows that are worth a thread
    """
    threads = min(count_cores(), count // small)
    if threads < 2:
        work(0, count)
        return
    edges = [count * i // threads for i in range(threads + 1)]
    for future in [_make_pool().submit(work, a, b) for a, b in pairwise(edges)]:
        future.result()


def evaluate_tape(tape: Tape, x: Array, out: Array, z: Array | None = None, whole: bool = True) -> Array:
    """Evaluate a tape for rows of ``x`` (N, i), each followed by its row of ``z``, into ``out`` (N, o).

    With ``whole`` a row of the answer is NaN as soon as one number of it, or of its inputs, is not finite.
    """
    from .blocks import evaluate_rows

    rest = np.empty((len(x), 0)) if z is None else z
    args = (tape, whole, freeze_rows(x), freeze_rows(rest), out)
    run_in_threads(len(x), lambda start, stop: evaluate_rows(*args, start, stop))
    return out


class ClosureLimits(NamedTuple):
    """How many of a tape's outputs, behind those of a row, are closures, and their greatest size where a leg closes."""

    closures: int
    closed: float  # mm


class ClosedRows(NamedTuple):
    """Rows of a tape that ends with closures and margins.

    rows : (N, k) its first outputs
    residual : (N,) the greatest closure, mm
    settled : (N,) where the residual is within its limit and all margins are positive
    """

    rows: Array
    residual: Array
    settled: Flags


def evaluate_closed_rows(tape: Tape, limits: ClosureLimits, x: Array, z: Array, rows: Array) -> ClosedRows:
    """Evaluate a tape of a row, closures and margins for rows of ``x`` and ``z``, the first into ``rows``."""
    from .blocks import evaluate_with_residual

    results = ClosedRows(rows, np.empty(len(x)), np.empty(len(x), np.bool_))
    args = (tape, limits, freeze_rows(x), freeze_rows(z), results)
    run_in_threads(len(x), lambda start, stop: evaluate_with_residual(*args, start, stop))
    return results


def evaluate_tape_with_residual(tape: Tape, x: Array, out: Array, z: Array) -> Array:
    """Evaluate a tape that ends with closures, all else into ``out``; returns the greatest closure, (N,) mm."""
    return evaluate_closed_rows(tape, ClosureLimits(tape.outputs - out.shape[1], 0.0), x, z, out).residual


def find_first_negative(tape: Tape, x: Array, z: Array) -> Indices:
    """Find the first output that is negative or NaN, (N,): 1 + its index, 0 where every output is ≥ 0."""
    if len(x) <= FEW:
        margins = evaluate_tape(tape, x, np.empty((len(x), tape.outputs)), z, whole=False)
        return _find_first_in_rows(margins, np.asarray(np.isfinite(x).all(1) & np.isfinite(z).all(1)))
    from .blocks import find_negative

    out = np.empty(len(x), np.int64)
    args = (tape, freeze_rows(x), freeze_rows(z), out)
    run_in_threads(len(x), lambda start, stop: find_negative(*args, start, stop))
    return out


def _find_first_in_rows(margins: Array, finite: Flags) -> Indices:
    """Find the first negative or NaN entry of each row as :func:`find_first_negative`; 1 where a row is not finite."""
    padded = np.column_stack([~(margins >= 0.0), np.ones(len(margins), np.bool_)])
    first: Indices = padded.argmax(1) + 1
    first[first > margins.shape[1]] = 0
    first[~finite & (first == 0)] = 1
    return first


class Settling(NamedTuple):
    """Bounds within which a root needs no second look, besides the last tape's margins, which are positive there.

    turned : what the product of the determinants exceeds
    steady : the greatest change of the determinant from the start's to the root's, relative to it
    steps : of Newton's method
    """

    turned: float = np.inf
    steady: float = np.inf
    steps: int = 0


NEVER = Settling()  # every root needs one


class NewtonSteps(NamedTuple):
    """Bounds of Newton's steps.

    caps : (m,) the greatest change of each coordinate in one step
    size : the legs' length, mm
    most : steps; zero only evaluates the start
    closed : mm, the greatest closure of a root
    """

    caps: Array
    size: float
    most: int
    closed: float
    settling: Settling


class Roots(NamedTuple):
    """The results of Newton's method, a row for each problem.

    rows : outputs of the last tape at the root
    residual : (N,) the greatest closure left, mm; NaN where the row is
    steps : (N,)
    turned : (N,) the determinant of the last factored matrix times that of the start, or times the side that was
        asked for; negative where the root is on the other side of a singularity
    settled : (N,) where a root is closed and needs no second look, by :class:`Settling`
    """

    rows: Array
    residual: Array
    steps: NDArray[np.int32]
    turned: Array
    settled: Flags


def solve_by_newton(tapes: NewtonTapes, limits: NewtonSteps, near: Array, joints: Array, side: Array) -> Roots:
    """Solve the closures by Newton's method from ``near`` (1 or N rows) for every row of joints.

    side : the sign of the determinant to end with, one a row or one for all; none for that of the start
    """
    from .newton import solve_newton

    count = len(joints)
    rows, settled = np.empty((count, near.shape[1])), np.empty(count, np.bool_)
    roots = Roots(rows, np.empty(count), np.empty(count, np.int32), np.empty(count), settled)
    args = (tapes, limits, freeze_rows(near), freeze_rows(joints), side, roots)
    run_in_threads(count, lambda start, stop: solve_newton(*args, start, stop))
    return roots
