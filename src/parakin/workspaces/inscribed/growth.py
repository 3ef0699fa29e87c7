"""Growth of a box in a region: by steps that the limits' slopes predict, every box on the way proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...arrays import Array
from ...budget import Budget
from ..certified.best_orientation import evaluate_margins, find_best_orientations
from ..certified.containment import prove_boxes
from ..certified.region import Region

MOST = 512  # sub-boxes of a box examined on the way; the last boxes get more
_STEPS = 40
_FIRST = 0.25  # trust region of the first step, as a fraction of the edges
_LENGTHS = (4.0, 2.0, 1.0, 0.6, 0.3, 0.1)  # tried fractions of a step; where orientations adapt it may go farther
_BACK = (0.0, 0.01, 0.05, 0.2)  # fractions of a step by which the box is then drawn in, as limits are curved
_NODES = 5  # points along a box's edge where limits are linearised; 3 with swept axes
_REMEMBERED = 64  # points where a limit was broken, at which it is linearised too
_TRIED = 12  # lengths at a time when one face moves


@dataclass(frozen=True, eq=False)
class BoxFamily:
    """Boxes with corners ``base`` + ``by``·z, (2, d) and (2, d, k): any, of given proportions, or about a centre.

    first : (k,) the z of the seed
    inward : (k,) changes no face by more than 1 mm, all to the inside
    outward : (g, k) each moves a face, or faces that can only move together, by 1 mm (those of the longest edge)
    """

    base: Array
    by: Array
    first: Array
    inward: Array
    outward: Array

    @classmethod
    def start_from(cls, low: Array, high: Array, shape: Array | None, centre: Array | None) -> BoxFamily:
        """Make the family of a seed [low, high], which has the ``shape`` and the ``centre`` where these are given."""
        d = len(low)
        one, none = np.eye(d), np.zeros((d, d))
        corners = np.array([low, high])
        if shape is None and centre is None:
            by = np.stack([np.hstack([one, none]), np.hstack([none, one])])
            inward = np.repeat([1.0, -1.0], d)
            return cls(np.zeros((2, d)), by, corners.reshape(-1), inward, -np.diag(inward))
        if shape is None:
            half = 0.5 * (high - low)
            return cls(np.array([centre, centre]), np.stack([-one, one]), half, -np.ones(d), one)
        edge = 0.5 * shape[:, None]
        size = float(((high - low) / shape).min())
        if centre is None:
            by = np.stack([np.hstack([one, -edge]), np.hstack([one, edge])])
            last = np.eye(d + 1)[d]
            return cls(np.zeros((2, d)), by, np.append(corners.mean(0), size), -2.0 * last, 2.0 * last[None])
        by, two = np.stack([-edge, edge]), np.array([2.0])
        return cls(np.array([centre, centre]), by, np.array([size]), -two, two[None])

    def make_boxes(self, z: Array) -> Array:
        """Make the corners (..., 2, d) of the boxes z (..., k)."""
        return np.asarray(self.base + np.einsum("cdk,...k->...cd", self.by, z))

    def prove_volumes(self, region: Region, z: Array, most: int, budget: Budget) -> tuple[Array, Array]:
        """Prove boxes z (n, k); returns their volumes, zero where not proved, and points where a limit is broken.

        The points (m, d + s) are fractions of the box and of the swept ranges.
        """
        boxes = self.make_boxes(z)
        edges = boxes[:, 1] - boxes[:, 0]
        volumes = np.where((edges > 0.0).all(1), edges.prod(1), 0.0)
        solid = np.flatnonzero(volumes > 0.0)
        containment = prove_boxes(region, boxes[solid, 0], boxes[solid, 1], most=most, budget=budget)
        volumes[solid[~containment.proved]] = 0.0
        is_broken = containment.limit >= 0
        broken = solid[is_broken]
        low, wide = _list_ranges(region)
        positions = (containment.positions[is_broken] - boxes[broken, 0]) / edges[broken]
        return volumes, np.hstack([positions, (containment.orientations[is_broken] - low) / wide])


def climb_volume(region: Region, family: BoxFamily, z: Array, tolerance: float, budget: Budget) -> Array:
    """Maximise the volume by sequential linearisation of the limits, starting from a proved box of the family.

    A budget that is spent ends it with the best box proved so far.
    """
    volume = float((family.make_boxes(z)[1] - family.make_boxes(z)[0]).prod())
    nodes, broken = _list_nodes(region), np.zeros((0, len(region.free_axes) + len(region.swept_axes)))
    trust = _FIRST
    for _ in range(_STEPS):
        low, high = family.make_boxes(z)
        edges = high - low
        if trust * edges.max() < tolerance or budget.is_spent():
            break
        rows, slack = _linearise_limits(region, family, low, high, np.vstack([nodes, broken]))
        reach = trust * np.array([edges[np.abs(family.by[:, :, j]).sum(0) > 0.0].min() for j in range(len(z))])
        step = _solve_barrier_step(edges, family.by[1] - family.by[0], rows, slack, reach)
        length = float(np.abs(family.by @ step).max())
        if length < 0.1 * tolerance:
            break
        tries = np.array([z + t * step + back * t * length * family.inward for t in _LENGTHS for back in _BACK])
        volumes, now_broken = family.prove_volumes(region, tries, MOST, budget)
        broken = np.vstack([broken, now_broken])[-_REMEMBERED:]
        best = int(volumes.argmax())
        gain = volumes[best] / volume - 1.0
        if gain > 0.0:
            z, volume = tries[best], float(volumes[best])
        best_length, back = _LENGTHS[best // len(_BACK)], _BACK[best % len(_BACK)]
        if gain <= 0.0:
            trust = 0.4 * min(trust, length / float(edges.min()))
        elif best_length < 1.0 or gain <= 1e-4 * trust:  # the limits bend too much within that step
            trust *= 0.4
        elif back <= _BACK[1]:
            trust = min(1.5 * trust, 0.5)
    return z


def grow_faces(region: Region, family: BoxFamily, z: Array, tolerance: float, budget: Budget) -> Array:
    """Move the faces outward, each until a move by more than a quarter of the tolerance is not proved.

    One search for each is enough: where a box can't grow, a larger one can't. A budget that is spent ends it before.
    """
    extent = region.find_extent(budget)
    assert extent is not None
    most = 8 * MOST if region.every_orientation else 2 * MOST
    for direction in family.outward:
        low, high = 0.0, float((extent[1] - extent[0]).max())
        lengths = 0.25 * tolerance * (4.0 * high / tolerance) ** np.linspace(0.0, 1.0, _TRIED)
        while not budget.is_spent():
            volumes, _ = family.prove_volumes(region, z + lengths[:, None] * direction, most, budget)
            good = int((volumes > 0.0).cumprod().sum())
            low, high = (lengths[good - 1] if good else low), (lengths[good] if good < len(lengths) else high)
            if high - low <= 0.25 * tolerance:
                break
            lengths = np.linspace(low, high, _TRIED + 2)[1:-1]
        z = z + low * direction
    return z


def _list_ranges(region: Region) -> tuple[Array, Array]:
    """List the lower ends of the swept ranges, and their widths (1 for a range of one value)."""
    low, high = region.swept_bounds
    return low, np.where(high > low, high - low, 1.0)


def _list_nodes(region: Region) -> Array:
    """List points of a box's surface, and of the swept ranges, as fractions (n, d + s)."""
    along: Sequence[float] = (0.0, 0.5, 1.0) if region.swept_axes else tuple(np.linspace(0.0, 1.0, _NODES))
    d, s = len(region.free_axes), len(region.swept_axes) if region.every_orientation else 0
    surface = [u for u in product(along, repeat=d) if 0.0 in u or 1.0 in u]
    rest = (0.5,) * (len(region.swept_axes) - s)
    return np.array([(*u, *v, *rest) for u in surface for v in product((0.0, 0.5, 1.0), repeat=s)])


def _linearise_limits(region: Region, family: BoxFamily, low: Array, high: Array, nodes: Array) -> tuple[Array, Array]:
    """Linearise every limit at every node: how its distance, mm, changes with z, (m, k), and that distance, (m,)."""
    d = len(low)
    fraction, (first, wide) = nodes[:, :d], _list_ranges(region)
    positions = low + fraction * (high - low)
    orientations = first + nodes[:, d:] * wide
    if not region.every_orientation:
        orientations, _ = find_best_orientations(region, positions)
    h = np.where(fraction < 0.5, 1e-5, -1e-5) * (high - low)  # inward: positions out of reach have no margins
    moved = positions[:, None] + np.concatenate([np.zeros((1, d)), np.eye(d)]) * h[:, None]
    margins = evaluate_margins(region, moved.reshape(-1, d), np.repeat(orientations, d + 1, 0))
    margins = margins.reshape(len(nodes), d + 1, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient = (margins[:, 1:] - margins[:, :1]) / h[:, :, None]
        steep = np.sqrt((gradient**2).sum(1))
        slack, gradient = margins[:, 0] / steep, gradient / steep[:, None]
    with_z = (1.0 - fraction)[:, :, None] * family.by[0] + fraction[:, :, None] * family.by[1]
    rows = np.einsum("ndc,ndk->nck", gradient, with_z)
    known = np.isfinite(slack) & np.isfinite(rows).all(2)
    return rows[known], np.maximum(slack[known], 0.0)


def _solve_barrier_step(edges: Array, by: Array, rows: Array, slack: Array, reach: Array) -> Array:
    """Find the step z (k,) that makes the product of ``edges`` + ``by``·z greatest, by Newton's method with barriers.

    It keeps ``rows``·z + ``slack`` ≥ 0 and |z| ≤ ``reach``. ``edges`` (d,) > 0, ``by`` (d, k), ``rows`` (m, k),
    ``slack`` (m,) ≥ 0.
    """
    near = np.abs(rows) @ reach > slack
    rows = np.concatenate([by, rows[near]])
    slack = np.concatenate([edges, np.maximum(slack[near], 1e-9 * edges.min())])
    z = np.zeros(len(reach))

    def evaluate(z: Array, weight: Array, barrier: float) -> float:
        inside = rows @ z + slack
        room = reach**2 - z**2
        if not ((inside > 0.0).all() and (room > 0.0).all()):
            return -np.inf
        return float(weight @ np.log(inside) + barrier * np.log(room).sum())

    for barrier in 0.2 ** np.arange(1, 13):
        weight = np.full(len(rows), barrier)
        weight[: len(by)] = 1.0
        for _ in range(8):
            inside, room = rows @ z + slack, reach**2 - z**2
            gradient = rows.T @ (weight / inside) - 2.0 * barrier * z / room
            hessian = (rows.T * (weight / inside**2)) @ rows
            hessian += np.diag(barrier * 2.0 * (reach**2 + z**2) / room**2)
            try:
                step = np.linalg.solve(hessian, gradient)
            except np.linalg.LinAlgError:  # a wall so near that all else is rounding
                return z
            gain = float(gradient @ step)
            if gain < 1e-3 * barrier:
                break
            value, length = evaluate(z, weight, barrier), 1.0
            while length > 1e-6 and not evaluate(z + length * step, weight, barrier) > value + 0.1 * length * gain:
                length *= 0.5
            z = z + (length if length > 1e-6 else 0.0) * step
    return z
