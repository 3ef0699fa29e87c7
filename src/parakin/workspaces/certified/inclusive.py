"""Places where all constraints hold for at least one turn θ of a box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .plane_cuts import CLEARED, EXCLUDED, KEPT, narrowest, surpassed, united
from .subdivision import Array, Cells, Cuts, Indices, Items, Shares, Subdivision, both, bounds, halved

LOOKS = 4  # at narrowed turns, a round
MOST = 128  # boxes of turns that a cell may have
_OPEN = 0.25  # how much more than the place the turns may leave open before they are halved


class SomeTurn(Subdivision):
    """Each cell keeps the boxes of turns, its leaves, that may hold one, with the constraints not yet shown there."""

    def _first(self, cell: Indices, low: Array, high: Array) -> list[Items]:
        return [Items(cell, low, high, np.ones((len(cell), len(self.constraints)), np.bool_))]

    def _examined(self, low: Array, size: Array, left: list[Items]) -> tuple[Cells, list[Items]]:
        (leaves,) = left
        done: list[tuple[Items, Shares, Array]] = []
        inside, count = np.zeros(len(low), np.bool_), np.zeros(len(low), np.int64)
        for look in range(LOOKS + 1):
            leaves = leaves.take(~inside[leaves.cell])
            leaves, found, line, sure, turn, spread = self._looked_at(low, size, leaves)
            inside[leaves.cell[found.inner >= 1.0]] = True
            most = count + np.bincount(leaves.cell, minlength=len(low))
            again = (turn != 0).any(1) | ((spread.sum(1) > _OPEN) & (most[leaves.cell] < MOST))
            again = np.asarray(again & ~inside[leaves.cell] & (look < LOOKS))
            needless = _needless(len(low), leaves.cell, sure, line)
            again &= ~needless
            stay = ~again & ~needless
            done.append((leaves.take(stay), _taken(found, stay), line[stay]))
            count += np.bincount(done[-1][0].cell, minlength=len(low))
            if not again.any():
                break
            leaves = _narrowed(leaves.take(again), turn[again], spread[again])
        leaves = both([part for part, _, _ in done])
        found = Shares(*(np.concatenate([getattr(part, name) for _, part, _ in done]) for name in _NAMES))
        lines = np.concatenate([part for _, _, part in done])
        return self._sorted_out(low, size, _of_cells(len(low), leaves.cell, found, lines, inside), [leaves])

    def _looked_at(
        self, low: Array, size: Array, leaves: Items
    ) -> tuple[Items, Shares, Array, Array, NDArray[np.int8], Array]:
        """The leaves that may hold a turn: their shares, the straight bound that leaves least (slopes of length 1, then
        height), the height from which on a leaf is proved to hold if one limit alone is open there, where each turn is
        best, and what it leaves open."""
        n, s = leaves.low.shape
        cuts, needs = Cuts(n), leaves.needs.copy()
        alive: NDArray[np.bool_] = np.ones(n, np.bool_)
        half = 0.5 * size[leaves.cell]
        best_low, best_high = np.ones((n, s), np.bool_), np.ones((n, s), np.bool_)
        spread = np.zeros((n, s))
        least, line = np.ones(n), np.zeros((n, low.shape[1] + 1))
        sure, limits = np.full(n, -np.inf), np.zeros(n, np.int64)
        for number, constraint in enumerate(self.constraints):
            which = np.flatnonzero(needs[:, number] & alive)
            found = bounds(constraint, low, size, leaves.take(which), every=False)
            needs[which[found.state == CLEARED], number] = False
            alive[which[found.state == EXCLUDED]] = False
            if constraint.implied:
                continue
            kept = which[found.state == KEPT]
            found = found.take(found.state == KEPT)
            cuts.add(number, kept, half, found)
            narrowest(kept, found.high, found.slopes, least, line, 0, len(kept))
            sure[kept] = found.low
            limits[kept] += 1
            best_low[kept] &= found.turn == 1
            best_high[kept] &= found.turn == -1
            room = np.abs(found.slopes).sum(1, keepdims=True)
            with np.errstate(divide="ignore", invalid="ignore"):
                spread[kept] = np.fmax(spread[kept], found.spread / room)
            alive = np.asarray(alive & (cuts.outer > 0.0))
        wide = (leaves.high > leaves.low) & np.any(needs, axis=1, keepdims=True)
        turn = np.where(wide & best_high, 1, np.where(wide & best_low, -1, 0)).astype(np.int8)
        length = np.linalg.norm(line[:, :-1], axis=1)
        sure = np.where((length > 0.0) & (limits == 1), sure / np.where(length > 0.0, length, 1.0), -np.inf)
        line[length > 0.0] /= length[length > 0.0, None]
        line[length == 0.0, -1] = np.inf
        spread = np.where(wide, spread, 0.0)
        kept_leaves = replace(leaves, needs=needs).take(alive)
        return kept_leaves, _taken(cuts.shares, alive), line[alive], sure[alive], turn[alive], spread[alive]


_NAMES = ("inner", "outer", "estimate", "limit", "area")


def _taken(shares: Shares, which: NDArray[np.bool_]) -> Shares:
    return Shares(*(getattr(shares, name)[which] for name in _NAMES))


def _narrowed(leaves: Items, turn: NDArray[np.int8], spread: Array) -> Items:
    """Leaves put where all constraints are best, where they agree; else halved where they leave most open."""
    low, high = leaves.low.copy(), leaves.high.copy()
    low[turn > 0] = leaves.high[turn > 0]
    high[turn < 0] = leaves.low[turn < 0]
    return halved(replace(leaves, low=low, high=high), ~(turn != 0).any(1), spread)


def _needless(count: int, cell: Indices, sure: Array, line: Array) -> NDArray[np.bool_]:
    """Leaves that add nothing to what one leaf of their cell is proved to hold."""
    witness = np.full(count, -1)
    order = np.argsort(sure, kind="stable")
    order = order[np.isfinite(sure[order])]
    witness[cell[order]] = order  # of several the last is kept
    needless = np.zeros(len(cell), np.bool_)
    surpassed(cell, witness, sure, line, needless)
    return needless


def _of_cells(count: int, cell: Indices, found: Shares, line: Array, inside: NDArray[np.bool_]) -> Shares:
    """Of each cell the best leaf's inner share, and no more than all leaves leave together."""
    inner, estimate, outer = np.zeros(count), np.zeros(count), np.zeros(count)
    limit, area = np.full(count, -1, np.int64), np.zeros(count)
    np.maximum.at(inner, cell, found.inner)
    widest = np.full(count, -1)
    order = np.argsort(found.outer, kind="stable")  # of several the last is kept
    widest[cell[order]] = order
    united(cell, widest, line, found.outer, outer)
    order = np.argsort(found.estimate, kind="stable")
    estimate[cell[order]], limit[cell[order]] = found.estimate[order], found.limit[order]
    area[cell[order]] = found.area[order]
    inner[inside], outer[inside], estimate[inside], limit[inside], area[inside] = 1.0, 1.0, 1.0, -1, 0.0
    # A leaf that lost no need has a limit only in its estimate; an undecided cell must name one.
    limit[~inside & (outer > 0.0) & (limit < 0)] = 0
    return Shares(inner, outer, estimate, limit, area)
