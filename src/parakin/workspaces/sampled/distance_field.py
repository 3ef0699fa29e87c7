"""A region's shape as a field: about the distance to its boundary, positive inside, sampled on a regular grid.

It is the least over the limits of each margin divided by the size of its gradient by position; its zero is the boundary
(Taubin 1994, for implicit curves). It is a picture, not a proof, and swept axes are sampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import NamedTuple

import numpy as np

from ... import algebra as alg
from ...arguments import check_arguments, check_positive, read_corners
from ...arrays import Array, Indices, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ...kernels.batch import evaluate_tape
from ...kernels.tape import Tape, compile_tape
from ..certified.constraints import Constraint
from ..certified.region import Region
from .sampling import TOO_SLOW, TURNS_STEP, sample_orientations

FINE = {1: 1000, 2: 240, 3: 60}  # steps along the longest edge of a region's box, by its dimension
_LEAST = 16  # steps along a short edge, so that a thin region is not missed
_MOST = 20_000_000  # nodes
_ORIENTATIONS = 4096  # samples of all swept axes together; more of them are set farther apart
_BLOCK = 1 << 16  # nodes at a time
_FLAT = 1e-12  # a gradient no greater counts as zero
_CUT = 2.0  # steps from the boundary at which the distance is cut off
_OFF = 1e-3  # steps by which nodes are kept off the boundary: no surface passes through one
_ON_EDGE = 1e-4  # steps: less is the rounding of a point on an edge
_HALVINGS = 4  # bisections of a grid's edge, to find where the boundary crosses it


class NearestLimits(NamedTuple):
    """The limit of the least distance at positions, and the swept axes at which it is least.

    limit : (N,) indices in the region's limits
    swept : (N, s) rad
    """

    limit: Indices
    swept: Array


class TangentPlanes(NamedTuple):
    """The first order of a field at positions.

    distance : (N,) mm, positive inside
    normal : (N, d) unit vectors, outward; not finite where the limit has no gradient
    """

    distance: Array
    normal: Array


@dataclass(frozen=True, eq=False)
class DistanceField:
    """The distance to a region's boundary at any position, about.

    region : whose boundary it is
    turns_step : between samples of swept axes, rad
    seconds : of each method, which raises :class:`PoseError` where it is not done by then; None for no end

    positions : as its methods take them: (N, d) mm, coordinates of the region's free axes
    """

    region: Region
    turns_step: float = TURNS_STEP
    seconds: float | None = SECONDS

    @cached_property
    def _constraints(self) -> list[Constraint]:
        return [constraint for constraint in self.region.constraints if not constraint.implied]

    def _compile(self, outputs: list[alg.Scalar]) -> Tape:
        region = self.region
        trace = region.traced_pose.inputs[0].trace
        return compile_tape(trace, outputs, len(region.free_axes) + len(region.swept_axes))

    @cached_property
    def _least_tape(self) -> Tape:
        least: alg.Scalar = np.inf
        for constraint in self._constraints:
            least = alg.minimum(least, _derive_distance(constraint))
        return self._compile([least])

    @cached_property
    def _reach_tape(self) -> Tape:
        reach = {limit.name for limit in self.region.machine.limit_definitions if limit.side == "reach"}
        return self._compile([_derive_distance(own) for own in self._constraints if own.name in reach])

    @cached_property
    def _each_tape(self) -> Tape:
        return self._compile([_derive_distance(constraint) for constraint in self._constraints])

    @cached_property
    def _plane_tapes(self) -> dict[int, Tape]:
        """Tapes of one limit's distance and gradient, compiled when they are asked for."""
        return {}

    def _compile_plane(self, limit: int) -> Tape:
        if limit not in self._plane_tapes:
            own = self._constraints[limit]
            gradient = [alg.derivative(own.margin, x) for x in own.position]
            self._plane_tapes[limit] = self._compile([own.margin, *gradient])
        return self._plane_tapes[limit]

    @cached_property
    def orientations(self) -> Array:
        """Samples of the swept axes (K, s), at least three of each, those that decide most often first."""
        widths = [high - low for low, high in self.region.swept_axes.values() if high > low]
        step = min([self.turns_step, *(0.5 * width for width in widths)])
        while np.prod([ceil(width / step) + 1.0 for width in widths]) > _ORIENTATIONS:
            step *= 1.25
        return sample_orientations(self.region, step)

    def evaluate(self, positions: Array, enough: float = np.inf, budget: Budget | None = None) -> Array:
        """Evaluate it, (N, d) -> (N,) mm, positive inside.

        enough : mm; a sign settled by more ends the samples of swept axes
        budget : the time for it; by default :attr:`seconds`
        """
        budget = budget or Budget(self.seconds)
        d, sign = positions.shape[1], 1.0 if self.region.every_orientation else -1.0
        distance = np.full(len(positions), np.inf)
        live: Indices = np.arange(len(positions))
        rows = np.empty((len(positions), d + len(self.region.swept_axes)))
        rows[:, :d] = positions
        for orientation in self.orientations:
            if budget.is_spent():
                raise PoseError(TOO_SLOW)
            rows[:, d:] = orientation
            distance[live] = np.minimum(distance[live], sign * self._evaluate_rows(rows))
            unsettled = distance[live] > -enough
            if not unsettled.all():
                live, rows = live[unsettled], rows[unsettled]
        return sign * distance

    def find_nearest_limits(self, positions: Array, orientations: Array | None = None) -> NearestLimits:
        """Find the limit of the least distance, at the orientation that decides, for positions (N, d) mm.

        orientations : (K, s) rad, of the samples that may decide; all by default
        """
        orientations = self.orientations if orientations is None else orientations
        d, sign = positions.shape[1], 1.0 if self.region.every_orientation else -1.0
        distance, limit = np.full(len(positions), np.inf), np.zeros(len(positions), np.int64)
        rows = np.empty((len(positions), d + len(self.region.swept_axes)))
        rows[:, :d] = positions
        swept = np.empty((len(positions), rows.shape[1] - d))
        swept[:] = orientations[0]
        budget = Budget(self.seconds)
        for orientation in orientations:
            if budget.is_spent():
                raise PoseError(TOO_SLOW)
            rows[:, d:] = orientation
            each = evaluate_tape(self._each_tape, rows, np.empty((len(rows), self._each_tape.outputs)), whole=False)
            each = np.where(np.isnan(each), np.inf, each)
            least = each.min(1)
            better = sign * least < distance
            distance[better], limit[better] = sign * least[better], each.argmin(1)[better]
            swept[better] = orientation
        return NearestLimits(limit, swept)

    def find_tangent_planes(self, positions: Array, nearest: NearestLimits) -> TangentPlanes:
        """Find the planes that touch, to the first order, the boundary that the nearest limit makes.

        nearest : of :meth:`find_nearest_limits` at these positions
        """
        rows = np.column_stack([positions, nearest.swept])
        planes = np.empty((len(rows), 1 + positions.shape[1]))
        for limit in np.unique(nearest.limit).tolist():
            own = np.flatnonzero(nearest.limit == limit)
            planes[own] = evaluate_tape(self._compile_plane(limit), rows[own], planes[own], whole=False)
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.linalg.norm(planes[:, 1:], axis=1)
            return TangentPlanes(planes[:, 0] / size, -planes[:, 1:] / size[:, None])

    def _evaluate_rows(self, rows: Array) -> Array:
        """Evaluate it at one orientation each; where a leg can't close, by the limits of reach alone."""
        distance = evaluate_tape(self._least_tape, rows, np.empty((len(rows), 1)), whole=False)[:, 0]
        lost = np.flatnonzero(np.isnan(distance))
        if len(lost):
            out = np.empty((len(lost), self._reach_tape.outputs))
            reach = evaluate_tape(self._reach_tape, rows[lost], out, whole=False)
            least = np.fmin.reduce(reach, axis=1, initial=np.inf)
            distance[lost] = np.where(least < 0.0, least, -np.inf)
        return distance


def _derive_distance(constraint: Constraint) -> alg.Scalar:
    gradient = [alg.derivative(constraint.margin, x) for x in constraint.position]
    return constraint.margin / alg.maximum(alg.norm(gradient), _FLAT)


@dataclass(frozen=True, eq=False)
class SampledField:
    """A distance field at the nodes of a grid, mm, positive inside, cut off at 2 steps.

    distance : the field at any other position
    box : lower and upper corner of a box that holds the region, (d,) mm each
    low : (d,) mm, of the first node
    step : (d,) mm, between nodes
    values : (n0, n1, ...); the outermost nodes are outside, so that the surface about the region is closed
    """

    distance: DistanceField
    box: tuple[Array, Array]
    low: Array
    step: Array
    values: Array

    @property
    def region(self) -> Region:
        """The region whose boundary is where the field is zero."""
        return self.distance.region

    @cached_property
    def inside(self) -> Indices:
        """Indices of the nodes inside, (K, d)."""
        return np.argwhere(self.values > 0.0)

    @property
    def span(self) -> tuple[Array, Array]:
        """Lower and upper corner of what is inside, (d,) mm each, to half a step; of the box if no node is."""
        if not len(self.inside):
            return self.box
        first, last = self.inside.min(0), self.inside.max(0)
        return self.low + (first - 0.5) * self.step, self.low + (last + 0.5) * self.step

    def refine_crossings(self, crossings: Array) -> Array:
        """Refine where the boundary crosses the grid's edges by bisection: positions (N, d) mm.

        crossings : (N, d) in steps from the first node

        The field is no straight line where a leg is nearly stretched, so interpolation alone is too coarse.
        """
        axis = np.abs(crossings - np.rint(crossings)).argmax(1)
        rows = np.arange(len(crossings))
        ends = [np.rint(crossings), np.rint(crossings)]
        ends[0][rows, axis] = np.floor(crossings[rows, axis])
        ends[1][rows, axis] = np.floor(crossings[rows, axis]) + 1.0
        known = [self.values[tuple(end.astype(np.int64).T)] for end in ends]
        flip, budget = known[0] > known[1], Budget(self.distance.seconds)
        outer, inner = np.where(flip[:, None], ends[1], ends[0]), np.where(flip[:, None], ends[0], ends[1])
        f_outer, f_inner = np.minimum(*known), np.maximum(*known)
        for _ in range(_HALVINGS):
            middle = 0.5 * (outer + inner)
            f = self.distance.evaluate(self.low + middle * self.step, _CUT * float(self.step.max()), budget)
            f = np.clip(f, self.values.min(), self.values.max())
            up = f > 0.0
            inner[up], f_inner[up] = middle[up], f[up]
            outer[~up], f_outer[~up] = middle[~up], f[~up]
        fraction = f_inner / np.where(f_inner > f_outer, f_inner - f_outer, 1.0)
        refined: Array = inner + fraction[:, None] * (outer - inner)
        off_edge = (np.abs(crossings - np.rint(crossings)) > _ON_EDGE).sum(1) > 1  # within a cube of the grid
        refined[off_edge] = crossings[off_edge]
        return self.low + refined * self.step

    def __repr__(self) -> str:
        return (
            f"<parakin distance field of {self.region.machine.name}: {' x '.join(map(str, self.values.shape))} nodes>"
        )


def choose_steps(low: Array, high: Array, step: float | None) -> Array:
    """Choose the grid's step along each axis: ``step`` mm or a fraction of the longest edge, less along a short edge.

    Raises :class:`PoseError` for an invalid step.
    """
    edges = high - low
    if step is not None and not (np.isfinite(step) and step > 0.0):
        raise PoseError(f"step: a length above 0 mm expected, not {step:g}")
    wanted = float(edges.max()) / FINE[len(edges)] if step is None else step
    return np.asarray(np.minimum(wanted, edges / _LEAST))


@check_arguments
def sample_field(
    region: Region,
    box: tuple[Array, Array],
    step: float | None = None,
    turns_step: float = TURNS_STEP,
    progress: Progress | None = None,
    seconds: float | None = SECONDS,
) -> SampledField:
    """Sample the distance field of a region on a grid over a box that holds it, mm, and one step around.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    box : lower and upper corner, (d,) mm each, as :attr:`Workspace.box`
    step : mm at most; by default a 60th of the box's longest edge, in a plane a 240th
    turns_step : rad between samples of the swept axes, at most, unless they would be too many
    progress : called with the fraction done
    seconds : the time in which all must be sampled; None for no end

    Raises :class:`PoseError` for a step that makes too many nodes, and where the time is up.
    """
    budget = Budget(seconds)
    check_positive("turns_step", turns_step, "rad")
    low, high = read_corners("box", box, region.free_axes)
    size = choose_steps(low, high, step)
    inner = np.ceil((high - low) / size - 1e-9)
    if np.prod(inner + 3) > _MOST:
        raise PoseError(
            f"step: {size.min():g} mm makes {np.prod(inner + 3):,.0f} places, at most {_MOST:,} are possible"
        )
    first = 0.5 * (low + high - inner * size) - size
    axes = [start + s * np.arange(int(n) + 3) for start, s, n in zip(first, size, inner, strict=True)]
    distance = DistanceField(region, turns_step, seconds)
    shape = tuple(len(axis) for axis in axes)
    values = np.empty(int(np.prod(shape)))
    for begin in range(0, len(values), _BLOCK):
        nodes = np.unravel_index(np.arange(begin, min(begin + _BLOCK, len(values))), shape)
        positions = np.column_stack([axis[index] for axis, index in zip(axes, nodes, strict=True)])
        values[begin : begin + _BLOCK] = distance.evaluate(positions, _CUT * float(size.max()), budget)
        if progress:
            progress(min(1.0, (begin + _BLOCK) / len(values)))
    values = values.reshape(shape)
    _close_outermost(values)
    unit = float(size.min())
    values = np.clip(values, -_CUT * unit, _CUT * unit)
    values = np.copysign(np.maximum(np.abs(values), _OFF * unit), np.where(values > 0.0, 1.0, -1.0))
    return SampledField(distance, box, first, size, values)


def _close_outermost(values: Array) -> None:
    """Set the outermost nodes outside."""
    for axis in range(values.ndim):
        layers = np.moveaxis(values, axis, 0)
        layers[[0, -1]] = np.minimum(layers[[0, -1]], 0.0)
