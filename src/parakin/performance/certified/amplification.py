"""The greatest and the least amplification over a box of poses, between two numbers: branch and bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..extremes import Side
from ..indices import performance
from ..search import best_of_blocks, climb_within
from .bisection import AT_ONCE, Budget, halves, inverted, off_one, widest
from .interval_matrices import Box, Linear, Over

_ROUNDING = 1e-12
_FINEST = 1e-13  # of the first box
_EXCEEDED = 20_000  # boxes for a bracket beyond its bound
_CORNERS = 6  # inputs up to which all corners are looked at
_STARTS = 8
UNBOUNDED = 1e9  # an amplification beyond it, or below its reciprocal, is a singularity's


@dataclass(frozen=True, eq=False)
class Bracket:
    """The greatest velocity amplification psi over a box of poses (or the least one) is proved to lie in [low, high].

    ``pose`` (axes,) attains ``low`` of the greatest, ``high`` of the least. ``closed`` tells that the bracket is as
    narrow as was asked for.
    """

    side: Side
    low: float
    high: float
    pose: Array
    closed: bool

    @property
    def found(self) -> float:
        """What psi is at ``pose``."""
        return self.low if self.side == "greatest" else self.high


def bracket(
    box: Box,
    side: Side,
    tolerance: float,
    budget: Budget,
    bound: float,
    progress: Callable[[float], None] | None = None,
) -> Bracket:
    """Refine until high ≤ low·(1 + tolerance), or until the budget is spent: a small part of it, once psi is known to
    exceed ``bound``.

    The least psi is the reciprocal of the greatest singular value of J⁻¹, so both are the greatest one of a matrix. J⁻¹
    is linear in the pose but for a rest of second order, and so is J by Neumann's series; the greatest singular value
    is convex, so a linear matrix has it in a corner, and a rest adds no more than its norm (Weyl).
    """
    search = _Search(box, side)
    search.climb()
    if search.best > bound if side == "greatest" else search.best * bound > 1.0:
        budget.boxes = min(budget.boxes, budget.used + _EXCEEDED)
    low, high = box.low[None], box.high[None]
    upper, axis = search.examined(low, high)
    top = -np.inf  # of what was laid aside
    closed = False
    while True:
        open_ = upper > search.best * (1.0 + tolerance)
        top = max(top, float(upper[~open_].max(initial=-np.inf)))
        low, high, upper, axis = low[open_], high[open_], upper[open_], axis[open_]
        closed = not len(low)
        if closed or budget.spent() or search.best > UNBOUNDED:
            break
        order = np.argsort(-upper, kind="stable")
        now, later = order[:AT_ONCE], order[AT_ONCE:]
        if ((high[now[0]] - low[now[0]]) <= _FINEST * (box.high - box.low)).all():
            break
        if progress:
            progress(min(1.0, tolerance / max(float(upper[now[0]]) / search.best - 1.0, tolerance)))
        cut = halves(low[now], high[now], axis[now])
        bounds, axes = search.examined(*cut)
        bounds = np.minimum(bounds, np.tile(upper[now], 2))
        low, high = (np.concatenate([ends[later], new]) for ends, new in zip((low, high), cut, strict=True))
        upper, axis = np.concatenate([upper[later], bounds]), np.concatenate([axis[later], axes])
        budget.used += len(bounds)
    top = max(top, float(upper.max(initial=-np.inf)), search.best)
    pose = box.poses(search.place[None])[0]
    if side == "greatest":
        return Bracket(side, search.best, top, pose, closed)
    return Bracket(side, 1.0 / top, 1.0 / search.best, pose, closed)


class _Search:
    """The greatest singular value of J, or of J⁻¹: bounds of it over boxes, and the greatest one met so far."""

    def __init__(self, box: Box, side: Side):
        self.box, self.side = box, side
        divisor, dividend = (box.a, box.b) if side == "greatest" else (box.b, box.a)
        self.divisor, self.dividend = (Over(matrix, box.inputs, box.trace) for matrix in (divisor, dividend))
        self.best, self.place = -np.inf, 0.5 * (box.low + box.high)

    def examined(self, low: Array, high: Array) -> tuple[Array, NDArray[np.int64]]:
        """Upper bounds (N,), and the input along which each box is best cut."""
        axis = widest(low, high, self.box.high - self.box.low)
        upper, toward = _of_quotient(self.divisor(low, high), self.dividend(low, high), axis)
        middle = 0.5 * (low + high)
        leader = int(upper.argmax())
        tried = np.where(
            toward[leader] < 0.0, low[leader], np.where(toward[leader] > 0.0, high[leader], middle[leader])
        )
        self.tried(np.concatenate([tried[None], middle[leader][None], middle[:: max(1, len(middle) // 8)]]))
        return upper, axis

    def value(self, points: Array) -> Array:
        """The greatest singular value at points (N, d); NaN out of reach."""
        found = performance(self.box.machine, self.box.poses(points), self.box.length.value, self.box.mode)
        with np.errstate(divide="ignore"):
            return found.greatest if self.side == "greatest" else 1.0 / found.least

    def climb(self) -> None:
        """Search for it from the best of some points: what is known early need not be looked at."""
        points = self.box.samples
        values = self.value(points)
        first = best_of_blocks(points, values, _STARTS) if points.shape[1] else np.zeros(1, np.int64)
        self.tried(points[first])
        if not points.shape[1] or not len(first):
            return
        self.tried(climb_within(self.value, self.box.low, self.box.high, points[first], 1e-6)[0])

    def tried(self, points: Array) -> None:
        values = self.value(points)
        values = np.where(np.isnan(values), -np.inf, values)
        which = int(values.argmax())
        if values[which] > self.best:
            self.best, self.place = float(values[which]), points[which]


def _of_quotient(divisor: Linear, dividend: Linear, axis: NDArray[np.int64]) -> tuple[Array, Array]:
    """Of M⁻¹N over boxes: upper bounds (N,) of the greatest singular value, and signs (N, d) of the corner where its
    linear part has it. The input that it changes most with goes to ``axis`` where it is known.

    With Y about the inverse of the middle M and G = Y·M - 1 of size g < 1, M⁻¹N = (1 + G)⁻¹·YN, that is YN - G·YN and
    what is no greater than g²/(1 - g)·|YN|.
    """
    count, d = divisor.half.shape
    upper, toward = np.full(count, np.inf), np.zeros((count, d))
    y, good = inverted(divisor)
    fine = dividend.bounded[good]
    y, good[good] = y[fine], fine
    given = divisor.take(good)
    m, n = given.times(y), dividend.take(good).times(y)
    off = off_one(m, given, y) + m.rest
    n_size = np.abs(n.middle) + n.turned + n.rest
    g = _size(off + m.turned)
    spread = n.spread + m.spread @ np.abs(n.middle)[:, None]
    linear = Linear(n.middle, n.own, n.slopes - m.slopes @ n.middle[:, None], spread, n.half)
    rest = n.rest + off @ n_size + m.turned @ (n.turned + n.rest)
    beyond = np.where(g < 1.0, g * g / np.where(g < 1.0, 1.0 - g, 1.0), np.inf)
    most, toward[good] = _linear(linear)
    upper[good] = (most + _size(rest) + beyond * _size(n_size)) * (1.0 + _ROUNDING)
    if d:
        axis[good] = linear.widest
    return upper, toward


def _linear(found: Linear) -> tuple[Array, Array]:
    """The greatest singular value of middle + Σ slopes·δ, or a bound of it, and the corner's signs (0: the middle)."""
    n, d = found.half.shape
    if d > _CORNERS:
        return _greatest(found.middle) + _size(found.turned), np.zeros((n, d))
    signs = np.array(list(product((-1.0, 1.0), repeat=d))).reshape(2**d, d)
    steps = found.slopes * found.half[:, :, None, None]
    corners = found.middle[:, None] + np.einsum("cd,ndij->ncij", signs, steps)
    sizes = _greatest(corners)
    which = sizes.argmax(1)
    return np.asarray(sizes.max(1)), signs[which]


def _greatest(matrices: Array) -> Array:
    return np.asarray(np.linalg.svd(matrices, compute_uv=False)[..., 0])


def _size(matrices: Array) -> Array:
    """Frobenius' norm, no less than the greatest singular value."""
    return np.asarray(np.sqrt(np.square(matrices).sum((1, 2))))
