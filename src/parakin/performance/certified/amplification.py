"""The greatest and the least velocity amplification over a box of poses, between two numbers, by branch and bound."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from ...arrays import Array, Indices, Progress
from ...budget import Budget
from ...kernels.small_matrices import compute_singular_values
from ..extremes import ExtremeSide
from ..indices import compute_performance
from ..search import pick_best_of_blocks, search_maxima_in_box
from .bisection import AT_ONCE, bisect_inputs, bound_inverse_error, find_widest_inputs, invert_middles
from .interval_matrices import LinearMatrices, MatrixBounds, PoseBox

_ROUNDING = 1e-12  # relative, of products and singular values of small matrices
_FINEST = 1e-13  # smallest box as a fraction of the first
_EXCEEDED = 20_000  # boxes for a bracket beyond its bound
_CORNERS = 6  # inputs up to which all corners are examined
_STARTS = 8
UNBOUNDED = 1e9  # an amplification beyond it, or below its reciprocal, is a singularity's


@dataclass(frozen=True, eq=False)
class Bracket:
    """The greatest velocity amplification psi over a box of poses (or the least one) is proved to lie in [low, high].

    ``pose`` (axes,) attains ``low`` of the greatest, ``high`` of the least. ``closed`` tells that the bracket is as
    narrow as wanted.
    """

    side: ExtremeSide
    low: float
    high: float
    pose: Array
    closed: bool

    @property
    def attained(self) -> float:
        """The value of psi at ``pose``."""
        return self.low if self.side == "greatest" else self.high


def bracket_amplification(
    box: PoseBox,
    side: ExtremeSide,
    tolerance: float,
    budget: Budget,
    bound: float,
    progress: Progress | None = None,
) -> Bracket:
    """Bracket one amplification by branch and bound until high ≤ low·(1 + tolerance), or until the budget is spent.

    Only a small part of the budget is spent once psi is known to exceed ``bound``.

    The least psi is the reciprocal of the greatest singular value of J⁻¹, so both are the greatest one of a matrix. J⁻¹
    is linear in the pose but for a remainder of second order, and so is J by Neumann's series; the greatest singular
    value is convex, so a linear matrix has it in a corner, and a remainder adds no more than its norm (Weyl).
    """
    search = _AmplificationSearch(box, side)
    search.climb()
    if search.best > bound if side == "greatest" else search.best * bound > 1.0:
        budget.boxes = min(budget.boxes, budget.used + _EXCEEDED)
    low, high = box.low[None], box.high[None]
    upper, axis = search.bound_boxes(low, high)
    top = -np.inf  # of what was decided
    closed = False
    while True:
        is_open = upper > search.best * (1.0 + tolerance)
        top = max(top, float(upper[~is_open].max(initial=-np.inf)))
        low, high, upper, axis = low[is_open], high[is_open], upper[is_open], axis[is_open]
        closed = not len(low)
        if closed or budget.is_spent() or search.best > UNBOUNDED:
            break
        order = np.argsort(-upper, kind="stable")
        now, later = order[:AT_ONCE], order[AT_ONCE:]
        if ((high[now[0]] - low[now[0]]) <= _FINEST * (box.high - box.low)).all():
            break
        if progress:
            progress(min(1.0, tolerance / max(float(upper[now[0]]) / search.best - 1.0, tolerance)))
        halves = bisect_inputs(low[now], high[now], axis[now])
        bounds, axes = search.bound_boxes(*halves)
        bounds = np.minimum(bounds, np.tile(upper[now], 2))
        low, high = (np.concatenate([ends[later], new]) for ends, new in zip((low, high), halves, strict=True))
        upper, axis = np.concatenate([upper[later], bounds]), np.concatenate([axis[later], axes])
        budget.used += len(bounds)
    top = max(top, float(upper.max(initial=-np.inf)), search.best)
    pose = box.poses(search.point[None])[0]
    if side == "greatest":
        return Bracket(side, search.best, top, pose, closed)
    return Bracket(side, 1.0 / top, 1.0 / search.best, pose, closed)


class _AmplificationSearch:
    """The greatest singular value of J, or of J⁻¹: bounds of it over boxes, and the greatest one found so far."""

    def __init__(self, box: PoseBox, side: ExtremeSide):
        self.box, self.side = box, side
        divisor, dividend = (box.a, box.b) if side == "greatest" else (box.b, box.a)
        self.divisor, self.dividend = (MatrixBounds(matrix, box.inputs, box.trace) for matrix in (divisor, dividend))
        self.best, self.point = -np.inf, 0.5 * (box.low + box.high)

    def bound_boxes(self, low: Array, high: Array) -> tuple[Array, Indices]:
        """Bound it over boxes from above, (N,); returns the input across which each box is best bisected too."""
        axis = find_widest_inputs(low, high, self.box.high - self.box.low)
        upper, corner = _bound_quotient(self.divisor(low, high), self.dividend(low, high), axis)
        middle = 0.5 * (low + high)
        leader = int(upper.argmax())
        toward = np.where(
            corner[leader] < 0.0, low[leader], np.where(corner[leader] > 0.0, high[leader], middle[leader])
        )
        self.try_points(np.concatenate([toward[None], middle[leader][None], middle[:: max(1, len(middle) // 8)]]))
        return upper, axis

    def evaluate(self, points: Array) -> Array:
        """Evaluate it at points (N, d); NaN out of reach."""
        performance = compute_performance(
            self.box.machine, self.box.poses(points), self.box.length.value, self.box.mode
        )
        with np.errstate(divide="ignore"):
            return performance.greatest if self.side == "greatest" else 1.0 / performance.least

    def climb(self) -> None:
        """Search for it from the best of some samples: boxes below a value known early need not be bisected."""
        points = self.box.samples
        values = self.evaluate(points)
        first = pick_best_of_blocks(points, values, _STARTS) if points.shape[1] else np.zeros(1, np.int64)
        self.try_points(points[first])
        if not points.shape[1] or not len(first):
            return
        self.try_points(search_maxima_in_box(self.evaluate, self.box.low, self.box.high, points[first], 1e-6)[0])

    def try_points(self, points: Array) -> None:
        """Keep the best of these points if it is better than all before."""
        values = self.evaluate(points)
        values = np.where(np.isnan(values), -np.inf, values)
        which = int(values.argmax())
        if values[which] > self.best:
            self.best, self.point = float(values[which]), points[which]


def _bound_quotient(divisor: LinearMatrices, dividend: LinearMatrices, axis: Indices) -> tuple[Array, Array]:
    """Bound the greatest singular value of M⁻¹N over boxes from above, (N,).

    Returns signs (N, d) of the corner where its linear part has it, too. The input that it changes most with goes to
    ``axis`` where it is known.

    With Y about the inverse of the middle M and G = Y·M - 1 of size g < 1, M⁻¹N = (1 + G)⁻¹·YN, that is YN - G·YN and
    a remainder no greater than g²/(1 - g)·|YN|.
    """
    count, d = divisor.half.shape
    upper, corner = np.full(count, np.inf), np.zeros((count, d))
    y, good = invert_middles(divisor)
    fine = dividend.bounded[good]
    y, good[good] = y[fine], fine
    given = divisor.take(good)
    m, n = given.multiply_left(y), dividend.take(good).multiply_left(y)
    off = bound_inverse_error(m, given, y) + m.rest
    n_size = np.abs(n.middle) + n.linear_change + n.rest
    g = _compute_norm(off + m.linear_change)
    spread = n.spread + m.spread @ np.abs(n.middle)[:, None]
    linear = LinearMatrices(n.middle, n.own, n.slopes - m.slopes @ n.middle[:, None], spread, n.half)
    rest = n.rest + off @ n_size + m.linear_change @ (n.linear_change + n.rest)
    beyond = np.where(g < 1.0, g * g / np.where(g < 1.0, 1.0 - g, 1.0), np.inf)
    most, corner[good] = _bound_linear_terms(linear)
    upper[good] = (most + _compute_norm(rest) + beyond * _compute_norm(n_size)) * (1.0 + _ROUNDING)
    if d:
        axis[good] = linear.widest
    return upper, corner


def _bound_linear_terms(matrices: LinearMatrices) -> tuple[Array, Array]:
    """Bound the greatest singular value of middle + Σ slopes·δ, by its corners; returns the corner's signs too.

    With many inputs it is bounded by the norm of the change, and the signs are 0: the middle.
    """
    n, d = matrices.half.shape
    if d > _CORNERS:
        return _compute_greatest(matrices.middle) + _compute_norm(matrices.linear_change), np.zeros((n, d))
    signs = np.array(list(product((-1.0, 1.0), repeat=d))).reshape(2**d, d)
    steps = matrices.slopes * matrices.half[:, :, None, None]
    corners = matrices.middle[:, None] + np.einsum("cd,ndij->ncij", signs, steps)
    sizes = _compute_greatest(corners)
    which = sizes.argmax(1)
    return np.asarray(sizes.max(1)), signs[which]


def _compute_greatest(matrices: Array) -> Array:
    """Compute the greatest singular values."""
    return np.asarray(compute_singular_values(matrices)[..., 0])


def _compute_norm(matrices: Array) -> Array:
    """Compute Frobenius' norm, no less than the greatest singular value."""
    return np.asarray(np.sqrt(np.square(matrices).sum((1, 2))))
