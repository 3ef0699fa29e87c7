"""Names of the types that every room shares, and the blocks in which long arrays are worked through."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]  # lengths in mm, angles in rad, unless a docstring says otherwise
Indices: TypeAlias = NDArray[np.int64]  # zero-based numbers of rows or columns
Flags: TypeAlias = NDArray[np.bool_]  # one truth a row
Progress: TypeAlias = Callable[[float], None]  # called now and then with the fraction done, 0 to 1
AxisRange: TypeAlias = tuple[float, float]  # of an axis: low and high, mm or rad
Writer: TypeAlias = Callable[[BinaryIO], None]  # writes a file's content


def find_finite_rows(rows: Array) -> Flags:
    """Tell which rows (n, k) hold finite numbers only, (n,), a column at a time: five times quicker than by rows."""
    finite = np.ones(len(rows), np.bool_)
    for column in rows.T:
        finite &= np.isfinite(column)
    return finite


def find_finite_matrices(*stacks: Array) -> Flags:
    """Tell of which matrices, all stacks (N, m, n) have one, every entry is finite, (N,)."""
    finite = np.ones(len(stacks[0]), np.bool_)
    for stack in stacks:
        finite &= np.isfinite(stack).all((1, 2))
    return finite


def make_lattice(lines: Sequence[Array | Sequence[float]]) -> Array:
    """Make all points (N, d) of a lattice from the values along its d axes; the last one changes first."""
    return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, len(lines))


def count_repeats(counts: Indices) -> Indices:
    """Count the repeats of each row from 0, as ``np.repeat`` by ``counts`` has them: 0 1 2, 0, 0 1 for 3, 1, 2."""
    return np.asarray(np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts))


def split_rows(count: int, size: int) -> Iterator[slice]:
    """Split rows into slices of at most ``size`` each."""
    for start in range(0, count, size):
        yield slice(start, start + size)
