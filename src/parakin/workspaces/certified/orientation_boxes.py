"""Boxes of orientations, each in a cell of positions, and the bounds of margins over both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kernels.batch import run_in_threads
from .constraints import Constraint
from .plane_cuts import (
    CLEARED,
    EXCLUDED,
    JoinedBoxes,
    LinearBounds,
    PlaneCuts,
    TaylorBounds,
    accumulate_cuts,
    bound_linearly,
    join_boxes,
    take_rows,
)
from .sign_proofs import FormPlanes


@dataclass(frozen=True, eq=False)
class OrientationBoxes:
    """Boxes of orientations [low, high], (N, s) rad, each in a cell, that are still to be proved.

    cell : (N,) index of the cell
    needs : (N, constraints) which constraints, where a list is not one constraint's alone
    """

    cell: Indices
    low: Array
    high: Array
    needs: Flags

    def take(self, which: Flags | Indices) -> OrientationBoxes:
        """Keep some of the boxes."""
        return OrientationBoxes(*take_rows((self.cell, self.low, self.high, self.needs), which))

    def repeat_for_children(self, count: int) -> OrientationBoxes:
        """Repeat the boxes for each of the ``count`` children of their cells."""
        cell = (self.cell[:, None] * count + np.arange(count)).reshape(-1)
        return replace(self.take(np.repeat(np.arange(len(self.cell)), count)), cell=cell)


def concatenate_boxes(groups: Sequence[OrientationBoxes]) -> OrientationBoxes:
    """Put boxes of orientations together."""
    if not groups:
        none = np.zeros((0, 0))
        return OrientationBoxes(np.zeros(0, np.int64), none, none, np.zeros((0, 0), np.bool_))
    names = ("cell", "low", "high", "needs")
    return OrientationBoxes(*(np.concatenate([getattr(group, name) for group in groups]) for name in names))


@dataclass(frozen=True, eq=False)
class BoxLists:
    """Lists of boxes of orientations, one after the other in ``boxes``; ``counts`` tells how many each has."""

    boxes: OrientationBoxes
    counts: Indices

    @classmethod
    def join(cls, lists: Sequence[OrientationBoxes]) -> BoxLists:
        """Put lists one after the other."""
        return cls(concatenate_boxes(lists), np.array([len(boxes.cell) for boxes in lists], np.int64))

    def split(self) -> list[OrientationBoxes]:
        """Return each list by itself."""
        rows = [slice(stop - count, stop) for stop, count in zip(np.cumsum(self.counts), self.counts, strict=True)]
        boxes = self.boxes
        return [OrientationBoxes(boxes.cell[r], boxes.low[r], boxes.high[r], boxes.needs[r]) for r in rows]

    def renumber(self, new: Indices) -> BoxLists:
        """Renumber the cells; the boxes of cells without a number (-1) are dropped."""
        cell = new[self.boxes.cell]
        kept = cell >= 0
        before = np.append(0, np.cumsum(kept))[np.append(0, np.cumsum(self.counts))]
        return BoxLists(replace(self.boxes.take(kept), cell=cell[kept]), np.diff(before))

    def repeat_for_children(self, count: int) -> BoxLists:
        """Repeat the boxes for each of the ``count`` children of their cells."""
        return BoxLists(self.boxes.repeat_for_children(count), self.counts * count)

    def shift(self, offset: int) -> BoxLists:
        """Add an offset to the cells' numbers."""
        return replace(self, boxes=replace(self.boxes, cell=self.boxes.cell + offset))


def concatenate_lists(groups: Sequence[BoxLists]) -> BoxLists:
    """Put together the first lists of all groups, then the second ones, and so on."""
    lists = [boxes for same in zip(*(group.split() for group in groups), strict=True) for boxes in same]
    return BoxLists(concatenate_boxes(lists), np.sum([group.counts for group in groups], 0))


def bisect_boxes(boxes: OrientationBoxes, which: Flags, spread: Array) -> OrientationBoxes:
    """Bisect some boxes across the angle with the greatest ``spread`` (N, s), or the widest if that is not finite."""
    cut = np.flatnonzero(which)
    known = np.isfinite(spread[cut]).all(1, keepdims=True)
    axis = np.where(known, spread[cut], (boxes.high - boxes.low)[cut]).argmax(1)
    row = np.arange(len(cut))
    middle = 0.5 * (boxes.low[cut, axis] + boxes.high[cut, axis])
    first, second = boxes.take(cut), boxes.take(cut)
    first.high[row, axis], second.low[row, axis] = middle, middle
    return concatenate_boxes([boxes.take(~which), first, second])


def bound_margin(constraint: Constraint, low: Array, size: Array, boxes: OrientationBoxes, every: bool) -> LinearBounds:
    """Bound a margin by planes over cells of corner ``low`` and edges ``size``, (cells, d), at boxes of orientations.

    every : the margin must be kept at every orientation of a box, else at one
    """
    n, d, s = len(boxes.cell), low.shape[1], boxes.low.shape[1]
    if not n:
        return LinearBounds.allocate(n, d, s)
    joined = JoinedBoxes(*(np.empty((n, d + s)) for _ in range(4)))
    join_boxes(low, size, boxes.cell, boxes.low, boxes.high, joined)
    over_box = constraint.box_program(joined.low, joined.high)
    in_middle = constraint.point_program(joined.middle, joined.middle)
    given = TaylorBounds(constraint.is_smooth, *over_box, *in_middle, joined.half)
    result = LinearBounds.allocate(n, d, s)
    run_in_threads(n, lambda start, stop: bound_linearly(given, every, result, start, stop))
    return result


def _list_corners(low: Array, size: Array, boxes: OrientationBoxes) -> tuple[Array, Array]:
    """List the ends of the boxes of positions and orientations, (N, d + s) each."""
    corner = low[boxes.cell]
    return np.concatenate([corner, boxes.low], 1), np.concatenate([corner + size[boxes.cell], boxes.high], 1)


def decide_signs(
    constraint: Constraint, low: Array, size: Array, boxes: OrientationBoxes, outside: Flags
) -> OrientationBoxes:
    """Decide boxes by the constraint's sign proof; returns the others, and marks cells ``outside`` that it excludes."""
    if constraint.sign is None or not len(boxes.cell):
        return boxes
    sign = constraint.sign(*_list_corners(low, size, boxes)).sign
    outside[boxes.cell[sign < 0.0]] = True
    return boxes.take(sign == 0.0)


def prove_signs(
    constraint: Constraint, low: Array, size: Array, boxes: OrientationBoxes, bounds: LinearBounds, which: Flags
) -> None:
    """Decide some boxes whose bounds don't tell by the constraint's sign proof; others get its spread and planes.

    The sum of a spread stays, shared by how far each angle spreads the form that would have decided. Planes are
    taken where they are relatively closer: of a form that has the margin's sign, they bound the same part of a cell.
    """
    rows = np.flatnonzero(which)
    if constraint.sign is None or not len(rows):
        return
    sign, shares, planes = constraint.sign(*_list_corners(low, size, boxes.take(rows)))
    bounds.state[rows] = np.where(sign > 0.0, CLEARED, np.where(sign < 0.0, EXCLUDED, bounds.state[rows]))
    if planes is not None:
        _take_closer_planes(bounds, rows, planes)
    shares = shares[:, low.shape[1] :]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = shares / shares.sum(1, keepdims=True)
    known, total = np.isfinite(shares).all(1), bounds.spread[rows].sum(1)
    total = np.where(np.isfinite(total), total, 1.0)
    bounds.spread[rows[known]] = (total[:, None] * shares)[known]


def _take_closer_planes(bounds: LinearBounds, rows: Indices, planes: FormPlanes) -> None:
    """Take planes over boxes, the angles' part added to their heights, where they are closer than the bounds are."""
    d = bounds.slopes.shape[1]
    slopes, turned = planes.slopes[:, :d], np.abs(planes.slopes[:, d:]).sum(1)
    low, high = planes.low - turned, planes.high + turned
    with np.errstate(invalid="ignore", divide="ignore"):
        own = (bounds.high[rows] - bounds.low[rows]) / np.abs(bounds.slopes[rows]).sum(1)
        closer = (high - low) / np.abs(slopes).sum(1) < np.nan_to_num(own, nan=inf)
    rows = rows[closer]
    bounds.low[rows], bounds.high[rows], bounds.slopes[rows] = low[closer], high[closer], slopes[closer]


def add_cuts(cuts: PlaneCuts, number: int, cell: Indices, half: Array, bounds: LinearBounds) -> None:
    """Add the cuts of a constraint to cells of half widths (cells, d); ``cell`` is sorted, all its bounds must hold."""
    run_in_threads(len(cell), lambda start, stop: accumulate_cuts(bounds, number, cell, half, cuts, start, stop))
