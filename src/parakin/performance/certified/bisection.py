"""Boxes of poses cut in halves until something is proved of every one of them, within a budget of boxes and time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from .interval_matrices import Linear, Over

AT_ONCE = 512
_FINEST = 1e-13  # of the first box: below this the numbers have no digits left
_ROUNDING = 1e-12  # relative, of products and singular values of small matrices

Decided = tuple[NDArray[np.bool_], NDArray[np.int64]]  # which boxes are, and along which input to cut the others


@dataclass
class Budget:
    """How many boxes and how long; ``used`` counts on over all that is proved with it."""

    boxes: int
    seconds: float | None
    used: int = 0
    _began: float = field(default_factory=time.monotonic)

    def spent(self) -> bool:
        late = inf if self.seconds is None else self._began + self.seconds
        return self.used >= self.boxes or time.monotonic() > late


def halves(low: Array, high: Array, axis: NDArray[np.int64]) -> tuple[Array, Array]:
    """Every box (N, d) cut across one of its inputs, the first halves before the second ones."""
    row = np.arange(len(low))
    middle = 0.5 * (low[row, axis] + high[row, axis])
    below, above = high.copy(), low.copy()
    below[row, axis] = above[row, axis] = middle
    return np.concatenate([low, above]), np.concatenate([below, high])


def widest(low: Array, high: Array, first: Array) -> NDArray[np.int64]:
    """The input along which a box is widest, as a share of the ``first`` one's widths (d,)."""
    if not len(first):
        return np.zeros(len(low), np.int64)
    return np.asarray(((high - low) / first).argmax(1))


def left_over(decide: Callable[[Array, Array], Decided], low: Array, high: Array, budget: Budget) -> Array | None:
    """None where ``decide`` is true all over the box [low, high]; else the middle of a part that it left open."""
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
            if fine.any() or budget.spent():
                return np.asarray(0.5 * (lower[0] + upper[0]))
            halved = halves(lower, upper, axis)
            bottom, top = np.concatenate([bottom, halved[0]]), np.concatenate([top, halved[1]])
    return None


def nowhere_negative(over: Over, first: Array) -> Callable[[Array, Array], Decided]:
    """What decides that no entry is negative in a box."""

    def decide(low: Array, high: Array) -> Decided:
        found = over(low, high)
        least = found.middle - (found.turned + found.rest) * (1.0 + _ROUNDING)
        return np.asarray((least >= 0.0).all((1, 2))), widest(low, high, first)

    return decide


def regular(over: Over, first: Array) -> Callable[[Array, Array], Decided]:
    """What decides that all matrices in a box are regular: with Y about the inverse of the middle one, 1 - Y·A has a
    spectral radius below 1 for all A there."""

    def decide(low: Array, high: Array) -> Decided:
        found = over(low, high)
        decided, axis = np.zeros(len(low), np.bool_), widest(low, high, first)
        inverse, good = inverted(found)
        part = found.take(good).times(inverse)
        decided[good] = _radius(off_one(part, found.take(good), inverse) + part.turned + part.rest) < 1.0 - _ROUNDING
        if len(first):
            axis[good] = part.widest
        return decided, axis

    return decide


def inverted(found: Linear) -> tuple[Array, NDArray[np.bool_]]:
    """The inverses of the bounded, regular middles among them, and which these are."""
    good = found.bounded
    with np.errstate(all="ignore"):
        size = np.abs(np.linalg.det(np.where(good[:, None, None], found.middle, 0.0)))
    good = good & (size > 0.0) & np.isfinite(size)
    inverse = np.linalg.inv(found.middle[good])
    fine = np.isfinite(inverse).all((1, 2))
    good[np.flatnonzero(good)[~fine]] = False
    return inverse[fine], good


def off_one(product: Linear, given: Linear, inverse: Array) -> Array:
    """How far the product of the middle with its computed inverse may be from 1, entry by entry."""
    n = inverse.shape[1]
    return np.asarray(np.abs(product.middle - np.eye(n)) + _ROUNDING * (np.abs(inverse) @ np.abs(given.middle)))


def _radius(matrices: Array) -> Array:
    """An upper bound of the spectral radius of matrices (N, n, n) without negative entries."""
    best = np.full(len(matrices), inf)
    vector = np.ones(matrices.shape[:2])
    for _ in range(3):
        image = np.einsum("nij,nj->ni", matrices, vector) + 1e-300
        with np.errstate(over="ignore"):
            best = np.minimum(best, (image / vector).max(1))
        vector = image / image.max(1, keepdims=True) + 1e-6
    return best
