"""Adaptive subdivision on intervals: cells proved inside, cells proved outside, and what is proved of those between.

A cell is a box of places x. A set of allowed places is where all constraints hold for every θ of a box of turns
(``every``), or for at least one. Only constraints that a cell has not yet been proved to keep are looked at in its
parts, and of the turns only those where such a constraint may be least; so the cost grows with the surface.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernels.batch import run_in_threads
from .constraints import Constraint
from .plane_cuts import gather, lines

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FIRST = 8  # cells along the longest side of the first box
MOST = 3_000_000  # cells open at a time
AT_ONCE = 8192  # cells refined together
OUTERMOST = 20_000  # cells refined for a closer box about all of them
_FEW = 64  # where the time is short
_FINEST = 2.0**-24  # of the first cells: below this the numbers have no digits left
_DIGITS = 26  # binary, of the first cells' corners; the others are for their parts


@dataclass(frozen=True, eq=False)
class Cells:
    """Boxes of places with what is known of each, and how the work ended.

    low, size : (N, d), mm; ``size`` a cell's edges
    inner, outer, estimate : (N,) shares of the cell: proved inside at least, at most, and likely
    limit : (N,) index of the constraint that bounds it there; -1 for a cell inside
    area : (N,) of the boundary in it, mm² (mm in the plane), as estimated
    """

    low: Array
    size: Array
    inner: Array
    outer: Array
    estimate: Array
    limit: Indices
    area: Array
    stopped: str = "gap"
    rounds: int = 0

    @property
    def volumes(self) -> Array:
        return np.asarray(self.size.prod(1))

    @property
    def inside(self) -> NDArray[np.bool_]:
        return self.limit < 0

    def total(self, shares: Array) -> float:
        return float(np.dot(shares, self.volumes))

    @property
    def gap(self) -> float:
        """(outer - inner)/estimate; 0 for nothing at all."""
        outer, inner, estimate = (self.total(part) for part in (self.outer, self.inner, self.estimate))
        return (outer - inner) / estimate if estimate > 0.0 else (np.inf if outer > 0.0 else 0.0)

    def take(self, which: NDArray[np.bool_] | Indices) -> Cells:
        parts: dict[str, Any] = {name: getattr(self, name)[which] for name in _COLUMNS}
        return replace(self, **parts)


_COLUMNS = ("low", "size", "inner", "outer", "estimate", "limit", "area")


def joined(parts: Sequence[Cells]) -> Cells:
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
    return replace(parts[0], **columns)


@dataclass(frozen=True, eq=False)
class Items:
    """What is still to be shown: in these cells, for these boxes of turns [low, high], (N, s).

    ``needs`` (N, constraints) tells of which constraints, where a list is not one constraint's alone.
    """

    cell: Indices
    low: Array
    high: Array
    needs: NDArray[np.bool_]

    def take(self, which: NDArray[np.bool_] | Indices) -> Items:
        return Items(self.cell[which], self.low[which], self.high[which], self.needs[which])

    def moved(self, place: Indices) -> Items:
        """With the cells' new numbers; the items of cells without one (-1) are dropped."""
        kept = self.take(place[self.cell] >= 0)
        return replace(kept, cell=place[kept.cell])

    def shifted(self, offset: int) -> Items:
        return replace(self, cell=self.cell + offset)

    def in_parts(self, count: int) -> Items:
        """For every one of the ``count`` parts of each cell."""
        cell = (self.cell[:, None] * count + np.arange(count)).reshape(-1)
        return replace(self.take(np.repeat(np.arange(len(self.cell)), count)), cell=cell)


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight bounds of one constraint over items; see :func:`parakin.workspaces.certified.plane_cuts.lines`."""

    state: NDArray[np.int8]
    turn: NDArray[np.int8]
    low: Array
    high: Array
    slopes: Array
    spread: Array

    def take(self, which: NDArray[np.bool_] | Indices) -> Lines:
        return Lines(*(getattr(self, name)[which] for name in ("state", "turn", "low", "high", "slopes", "spread")))


def bounds(constraint: Constraint, low: Array, size: Array, items: Items, every: bool) -> Lines:
    """Straight bounds over the items' boxes: cells of corner ``low`` and edges ``size``, turns in [low, high]."""
    d, n = low.shape[1], len(items.cell)
    corner = low[items.cell]
    bottom = np.concatenate([corner, items.low], 1)
    top = np.concatenate([corner + size[items.cell], items.high], 1)
    middle = 0.5 * (bottom + top)
    half = np.maximum(middle - bottom, top - middle)
    over = constraint.over(bottom, top)
    at = constraint.at(middle, middle)
    s = items.low.shape[1]
    result = Lines(
        np.empty(n, np.int8), np.empty((n, s), np.int8), np.empty(n), np.empty(n), np.empty((n, d)), np.empty((n, s))
    )
    into = (result.state, result.turn, result.low, result.high, result.slopes, result.spread)
    run_in_threads(n, lambda start, stop: lines(constraint.smooth, *over, *at, half, d, every, *into, start, stop))
    return result


@dataclass(frozen=True, eq=False)
class Shares:
    """What is found of cells, as shares of each: columns as in :class:`Cells`, ``area`` a unit of volume."""

    inner: Array
    outer: Array
    estimate: Array
    limit: Indices
    area: Array


class Cuts:
    """What the constraints cut off each of ``n`` boxes together, one constraint after the other."""

    def __init__(self, n: int):
        self.bad, self.outer, self.lost, self.near = np.zeros(n), np.ones(n), np.zeros(n), np.full(n, np.inf)
        self.limit, self.area = np.full(n, -1, np.int64), np.zeros(n)

    def add(self, number: int, box: Indices, half: Array, found: Lines) -> None:
        """The cuts of one constraint; ``box`` is sorted, several lines of one box must all hold."""
        given = (box, half, found.low, found.high, found.slopes, number)
        into = (self.bad, self.outer, self.lost, self.near, self.limit, self.area)
        run_in_threads(len(box), lambda start, stop: gather(*given, *into, start, stop))

    @property
    def shares(self) -> Shares:
        estimate = 0.5 * (np.maximum(0.0, 1.0 - self.lost) + np.minimum(self.near, 1.0))
        return Shares(np.maximum(0.0, 1.0 - self.bad), self.outer, estimate, self.limit, self.area)


class Subdivision(ABC):
    """The work on one set of constraints; ``run`` refines until it is told to stop."""

    def __init__(self, constraints: Sequence[Constraint], low: Array, high: Array, turns: tuple[Array, Array]):
        self.constraints = list(constraints)
        self.turns = turns
        edge = float((high - low).max()) / FIRST
        self.finest = edge * _FINEST
        counts = np.maximum(1, np.ceil((high - low) / edge - 1e-9)).astype(int)
        low, size = _on_a_grid(low, high, counts)
        index = np.array(list(product(*[range(n) for n in counts])), float).reshape(-1, len(low))
        self._decided: list[Cells] = []  # in the round that runs
        self.rounds = 0
        began = time.monotonic()
        bottom, top = (np.broadcast_to(end, (len(index), len(end))) for end in turns)
        left = self._first(np.arange(len(index)), bottom, top)
        self.open, self.left = self._examined(low + index * size, np.tile(size, (len(index), 1)), left)
        self.done = self._decided
        self._pace = (time.monotonic() - began + 1e-9) / len(index)  # seconds a cell, of late

    @abstractmethod
    def _first(self, cell: Indices, low: Array, high: Array) -> list[Items]:
        """All there is to show, of the first cells."""

    @abstractmethod
    def _examined(self, low: Array, size: Array, left: list[Items]) -> tuple[Cells, list[Items]]:
        """Cells with what is found of them; those decided are laid aside, those outside are dropped.

        ``left`` is what was not shown of the cells they were cut from.
        """

    def _sorted_out(self, low: Array, size: Array, found: Shares, left: list[Items]) -> tuple[Cells, list[Items]]:
        estimate = np.clip(found.estimate, found.inner, found.outer)
        limit = np.where(found.inner >= 1.0, -1, found.limit)
        cells = Cells(low, size, found.inner, found.outer, estimate, limit, found.area * size.prod(1))
        gone = found.outer <= 0.0
        self._decided.append(cells.take(~gone & (limit < 0)))
        undecided = np.flatnonzero(~gone & (limit >= 0))
        place = np.full(len(low), -1)
        place[undecided] = np.arange(len(undecided))
        return cells.take(undecided), [part.moved(place) for part in left]

    def refine(self, parents: Indices, deadline: float = inf) -> None:
        """Cut these open cells into 2^d parts each, the first ones first, as many as the time allows.

        Interrupted, it leaves the cells as they were.
        """
        self._decided = []
        d = self.open.low.shape[1]
        corners = np.array(list(product((0.0, 1.0), repeat=d)))
        which = np.zeros(len(self.open.low), np.bool_)
        found: list[tuple[Cells, list[Items]]] = []
        start = 0
        while start < len(parents):
            began = time.monotonic()
            if start and began > deadline:
                break
            count = AT_ONCE if deadline == inf else int(min(AT_ONCE, 0.5 * (deadline - began) / self._pace))
            now = np.sort(parents[start : start + max(_FEW, count)])
            start += len(now)
            which[now] = True
            half = 0.5 * self.open.size[now]
            low = (self.open.low[now][:, None] + corners * half[:, None]).reshape(-1, d)
            place = np.full(len(which), -1)
            place[now] = np.arange(len(now))
            children = [part.moved(place).in_parts(len(corners)) for part in self.left]
            found.append(self._examined(low, np.repeat(half, len(corners), 0), children))
            self._pace = (time.monotonic() - began + 1e-9) / len(now)
        place = np.cumsum(~which) - 1
        place[which] = -1
        cells = [self.open.take(~which), *[part for part, _ in found]]
        offsets = np.cumsum([len(part.low) for part in cells])
        lists = [[part.moved(place) for part in self.left]]
        lists += [[part.shifted(n) for part in left] for n, (_, left) in zip(offsets, found, strict=False)]
        left, undecided = [both(parts) for parts in zip(*lists, strict=True)], joined(cells)
        self.open, self.left, self.done = undecided, left, [*self.done, *self._decided]
        self.rounds += 1

    # The whole.

    def cells(self, stopped: str) -> Cells:
        return replace(joined([*self.done, self.open]), stopped=stopped, rounds=self.rounds)

    def tighten(self, share: float, deadline: float = inf) -> tuple[Array, Array] | None:
        """Refine the outermost cells until none is larger than a share of the box about all cells: that box, or None.

        Faces along which very many cells lie are left as they are.
        """
        while True:
            cells, left = self.cells("gap"), self.open
            if not len(cells.low):
                return None
            low, high = cells.low.min(0), (cells.low + cells.size).max(0)
            slack = 1e-9 * (high - low)
            outermost = (left.low <= low + slack) | (left.low + left.size >= high - slack)
            coarse = np.flatnonzero(outermost.any(1) & (left.size.max(1) > (high - low).max() * share))
            if not len(coarse) or len(coarse) > OUTERMOST or time.monotonic() > deadline:
                return low, high
            self.refine(coarse)

    def run(
        self,
        gap: float,
        cell: float | None = None,
        seconds: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Cells:
        """Refine until the relative gap, the cells' size or the time is reached; interrupted, it gives what it has."""
        deadline = inf if seconds is None else time.monotonic() + seconds
        try:
            while True:
                now = self.cells("gap")
                stopped, parents = self._next(now, gap, cell)
                if not stopped and time.monotonic() > deadline:
                    stopped = "time"
                if stopped:
                    return replace(now, stopped=stopped)
                if progress:
                    progress(min(1.0, gap / now.gap) if now.gap > 0 else 1.0)
                self.refine(parents, deadline)
        except KeyboardInterrupt:
            return self.cells("interrupted")

    def _next(self, now: Cells, gap: float, cell: float | None) -> tuple[str, Indices]:
        """Why to stop, or "" and which cells to refine, the worst first."""
        large = self.open.size.max(1) > (self.finest if cell is None else max(cell * (1.0 + 1e-9), self.finest))
        if cell is None and now.gap <= gap:
            return "gap", np.zeros(0, np.int64)
        if not large.any():
            return ("resolution" if cell is None else "cell"), np.zeros(0, np.int64)
        if len(self.open.low) > MOST or sum(len(part.cell) for part in self.left) > 4 * MOST:
            return "memory", np.zeros(0, np.int64)
        undecided = np.where(large, (self.open.outer - self.open.inner) * self.open.volumes, -1.0)
        order = np.argsort(-undecided, kind="stable")
        order = order[: int(large.sum())]
        if cell is not None:
            return "", order
        rest = float(undecided[large].sum()) - np.cumsum(undecided[order])  # if all up to here vanished
        return "", order[: int(np.searchsorted(-rest, -0.5 * gap * now.total(now.estimate))) + 1]


def _on_a_grid(low: Array, high: Array, counts: NDArray[np.int64]) -> tuple[Array, Array]:
    """Lower corner and size of ``counts`` cells that hold a box.

    Both have so few digits that the corners of all parts of parts are exact: no sliver is left between neighbours.
    """
    _, exponent = np.frexp(np.maximum(np.abs(low), np.abs(high)))
    unit = np.ldexp(1.0, exponent - _DIGITS)
    low, high = np.floor(low / unit), np.ceil(high / unit)
    return low * unit, np.ceil((high - low) / counts) * unit


def both(parts: Sequence[Items]) -> Items:
    names = ("cell", "low", "high", "needs")
    return Items(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def in_order(parts: Sequence[tuple[Items, Lines]]) -> tuple[Items, Lines]:
    """All parts together, sorted by cell."""
    items = both([part for part, _ in parts])
    names = ("state", "turn", "low", "high", "slopes", "spread")
    found = Lines(*(np.concatenate([getattr(part, name) for _, part in parts]) for name in names))
    order = np.argsort(items.cell, kind="stable")
    return items.take(order), found.take(order)


def halved(items: Items, which: NDArray[np.bool_], spread: Array) -> Items:
    """Some items' turns halved: the one that leaves most open, or the widest where that is not known."""
    cut = np.flatnonzero(which)
    known = np.isfinite(spread[cut]).all(1, keepdims=True)
    axis = np.where(known, spread[cut], (items.high - items.low)[cut]).argmax(1)
    row = np.arange(len(cut))
    middle = 0.5 * (items.low[cut, axis] + items.high[cut, axis])
    first, second = items.take(cut), items.take(cut)
    first.high[row, axis], second.low[row, axis] = middle, middle
    return both([items.take(~which), first, second])
