"""Linear bounds of matrices of terms over boxes, by the mean value theorem, and their regularity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import NamedTuple

import numpy as np

from ...algebra import Scalar, Term, Trace, derivative
from ...arrays import Array, Flags, Indices
from ...kernels.intervals import IntervalProgram
from ...kinematics.tall_matrices import compute_determinants, invert_from_left

Matrix = Sequence[Sequence[Scalar]]

ROUNDING = 1e-12  # relative, of products and singular values of small matrices


@dataclass(frozen=True, eq=False)
class LinearMatrices:
    """Matrices over N boxes: ``middle`` + Σ (``slopes`` ± ``spread``)·δ ± ``own``, entry by entry, for |δ| ≤ ``half``.

    middle, own (N, n, m); slopes, spread (N, d, n, m); half (N, d). An entry without bounds is infinite or NaN.
    """

    middle: Array
    own: Array
    slopes: Array
    spread: Array
    half: Array

    def take(self, which: Flags | Indices) -> LinearMatrices:
        """Keep some of the boxes."""
        columns = (self.middle, self.own, self.slopes, self.spread, self.half)
        return LinearMatrices(*(column[which] for column in columns))

    @cached_property
    def bounded(self) -> Flags:
        """(N,) where everything is finite."""
        ends = np.isfinite(self.middle).all((1, 2)) & np.isfinite(self.own).all((1, 2))
        return np.asarray(ends & np.isfinite(self.slopes).all((1, 2, 3)) & np.isfinite(self.spread).all((1, 2, 3)))

    def multiply_left(self, left: Array) -> LinearMatrices:
        """Multiply by matrices (N, k, n) from the left."""
        size = np.abs(left)
        spread = size[:, None] @ self.spread
        return LinearMatrices(left @ self.middle, size @ self.own, left[:, None] @ self.slopes, spread, self.half)

    @cached_property
    def linear_change(self) -> Array:
        """By how much the linear part changes at most, (N, n, m)."""
        return np.asarray(np.einsum("nd,ndij->nij", self.half, np.abs(self.slopes)))

    @cached_property
    def rest(self) -> Array:
        """How far the matrices are from the linear part at most, (N, n, m)."""
        return np.asarray(self.own + np.einsum("nd,ndij->nij", self.half, self.spread))

    @property
    def changes(self) -> Array:
        """How far each input changes the matrix, (N, d)."""
        sizes = (np.sqrt(np.square(changes).sum((2, 3))) for changes in (self.slopes, self.spread))
        return np.asarray(self.half * sum(sizes))

    @property
    def widest(self) -> Indices:
        """The input that changes the matrix most, (N,)."""
        return np.asarray(self.changes.argmax(1))


@dataclass(frozen=True, eq=False)
class MatrixBounds:
    """A matrix of terms, to be bounded over boxes of their inputs by the mean value theorem."""

    matrix: Matrix
    inputs: Sequence[Term]
    trace: Trace

    @cached_property
    def _programs(self) -> tuple[IntervalProgram, IntervalProgram]:
        entries = [x for row in self.matrix for x in row]
        slopes = [derivative(x, term) for term in self.inputs for x in entries]
        return IntervalProgram(self.trace, entries), IntervalProgram(self.trace, slopes)

    def __call__(self, low: Array, high: Array) -> LinearMatrices:
        """Bound it over boxes [low, high], (N, d)."""
        count, d = low.shape
        shape = len(self.matrix), len(self.matrix[0])
        at, over = self._programs
        middle = 0.5 * (low + high)
        half = np.maximum(middle - low, high - middle)
        entries = _compute_middles(*(end.reshape(count, *shape) for end in at(middle, middle)))
        slopes = _compute_middles(*(end.reshape(count, d, *shape) for end in over(low, high)))
        return LinearMatrices(*entries, *slopes, half)


def _compute_middles(down: Array, up: Array) -> tuple[Array, Array]:
    """Compute middles and radii of intervals, radii rounded up."""
    with np.errstate(invalid="ignore", over="ignore"):
        middle = 0.5 * down + 0.5 * up
        return middle, np.maximum(up - middle, middle - down) * (1.0 + 1e-15)


def invert_middles(matrices: LinearMatrices, dividend: LinearMatrices | None = None) -> tuple[Array, Flags]:
    """Invert the bounded, regular middles; returns the inverses, and which these are.

    Of a tall middle M the inverse Y is one from the left, Y·M = 1: the pseudo-inverse, or with a ``dividend`` N that
    for which Y·N is least, of a square N the pseudo-inverse of N⁻¹M.
    """
    good = matrices.bounded
    if dividend is not None and _is_tall(matrices):
        good = good & dividend.bounded
    with np.errstate(all="ignore"):
        size = np.abs(compute_determinants(np.where(good[:, None, None], matrices.middle, 0.0)))
    good = good & (size > 0.0) & np.isfinite(size)
    middle = matrices.middle[good]
    if not _is_tall(matrices):
        inverse = np.linalg.inv(middle)
    elif dividend is None:
        inverse = np.linalg.pinv(middle)
    else:
        inverse = invert_from_left(middle, dividend.middle[good])
    fine = np.isfinite(inverse).all((1, 2))
    good[np.flatnonzero(good)[~fine]] = False
    return inverse[fine], good


def _is_tall(matrices: LinearMatrices) -> bool:
    """Tell whether there are more rows than columns."""
    return bool(matrices.middle.shape[1] > matrices.middle.shape[2])


def bound_inverse_error(product: LinearMatrices, given: LinearMatrices, inverse: Array) -> Array:
    """Bound the error of the computed inverse, entry by entry: how far middle × inverse may be from the identity."""
    n = product.middle.shape[1]
    return np.asarray(np.abs(product.middle - np.eye(n)) + ROUNDING * (np.abs(inverse) @ np.abs(given.middle)))


class RegularMatrices(NamedTuple):
    """What is known of N interval matrices.

    sign : (N,) of all determinants in it, zero where it is not known; 1 of tall matrices that are of full rank
    inverted : (N,) whose middle has an inverse
    spread : (N, d) how far each input changes the matrices, preconditioned where that is possible
    """

    sign: Array
    inverted: Flags
    spread: Array


def prove_regular(matrices: LinearMatrices) -> RegularMatrices:
    """Prove that all matrices over boxes are regular.

    They are if 1 - Y·A has a spectral radius below 1 for all A there, with Y about the inverse of the middle one. Then
    det Y·A is positive, and Y has the sign of them all.
    """
    sign = np.zeros(len(matrices.middle))
    inverse, good = invert_middles(matrices)
    given = matrices.take(good)
    scaled = given.multiply_left(inverse)
    off = bound_inverse_error(scaled, given, inverse)
    regular = _bound_spectral_radius(off + scaled.linear_change + scaled.rest) < 1.0 - ROUNDING
    sides = np.ones(len(inverse)) if _is_tall(matrices) else np.linalg.slogdet(inverse)[0]
    sign[good] = np.where(regular, sides, 0.0)
    spread = matrices.half.copy()
    spread[good] = scaled.changes
    return RegularMatrices(sign, good, spread)


def _bound_spectral_radius(matrices: Array) -> Array:
    """Bound the spectral radius of matrices (N, n, n) without negative entries, by Collatz and Wielandt."""
    best = np.full(len(matrices), inf)
    vector = np.ones(matrices.shape[:2])
    for _ in range(3):
        image = np.einsum("nij,nj->ni", matrices, vector) + 1e-300
        with np.errstate(over="ignore"):
            best = np.minimum(best, (image / vector).max(1))
        vector = image / image.max(1, keepdims=True) + 1e-6
    return best
