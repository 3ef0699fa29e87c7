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
from .kernel import find_kernel
from .newton import NewtonShape, write_newton
from .tape import NewtonTapes, Tape
from .tape_rows import write_closed_rows, write_first_negative, write_rows

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


def run_here(count: int, work: Callable[[int, int], None]) -> None:
    """Run ``work(start, stop)`` over all rows in the calling thread."""
    work(0, count)


def _list_arrays(x: Array, z: Array | None) -> tuple[list[Array], tuple[int, ...]]:
    """List the arrays of a tape's inputs that have columns, and how many."""
    arrays = [array for array in (x, z) if array is not None and array.shape[1]]
    return arrays, tuple(array.shape[1] for array in arrays)


def evaluate_tape(tape: Tape, x: Array, out: Array, z: Array | None = None, whole: bool = True) -> Array:
    """Evaluate a tape for rows of ``x`` (N, i), each followed by its row of ``z``, into ``out`` (N, o).

    With ``whole`` a row of the answer is NaN as soon as one number of it, or of its inputs, is not finite.
    """
    arrays, widths = _list_arrays(x, z)
    find_kernel(write_rows, tape, widths, whole).run(arrays, [out], run_in_threads)
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
    results = ClosedRows(rows, np.empty(len(x)), np.empty(len(x), np.bool_))
    arrays, widths = _list_arrays(x, z)
    kernel = find_kernel(write_closed_rows, tape, widths, rows.shape[1], limits.closures)
    kernel.run([*arrays, np.array([[limits.closed]])], results, run_in_threads)
    return results


def evaluate_tape_with_residual(tape: Tape, x: Array, out: Array, z: Array) -> Array:
    """Evaluate a tape that ends with closures, all else into ``out``; returns the greatest closure, (N,) mm."""
    return evaluate_closed_rows(tape, ClosureLimits(tape.outputs - out.shape[1], 0.0), x, z, out).residual


def find_first_negative(tape: Tape, x: Array, z: Array) -> Indices:
    """Find the first output that is negative or NaN, (N,): 1 + its index, 0 where every output is ≥ 0."""
    out = np.empty(len(x), np.int64)
    arrays, widths = _list_arrays(x, z)
    find_kernel(write_first_negative, tape, widths).run(arrays, [out], run_in_threads)
    return out


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
    count, answer = len(joints), near.shape[1]
    roots = Roots(
        np.empty((count, answer)),
        np.empty(count),
        np.empty(count, np.int32),
        np.empty(count),
        np.empty(count, np.bool_),
    )
    sides = "start" if not len(side) else "shared" if len(side) == 1 else "rows"
    shape = NewtonShape(
        len(limits.caps), joints.shape[1], answer, answer, "shared" if len(near) == 1 else "rows", sides
    )
    settling = limits.settling
    numbers = [limits.size, limits.most, limits.closed, settling.turned, settling.steady, settling.steps, *limits.caps]
    arrays = [near, joints, np.array([numbers], np.float64)] + ([] if sides == "start" else [side.reshape(-1, 1)])
    find_kernel(write_newton, tapes, shape).run(arrays, roots, run_in_threads)
    return roots
