"""How a box in a region grows: by steps that its limits' slopes foretell, every box on the way proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...arrays import Array
from ..certified.best_orientation import best_turns, margins_at
from ..certified.containment import verdicts
from ..certified.region import Region
from .mask_boxes import ascent

MOST = 512  # parts of a box on the way; the last ones get more
_STEPS = 40
_FIRST = 0.25  # of the edges, how far a first step may go
_SHARES = (4.0, 2.0, 1.0, 0.6, 0.3, 0.1)  # of a foretold step; where turns adapt it may go farther
_BACK = (0.0, 0.01, 0.05, 0.2)  # of its length, by which the box is then drawn in: limits are not straight
_NODES = 5  # points along a box's edge where limits are looked at; 3 with turns
_MET = 64  # broken places that are remembered
_LENGTHS = 12  # tried at a time when one face moves


@dataclass(frozen=True, eq=False)
class Family:
    """Boxes with corners ``base`` + ``by``·z, (2, d) and (2, d, k): any, of given proportions, or about a centre.

    first : (k,) the z of the box to start from
    inward : (k,) changes no face by more than 1 mm, all to the inside
    outward : (g, k) each moves a face, or faces that can only move together, by 1 mm (those of the longest edge)
    """

    base: Array
    by: Array
    first: Array
    inward: Array
    outward: Array

    @classmethod
    def of(cls, low: Array, high: Array, shape: Array | None, centre: Array | None) -> Family:
        """The boxes like [low, high], which has the ``shape`` and the ``centre`` where these are given."""
        d = len(low)
        one, none = np.eye(d), np.zeros((d, d))
        both = np.array([low, high])
        if shape is None and centre is None:
            by = np.stack([np.hstack([one, none]), np.hstack([none, one])])
            inward = np.repeat([1.0, -1.0], d)
            return cls(np.zeros((2, d)), by, both.reshape(-1), inward, -np.diag(inward))
        if shape is None:
            half = 0.5 * (high - low)
            return cls(np.array([centre, centre]), np.stack([-one, one]), half, -np.ones(d), one)
        edge = 0.5 * shape[:, None]
        size = float(((high - low) / shape).min())
        if centre is None:
            by = np.stack([np.hstack([one, -edge]), np.hstack([one, edge])])
            last = np.eye(d + 1)[d]
            return cls(np.zeros((2, d)), by, np.append(both.mean(0), size), -2.0 * last, 2.0 * last[None])
        by, two = np.stack([-edge, edge]), np.array([2.0])
        return cls(np.array([centre, centre]), by, np.array([size]), -two, two[None])

    def box(self, z: Array) -> Array:
        """Corners (..., 2, d) of the boxes z (..., k)."""
        return np.asarray(self.base + np.einsum("cdk,...k->...cd", self.by, z))

    def proved(self, region: Region, z: Array, most: int) -> tuple[Array, Array]:
        """Volumes of the boxes z (n, k), 0 of those not proved; and what was met outside, as shares of box and turns.

        (m, d + s)
        """
        boxes = self.box(z)
        edges = boxes[:, 1] - boxes[:, 0]
        volumes = np.where((edges > 0.0).all(1), edges.prod(1), 0.0)
        some = np.flatnonzero(volumes > 0.0)
        found = verdicts(region, boxes[some, 0], boxes[some, 1], most=most)
        volumes[some[~found.proved]] = 0.0
        wrong = some[found.limit >= 0]
        low, wide = _ranges(region)
        at = (found.places[found.limit >= 0] - boxes[wrong, 0]) / edges[wrong]
        return volumes, np.hstack([at, (found.turns[found.limit >= 0] - low) / wide])


def climbed(region: Region, family: Family, z: Array, tolerance: float) -> Array:
    """A box of the family from which no step leads to a greater one, starting from a proved one."""
    volume = float((family.box(z)[1] - family.box(z)[0]).prod())
    nodes, met = _nodes(region), np.zeros((0, len(region.free_axes) + len(region.swept_axes)))
    share = _FIRST
    for _ in range(_STEPS):
        low, high = family.box(z)
        edges = high - low
        if share * edges.max() < tolerance:
            break
        rows, slack = _slopes(region, family, low, high, np.vstack([nodes, met]))
        reach = share * np.array([edges[np.abs(family.by[:, :, j]).sum(0) > 0.0].min() for j in range(len(z))])
        step = ascent(edges, family.by[1] - family.by[0], rows, slack, reach)
        length = float(np.abs(family.by @ step).max())
        if length < 0.1 * tolerance:
            break
        tries = np.array([z + t * step + back * t * length * family.inward for t in _SHARES for back in _BACK])
        volumes, wrong = family.proved(region, tries, MOST)
        met = np.vstack([met, wrong])[-_MET:]
        best = int(volumes.argmax())
        gain = volumes[best] / volume - 1.0
        if gain > 0.0:
            z, volume = tries[best], float(volumes[best])
        taken, drawn = _SHARES[best // len(_BACK)], _BACK[best % len(_BACK)]
        if gain <= 0.0:
            share = 0.4 * min(share, length / float(edges.min()))
        elif taken < 1.0 or gain <= 1e-4 * share:  # the limits bend too much within that step
            share *= 0.4
        elif drawn <= _BACK[1]:
            share = min(1.5 * share, 0.5)
    return z


def grown(region: Region, family: Family, z: Array, tolerance: float) -> Array:
    """A box that none of the family's outward moves enlarges by more than a quarter of the tolerance.

    One look at each is enough: what a box can't take on, a greater one can't.
    """
    extent = region.extent
    assert extent is not None
    most = 8 * MOST if region.every_orientation else 2 * MOST
    for direction in family.outward:
        low, high = 0.0, float((extent[1] - extent[0]).max())
        lengths = 0.25 * tolerance * (4.0 * high / tolerance) ** np.linspace(0.0, 1.0, _LENGTHS)
        while True:
            volumes, _ = family.proved(region, z + lengths[:, None] * direction, most)
            good = int((volumes > 0.0).cumprod().sum())
            low, high = (lengths[good - 1] if good else low), (lengths[good] if good < len(lengths) else high)
            if high - low <= 0.25 * tolerance:
                break
            lengths = np.linspace(low, high, _LENGTHS + 2)[1:-1]
        z = z + low * direction
    return z


def _ranges(region: Region) -> tuple[Array, Array]:
    """Lower ends of the turns' ranges, and their widths (1 for none)."""
    low, high = (np.array([span[i] for span in region.swept_axes.values()], float) for i in (0, 1))
    return low, np.where(high > low, high - low, 1.0)


def _nodes(region: Region) -> Array:
    """Points of a box's surface, and of the turns' ranges, as shares (n, d + s)."""
    along: Sequence[float] = (0.0, 0.5, 1.0) if region.swept_axes else tuple(np.linspace(0.0, 1.0, _NODES))
    d, s = len(region.free_axes), len(region.swept_axes) if region.every_orientation else 0
    surface = [u for u in product(along, repeat=d) if 0.0 in u or 1.0 in u]
    rest = (0.5,) * (len(region.swept_axes) - s)
    return np.array([(*u, *v, *rest) for u in surface for v in product((0.0, 0.5, 1.0), repeat=s)])


def _slopes(region: Region, family: Family, low: Array, high: Array, nodes: Array) -> tuple[Array, Array]:
    """Of every limit at every node its distance, mm, and how that changes with z: (m, k) and (m,)."""
    d = len(low)
    share, (first, wide) = nodes[:, :d], _ranges(region)
    places = low + share * (high - low)
    turns = first + nodes[:, d:] * wide
    if not region.every_orientation:
        turns, _ = best_turns(region, places)
    h = np.where(share < 0.5, 1e-5, -1e-5) * (high - low)  # inward: what is out of reach has no margins
    moved = places[:, None] + np.concatenate([np.zeros((1, d)), np.eye(d)]) * h[:, None]
    margins = margins_at(region, moved.reshape(-1, d), np.repeat(turns, d + 1, 0)).reshape(len(nodes), d + 1, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient = (margins[:, 1:] - margins[:, :1]) / h[:, :, None]
        steep = np.sqrt((gradient**2).sum(1))
        slack, gradient = margins[:, 0] / steep, gradient / steep[:, None]
    with_z = (1.0 - share)[:, :, None] * family.by[0] + share[:, :, None] * family.by[1]
    rows = np.einsum("ndc,ndk->nck", gradient, with_z)
    known = np.isfinite(slack) & np.isfinite(rows).all(2)
    return rows[known], np.maximum(slack[known], 0.0)
