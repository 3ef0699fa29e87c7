"""What hangs together of a region on one side of a singularity, by its certified cells."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..certified.constraints import Constraint
from ..certified.containment import verdicts
from ..certified.region import Region
from ..certified.subdivision import Cells
from ..inscribed.seeds import whole
from .adjacency import Indices, labelled, touching

_GAP = 1e-9  # never reached: the cells' size ends the work
_FINER, _DEEPER = 8, 2  # how much finer, and how often, a speck is looked at
_ROUNDS = 4  # of looking for boxes that join
_AT = (0.5, 0.02, 0.98)  # where across the common part of two cells a joining box may run
_THIN = 1e-3  # of a cell: its half width
_PARTS = 64  # it may be cut into to be proved
_LINKS = 4096  # looked at in a round
_FEW = 8  # cells: fewer that nothing joins nor parts are no island of their own


@dataclass(frozen=True, eq=False)
class Island:
    """Cells proved inside, (N, d), that hang together.

    inner, estimate, outer : volumes, the outer one with all that may belong to it
    box : corners of a box proved to hold it
    apart : nothing undecided joins it to another
    """

    low: Array
    size: Array
    inner: float
    estimate: float
    outer: float
    box: tuple[Array, Array]
    apart: bool


@dataclass(frozen=True, eq=False)
class Islands:
    """All islands, how many of them are proved to be different, and the volume that may be more of them."""

    islands: list[Island]
    at_least: int
    undecided: float
    stopped: str


def islands(
    region: Region,
    constraint: Constraint,
    low: Array,
    high: Array,
    cell: float,
    seconds: float | None,
    deeper: int = _DEEPER,
) -> Islands:
    """The islands of a region within a box, where the constraint holds too, by cells of the given size."""
    cells = whole(region.subdivide(low, high, [constraint]).run(_GAP, cell, seconds))
    if not len(cells.low):
        return Islands([], 0, 0.0, cells.stopped)
    faces, points = touching(cells.low, cells.size)
    inside, group = cells.inside, labelled(len(cells.low), points)
    island = _joined(region, constraint, cells, faces, points)
    owner = _owners(island, inside, points)
    found, at_least, undecided = [], 0, 0.0
    for number in np.unique(group):
        members = group == number
        own = np.unique(island[members & inside]).tolist()
        if len(own) > 1:
            own = [which for which in own if (island == which).sum() >= _FEW] or own[:1]
        if not own:
            speck = _speck(region, constraint, cells, members, cell, seconds, deeper)
            found += speck.islands
            at_least += speck.at_least
            undecided += speck.undecided
            continue
        at_least += 1
        vague = cells.take(members & ~inside)
        lost = members & inside & ~np.isin(island, own)
        undecided += float(cells.volumes[lost].sum())
        box = cells.low[members].min(0), (cells.low + cells.size)[members].max(0)
        for which in own:
            mine = cells.take(inside & (island == which))
            inner = float(mine.volumes.sum())
            estimate = inner + _total(cells, cells.estimate, ~inside & (owner == which))
            outer = inner + vague.total(vague.outer) + float(cells.volumes[lost].sum())
            found.append(Island(mine.low, mine.size, inner, estimate, outer, box, len(own) == 1))
    return Islands(found, at_least, undecided, cells.stopped)


def _total(cells: Cells, shares: Array, which: NDArray[np.bool_]) -> float:
    return float(shares[which] @ cells.volumes[which])


def _speck(
    region: Region,
    constraint: Constraint,
    cells: Cells,
    members: NDArray[np.bool_],
    cell: float,
    seconds: float | None,
    deeper: int,
) -> Islands:
    """Undecided cells on their own, looked at more finely if nothing else is in their box."""
    low, high = cells.low[members].min(0), (cells.low + cells.size)[members].max(0)
    others = ~members & (cells.low < high).all(1) & (cells.low + cells.size > low).all(1)
    if not deeper or others.any():
        return Islands([], 0, _total(cells, cells.outer, members), cells.stopped)
    return islands(region, constraint, low, high, cell / _FINER, seconds, deeper - 1)


def _joined(region: Region, constraint: Constraint, cells: Cells, faces: Indices, points: Indices) -> Indices:
    """Numbers, equal for cells inside that hang together: by faces, or by small boxes that are proved inside."""
    inside, count = cells.inside, len(cells.low)
    pairs = faces[inside[faces].all(1)]
    island = labelled(count, pairs)
    for _ in range(_ROUNDS):
        links = _links(island, inside, points)
        good = _bridged(region, constraint, cells, links)
        if not good.any():
            break
        pairs = np.concatenate([pairs, links[good]])
        island = labelled(count, pairs)
    return island


def _links(island: Indices, inside: NDArray[np.bool_], points: Indices) -> Indices:
    """Pairs of cells inside, of different islands, that touch, or that one undecided cell touches."""
    a, b = points.T
    direct = points[inside[a] & inside[b] & (island[a] != island[b])]
    by = np.concatenate([points[inside[a] & ~inside[b]][:, ::-1], points[~inside[a] & inside[b]]])
    _, first = np.unique(by[:, 0] * len(island) + island[by[:, 1]], return_index=True)
    by = by[first]  # sorted by the undecided cell: one cell of each island that it touches
    same = by[1:, 0] == by[:-1, 0]
    links = np.concatenate([direct, np.column_stack([by[:-1, 1], by[1:, 1]])[same]])
    return links[:: max(1, -(-len(links) // _LINKS))]


def _bridged(region: Region, constraint: Constraint, cells: Cells, links: Indices) -> NDArray[np.bool_]:
    """Whether thin boxes from cell to cell are proved inside."""
    good = np.zeros(len(links), np.bool_)
    top = cells.low + cells.size
    ends = np.stack([cells.low[links].max(1), top[links].min(1)])
    apart = ends[0] > ends[1]
    low, high = ends.min(0), ends.max(0)
    thin = _THIN * cells.size.min(0)
    for at in product(_AT, repeat=low.shape[1]):
        left = np.flatnonzero(~good)
        if not len(left):
            break
        middle = low[left] + np.array(at) * (high[left] - low[left])
        bottom = np.where(apart[left], low[left], middle - thin)
        over = np.where(apart[left], high[left], middle + thin)
        good[left] = verdicts(region, bottom, over, [constraint], _PARTS).proved
    return good


def _owners(island: Indices, inside: NDArray[np.bool_], points: Indices) -> Indices:
    """The island that each undecided cell touches, or touches by way of others; -1 for none."""
    owner = np.where(inside, island, -1)
    while True:
        a, b = owner[points[:, 0]], owner[points[:, 1]]
        to = np.concatenate([points[(a < 0) & (b >= 0)][:, 0], points[(b < 0) & (a >= 0)][:, 1]])
        if not len(to):
            return owner
        np.maximum.at(owner, to, np.concatenate([b[(a < 0) & (b >= 0)], a[(b < 0) & (a >= 0)]]))
