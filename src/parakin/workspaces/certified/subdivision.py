"""Adaptive subdivision by interval bisection: cells proved inside, cells proved outside, and bounds of those between.

A cell is a box of positions x. A position is allowed where all constraints hold at every orientation θ of a box
(total), or at one at least (inclusive). Parts of a cell are examined only for the constraints that the cell is not yet
proved to keep, and only at the orientations where such a constraint may be least; so the cost grows with the surface.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import pairwise, product
from math import inf
from typing import Any

import numpy as np

from ...arrays import Array, Flags, Indices, Progress
from ...budget import Budget
from .constraints import Constraint
from .orientation_boxes import BoxLists, OrientationBoxes, concatenate_lists
from .plane_cuts import CellFractions, take_rows

FIRST = 8  # cells along the longest side of the first box
MOST = 3_000_000  # undecided cells at a time
AT_ONCE = 8192  # cells refined together
OUTERMOST = 20_000  # cells refined for a closer box about all of them
_FEW = 64  # cells refined together at least, where the time is short
_FINEST = 2.0**-24  # smallest cell as a fraction of the first cells' edge: below this no digits are left
_DIGITS = 26  # binary, of the first cells' corners; the others are for their parts


@dataclass(frozen=True, eq=False)
class Cells:
    """Boxes of positions with what is known of each, and how the subdivision ended.

    low, size : (N, d) mm; ``size`` are a cell's edges
    inner, outer, estimate : (N,) fractions of the cell: proved inside at least, at most, and likely
    limit : (N,) index of the constraint that bounds it there; -1 for a cell inside
    area : (N,) of the boundary in it, mm² (mm in the plane), as estimated
    stopped : why the subdivision ended, as :attr:`Workspace.stopped`
    rounds : how many there were
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

    @cached_property
    def volumes(self) -> Array:
        """The volume of each cell, (N,) mm³ (mm² in the plane)."""
        return multiply_columns(self.size)

    @cached_property
    def longest_edges(self) -> Array:
        """The longest edge of each cell, (N,) mm; by columns, for rows are so short."""
        return np.asarray(reduce(np.maximum, self.size.T))

    @property
    def inside(self) -> Flags:
        """Which cells are proved inside, (N,)."""
        return self.limit < 0

    def total(self, fractions: Array) -> float:
        """Sum the volume that ``fractions`` (N,) of the cells are together, mm³ (mm² in the plane)."""
        return float(np.einsum("n,n->", fractions, self.volumes))  # BLAS' threads go on spinning

    @cached_property
    def totals(self) -> Array:
        """The volumes that are inside at least, at most and likely, (3,) mm³ (mm² in the plane)."""
        return np.array([self.total(fractions) for fractions in (self.inner, self.outer, self.estimate)])

    @property
    def gap(self) -> float:
        """(outer - inner)/estimate; 0 if both are zero."""
        return compute_gap(self.totals)

    @cached_property
    def corners(self) -> tuple[Array, Array]:
        """The box about all cells, (d,) mm each; of no cells it is inverted."""
        low = [column.min(initial=inf) for column in self.low.T]
        high = [column.max(initial=-inf) for column in (self.low + self.size).T]
        return np.array(low), np.array(high)

    @cached_property
    def undecided_volumes(self) -> Array:
        """The volume of each cell that is not decided, (N,) mm³ (mm² in the plane)."""
        return np.asarray((self.outer - self.inner) * self.volumes)

    def take(self, which: Flags | Indices) -> Cells:
        """Keep some of the cells.

        which : flags (N,) or indices
        """
        rows = take_rows([getattr(self, name) for name in _COLUMNS], which)
        columns: dict[str, Any] = dict(zip(_COLUMNS, rows, strict=True))
        return replace(self, **columns)

    def __repr__(self) -> str:
        return f"<parakin cells: {len(self.low)}, {np.count_nonzero(self.inside)} of them inside>"


def compute_gap(totals: Array) -> float:
    """Compute (outer - inner)/estimate of the totals of :class:`Cells`; 0 if both are zero."""
    inner, outer, estimate = totals.tolist()
    return (outer - inner) / estimate if estimate > 0.0 else (inf if outer > 0.0 else 0.0)


def multiply_columns(rows: Array) -> Array:
    """Multiply the columns of rows (N, d), (N,); many times quicker than along such short rows."""
    return np.asarray(reduce(np.multiply, rows.T, np.ones(len(rows))))


_COLUMNS = ("low", "size", "inner", "outer", "estimate", "limit", "area")


def concatenate_cells(groups: Sequence[Cells]) -> Cells:
    """Put cells together; how the work ended is taken from the first group."""
    columns: dict[str, Any] = {name: np.concatenate([getattr(group, name) for group in groups]) for name in _COLUMNS}
    return replace(groups[0], **columns)


def make_empty_cells(dimension: int) -> Cells:
    """Make no cells, of positions with so many coordinates."""
    none = np.zeros(0)
    return Cells(np.zeros((0, dimension)), np.zeros((0, dimension)), none, none, none, np.zeros(0, np.int64), none)


@dataclass(frozen=True, eq=False)
class OpenCells:
    """Undecided cells, and lists of what is still to be proved of them."""

    cells: Cells
    boxes: BoxLists

    def __len__(self) -> int:
        return len(self.cells.low)

    def take(self, which: Indices) -> OpenCells:
        """Keep some of the cells, each once."""
        new = np.full(len(self), -1)
        new[which] = np.arange(len(which))
        return OpenCells(self.cells.take(which), self.boxes.renumber(new))


def concatenate_open_cells(groups: Sequence[OpenCells]) -> OpenCells:
    """Put groups of open cells together."""
    if len(groups) == 1:
        return groups[0]
    offsets = np.cumsum([0, *map(len, groups)]).tolist()
    lists = [group.boxes.shift(offset) for group, offset in zip(groups, offsets, strict=False)]
    return OpenCells(concatenate_cells([group.cells for group in groups]), concatenate_lists(lists))


class Subdivision(ABC):
    """The subdivision of a box of positions under constraints; :meth:`run` refines it until a condition stops it.

    constraints : what must be ≥ 0
    low, high : the box's corners, (d,) mm
    orientations : low and high of the swept axes, (s,) rad each
    closely : whether signs are proved where bounds don't tell them; it is of no use in cells larger than the machine
    finest : mm; cells that are no longer are not divided
    decided_cells : cells proved inside, a list of groups
    budget : of the round that runs
    rounds : how many there were
    open_groups : undecided cells, those of each round together, so that a round copies only what it cuts
    """

    def __init__(
        self,
        constraints: Sequence[Constraint],
        low: Array,
        high: Array,
        orientations: tuple[Array, Array],
        closely: bool = True,
    ):
        self.constraints, self.closely = list(constraints), closely
        edge = float((high - low).max()) / FIRST
        self.finest = edge * _FINEST
        counts = np.maximum(1, np.ceil((high - low) / edge - 1e-9)).astype(int)
        low, size = _snap_to_grid(low, high, counts)
        index = np.array(list(product(*[range(n) for n in counts])), float).reshape(-1, len(low))
        self._decided: list[Cells] = []  # in the round that runs
        self.budget: Budget | None = None  # of that round
        self.rounds = 0
        began = time.monotonic()
        bottom, top = (np.broadcast_to(end, (len(index), len(end))) for end in orientations)
        boxes = self._list_boxes(np.arange(len(index)), bottom, top)
        self.open_groups = [self._examine(low + index * size, np.tile(size, (len(index), 1)), boxes)]
        self.decided_cells = self._decided
        self._seconds_per_cell = (time.monotonic() - began + 1e-9) / len(index)  # of the last cells

    @abstractmethod
    def _list_boxes(self, cell: Indices, low: Array, high: Array) -> list[OrientationBoxes]:
        """List all there is to prove of the first cells, at orientations [low, high]."""

    @abstractmethod
    def _examine(self, low: Array, size: Array, boxes: list[OrientationBoxes]) -> OpenCells:
        """Bound the cells' fractions; store the cells that are decided inside and drop those outside.

        ``boxes`` is what was not proved of the cells they were cut from.
        """

    def _sort_out(self, low: Array, size: Array, fractions: CellFractions, boxes: list[OrientationBoxes]) -> OpenCells:
        """Store the cells proved inside, drop those outside, and return the others."""
        estimate = np.clip(fractions.estimate, fractions.inner, fractions.outer)
        limit = np.where(fractions.inner >= 1.0, -1, fractions.limit)
        area = fractions.area * multiply_columns(size)
        cells = Cells(low, size, fractions.inner, fractions.outer, estimate, limit, area)
        outside = fractions.outer <= 0.0
        self._decided.append(cells.take(~outside & (limit < 0)))
        return OpenCells(cells, BoxLists.join(boxes)).take(np.flatnonzero(~outside & (limit >= 0)))

    @property
    def open_cells(self) -> Cells:
        """All undecided cells."""
        return concatenate_cells([group.cells for group in self.open_groups])

    def _take_open_cells(self, which: Indices) -> OpenCells:
        """Take some of the undecided cells, by their sorted indices among all of them."""
        edges = np.cumsum([0, *map(len, self.open_groups)])
        cuts = np.searchsorted(which, edges)
        groups = [
            group.take(which[a:b] - first)
            for group, first, (a, b) in zip(self.open_groups, edges, pairwise(cuts), strict=False)
            if b > a
        ]
        return concatenate_open_cells(groups or [self.open_groups[0].take(which)])

    def refine(self, parents: Indices, budget: Budget | None = None) -> None:
        """Divide open cells into 2^d children each, the first ones first, as many as the budget's time allows.

        parents : indices of the cells to divide
        budget : of time; without it all are divided

        Interrupted, it leaves the cells as they were.
        """
        self._decided, self.budget = [], budget
        d = self.open_groups[0].cells.low.shape[1]
        corners = np.array(list(product((0.0, 1.0), repeat=d)))
        is_cut = np.zeros(sum(map(len, self.open_groups)), np.bool_)
        examined: list[OpenCells] = []
        start = 0
        while start < len(parents):
            began = time.monotonic()
            left = inf if budget is None else budget.seconds_left
            if start and not left > 0.0:
                break
            count = int(min(AT_ONCE, 0.5 * left / self._seconds_per_cell))
            batch = np.sort(parents[start : start + max(_FEW, count)])
            start += len(batch)
            is_cut[batch] = True
            cut = self._take_open_cells(batch)
            half = 0.5 * cut.cells.size
            low = (cut.cells.low[:, None] + corners * half[:, None]).reshape(-1, d)
            boxes = cut.boxes.repeat_for_children(len(corners))
            examined.append(self._examine(low, np.repeat(half, len(corners), 0), boxes.split()))
            self._seconds_per_cell = (time.monotonic() - began + 1e-9) / len(batch)
        groups = []
        for group, cuts in zip(self.open_groups, _split_by_groups(is_cut, self.open_groups), strict=True):
            rest = group.take(np.flatnonzero(~cuts)) if cuts.any() else group
            groups += [rest] if len(rest) else []
        self.open_groups = [*groups, concatenate_open_cells(examined)] if examined else groups or self.open_groups[:1]
        self.decided_cells = [*self.decided_cells, *self._decided]
        self.rounds += 1

    def collect_cells(self, stopped: str) -> Cells:
        """Put all cells together.

        stopped : why the subdivision ends
        """
        return replace(concatenate_cells(self._groups), stopped=stopped, rounds=self.rounds)

    @property
    def _groups(self) -> list[Cells]:
        return [*self.decided_cells, *(group.cells for group in self.open_groups)]

    def tighten(self, fraction: float, budget: Budget | None = None) -> tuple[Array, Array] | None:
        """Refine the outermost cells until none is larger than a fraction of the box about all cells.

        Returns that box, (d,) mm each corner, or None if there are no cells. Faces along which very many cells lie are
        left as they are, and so are all where the budget is spent.

        fraction : of the box's edges
        budget : of time
        """
        while True:
            corners = [group.corners for group in self._groups]
            low, high = np.min([ends[0] for ends in corners], 0), np.max([ends[1] for ends in corners], 0)
            if not (low <= high).all():
                return None
            slack = 1e-9 * (high - low)
            edges = np.concatenate([group.cells.longest_edges for group in self.open_groups])
            coarse = np.flatnonzero(edges > (high - low).max() * fraction)
            bottom = np.concatenate([group.cells.low for group in self.open_groups])[coarse]
            top = bottom + np.concatenate([group.cells.size for group in self.open_groups])[coarse]
            coarse = coarse[((bottom <= low + slack) | (top >= high - slack)).any(1)]
            if not len(coarse) or len(coarse) > OUTERMOST or (budget is not None and budget.is_spent()):
                return low, high
            self.refine(coarse, budget)

    def run(
        self,
        gap: float,
        cell: float | None = None,
        budget: Budget | None = None,
        progress: Progress | None = None,
    ) -> Cells:
        """Refine until the relative gap or the cells' size is reached, or until the budget is spent.

        gap : (outer - inner)/estimate of the volume
        cell : edge of the boundary's cells, mm, in place of the gap
        budget : of time
        progress : called with the fraction done

        Interrupted, it returns the cells it has.
        """
        try:
            while True:
                totals = np.sum([group.totals for group in self._groups], 0)
                stopped, parents = self._choose_parents(totals, gap, cell)
                if not stopped and budget is not None and budget.is_spent():
                    stopped = "time"
                if stopped:
                    return self.collect_cells(stopped)
                if progress:
                    left = compute_gap(totals)
                    progress(min(1.0, gap / left) if left > 0 else 1.0)
                self.refine(parents, budget)
        except KeyboardInterrupt:
            return self.collect_cells("interrupted")

    def _choose_parents(self, totals: Array, gap: float, cell: float | None) -> tuple[str, Indices]:
        """Choose which open cells to refine, the worst first; returns why to stop, or "", and their indices.

        totals : of all cells
        """
        open_cells = [group.cells for group in self.open_groups]
        edges = np.concatenate([cells.longest_edges for cells in open_cells])
        large = edges > (self.finest if cell is None else max(cell * (1.0 + 1e-9), self.finest))
        if cell is None and compute_gap(totals) <= gap:
            return "gap", np.zeros(0, np.int64)
        if not large.any():
            return ("resolution" if cell is None else "cell"), np.zeros(0, np.int64)
        if len(edges) > MOST or sum(group.boxes.counts.sum() for group in self.open_groups) > 4 * MOST:
            return "memory", np.zeros(0, np.int64)
        undecided = np.where(large, np.concatenate([cells.undecided_volumes for cells in open_cells]), -1.0)
        order = np.argsort(-undecided, kind="stable")
        order = order[: int(large.sum())]
        if cell is not None:
            return "", order
        rest = float(undecided[large].sum()) - np.cumsum(undecided[order])  # if all up to here were decided
        return "", order[: int(np.searchsorted(-rest, -0.5 * gap * totals[2])) + 1]


def _split_by_groups(flags: Flags, groups: Sequence[OpenCells]) -> list[Flags]:
    """Split flags of all cells into those of each group."""
    return np.split(flags, np.cumsum([len(group) for group in groups])[:-1])


def _snap_to_grid(low: Array, high: Array, counts: Indices) -> tuple[Array, Array]:
    """Compute lower corner and size of ``counts`` cells that hold a box.

    Both have so few digits that the corners of children at any depth are exact: adjacent cells leave no gap.
    """
    _, exponent = np.frexp(np.maximum(np.abs(low), np.abs(high)))
    unit = np.ldexp(1.0, exponent - _DIGITS)
    low, high = np.floor(low / unit), np.ceil(high / unit)
    return low * unit, np.ceil((high - low) / counts) * unit
