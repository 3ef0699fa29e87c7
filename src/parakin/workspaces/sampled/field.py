"""A region's shape as a field: about the distance to its boundary, positive inside, sampled on a regular grid.

Of each limit it takes the margin over the size of its gradient by place, and of all the least. That is a picture, not a
proof: where it is 0 is the boundary (Taubin 1994, for implicit curves), and turns are sampled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ... import algebra as alg
from ...arrays import Array
from ...errors import PoseError
from ...kernels.batch import evaluate_tape
from ...kernels.tape import Tape, compile_tape
from ..certified.constraints import Constraint
from ..certified.region import Region
from .sampling import TURNS_STEP, turn_samples

Indices = NDArray[np.int64]

FINE = {1: 1000, 2: 240, 3: 60}  # steps along the longest edge of a region's box, by its dimension
_LEAST = 16  # steps along a short edge, so that a thin region is not missed
_MOST = 20_000_000  # nodes
_TURNS = 4096  # samples of all turns together; more of them are set farther apart
_BLOCK = 1 << 16  # nodes at a time
_FLAT = 1e-12  # a gradient so small is none
_CUT = 2.0  # steps from the boundary beyond which the distance is of no use
_OFF = 1e-3  # steps by which nodes keep off the boundary: no surface passes through one
_WITHIN = 1e-4  # steps: less is the rounding of a place on an edge
_HALVINGS = 4  # of a grid's edge, to find where the boundary crosses it


@dataclass(frozen=True, eq=False)
class Distance:
    """The field of a region at any places; turns are taken at samples ``turn_step`` rad apart, ends included."""

    region: Region
    turn_step: float = TURNS_STEP

    @cached_property
    def _own(self) -> list[Constraint]:
        return [constraint for constraint in self.region.constraints if not constraint.implied]

    def _tape(self, outputs: list[alg.Scalar]) -> Tape:
        region = self.region
        return compile_tape(region.slice.inputs[0].trace, outputs, len(region.free_axes) + len(region.swept_axes))

    @cached_property
    def _least(self) -> Tape:
        least: alg.Scalar = np.inf
        for constraint in self._own:
            least = alg.minimum(least, _distance(constraint))
        return self._tape([least])

    @cached_property
    def _reach(self) -> Tape:
        reach = {limit.name for limit in self.region.machine.limit_parts if limit.side == "reach"}
        return self._tape([_distance(constraint) for constraint in self._own if constraint.name in reach])

    @cached_property
    def _each(self) -> Tape:
        return self._tape([_distance(constraint) for constraint in self._own])

    @cached_property
    def turns(self) -> Array:
        """(K, s): the samples, at least three of a turn, those that decide most often first."""
        widths = [high - low for low, high in self.region.swept_axes.values() if high > low]
        step = min([self.turn_step, *(0.5 * width for width in widths)])
        while np.prod([ceil(width / step) + 1.0 for width in widths]) > _TURNS:
            step *= 1.25
        return turn_samples(self.region, step)

    def at(self, places: Array, enough: float = np.inf) -> Array:
        """(N,) mm at places (N, d); a sign that is settled by more than ``enough`` is not looked at any more."""
        d, sign = places.shape[1], 1.0 if self.region.every_orientation else -1.0
        found = np.full(len(places), np.inf)
        live: Indices = np.arange(len(places))
        rows = np.empty((len(places), d + len(self.region.swept_axes)))
        rows[:, :d] = places
        for turn in self.turns:
            rows[:, d:] = turn
            found[live] = np.minimum(found[live], sign * self._one(rows))
            open_ = found[live] > -enough
            if not open_.all():
                live, rows = live[open_], rows[open_]
        return sign * found

    def nearest(self, places: Array) -> Indices:
        """(N,): the index in the region's limits of the one that is least, at the turn that decides."""
        d, sign = places.shape[1], 1.0 if self.region.every_orientation else -1.0
        found, limit = np.full(len(places), np.inf), np.zeros(len(places), np.int64)
        rows = np.empty((len(places), d + len(self.region.swept_axes)))
        rows[:, :d] = places
        for turn in self.turns:
            rows[:, d:] = turn
            each = evaluate_tape(self._each, rows, np.empty((len(rows), self._each.outputs)), whole=False)
            each = np.where(np.isnan(each), np.inf, each)
            least = each.min(1)
            better = sign * least < found
            found[better], limit[better] = sign * least[better], each.argmin(1)[better]
        return limit

    def _one(self, rows: Array) -> Array:
        """For one turn each; where a leg can't close, what its reach alone tells."""
        f = evaluate_tape(self._least, rows, np.empty((len(rows), 1)), whole=False)[:, 0]
        lost = np.flatnonzero(np.isnan(f))
        if len(lost):
            reach = evaluate_tape(self._reach, rows[lost], np.empty((len(lost), self._reach.outputs)), whole=False)
            least = np.fmin.reduce(reach, axis=1, initial=np.inf)
            f[lost] = np.where(least < 0.0, least, -np.inf)
        return f


def _distance(constraint: Constraint) -> alg.Scalar:
    gradient = [alg.derivative(constraint.margin, x) for x in constraint.places]
    return constraint.margin / alg.maximum(alg.norm(gradient), _FLAT)


@dataclass(frozen=True, eq=False)
class Field:
    """About the distance to a region's boundary, mm, positive inside, at the nodes of a grid; no farther than 2 steps.

    distance : the field at any other place
    box : lower and upper corner of a box that holds the region, mm
    low : (d,) place of the first node
    step : (d,) between nodes
    values : (n0, n1, ...); the outermost nodes are outside, so that what encloses the region is closed
    """

    distance: Distance
    box: tuple[Array, Array]
    low: Array
    step: Array
    values: Array

    @property
    def region(self) -> Region:
        return self.distance.region

    @cached_property
    def inside(self) -> Indices:
        """(K, d): indices of the nodes inside."""
        return np.argwhere(self.values > 0.0)

    @property
    def span(self) -> tuple[Array, Array]:
        """Lower and upper corner of what is inside, to half a step; of the whole box if no node is."""
        if not len(self.inside):
            return self.box
        first, last = self.inside.min(0), self.inside.max(0)
        return self.low + (first - 0.5) * self.step, self.low + (last + 0.5) * self.step

    def crossings(self, found: Array) -> Array:
        """Places (N, d), mm, where the boundary crosses the grid's edges, found by interpolation, in steps.

        The field is no straight line where a leg is nearly stretched, so each edge is halved some times first.
        """
        axis = np.abs(found - np.rint(found)).argmax(1)
        rows = np.arange(len(found))
        ends = [np.rint(found), np.rint(found)]
        ends[0][rows, axis], ends[1][rows, axis] = np.floor(found[rows, axis]), np.floor(found[rows, axis]) + 1.0
        known = [self.values[tuple(end.astype(np.int64).T)] for end in ends]
        flip = known[0] > known[1]
        outer, inner = np.where(flip[:, None], ends[1], ends[0]), np.where(flip[:, None], ends[0], ends[1])
        f_outer, f_inner = np.minimum(*known), np.maximum(*known)
        for _ in range(_HALVINGS):
            middle = 0.5 * (outer + inner)
            f = self.distance.at(self.low + middle * self.step, enough=_CUT * float(self.step.max()))
            f = np.clip(f, self.values.min(), self.values.max())
            up = f > 0.0
            inner[up], f_inner[up] = middle[up], f[up]
            outer[~up], f_outer[~up] = middle[~up], f[~up]
        share = f_inner / np.where(f_inner > f_outer, f_inner - f_outer, 1.0)
        exact: Array = inner + share[:, None] * (outer - inner)
        between = (np.abs(found - np.rint(found)) > _WITHIN).sum(1) > 1  # not on an edge: within a cube of the grid
        exact[between] = found[between]
        return self.low + exact * self.step


def steps(low: Array, high: Array, step: float | None) -> Array:
    """The grid's step along each axis: ``step`` mm or a part of the longest edge, shorter along a short edge.

    Raises :class:`PoseError` for a step that is none.
    """
    edges = high - low
    if step is not None and not (np.isfinite(step) and step > 0.0):
        raise PoseError(f"step: a length above 0 mm expected, not {step:g}")
    wanted = float(edges.max()) / FINE[len(edges)] if step is None else step
    return np.asarray(np.minimum(wanted, edges / _LEAST))


def field(
    region: Region,
    box: tuple[Array, Array],
    step: float | None = None,
    turn_step: float = TURNS_STEP,
    progress: Callable[[float], None] | None = None,
) -> Field:
    """The field of a region on a grid over a box that holds it, mm, and one step around.

    Parameters
    ----------
    box : lower and upper corner, (d,) each
    step : mm at most; by default a 60th of the box's longest edge, in a plane a 240th
    turn_step : rad between samples of the turns, at most, unless they would be too many
    progress : called with the fraction done

    Raises :class:`PoseError` for a step that makes too many nodes.
    """
    low, high = box
    size = steps(low, high, step)
    inner = np.ceil((high - low) / size - 1e-9)
    if np.prod(inner + 3) > _MOST:
        raise PoseError(
            f"step: {size.min():g} mm makes {np.prod(inner + 3):,.0f} places, at most {_MOST:,} are possible"
        )
    first = 0.5 * (low + high - inner * size) - size
    axes = [start + s * np.arange(int(n) + 3) for start, s, n in zip(first, size, inner, strict=True)]
    distance = Distance(region, turn_step)
    shape = tuple(len(axis) for axis in axes)
    values = np.empty(int(np.prod(shape)))
    for begin in range(0, len(values), _BLOCK):
        nodes = np.unravel_index(np.arange(begin, min(begin + _BLOCK, len(values))), shape)
        places = np.column_stack([axis[index] for axis, index in zip(axes, nodes, strict=True)])
        values[begin : begin + _BLOCK] = distance.at(places, enough=_CUT * float(size.max()))
        if progress:
            progress(min(1.0, (begin + _BLOCK) / len(values)))
    values = values.reshape(shape)
    _outermost(values)
    unit = float(size.min())
    values = np.clip(values, -_CUT * unit, _CUT * unit)
    values = np.copysign(np.maximum(np.abs(values), _OFF * unit), np.where(values > 0.0, 1.0, -1.0))
    return Field(distance, box, first, size, values)


def _outermost(values: Array) -> None:
    for axis in range(values.ndim):
        layers = np.moveaxis(values, axis, 0)
        layers[[0, -1]] = np.minimum(layers[[0, -1]], 0.0)
