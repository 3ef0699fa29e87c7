"""The inclusive workspace: positions where all constraints hold at one orientation θ of a box at least."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, Flags, Indices
from .orientation_boxes import OrientationBoxes, add_cuts, bisect_boxes, bound_margin, concatenate_boxes
from .plane_cuts import (
    CLEARED,
    EXCLUDED,
    KEPT,
    CellFractions,
    PlaneCuts,
    bound_unions,
    find_redundant_leaves,
    keep_tightest_planes,
)
from .subdivision import OpenCells, Subdivision

LOOKS = 4  # tries at narrowed orientations in a round
MOST = 128  # boxes of orientations that a cell may have
POINTS = 3  # orientations at which a cell is tried, the middles of its best leaves
_SPREAD = 0.25  # boxes whose margins change more with orientation than this × their change with position are bisected


class LeafBounds(NamedTuple):
    """What is proved of N leaves: boxes of orientations of a cell, in which one may be allowed.

    fractions : what each leaf holds of its cell
    planes : (N, d + 1) the linear bound that leaves least of the cell: slopes of length 1, then the height
    proved_height : (N,) if one limit alone is open, the height of the plane above which the leaf is proved to hold
    best_at : (N, s) -1 or 1 where all constraints are best at the lower or upper end of an angle, else 0
    spread : (N, s) how far the margins change with each angle, as a fraction of their change with position
    """

    fractions: CellFractions
    planes: Array
    proved_height: Array
    best_at: NDArray[np.int8]
    spread: Array


class InclusiveSubdivision(Subdivision):
    """The subdivision in which each cell keeps its leaves, with the constraints not yet proved to hold in each."""

    def _list_boxes(self, cell: Indices, low: Array, high: Array) -> list[OrientationBoxes]:
        return [OrientationBoxes(cell, low, high, np.ones((len(cell), len(self.constraints)), np.bool_))]

    def _examine(self, low: Array, size: Array, boxes: list[OrientationBoxes]) -> OpenCells:
        (leaves,) = boxes
        finished: list[tuple[OrientationBoxes, CellFractions, Array]] = []
        inside, count = np.zeros(len(low), np.bool_), np.zeros(len(low), np.int64)
        for look in range(LOOKS + 1):
            leaves = leaves.take(~inside[leaves.cell])
            leaves, bounds = self._bound_leaves(low, size, leaves)
            inside[leaves.cell[bounds.fractions.inner >= 1.0]] = True
            most = count + np.bincount(leaves.cell, minlength=len(low))
            again = (bounds.best_at != 0).any(1) | ((bounds.spread.sum(1) > _SPREAD) & (most[leaves.cell] < MOST))
            again = np.asarray(again & ~inside[leaves.cell] & (look < LOOKS))
            redundant = _find_redundant(len(low), leaves.cell, bounds)
            again &= ~redundant
            if self.budget is not None and self.budget.is_spent():
                again[:] = False  # what is bounded so far holds all the same
            stay = ~again & ~redundant
            finished.append((leaves.take(stay), bounds.fractions.take(stay), bounds.planes[stay]))
            count += np.bincount(finished[-1][0].cell, minlength=len(low))
            if not again.any():
                break
            leaves = _narrow_leaves(leaves.take(again), bounds.best_at[again], bounds.spread[again])
        leaves = concatenate_boxes([group for group, _, _ in finished])
        columns = zip(*(group for _, group, _ in finished), strict=True)
        fractions = CellFractions(*(np.concatenate(column) for column in columns))
        planes = np.concatenate([group for _, _, group in finished])
        at_points = self._prove_at_points(low, size, leaves, fractions.estimate)
        inside |= at_points >= 1.0
        merged = _merge_leaves(leaves.cell, fractions, planes, inside)
        merged = merged._replace(inner=np.maximum(merged.inner, at_points))
        return self._sort_out(low, size, merged, [leaves])

    def _prove_at_points(self, low: Array, size: Array, leaves: OrientationBoxes, estimate: Array) -> Array:
        """Prove what the middle orientations of each cell's best leaves hold of it alone: inner fractions (cells,).

        Bounds over a leaf are wide as long as it is; those at one orientation are not.
        """
        inner = np.zeros(len(low))
        order = np.lexsort((-estimate, leaves.cell))
        cell = leaves.cell[order]
        rank = np.arange(len(cell)) - np.searchsorted(cell, cell)
        best = leaves.take(order[rank < POINTS])
        middle = 0.5 * (best.low + best.high)
        points, bounds = self._bound_leaves(low, size, replace(best, low=middle, high=middle))
        np.maximum.at(inner, points.cell, bounds.fractions.inner)
        return inner

    def _bound_leaves(self, low: Array, size: Array, leaves: OrientationBoxes) -> tuple[OrientationBoxes, LeafBounds]:
        """Bound all constraints over leaves; returns those that may hold an allowed orientation, and their bounds."""
        n, s = leaves.low.shape
        cuts, needs = PlaneCuts.start(n), leaves.needs.copy()
        alive: Flags = np.ones(n, np.bool_)
        half = 0.5 * size[leaves.cell]
        best_low, best_high = np.ones((n, s), np.bool_), np.ones((n, s), np.bool_)
        spread = np.zeros((n, s))
        tightest, planes = np.ones(n), np.zeros((n, low.shape[1] + 1))
        proved_height, limits = np.full(n, -np.inf), np.zeros(n, np.int64)
        for number, constraint in enumerate(self.constraints):
            which = np.flatnonzero(needs[:, number] & alive)
            bounds = bound_margin(constraint, low, size, leaves.take(which), every=False)
            needs[which[bounds.state == CLEARED], number] = False
            alive[which[bounds.state == EXCLUDED]] = False
            if constraint.implied:
                continue
            kept = which[bounds.state == KEPT]
            bounds = bounds.take(bounds.state == KEPT)
            add_cuts(cuts, number, kept, half, bounds)
            keep_tightest_planes(kept, bounds, tightest, planes)
            proved_height[kept] = bounds.low
            limits[kept] += 1
            best_low[kept] &= bounds.least_at == 1
            best_high[kept] &= bounds.least_at == -1
            change = np.abs(bounds.slopes).sum(1, keepdims=True)
            with np.errstate(divide="ignore", invalid="ignore"):
                spread[kept] = np.fmax(spread[kept], bounds.spread / change)
            alive = np.asarray(alive & (cuts.outer > 0.0))
        wide = (leaves.high > leaves.low) & np.any(needs, axis=1, keepdims=True)
        best_at = np.where(wide & best_high, 1, np.where(wide & best_low, -1, 0)).astype(np.int8)
        _normalise_planes(planes, proved_height, limits == 1)
        spread = np.where(wide, spread, 0.0)
        fractions = cuts.fractions.take(alive)
        kept_leaves = replace(leaves, needs=needs).take(alive)
        return kept_leaves, LeafBounds(fractions, planes[alive], proved_height[alive], best_at[alive], spread[alive])


def _normalise_planes(planes: Array, proved_height: Array, one_limit: Flags) -> None:
    """Scale slopes to length 1; a height is proved only where one limit alone is open and the plane is not level."""
    length = np.linalg.norm(planes[:, :-1], axis=1)
    steep = length > 0.0
    proved_height[:] = np.where(steep & one_limit, proved_height / np.where(steep, length, 1.0), -np.inf)
    planes[steep] /= length[steep, None]
    planes[length == 0.0, -1] = np.inf


def _narrow_leaves(leaves: OrientationBoxes, best_at: NDArray[np.int8], spread: Array) -> OrientationBoxes:
    """Shrink leaves to the ends where all constraints are best, where they agree; bisect the others."""
    low, high = leaves.low.copy(), leaves.high.copy()
    low[best_at > 0] = leaves.high[best_at > 0]
    high[best_at < 0] = leaves.low[best_at < 0]
    return bisect_boxes(replace(leaves, low=low, high=high), ~(best_at != 0).any(1), spread)


def _find_redundant(count: int, cell: Indices, bounds: LeafBounds) -> Flags:
    """Find the leaves whose allowed part another leaf of their cell is proved to contain; ``count`` is of the cells."""
    witness = np.full(count, -1)
    order = np.argsort(bounds.proved_height, kind="stable")
    order = order[np.isfinite(bounds.proved_height[order])]
    witness[cell[order]] = order  # of several the last is kept
    redundant = np.zeros(len(cell), np.bool_)
    find_redundant_leaves(cell, witness, bounds.proved_height, bounds.planes, redundant)
    return redundant


def _merge_leaves(cell: Indices, leaves: CellFractions, planes: Array, inside: Flags) -> CellFractions:
    """Merge the leaves of each cell: the inner fraction of the best leaf, the outer fraction of all together.

    cell : (N,) of each leaf; inside : (cells,) where the whole cell is proved inside
    """
    count = len(inside)
    inner, estimate, outer = np.zeros(count), np.zeros(count), np.zeros(count)
    limit, area = np.full(count, -1, np.int64), np.zeros(count)
    np.maximum.at(inner, cell, leaves.inner)
    widest = np.full(count, -1)
    order = np.argsort(leaves.outer, kind="stable")  # of several the last is kept
    widest[cell[order]] = order
    bound_unions(cell, widest, planes, leaves.outer, outer)
    order = np.argsort(leaves.estimate, kind="stable")
    estimate[cell[order]], limit[cell[order]] = leaves.estimate[order], leaves.limit[order]
    area[cell[order]] = leaves.area[order]
    inner[inside], outer[inside], estimate[inside], limit[inside], area[inside] = 1.0, 1.0, 1.0, -1, 0.0
    # A leaf that lost no need has a limit only in its estimate; an undecided cell must name one.
    limit[~inside & (outer > 0.0) & (limit < 0)] = 0
    return CellFractions(inner, outer, estimate, limit, area)
