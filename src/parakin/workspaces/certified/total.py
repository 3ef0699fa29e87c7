"""The total orientation workspace: positions where all constraints hold at every orientation θ of a box.

A box of one orientation gives the workspace of constant orientation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, Flags, Indices
from .constraints import Constraint
from .orientation_boxes import (
    OrientationBoxes,
    add_cuts,
    bisect_boxes,
    bound_margin,
    concatenate_boxes,
    decide_signs,
    prove_signs,
)
from .plane_cuts import EXCLUDED, KEPT, LinearBounds, PlaneCuts
from .subdivision import OpenCells, Subdivision

LOOKS = 6  # tries at narrowed orientations in a round
MOST = 32  # boxes of orientations that a constraint may have in a cell
_MANY = (
    3  # swept angles from which on signs are proved by closer forms, as without any; twice as many boxes may be left
)
_SPREAD = 0.15  # boxes whose margin changes more with orientation than this × its change with position are bisected


class TotalSubdivision(Subdivision):
    """The subdivision in which each constraint keeps only the orientations where it may be least."""

    def _list_boxes(self, cell: Indices, low: Array, high: Array) -> list[OrientationBoxes]:
        return [OrientationBoxes(cell, low, high, np.zeros((len(cell), 0), np.bool_))] * len(self.constraints)

    def _examine(self, low: Array, size: Array, boxes: list[OrientationBoxes]) -> OpenCells:
        cuts, outside = PlaneCuts.start(len(low)), np.zeros(len(low), np.bool_)
        open_boxes: list[OrientationBoxes] = []
        for number, (constraint, own) in enumerate(zip(self.constraints, boxes, strict=True)):
            own, bounds = self._bound_constraint(constraint, low, size, own, outside)
            if not constraint.implied:
                add_cuts(cuts, number, own.cell, 0.5 * size, bounds)
            open_boxes.append(own)
            outside |= cuts.outer <= 0.0
        cuts.outer[outside] = 0.0
        return self._sort_out(low, size, cuts.fractions, open_boxes)

    def _bound_constraint(
        self, constraint: Constraint, low: Array, size: Array, boxes: OrientationBoxes, outside: Flags
    ) -> tuple[OrientationBoxes, LinearBounds]:
        """Narrow the boxes of orientations to where a margin may be least, and bound it there.

        Returns the boxes in which it is not proved to hold, sorted by cell, with bounds; the cells that it excludes are
        marked in ``outside``.
        """
        if not boxes.low.shape[1]:
            return self._bound_still(constraint, low, size, boxes, outside)
        finished: list[tuple[OrientationBoxes, LinearBounds]] = []
        count = np.zeros(len(low), np.int64)
        closely = self.closely and boxes.low.shape[1] >= _MANY
        most = 2 * MOST if closely else MOST
        for look in range(LOOKS + 1):
            boxes = boxes.take(~outside[boxes.cell])
            bounds = bound_margin(constraint, low, size, boxes, every=True)
            spread, change = bounds.spread.sum(1), np.abs(bounds.slopes).sum(1)
            narrow: Flags = (bounds.least_at != 0).any(1)
            large = ~narrow & (spread > _SPREAD * change) & (spread > 0.0)
            if closely:
                prove_signs(constraint, low, size, boxes, bounds, large & (bounds.state == KEPT))
            outside[boxes.cell[bounds.state == EXCLUDED]] = True
            unbounded = ~np.all(np.isfinite(bounds.spread), axis=1)
            if unbounded.any():  # their middle is looked at
                wide = boxes.take(unbounded)
                middle = 0.5 * (wide.low + wide.high)
                in_middle = bound_margin(constraint, low, size, replace(wide, low=middle, high=middle), every=True)
                outside[wide.cell[in_middle.state == EXCLUDED]] = True
            kept = bounds.state == KEPT
            again = np.zeros(len(kept), np.bool_)
            if look < LOOKS:
                few = (count + np.bincount(boxes.cell, minlength=len(low)))[boxes.cell] < most
                again = kept & (narrow | (large & few))
            finished.append((boxes.take(kept & ~again), bounds.take(kept & ~again)))
            count += np.bincount(finished[-1][0].cell, minlength=len(low))
            if not again.any():
                break
            boxes = _narrow_boxes(boxes.take(again), bounds.take(again))
        return _sort_by_cell(finished)

    def _bound_still(
        self, constraint: Constraint, low: Array, size: Array, boxes: OrientationBoxes, outside: Flags
    ) -> tuple[OrientationBoxes, LinearBounds]:
        """Bound a margin where there is one orientation, as :meth:`_bound_constraint`."""
        boxes = boxes.take(~outside[boxes.cell])
        if self.closely and constraint.sign_first and not self.rounds:
            boxes = decide_signs(constraint, low, size, boxes, outside)
        bounds = bound_margin(constraint, low, size, boxes, every=True)
        if self.closely and not constraint.sign_first:
            prove_signs(constraint, low, size, boxes, bounds, bounds.state == KEPT)
        outside[boxes.cell[bounds.state == EXCLUDED]] = True
        kept = bounds.state == KEPT
        return boxes.take(kept), bounds.take(kept)


def _narrow_boxes(boxes: OrientationBoxes, bounds: LinearBounds) -> OrientationBoxes:
    """Shrink boxes to the ends where the margin is least, where these are known; bisect the others."""
    low, high = boxes.low.copy(), boxes.high.copy()
    high[bounds.least_at < 0] = boxes.low[bounds.least_at < 0]
    low[bounds.least_at > 0] = boxes.high[bounds.least_at > 0]
    return bisect_boxes(replace(boxes, low=low, high=high), ~(bounds.least_at != 0).any(1), bounds.spread)


def _sort_by_cell(groups: Sequence[tuple[OrientationBoxes, LinearBounds]]) -> tuple[OrientationBoxes, LinearBounds]:
    """Put all groups together, sorted by cell."""
    boxes = concatenate_boxes([group for group, _ in groups])
    bounds = LinearBounds(*(np.concatenate(columns) for columns in zip(*(group for _, group in groups), strict=True)))
    order = np.argsort(boxes.cell, kind="stable")
    return boxes.take(order), bounds.take(order)
