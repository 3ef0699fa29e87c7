"""Connected components of certified cells: what hangs together of a region on one side of a singularity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...budget import Budget
from ..certified.constraints import Constraint
from ..certified.containment import prove_boxes
from ..certified.region import Region
from ..certified.subdivision import Cells
from ..inscribed.seeds import refuse_interrupted
from .adjacency import find_adjacent_cells, label_components

_GAP = 1e-9  # never reached: the cells' size ends the subdivision
_FINER, _DEEPER = 8, 2  # how much finer, and how often, an undecided group of cells is subdivided
_ROUNDS = 4  # rounds of the search for boxes that join cells
_ALONG = (0.5, 0.02, 0.98)  # where across what two cells have in common a joining box may run
_THIN = 1e-3  # half width of a joining box, as a fraction of a cell
_MOST_BOXES = 64  # greatest number of sub-boxes of a joining box that are examined
_LINKS = 4096  # examined in a round
_FEW = 8  # cells: fewer that nothing joins nor separates are no component of their own


@dataclass(frozen=True, eq=False)
class CellComponent:
    """Cells proved inside, (N, d) mm, that hang together.

    inner, estimate, outer : volumes, the outer one with all that may belong to it
    box : corners of a box proved to hold it
    apart : no undecided cell joins it to another component
    """

    low: Array
    size: Array
    inner: float
    estimate: float
    outer: float
    box: tuple[Array, Array]
    apart: bool


@dataclass(frozen=True, eq=False)
class CellComponents:
    """All components, how many of them are proved to be different, and the volume that may be more of them."""

    components: list[CellComponent]
    at_least: int
    undecided: float
    stopped: str


class Resolution(NamedTuple):
    """How finely a region is subdivided: the cells' edge, mm, within a budget, and how often again more finely."""

    cell: float
    budget: Budget
    deeper: int = _DEEPER


class _LabelledCells(NamedTuple):
    """Cells, the component (N,) of each that is inside, and the one that each undecided cell touches, else -1."""

    cells: Cells
    component: Indices
    owner: Indices


def find_cell_components(
    region: Region, side: Sequence[Constraint], low: Array, high: Array, resolution: Resolution
) -> CellComponents:
    """Find the connected components of a region within a box [low, high], where those of one side are kept too.

    Cells that share a point, undecided ones included, form groups; no path leads from one group to another.
    """
    subdivision = region.subdivide(low, high, side)
    cells = refuse_interrupted(subdivision.run(_GAP, resolution.cell, resolution.budget))
    if not len(cells.low):
        return CellComponents([], 0, 0.0, cells.stopped)
    faces, points = find_adjacent_cells(cells.low, cells.size)
    group = label_components(len(cells.low), points)
    component = _join_cells(region, side, cells, (faces, points), resolution.budget)
    labelled = _LabelledCells(cells, component, _spread_owners(component, cells.inside, points))
    components, at_least, undecided = [], 0, 0.0
    for number in np.unique(group):
        members = group == number
        own = np.unique(component[members & cells.inside]).tolist()
        if len(own) > 1:
            own = [which for which in own if (component == which).sum() >= _FEW] or own[:1]
        if own:
            at_least += 1
            own_components, lost = _measure_components(labelled, members, own)
            undecided += lost
            components += own_components
        else:
            finer = _refine_group(region, side, cells, members, resolution)
            components += finer.components
            at_least += finer.at_least
            undecided += finer.undecided
    return CellComponents(components, at_least, undecided, cells.stopped)


def _measure_components(labelled: _LabelledCells, members: Flags, own: list[int]) -> tuple[list[CellComponent], float]:
    """Measure the components ``own`` of a group of cells; returns them, and the volume inside that is of none."""
    cells, component, owner = labelled
    inside = cells.inside
    vague = cells.take(members & ~inside)
    lost = members & inside & ~np.isin(component, own)
    lost_volume = float(cells.volumes[lost].sum())
    box = cells.low[members].min(0), (cells.low + cells.size)[members].max(0)
    components = []
    for which in own:
        proved = cells.take(inside & (component == which))
        inner = float(proved.volumes.sum())
        estimate = inner + _sum_volumes(cells, cells.estimate, ~inside & (owner == which))
        outer = inner + vague.total(vague.outer) + lost_volume
        components.append(CellComponent(proved.low, proved.size, inner, estimate, outer, box, len(own) == 1))
    return components, lost_volume


def _sum_volumes(cells: Cells, fractions: Array, which: Flags) -> float:
    return float(fractions[which] @ cells.volumes[which])


def _refine_group(
    region: Region, side: Sequence[Constraint], cells: Cells, members: Flags, resolution: Resolution
) -> CellComponents:
    """Find the components of a group of undecided cells by finer ones, if no other cell is in their box."""
    low, high = cells.low[members].min(0), (cells.low + cells.size)[members].max(0)
    others = ~members & (cells.low < high).all(1) & (cells.low + cells.size > low).all(1)
    if not resolution.deeper or others.any() or resolution.budget.is_spent():
        return CellComponents([], 0, _sum_volumes(cells, cells.outer, members), cells.stopped)
    finer = Resolution(resolution.cell / _FINER, resolution.budget, resolution.deeper - 1)
    return find_cell_components(region, side, low, high, finer)


def _join_cells(
    region: Region, side: Sequence[Constraint], cells: Cells, adjacency: tuple[Indices, Indices], budget: Budget
) -> Indices:
    """Label cells inside that hang together: by faces, or by thin boxes that are proved inside.

    adjacency : pairs of cells that share a face, and that share a point, as of :func:`find_adjacent_cells`
    """
    faces, points = adjacency
    inside, count = cells.inside, len(cells.low)
    pairs = faces[inside[faces].all(1)]
    component = label_components(count, pairs)
    for _ in range(_ROUNDS):
        links = _list_links(component, inside, points)
        proved = _prove_links(region, side, cells, links, budget)
        if not proved.any():
            break
        pairs = np.concatenate([pairs, links[proved]])
        component = label_components(count, pairs)
    return component


def _list_links(component: Indices, inside: Flags, points: Indices) -> Indices:
    """List pairs of cells inside, of different components, that touch, or that one undecided cell touches."""
    a, b = points.T
    direct = points[inside[a] & inside[b] & (component[a] != component[b])]
    by = np.concatenate([points[inside[a] & ~inside[b]][:, ::-1], points[~inside[a] & inside[b]]])
    _, first = np.unique(by[:, 0] * len(component) + component[by[:, 1]], return_index=True)
    by = by[first]  # sorted by the undecided cell: one cell of each component that it touches
    same = by[1:, 0] == by[:-1, 0]
    links = np.concatenate([direct, np.column_stack([by[:-1, 1], by[1:, 1]])[same]])
    return links[:: max(1, -(-len(links) // _LINKS))]


def _prove_links(region: Region, side: Sequence[Constraint], cells: Cells, links: Indices, budget: Budget) -> Flags:
    """Prove that a thin box from cell to cell is inside, for each of the links."""
    proved = np.zeros(len(links), np.bool_)
    top = cells.low + cells.size
    ends = np.stack([cells.low[links].max(1), top[links].min(1)])
    apart = ends[0] > ends[1]
    low, high = ends.min(0), ends.max(0)
    thin = _THIN * cells.size.min(0)
    for along in product(_ALONG, repeat=low.shape[1]):
        left = np.flatnonzero(~proved)
        if not len(left):
            break
        middle = low[left] + np.array(along) * (high[left] - low[left])
        box_low = np.where(apart[left], low[left], middle - thin)
        box_high = np.where(apart[left], high[left], middle + thin)
        proved[left] = prove_boxes(region, box_low, box_high, side, _MOST_BOXES, budget).proved
    return proved


def _spread_owners(component: Indices, inside: Flags, points: Indices) -> Indices:
    """Find the component that each undecided cell touches, directly or by others; -1 for none."""
    owner = np.where(inside, component, -1)
    while True:
        a, b = owner[points[:, 0]], owner[points[:, 1]]
        to = np.concatenate([points[(a < 0) & (b >= 0)][:, 0], points[(b < 0) & (a >= 0)][:, 1]])
        if not len(to):
            return owner
        np.maximum.at(owner, to, np.concatenate([b[(a < 0) & (b >= 0)], a[(b < 0) & (a >= 0)]]))
