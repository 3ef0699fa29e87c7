"""The greatest norm of M⁻¹N over a box of poses, or the greatest product of two such norms, by branch and bound.

M⁻¹N is linear in the pose but for a remainder of second order, by Neumann's series. A norm is convex, so a linear
matrix has its greatest one in a corner, and a remainder adds no more than its own norm (Weyl). A product of two is no
greater than the square of their mean, once they are scaled alike, and that is convex too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from ...arrays import Array, Indices, Progress
from ...budget import Budget
from ...kernels.small_matrices import compute_singular_values
from ...workspaces.certified.matrix_bounds import (
    ROUNDING,
    LinearMatrices,
    Matrix,
    MatrixBounds,
    bound_inverse_error,
    invert_middles,
)
from ..quotients import compute_quotients
from ..search import pick_best_of_blocks, search_maxima_in_box
from .bisection import AT_ONCE, FINEST, bisect_inputs, find_widest_inputs
from .interval_matrices import PoseBox

Norm = Literal["spectral", "frobenius"]

_CORNERS = 6  # inputs up to which all corners are examined
_STARTS = 8
_EXCEEDED = 20_000  # boxes for a bracket beyond its bound
UNBOUNDED = 1e9  # what is greater is a singularity's


class Quotient(NamedTuple):
    """M⁻¹N, or its first ``rows`` rows, whose norm is sought."""

    divisor: Matrix
    dividend: Matrix
    norm: Norm = "spectral"
    rows: int | None = None


class NormBracket(NamedTuple):
    """The greatest value over a box is proved to lie in [low, high]; ``point`` (d,) attains ``low``.

    ``closed`` tells that the bracket is as narrow as wanted.
    """

    low: float
    high: float
    point: Array
    closed: bool


@dataclass(eq=False)
class NormSearch:
    """The greatest product of some quotients' norms over a box: bounds of it over parts, and the greatest one known.

    evaluate : computes it at points (N, d); NaN out of reach
    """

    box: PoseBox
    quotients: Sequence[Quotient]
    evaluate: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        self._bounds = [
            tuple(MatrixBounds(matrix, self.box.inputs, self.box.trace) for matrix in quotient[:2])
            for quotient in self.quotients
        ]
        self.best, self.point = -np.inf, 0.5 * (self.box.low + self.box.high)

    def bracket(
        self, tolerance: float, budget: Budget, bound: float, progress: Progress | None = None, enough: float = 0.0
    ) -> NormBracket:
        """Bracket it until high ≤ low·(1 + tolerance), or high ≤ ``enough``, or until the budget is spent.

        Only a small part of the budget is spent once it is known to exceed ``bound``.
        """
        self._climb()
        if self.best > bound:
            budget.boxes = min(budget.boxes, budget.used + _EXCEEDED)
        low, high = self.box.low[None], self.box.high[None]
        upper, axis = self._bound_boxes(low, high)
        top = -np.inf  # of what was decided
        closed = False
        while True:
            is_open = upper > max(self.best * (1.0 + tolerance), enough)
            top = max(top, float(upper[~is_open].max(initial=-np.inf)))
            low, high, upper, axis = low[is_open], high[is_open], upper[is_open], axis[is_open]
            closed = not len(low)
            if closed or budget.is_spent() or self.best > UNBOUNDED:
                break
            order = np.argsort(-upper, kind="stable")
            now, later = order[:AT_ONCE], order[AT_ONCE:]
            if ((high[now[0]] - low[now[0]]) <= FINEST * self.box.widths).all():
                break
            if progress:
                progress(min(1.0, tolerance / max(float(upper[now[0]]) / self.best - 1.0, tolerance)))
            halves = bisect_inputs(low[now], high[now], axis[now])
            bounds, axes = self._bound_boxes(*halves)
            bounds = np.minimum(bounds, np.tile(upper[now], 2))
            low, high = (np.concatenate([ends[later], new]) for ends, new in zip((low, high), halves, strict=True))
            upper, axis = np.concatenate([upper[later], bounds]), np.concatenate([axis[later], axes])
            budget.used += len(bounds)
        top = max(top, float(upper.max(initial=-np.inf)), self.best)
        return NormBracket(self.best, top, self.point, closed)

    def _bound_boxes(self, low: Array, high: Array) -> tuple[Array, Indices]:
        """Bound it over boxes from above, (N,); returns the input across which each box is best bisected too."""
        axis = find_widest_inputs(low, high, self.box.widths)
        sizes = [
            _bound_quotient(quotient, divisor(low, high), dividend(low, high), axis)
            for quotient, (divisor, dividend) in zip(self.quotients, self._bounds, strict=True)
        ]
        upper, corner = _bound_product(sizes)
        middle = 0.5 * (low + high)
        leader = int(upper.argmax())
        ends, side = (low[leader], high[leader]), corner[leader]
        toward = np.where(side < 0.0, ends[0], np.where(side > 0.0, ends[1], middle[leader]))
        self._try_points(np.concatenate([toward[None], middle[leader][None], middle[:: max(1, len(middle) // 8)]]))
        return upper, axis

    def _evaluate(self, points: Array) -> Array:
        if self.evaluate is not None:
            return self.evaluate(points)
        values: Array = np.ones(len(points))
        for quotient, (divisor, dividend) in zip(self.quotients, self._bounds, strict=True):
            matrices = compute_quotients(divisor(points, points).middle, dividend(points, points).middle)
            values = values * _compute_norms(matrices[:, : quotient.rows], quotient.norm)
        return np.where(np.isnan(values), np.nan, values)

    def _climb(self) -> None:
        """Search for it from the best of some samples: boxes below a value known early need not be bisected."""
        points = self.box.samples
        values = self._evaluate(points)
        first = pick_best_of_blocks(points, values, _STARTS) if points.shape[1] else np.zeros(1, np.int64)
        self._try_points(points[first])
        d = self.box.searched
        if not d or not len(first):
            return

        def extend(inner: Array) -> Array:
            return np.hstack([inner, np.broadcast_to(points[0, d:], (len(inner), points.shape[1] - d))])

        low, high = self.box.low[:d], self.box.high[:d]
        best, _ = search_maxima_in_box(lambda inner: self._evaluate(extend(inner)), low, high, points[first, :d], 1e-6)
        self._try_points(extend(best))

    def _try_points(self, points: Array) -> None:
        """Keep the best of these points if it is better than all before."""
        values = self._evaluate(points)
        values = np.where(np.isnan(values), -np.inf, values)
        which = int(values.argmax())
        if values[which] > self.best:
            self.best, self.point = float(values[which]), points[which]


class _CornerSizes(NamedTuple):
    """Bounds of a norm over N boxes: no more than a convex function with these values in the corners.

    sizes : (N, corners) infinite where there is no bound
    signs : (corners, d) of the corners; zero where the middle stands for all
    """

    sizes: Array
    signs: Array


def _bound_product(factors: Sequence[_CornerSizes]) -> tuple[Array, Array]:
    """Bound a product over boxes, (N,); returns the signs (N, d) of the corner where its bound is greatest too."""
    sizes = factors[0].sizes
    for factor in factors[1:]:
        with np.errstate(all="ignore"):
            scale = np.sqrt(sizes.mean(1) / factor.sizes.mean(1))[:, None]
            sizes = (0.5 * (sizes / scale + factor.sizes * scale)) ** 2
        sizes = np.where(np.isfinite(sizes), sizes, np.inf)
    which = sizes.argmax(1)
    return np.asarray(sizes.max(1) * (1.0 + ROUNDING)), factors[0].signs[which]


def _bound_quotient(
    quotient: Quotient, divisor: LinearMatrices, dividend: LinearMatrices, axis: Indices
) -> _CornerSizes:
    """Bound the norm of M⁻¹N over boxes from above, by its corners.

    The input that it changes most with goes to ``axis`` where it is known.

    With Y about the inverse of the middle M and G = Y·M - 1 of size g < 1, M⁻¹N = (1 + G)⁻¹·YN, that is YN - G·YN and
    a remainder no greater than g²/(1 - g)·|YN|.

    Where M is tall, M⁻¹N is the pseudo-inverse of N⁻¹M. (1 + G)⁻¹·YN is an inverse of that from the left, so its size
    is no less, and in the middle it is the pseudo-inverse itself.
    """
    count, d = divisor.half.shape
    signs = np.array(list(product((-1.0, 1.0), repeat=d))).reshape(2**d, d) if d <= _CORNERS else np.zeros((1, d))
    sizes = np.full((count, len(signs)), np.inf)
    y, good = invert_middles(divisor, dividend)
    fine = dividend.bounded[good]
    y, good[good] = y[fine], fine
    given = divisor.take(good)
    m, n = given.multiply_left(y), dividend.take(good).multiply_left(y)
    off = bound_inverse_error(m, given, y) + m.rest
    n_size = np.abs(n.middle) + n.linear_change + n.rest
    g = _compute_frobenius(off + m.linear_change)
    spread = n.spread + m.spread @ np.abs(n.middle)[:, None]
    rows = slice(quotient.rows)
    slopes = (n.slopes - m.slopes @ n.middle[:, None])[:, :, rows]
    linear = LinearMatrices(n.middle[:, rows], n.own[:, rows], slopes, spread[:, :, rows], n.half)
    rest = n.rest + off @ n_size + m.linear_change @ (n.linear_change + n.rest)
    beyond = np.where(g < 1.0, g * g / np.where(g < 1.0, 1.0 - g, 1.0), np.inf)
    rest_size = _compute_frobenius(rest[:, rows]) + beyond * _compute_frobenius(n_size)
    sizes[good] = (_bound_corners(linear, signs, quotient.norm) + rest_size[:, None]) * (1.0 + ROUNDING)
    if d:
        axis[good] = linear.widest
    return _CornerSizes(sizes, signs)


def _bound_corners(matrices: LinearMatrices, signs: Array, norm: Norm) -> Array:
    """Bound the norm of middle + Σ slopes·δ in the corners, (N, corners); one bound of all where the signs are zero."""
    if not signs.any():
        return (_compute_norms(matrices.middle, norm) + _compute_frobenius(matrices.linear_change))[:, None]
    steps = matrices.slopes * matrices.half[:, :, None, None]
    return _compute_norms(matrices.middle[:, None] + np.einsum("cd,ndij->ncij", signs, steps), norm)


def _compute_norms(matrices: Array, norm: Norm) -> Array:
    if norm == "frobenius":
        return _compute_frobenius(matrices)
    return np.asarray(compute_singular_values(matrices)[..., 0])


def _compute_frobenius(matrices: Array) -> Array:
    """Compute Frobenius' norm, no less than the greatest singular value."""
    return np.asarray(np.sqrt(np.square(matrices).sum((-2, -1))))
