"""Interval bisection: boxes of poses are halved until a claim is proved of each, within a budget."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np

from ...arrays import Array, Flags, Indices
from ...budget import Budget
from ...kinematics.tall_matrices import compute_determinants
from .interval_matrices import LinearMatrices, MatrixBounds

AT_ONCE = 512  # boxes
_FINEST = 1e-13  # smallest box as a fraction of the first: below this no digits are left
_ROUNDING = 1e-12  # relative, of products and singular values of small matrices

Decided = tuple[Flags, Indices]  # which boxes are decided, and across which input to bisect the others


def bisect_inputs(low: Array, high: Array, axis: Indices) -> tuple[Array, Array]:
    """Bisect every box (N, d) across one of its inputs, the first halves before the second ones."""
    row = np.arange(len(low))
    middle = 0.5 * (low[row, axis] + high[row, axis])
    below, above = high.copy(), low.copy()
    below[row, axis] = above[row, axis] = middle
    return np.concatenate([low, above]), np.concatenate([below, high])


def find_widest_inputs(low: Array, high: Array, first: Array) -> Indices:
    """Find the input along which each box is widest, relative to the ``first`` box's widths (d,)."""
    if not len(first):
        return np.zeros(len(low), np.int64)
    return np.asarray(((high - low) / first).argmax(1))


def find_undecided_box(
    decide: Callable[[Array, Array], Decided], low: Array, high: Array, budget: Budget
) -> Array | None:
    """Bisect the box [low, high] until all of it is decided: None, else the middle of a box left undecided."""
    first = high - low
    bottom, top = low[None], high[None]
    while len(bottom):
        now = slice(max(0, len(bottom) - AT_ONCE), None)  # the last ones first: little is kept
        lower, upper = bottom[now], top[now]
        budget.used += len(lower)
        decided, axis = decide(lower, upper)
        lower, upper, axis = lower[~decided], upper[~decided], axis[~decided]
        bottom, top = bottom[: now.start], top[: now.start]
        if len(lower):
            fine = ((upper - lower) <= _FINEST * first).all(1)
            if fine.any() or budget.is_spent():
                return np.asarray(0.5 * (lower[0] + upper[0]))
            lower, upper = bisect_inputs(lower, upper, axis)
            bottom, top = np.concatenate([bottom, lower]), np.concatenate([top, upper])
    return None


def decide_nonnegative(bounds: MatrixBounds, first: Array) -> Callable[[Array, Array], Decided]:
    """Make the function that decides, for boxes (N, d), that no entry is negative."""

    def decide(low: Array, high: Array) -> Decided:
        matrices = bounds(low, high)
        least = matrices.middle - (matrices.linear_change + matrices.rest) * (1.0 + _ROUNDING)
        return np.asarray((least >= 0.0).all((1, 2))), find_widest_inputs(low, high, first)

    return decide


def decide_regular(bounds: MatrixBounds, first: Array) -> Callable[[Array, Array], Decided]:
    """Make the function that decides, for boxes (N, d), that all matrices in it are regular, tall ones of full rank.

    They are if 1 - Y·A has a spectral radius below 1 for all A there, with Y about the inverse of the middle one.
    """

    def decide(low: Array, high: Array) -> Decided:
        matrices = bounds(low, high)
        decided, axis = np.zeros(len(low), np.bool_), find_widest_inputs(low, high, first)
        inverse, good = invert_middles(matrices)
        scaled = matrices.take(good).multiply_left(inverse)
        off = bound_inverse_error(scaled, matrices.take(good), inverse)
        decided[good] = _bound_spectral_radius(off + scaled.linear_change + scaled.rest) < 1.0 - _ROUNDING
        if len(first):
            axis[good] = scaled.widest
        return decided, axis

    return decide


def invert_middles(matrices: LinearMatrices, dividend: LinearMatrices | None = None) -> tuple[Array, Flags]:
    """Invert the bounded, regular middles; returns the inverses, and which these are.

    Of a tall middle M the inverse Y is one from the left, Y·M = 1: the pseudo-inverse, or with a square ``dividend`` N
    that for which Y·N is the pseudo-inverse of N⁻¹M.
    """
    good = matrices.bounded
    if dividend is not None and _is_tall(matrices):
        good = good & dividend.bounded
        good[good] = compute_determinants(dividend.middle[good]) != 0.0
    with np.errstate(all="ignore"):
        size = np.abs(compute_determinants(np.where(good[:, None, None], matrices.middle, 0.0)))
    good = good & (size > 0.0) & np.isfinite(size)
    middle = matrices.middle[good]
    if not _is_tall(matrices):
        inverse = np.linalg.inv(middle)
    elif dividend is None:
        inverse = np.linalg.pinv(middle)
    else:
        back = np.linalg.inv(dividend.middle[good])
        inverse = np.linalg.pinv(back @ middle) @ back
    fine = np.isfinite(inverse).all((1, 2))
    good[np.flatnonzero(good)[~fine]] = False
    return inverse[fine], good


def _is_tall(matrices: LinearMatrices) -> bool:
    """Tell whether there are more rows than columns."""
    return bool(matrices.middle.shape[1] > matrices.middle.shape[2])


def bound_inverse_error(product: LinearMatrices, given: LinearMatrices, inverse: Array) -> Array:
    """Bound the error of the computed inverse, entry by entry: how far middle × inverse may be from the identity."""
    n = product.middle.shape[1]
    return np.asarray(np.abs(product.middle - np.eye(n)) + _ROUNDING * (np.abs(inverse) @ np.abs(given.middle)))


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
