"""Kernels for cubic splines through rows of joints: fitted, evaluated, and compared with the machine's own joints.

``step`` leads from one row to the next. A step of 0 separates two stretches, at a corner that is not rounded; each
stretch has a spline of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Indices
from ....kernels.compiling import njit


class ForceRows(NamedTuple):
    """Bounds of the drives' forces at n rows: along·s̈ + across·ṡ² ≤ 1 for each of c, linear in s between rows.

    drive : (c,) the drive whose force it bounds, one way; plus the number of joints where it is the drive's power
    along, across : (n, c)
    """

    drive: Indices
    along: Array
    across: Array

    def __repr__(self) -> str:
        return f"<parakin force rows: {len(self.along)} with {len(self.drive)} bounds>"


def make_unforced_rows(rows: int) -> ForceRows:
    """Make the bounds of rows whose drives may give any force."""
    return ForceRows(np.empty(0, np.int64), np.empty((rows, 0)), np.empty((rows, 0)))


class JointRows(NamedTuple):
    """The rows of a joint path over its length s: cubic splines of n rows, and what the feed allows.

    step : (n - 1,) mm of s from row to row, 0 between two stretches
    joints, curvature : (n, joints) and their second derivatives by s
    feed_ceiling : (n - 1,) the greatest ṡ² that the feed allows over each step
    forces : what the drives' forces allow
    """

    step: Array
    joints: Array
    curvature: Array
    feed_ceiling: Array
    forces: ForceRows

    def __repr__(self) -> str:
        return f"<parakin joint rows: {len(self.joints)} of {self.joints.shape[1]} joints>"


class PathState(NamedTuple):
    """States along a joint path, (k,) each: the row before, mm of s after it, ṡ and s̈."""

    row: Indices
    shift: Array
    speed: Array
    acceleration: Array


class JointState(NamedTuple):
    """Joints, and how they move at k states.

    joints : (k, joints) mm and rad
    speeds, accelerations : (k, joints) mm/s, mm/s², or rad
    """

    joints: Array
    speeds: Array
    accelerations: Array


class Midpoints(NamedTuple):
    """The middle of k steps, (k, joints) each: the machine's joints, the splines', and the rounding of the former."""

    joints: Array
    splined: Array
    rounding: Array


class SplineTolerances(NamedTuple):
    """How far splines may be off: ``joints`` (joints,), and ``fraction`` of the limits ``acceleration`` (joints,)."""

    joints: Array
    acceleration: Array
    fraction: float


@njit(nogil=True, cache=True, error_model="numpy")
def fit_splines(step, joints, curvature, pivots):
    """Fit a cubic spline to each stretch: write its second derivatives at the rows to ``curvature`` (rows, joints).

    At a stretch's ends the first two and the last two steps share one cubic. ``pivots`` (rows,) is overwritten.
    """
    count, m = joints.shape
    start = np.int64(0)
    while start < count:
        stop = start
        while stop < count - 1 and step[stop] > 0.0:
            stop += 1
        if stop - start > 2:
            _fit_stretch(start, stop, step, joints, curvature, pivots)
        else:
            for j in range(m):
                bend = 0.0
                if stop - start == 2:
                    h, g = step[start], step[start + 1]
                    after, before = joints[stop, j] - joints[start + 1, j], joints[start + 1, j] - joints[start, j]
                    bend = 2.0 * (after / g - before / h) / (h + g)
                for i in range(start, stop + 1):
                    curvature[i, j] = bend
        start = stop + 1


@njit(nogil=True, cache=True, error_model="numpy")
def _fit_stretch(start, stop, step, q, curvature, pivots):
    """Fit one stretch of at least three steps: elimination downward, then substitution upward."""
    m = q.shape[1]
    for i in range(start + 1, stop):
        h, g = step[i - 1], step[i]
        below, middle, above = h, 2.0 * (h + g), g
        if i == start + 1:
            middle, above, below = middle + h + h * h / g, above - h * h / g, 0.0
        if i == stop - 1:
            middle, below, above = middle + g + g * g / h, below - g * g / h, 0.0
        pivot = 1.0 / (middle - below * pivots[i - 1]) if i > start + 1 else 1.0 / middle
        pivots[i] = above * pivot
        h, g = 6.0 / h, 6.0 / g
        for j in range(m):
            right = (q[i + 1, j] - q[i, j]) * g - (q[i, j] - q[i - 1, j]) * h
            if i > start + 1:
                right -= below * curvature[i - 1, j]
            curvature[i, j] = right * pivot
    for i in range(stop - 2, start, -1):
        for j in range(m):
            curvature[i, j] -= pivots[i] * curvature[i + 1, j]
    first, last = step[start] / step[start + 1], step[stop - 1] / step[stop - 2]
    for j in range(m):
        curvature[start, j] = (1.0 + first) * curvature[start + 1, j] - first * curvature[start + 2, j]
        curvature[stop, j] = (1.0 + last) * curvature[stop - 1, j] - last * curvature[stop - 2, j]


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def compute_start_slope(q, bend, h, i, j):
    """Compute q' of joint j at the start of step i, of length h, from joints and their q'' at the rows."""
    return (q[i + 1, j] - q[i, j]) / h - h * (2.0 * bend[i, j] + bend[i + 1, j]) / 6.0


@njit(nogil=True, cache=True, error_model="numpy")
def evaluate_splines(rows, state, out, start, stop):
    """Evaluate the splines of ``rows`` for a :class:`PathState` into the arrays of ``out``, a :class:`JointState`."""
    q, bend = rows.joints, rows.curvature
    for k in range(start, stop):
        i, o = state.row[k], state.shift[k]
        speed, acceleration = state.speed[k], state.acceleration[k]
        h = rows.step[i] if rows.step[i] > 0.0 else 1.0
        for j in range(q.shape[1]):
            third = (bend[i + 1, j] - bend[i, j]) / h
            first = compute_start_slope(q, bend, h, i, j)
            second = bend[i, j] + third * o
            slope = first + o * (bend[i, j] + 0.5 * third * o)
            out.joints[k, j] = q[i, j] + o * (first + o * (0.5 * bend[i, j] + third * o / 6.0))
            out.speeds[k, j] = slope * speed
            out.accelerations[k, j] = slope * acceleration + second * speed * speed


@njit(nogil=True, cache=True, error_model="numpy")
def mark_coarse_steps(rows, steps, middle, tolerances, coarse, start, stop):
    """Mark the steps over which the splines are not the machine's joints, from both in the middle of each step.

    steps : (k,) indices; middle : :class:`Midpoints`; tolerances : :class:`SplineTolerances`
    coarse : (k,) becomes True where a joint, or its acceleration at the greatest speed, is off by more
    """
    bend, limit = rows.curvature, tolerances.acceleration
    for k in range(start, stop):
        i = steps[k]
        x = rows.feed_ceiling[i]
        for j in range(len(limit)):  # no acceleration lets the path be passed faster, but for a moment
            x = min(x, limit[j] / max(abs(bend[i, j]), abs(bend[i + 1, j])))
        coarse[k] = False
        for j in range(len(limit)):
            off = abs(middle.joints[k, j] - middle.splined[k, j])
            if off > middle.rounding[k, j]:
                # a spline off in the middle is off 32/h² times as much in its second derivative
                harder = limit[j] < np.inf and 32.0 * off / rows.step[i] ** 2 * x > tolerances.fraction * limit[j]
                coarse[k] |= off > tolerances.joints[j] or harder
            elif off != off:
                coarse[k] = True
