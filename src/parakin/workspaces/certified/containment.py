"""Containment: whether whole boxes of positions lie in a region, proved on intervals; else where a limit is broken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, Flags, Indices, split_rows
from ...budget import Budget
from ...errors import PoseError
from .assembly_mode import PARALLEL_SINGULARITY
from .best_orientation import find_best_orientations
from .constraints import Constraint
from .orientation_boxes import OrientationBoxes, bound_margin, prove_signs
from .plane_cuts import CLEARED, EXCLUDED, KEPT, LinearBounds
from .region import Region

MOST = 4096  # sub-boxes of a box to be examined before it is left undecided
_ROUNDS = 60  # bisected more often, a sub-box's numbers have no digits left
_ULP = 2.3e-16
_AT_ONCE = 512  # sub-boxes whose best orientations are searched for together


@dataclass(frozen=True, eq=False)
class Containment:
    """Results of a proof about N boxes of positions.

    proved : (N,) every position of the box is in the region
    limit : (N,) index in ``names`` of a limit that is broken in the box, -1 where none was found
    positions, orientations : (N, d), (N, s) where that is, else NaN; of an inclusive region no sampled orientation is
        allowed there, which is not proved of all orientations
    boxes : (N,) sub-boxes examined
    """

    proved: Flags
    limit: Indices
    positions: Array
    orientations: Array
    boxes: Indices
    names: tuple[str, ...]


def prove_boxes(
    region: Region,
    low: ArrayLike,
    high: ArrayLike,
    more: Sequence[Constraint] = (),
    most: int = MOST,
    budget: Budget | None = None,
) -> Containment:
    """Prove by interval bisection that all positions of boxes [low, high], (N, d) mm, are in a region.

    Many boxes at once cost little more than one.

    more : further constraints to be kept
    most : sub-boxes of a box examined before it is left undecided
    budget : for all boxes, those not decided when it is spent are left so too; None for no end

    Raises :class:`PoseError` for invalid corners.
    """
    bottom, top = np.asarray(low, float), np.asarray(high, float)
    if bottom.ndim != 2 or bottom.shape != top.shape or bottom.shape[1] != len(region.free_axes):
        raise PoseError(f"two corners of {' '.join(region.free_axes)} expected of a box")
    if not (np.isfinite(bottom).all() and np.isfinite(top).all() and (bottom <= top).all()):
        raise PoseError("two finite corners expected of a box, the lower one first")
    constraints = [*(c for c in region.constraints if not c.implied), *more]
    bisection = _BoxBisection(constraints, region.swept_bounds, bottom, top, most, budget or Budget(None))
    if region.every_orientation or not constraints:
        return bisection.prove_all_orientations()
    bisection.prove_at_best_orientations(region, more)
    return bisection.result


def prove_constraints(
    constraints: Sequence[Constraint], low: Array, high: Array, most: int = MOST, budget: Budget | None = None
) -> Containment:
    """Prove that constraints are kept all over a box [low, high] of their positions and orientations, as one box."""
    d = len(constraints[0].position)
    boxes = _BoxBisection(constraints, (low[d:], high[d:]), low[None, :d], high[None, :d], most, budget or Budget(None))
    return boxes.prove_all_orientations()


class _BoxBisection:
    """N boxes in sub-boxes; ``undecided`` are those whose sub-boxes are all proved so far or can still be."""

    def __init__(
        self,
        constraints: Sequence[Constraint],
        swept: tuple[Array, Array],
        low: Array,
        high: Array,
        most: int,
        budget: Budget,
    ):
        self.constraints, self.low, self.high = constraints, low, high
        self.most, self.budget = most, budget
        n, self.d = low.shape
        self.first, self.last = swept
        self.proved, self.limit = np.zeros(n, np.bool_), np.full(n, -1, np.int64)
        self.positions, self.orientations = np.full(low.shape, np.nan), np.full((n, len(self.first)), np.nan)
        self.boxes, self.undecided = np.zeros(n, np.int64), np.ones(n, np.bool_)

    @property
    def result(self) -> Containment:
        names = tuple(constraint.name for constraint in self.constraints)
        return Containment(self.proved, self.limit, self.positions, self.orientations, self.boxes, names)

    def _count_sub_boxes(self, box: Indices, before: Indices) -> Flags:
        """Count sub-boxes; returns those of undecided boxes without too many examined ones since ``before``."""
        self.boxes += np.bincount(box, minlength=len(self.boxes))
        self.undecided &= self.boxes - before <= self.most
        if self.budget.is_spent():
            self.undecided[box] = False
        return np.asarray(self.undecided[box])

    def prove_all_orientations(self) -> Containment:
        """Prove every constraint at all orientations."""
        for number, constraint in enumerate(self.constraints):
            self._prove_constraint(number, constraint)
        self.proved[:] = self.undecided
        return self.result

    def _prove_constraint(self, number: int, constraint: Constraint) -> None:
        """Prove one constraint at all orientations: sub-boxes are boxes of both, bisected where bounds are widest."""
        d = self.d
        # A determinant's bounds are wider than those of limits, and it gets a budget of its own.
        before = self.boxes.copy() if constraint.name == PARALLEL_SINGULARITY else np.zeros_like(self.boxes)
        box = np.flatnonzero(self.undecided)
        low = np.concatenate([self.low[box], np.tile(self.first, (len(box), 1))], 1)
        high = np.concatenate([self.high[box], np.tile(self.last, (len(box), 1))], 1)
        for _ in range(_ROUNDS):
            which = self._count_sub_boxes(box, before)
            box, low, high = box[which], low[which], high[which]
            if not len(box):
                return
            bounds = _bound_sub_boxes(constraint, low[:, :d], high[:, :d], low[:, d:], high[:, d:])
            which = bounds.state != CLEARED
            box, low, high, bounds = box[which], low[which], high[which], bounds.take(which)
            if not len(box):
                return
            point = _guess_least(low, high, bounds)
            broken = constraint.point_program(point, point)[1][:, 0] < 0.0
            if broken.any():
                self.limit[box[broken]], self.undecided[box[broken]] = number, False
                self.positions[box[broken]], self.orientations[box[broken]] = point[broken, :d], point[broken, d:]
                which = self.undecided[box]
                box, low, high, bounds = box[which], low[which], high[which], bounds.take(which)
            low[:, d:] = np.where(bounds.least_at > 0, high[:, d:], low[:, d:])
            high[:, d:] = np.where(bounds.least_at < 0, low[:, d:], high[:, d:])
            box, low, high = _bisect_sub_boxes(box, low, high, _measure_spread(constraint, low, high, d))
        self.undecided[box] = False

    def prove_at_best_orientations(self, region: Region, more: Sequence[Constraint]) -> None:
        """Prove each sub-box by one orientation allowed all over it: that of its whole, or the best at its middle."""
        box, low, high = np.arange(len(self.low)), self.low, self.high
        orientations: Array | None = None
        for _ in range(_ROUNDS):
            which = self._count_sub_boxes(box, np.zeros_like(self.boxes))
            if orientations is not None:
                which[which] = ~self._prove_at_orientations(low[which], high[which], orientations[which])
                orientations = orientations[which]
            box, low, high = box[which], low[which], high[which]
            if not len(box):
                break
            middle = 0.5 * (low + high)
            orientations, margins = self._find_best_orientations(region, middle, more)
            if self.budget.is_spent():
                break
            broken = ~(margins >= 0.0).all(1)
            if broken.any():
                first = (~(margins[broken] >= 0.0)).argmax(1)
                self.limit[box[broken]], self.undecided[box[broken]] = first, False
                self.positions[box[broken]], self.orientations[box[broken]] = middle[broken], orientations[broken]
            left = self.undecided[box]
            left[left] = ~self._prove_at_orientations(low[left], high[left], orientations[left])
            number, low, high = _bisect_sub_boxes(np.flatnonzero(left), low[left], high[left], (high - low)[left])
            box, orientations = box[number], orientations[number]
        self.undecided[box] = False
        self.proved[:] = self.undecided

    def _find_best_orientations(
        self, region: Region, positions: Array, more: Sequence[Constraint]
    ) -> tuple[Array, Array]:
        """Find the best orientation at each position, and the margins there; NaN where the budget does not allow it."""
        names = [*region.limits, *(constraint.name for constraint in more)]
        orientations = np.full((len(positions), len(self.first)), np.nan)
        margins = np.full((len(positions), len(names)), np.nan)
        for block in split_rows(len(positions), _AT_ONCE):
            if self.budget.is_spent():
                break
            orientations[block], margins[block] = find_best_orientations(region, positions[block], more)
        return orientations, margins

    def _prove_at_orientations(self, low: Array, high: Array, orientations: Array) -> Flags:
        """Prove that all limits are kept all over boxes, each at one orientation."""
        proved = np.ones(len(low), np.bool_)
        for constraint in self.constraints:
            which = np.flatnonzero(proved)
            bounds = _bound_sub_boxes(constraint, low[which], high[which], orientations[which], orientations[which])
            proved[which] = bounds.state == CLEARED
        return proved


def _bound_sub_boxes(constraint: Constraint, low: Array, high: Array, first: Array, last: Array) -> LinearBounds:
    """Bound a margin over positions [low, high] and orientations [first, last], the last ulp included."""
    size = np.where(high > low, high - low + _ULP * np.maximum(np.abs(low), np.abs(high)), 0.0)
    boxes = OrientationBoxes(np.arange(len(low)), first, last, np.zeros((len(low), 0), np.bool_))
    bounds = bound_margin(constraint, low, size, boxes, every=True)
    prove_signs(constraint, low, size, boxes, bounds, bounds.state == KEPT)
    return bounds


def _guess_least(low: Array, high: Array, bounds: LinearBounds) -> Array:
    """Guess the corner, of position and orientation, where a margin is least; its middle if it is excluded there."""
    ahead = np.concatenate([-np.sign(bounds.slopes), bounds.least_at], 1)
    ahead[bounds.state == EXCLUDED] = 0.0
    return np.clip(0.5 * (low + high) + 0.5 * ahead * (high - low), low, high)


def _measure_spread(constraint: Constraint, low: Array, high: Array, d: int) -> Array:
    """Measure how far each axis of position and orientation spreads a margin's bounds, (N, d + s)."""
    half = 0.5 * (high - low)
    if constraint.sign is not None:
        return _fill_spread(constraint.sign(low, high).spread, half)
    down, up = constraint.box_program(low, high)
    size = np.maximum(np.abs(down), np.abs(up))
    s = low.shape[1] - d
    spread = np.empty_like(half)
    spread[:, d:] = size[:, 2 : 2 + s] * half[:, d:]
    if not constraint.is_smooth:
        spread[:, :d] = 0.5 * (up - down)[:, 2 + s :] * half[:, :d]
    else:
        spread[:, :d] = 0.0
        for column, (k, n) in enumerate(zip(*np.triu_indices(d), strict=True), 2 + s):
            if k == n:
                spread[:, k] += 0.5 * np.maximum(-down[:, column], 0.0) * half[:, k] ** 2
            else:
                spread[:, [k, n]] += 0.5 * (size[:, column] * half[:, k] * half[:, n])[:, None]
    return _fill_spread(spread, half)


def _fill_spread(spread: Array, half: Array) -> Array:
    """Fill in the half widths, relative to the widest, where a spread is not known."""
    unknown = ~np.isfinite(spread).all(1)
    widest = half[unknown].max(0, initial=0.0)
    spread[unknown] = half[unknown] / np.where(widest > 0.0, widest, 1.0)
    return spread


def _bisect_sub_boxes(box: Indices, low: Array, high: Array, spread: Array) -> tuple[Indices, Array, Array]:
    """Bisect sub-boxes across every axis whose spread is nearly that of the worst one."""
    cut = (spread >= 0.5 * spread.max(1, keepdims=True)) & (high > low)
    for axis in range(low.shape[1]):
        own = np.flatnonzero(cut[:, axis])
        middle = 0.5 * (low[own, axis] + high[own, axis])
        box, cut = np.concatenate([box, box[own]]), np.concatenate([cut, cut[own]])
        low, high = np.concatenate([low, low[own]]), np.concatenate([high, high[own]])
        high[own, axis] = middle
        low[len(low) - len(own) :, axis] = middle
    return box, low, high
