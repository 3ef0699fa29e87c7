"""Plane cuts of boxes: linear bounds of a margin over a box, and the fraction of the box above such a plane.

Over a box of half widths h about c a margin g is bounded by g(c) + m·(x - c) and a remainder, which follows from the
bounds of its derivatives and is of the order of h². The fraction of a box above a plane has a closed form, so the
volume inside and outside is known far closer than by whole boxes.

x is a position, of d ≤ 3 coordinates; θ is an orientation, of s angles; v = (x - c)/h is in [-1, 1]^d.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, Flags, Indices
from ...kernels.compiling import njit
from .box_fractions import bound_fraction, bound_scaled_fraction, estimate_growth, scale_slopes

KEPT, CLEARED, EXCLUDED = 0, 1, 2  # a margin over a box: undecided, kept everywhere, broken for every x


def take_rows(columns: Sequence[NDArray[Any]], which: Flags | Indices) -> list[NDArray[Any]]:
    """Take some rows of each column; flags are made indices once for all of them."""
    rows = np.flatnonzero(which) if which.dtype == np.bool_ else which
    return [column.take(rows, 0) for column in columns]


class TaylorBounds(NamedTuple):
    """Bounds that the programs of a :class:`~.constraints.Constraint` give over N boxes (x, θ) and in their middles.

    is_smooth : the constraint has second derivatives
    box_low, box_high : (N, .) over the box: the margin, the guard, the derivatives by θ, then of a smooth margin the
        second derivatives by x, else the first ones
    middle_low, middle_high : (N, .) in the middle: the margin, and of a smooth one the derivatives by x
    half : (N, d + s) half widths
    """

    is_smooth: bool
    box_low: Array
    box_high: Array
    middle_low: Array
    middle_high: Array
    half: Array


class JoinedBoxes(NamedTuple):
    """Boxes of positions and orientations: their ends, middles and half widths, (N, d + s) each."""

    low: Array
    high: Array
    middle: Array
    half: Array


class LinearBounds(NamedTuple):
    """Linear bounds of one margin over N boxes (x, θ), and what they decide.

    state : (N,) KEPT, CLEARED where the margin is ≥ 0 all over the box, EXCLUDED where it is < 0 for every x
    least_at : (N, s) -1 or 1 where the margin is least at the lower or upper end of θ, else 0
    low, high, slopes : (N,), (N,), (N, d); if the margin must be kept at every θ, slopes·v + low ≤ margin for all θ and
        margin ≤ slopes·v + high in the middle θ, else the same with "all" and "middle" exchanged
    spread : (N, s) how far the margin may change with each θ
    """

    state: NDArray[np.int8]
    least_at: NDArray[np.int8]
    low: Array
    high: Array
    slopes: Array
    spread: Array

    @classmethod
    def allocate(cls, n: int, d: int, s: int) -> LinearBounds:
        """Make room for the bounds over n boxes."""
        return cls(
            np.empty(n, np.int8),
            np.empty((n, s), np.int8),
            np.empty(n),
            np.empty(n),
            np.empty((n, d)),
            np.empty((n, s)),
        )

    def take(self, which: Flags | Indices) -> LinearBounds:
        """Keep some of the boxes."""
        return LinearBounds(*take_rows(self, which))


class CellFractions(NamedTuple):
    """Bounds and estimates of N cells' allowed parts, as fractions of their volumes.

    inner, outer, estimate : (N,) inside at least, at most, and likely
    limit : (N,) index of the constraint that leaves least of the cell, -1 for none
    area : (N,) of its boundary in the cell, per unit of the cell's volume
    """

    inner: Array
    outer: Array
    estimate: Array
    limit: Indices
    area: Array

    def take(self, which: Flags) -> CellFractions:
        """Keep some of the cells."""
        return CellFractions(*take_rows(self, which))


class PlaneCuts(NamedTuple):
    """What the constraints cut off each of N cells together, one constraint after the other.

    cut_off : (N,) sum of the fractions that each constraint may cut off
    outer : (N,) least fraction that any constraint leaves
    cut_off_estimate, least_estimate : (N,) the same two by the middles of the bounds
    limit, area : as of :class:`CellFractions`
    """

    cut_off: Array
    outer: Array
    cut_off_estimate: Array
    least_estimate: Array
    limit: Indices
    area: Array

    @classmethod
    def start(cls, n: int) -> PlaneCuts:
        """Start with n cells that no constraint cuts."""
        return cls(np.zeros(n), np.ones(n), np.zeros(n), np.full(n, np.inf), np.full(n, -1, np.int64), np.zeros(n))

    @property
    def fractions(self) -> CellFractions:
        estimate = 0.5 * (np.maximum(0.0, 1.0 - self.cut_off_estimate) + np.minimum(self.least_estimate, 1.0))
        return CellFractions(np.maximum(0.0, 1.0 - self.cut_off), self.outer, estimate, self.limit, self.area)


@njit(nogil=True, cache=True)
def join_boxes(low, size, cell, first, last, joined):
    """Join cells and boxes of orientations in them to boxes of both.

    low, size : (cells, d); cell : (N,) of each box; first, last : (N, s) the ends of its orientations
    joined : :class:`JoinedBoxes`, filled
    """
    bottom, top, middle, half = joined
    d, s = low.shape[1], first.shape[1]
    for i in range(len(cell)):
        c = cell[i]
        for k in range(d + s):
            a, b = (low[c, k], low[c, k] + size[c, k]) if k < d else (first[i, k - d], last[i, k - d])
            m = 0.5 * (a + b)
            bottom[i, k], top[i, k], middle[i, k], half[i, k] = a, b, m, max(m - a, b - m)


@njit(nogil=True, cache=True, inline="always")
def _bound_change_with_position(box_low, box_high, middle_low, middle_high, half, is_smooth, slopes, i):
    """Bound how box i's margin changes with x: fill its slopes, return remainders (below, above), rounded up."""
    below, above = 0.0, 0.0
    d = slopes.shape[1]
    column = 2 + half.shape[1] - d
    for k in range(d):
        if is_smooth:
            a, b = middle_low[i, 1 + k], middle_high[i, 1 + k]
            for n in range(k, d):
                p, q = box_low[i, column], box_high[i, column]
                column += 1
                if n == k:
                    scale = 0.5 * half[i, k] * half[i, k]
                    below += max(-p, 0.0) * scale
                    above += max(q, 0.0) * scale
                else:
                    scale = max(abs(p), abs(q)) * half[i, k] * half[i, n]
                    below += scale
                    above += scale
        else:
            a, b = box_low[i, column], box_high[i, column]
            column += 1
        slopes[i, k] = 0.5 * (a + b) * half[i, k]
        rest = (0.5 * (b - a) + 1e-15 * max(abs(a), abs(b))) * half[i, k]
        below += rest
        above += rest
    return below * (1.0 + 1e-14), above * (1.0 + 1e-14)


@njit(nogil=True, cache=True, inline="always")
def _bound_change_with_orientation(box_low, box_high, half, least_at, spread, i):
    """Bound how far box i's margin changes with each θ: fill in that and the end where it is least, return the sum."""
    s = spread.shape[1]
    d = half.shape[1] - s
    total = 0.0
    for k in range(s):
        a, b = box_low[i, 2 + k], box_high[i, 2 + k]
        spread[i, k] = max(abs(a), abs(b)) * half[i, d + k] if half[i, d + k] > 0.0 else 0.0
        total += spread[i, k]
        least_at[i, k] = 0
        if (half[i, d + k] > 0.0) & (box_low[i, 1] > 0.0):
            least_at[i, k] = -1 if a >= 0.0 else (1 if b <= 0.0 else 0)
    return total


@njit(nogil=True, cache=True)
def bound_linearly(given, every, result, start, stop):
    """Bound one margin over boxes by planes, by Taylor's formula about the middle, and decide by them.

    given : :class:`TaylorBounds`; result : :class:`LinearBounds`, filled from start to stop
    every : the margin must be kept at every θ, else at one
    """
    # Fields are taken out of the tuples once: Numba counts references at every access within a loop.
    box_low, box_high, half = given.box_low, given.box_high, given.half
    middle_low, middle_high = given.middle_low, given.middle_high
    state, slopes, spread = result.state, result.slopes, result.spread
    d, s = slopes.shape[1], spread.shape[1]
    for i in range(start, stop):
        below, above = _bound_change_with_position(
            box_low, box_high, middle_low, middle_high, half, given.is_smooth, slopes, i
        )
        steep = 0.0
        for k in range(d):
            steep += abs(slopes[i, k])
        turned = _bound_change_with_orientation(box_low, box_high, half, result.least_at, spread, i)
        no_jump = box_low[i, 1] > 0.0
        bottom, top = box_low[i, 0], box_high[i, 0]
        top_in_middle = top  # for every x, in the middle θ
        if np.isfinite(middle_low[i, 0] + middle_high[i, 0] + steep + below + above + turned) & no_jump:
            low, high = middle_low[i, 0] - below, middle_high[i, 0] + above
            bottom = max(bottom, low - steep - turned)
            top = min(top, high + steep + turned)
            top_in_middle = min(top, high + steep)
            if every:
                low -= turned
            else:
                high += turned
        else:
            low, high = bottom, top
            for k in range(d):
                slopes[i, k] = 0.0
            for k in range(s):
                spread[i, k] = np.inf if half[i, d + k] > 0.0 else 0.0
        result.low[i], result.high[i] = low, high
        if bottom >= 0.0:
            state[i] = CLEARED
        elif (top_in_middle if every else top) < 0.0:
            state[i] = EXCLUDED
        else:
            state[i] = KEPT


@njit(nogil=True, cache=True)
def accumulate_cuts(bounds, number, cell, half, cuts, start, stop):
    """Add the parts that one constraint cuts off every cell.

    bounds : :class:`LinearBounds` over boxes (x, θ); number : the constraint's
    cell : (N,) of each box, sorted; the boxes of one cell are parts of the θ at all of which the margin must be kept
    half : (cells, d) half widths
    cuts : :class:`PlaneCuts`, changed
    """
    low, high, slopes = bounds.low, bounds.high, bounds.slopes
    outer, cut_off, cut_off_estimate = cuts.outer, cuts.cut_off, cuts.cut_off_estimate
    least_estimate, limit, area = cuts.least_estimate, cuts.limit, cuts.area
    d = slopes.shape[1]
    scratch, scaled = np.empty(3), np.empty(3)
    while 0 < start < len(cell) and cell[start] == cell[start - 1]:  # a cell belongs to where its boxes begin
        start += 1
    i = start
    while i < stop:
        c = cell[i]
        end = i
        while end < len(cell) and cell[end] == c:
            end += 1
        worst = i
        for j in range(i, end):
            if low[j] < low[worst]:
                worst = j
        scale = scale_slopes(slopes[worst], scaled)
        least, middle = low[worst], 0.5 * (low[worst] + high[worst])
        outer[c] = min(outer[c], bound_scaled_fraction(high[worst], scaled, scale)[1])
        for j in range(i, end):
            if j == worst:
                continue
            shift = 0.0
            for k in range(d):
                shift += abs(slopes[j, k] - slopes[worst, k])
            least = min(least, low[j] - shift)
            outer[c] = min(outer[c], bound_fraction(high[j], slopes[j], scratch)[1])
        cut_off[c] += 1.0 - bound_scaled_fraction(least, scaled, scale)[0]
        ends = bound_scaled_fraction(middle, scaled, scale)
        estimate = 0.5 * (ends[0] + ends[1])
        cut_off_estimate[c] += 1.0 - estimate
        if estimate < least_estimate[c]:
            least_estimate[c] = estimate
            limit[c] = number
            gradient = 0.0
            for k in range(d):
                gradient += (slopes[worst, k] / half[c, k]) ** 2
            area[c] = estimate_growth(middle, scaled, scale) * np.sqrt(gradient)
        i = end


@njit(nogil=True, cache=True)
def keep_tightest_planes(box, bounds, outer, planes):
    """Keep of every box the upper bound that leaves least of it.

    box : (N,) of each bound, none twice
    outer, planes : (boxes,) the fraction it leaves, (boxes, d + 1) its slopes and height; changed
    """
    scratch, high, slopes = np.empty(3), bounds.high, bounds.slopes
    for i in range(len(box)):
        most = bound_fraction(high[i], slopes[i], scratch)[1]
        c = box[i]
        if most < outer[c]:
            outer[c] = most
            planes[c, :-1] = slopes[i]
            planes[c, -1] = high[i]


@njit(nogil=True, cache=True)
def bound_unions(cell, widest, planes, outer, result):
    """Bound the union of the leaves of each cell; the bound is close if their planes are nearly parallel.

    What is above one leaf's plane is above that of the cell's widest leaf, moved by as much as the two differ within
    the box.

    cell : (N,) of each leaf; widest : (cells,) its leaf that leaves most, or -1
    planes, outer : of the leaves, as from :func:`keep_tightest_planes`, with slopes of length 1
    result : (cells,) fractions
    """
    d = planes.shape[1] - 1
    scratch = np.empty(3)
    height = np.full(len(widest), -np.inf)
    total = np.zeros(len(widest))
    for i in range(len(cell)):
        reference = planes[widest[cell[i]]]
        moved = planes[i, d]
        for k in range(d):
            moved += abs(planes[i, k] - reference[k])
        height[cell[i]] = max(height[cell[i]], moved)
        total[cell[i]] += outer[i]
    for c in range(len(widest)):
        result[c] = 0.0
        if widest[c] >= 0:
            result[c] = min(1.0, total[c], bound_fraction(height[c], planes[widest[c], :d], scratch)[1])


@njit(nogil=True, cache=True)
def find_redundant_leaves(cell, witness, proved_height, planes, result):
    """Find the leaves whose allowed part one other leaf of their cell, the witness, is proved to contain.

    cell : (N,) of each leaf; witness : (cells,) a leaf, or -1
    proved_height : (N,) height of the parallel to the leaf's plane above which the leaf is proved to hold
    planes : (N, d + 1), as in :func:`bound_unions`
    result : (N,) flags
    """
    d = planes.shape[1] - 1
    for i in range(len(cell)):
        w = witness[cell[i]]
        result[i] = False
        if w >= 0 and w != i:
            moved = planes[i, d]
            for k in range(d):
                moved += abs(planes[i, k] - planes[w, k])
            result[i] = proved_height[w] >= moved
