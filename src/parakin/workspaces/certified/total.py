"""Places where all constraints hold for every turn θ of a box; for one θ where the box is a point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .constraints import Constraint
from .plane_cuts import EXCLUDED, KEPT
from .subdivision import Array, Cells, Cuts, Indices, Items, Lines, Subdivision, bounds, halved, in_order

LOOKS = 6  # at narrowed turns, a round
MOST = 32  # boxes of turns that a constraint may have in a cell
_OPEN = 0.15  # how much more than the place the turns may leave open before they are halved


class EveryTurn(Subdivision):
    """Of the turns, each constraint keeps only those where it may be least."""

    def _first(self, cell: Indices, low: Array, high: Array) -> list[Items]:
        return [Items(cell, low, high, np.zeros((len(cell), 0), np.bool_))] * len(self.constraints)

    def _examined(self, low: Array, size: Array, left: list[Items]) -> tuple[Cells, list[Items]]:
        cuts, gone = Cuts(len(low)), np.zeros(len(low), np.bool_)
        kept: list[Items] = []
        for number, (constraint, items) in enumerate(zip(self.constraints, left, strict=True)):
            items, found = self._settled(constraint, low, size, items, gone)
            if not constraint.implied:
                cuts.add(number, items.cell, 0.5 * size, found)
            kept.append(items)
            gone |= cuts.outer <= 0.0
        cuts.outer[gone] = 0.0
        return self._sorted_out(low, size, cuts.shares, kept)

    def _settled(
        self, constraint: Constraint, low: Array, size: Array, items: Items, gone: NDArray[np.bool_]
    ) -> tuple[Items, Lines]:
        """The items that a constraint is not cleared of, sorted by cell, with bounds; cells it excludes are marked."""
        finished: list[tuple[Items, Lines]] = []
        count = np.zeros(len(low), np.int64)
        for attempt in range(LOOKS + 1):
            items = items.take(~gone[items.cell])
            found = bounds(constraint, low, size, items, every=True)
            gone[items.cell[found.state == EXCLUDED]] = True
            vague = items.take(~np.all(np.isfinite(found.spread), axis=1))  # too wide to tell of its middle: look there
            middle = 0.5 * (vague.low + vague.high)
            there = bounds(constraint, low, size, replace(vague, low=middle, high=middle), every=True)
            gone[vague.cell[there.state == EXCLUDED]] = True
            kept = found.state == KEPT
            again = np.zeros(len(kept), np.bool_)
            if attempt < LOOKS and items.low.shape[1]:
                spread, room = found.spread.sum(1), np.abs(found.slopes).sum(1)
                few = (count + np.bincount(items.cell, minlength=len(low)))[items.cell] < MOST
                wide = few & (spread > _OPEN * room) & (spread > 0.0)
                again = kept & ((found.turn != 0).any(1) | wide)
            finished.append((items.take(kept & ~again), found.take(kept & ~again)))
            count += np.bincount(finished[-1][0].cell, minlength=len(low))
            if not again.any():
                break
            items = _narrowed(items.take(again), found.take(again))
        return in_order(finished)


def _narrowed(items: Items, found: Lines) -> Items:
    """Turns put where the margin is least, where that is known; else halved where they leave most open."""
    low, high = items.low.copy(), items.high.copy()
    high[found.turn < 0] = items.low[found.turn < 0]
    low[found.turn > 0] = items.high[found.turn > 0]
    return halved(replace(items, low=low, high=high), ~(found.turn != 0).any(1), found.spread)
