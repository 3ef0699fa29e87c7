"""Interval bisection: boxes of poses are halved until a claim is proved of each, within a budget."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...budget import Budget
from ...workspaces.certified.matrix_bounds import ROUNDING, MatrixBounds, prove_regular

AT_ONCE = 512  # boxes
FINEST = 1e-13  # smallest box as a fraction of the first: below this no digits are left

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


class Undecided(NamedTuple):
    """What bisection left undecided: the middle of one such box, (d,), and their fraction of the whole."""

    middle: Array
    fraction: float


def find_undecided_boxes(
    decide: Callable[[Array, Array], Decided], low: Array, high: Array, budget: Budget
) -> Undecided | None:
    """Bisect the box [low, high] until all of it is decided: None, else what is left."""
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
            fine = ((upper - lower) <= FINEST * first).all(1)
            if fine.any() or budget.is_spent():
                left = np.concatenate([upper - lower, top - bottom]) / first
                return Undecided(0.5 * (lower[0] + upper[0]), float(left.prod(1).sum()))
            lower, upper = bisect_inputs(lower, upper, axis)
            bottom, top = np.concatenate([bottom, lower]), np.concatenate([top, upper])
    return None


def decide_nonnegative(bounds: MatrixBounds, first: Array) -> Callable[[Array, Array], Decided]:
    """Make the function that decides, for boxes (N, d), that no entry is negative."""

    def decide(low: Array, high: Array) -> Decided:
        matrices = bounds(low, high)
        least = matrices.middle - (matrices.linear_change + matrices.rest) * (1.0 + ROUNDING)
        return np.asarray((least >= 0.0).all((1, 2))), find_widest_inputs(low, high, first)

    return decide


def decide_regular(bounds: MatrixBounds, first: Array) -> Callable[[Array, Array], Decided]:
    """Make the function that decides, for boxes (N, d), that all matrices in it are regular, tall ones of full rank."""

    def decide(low: Array, high: Array) -> Decided:
        regular = prove_regular(bounds(low, high))
        decided, axis = regular.sign != 0.0, find_widest_inputs(low, high, first)
        if len(first):
            axis[regular.inverted] = regular.spread[regular.inverted].argmax(1)
        return decided, axis

    return decide
