"""Kernels for passes over one stretch of a joint path, after which its joints keep limits of jerk too.

With x = ṡ² over the path, u = ½·x' is s̈ and u'·ṡ is s⃛: a limit of jerk bounds how fast u may change. Where x bends
upward, behind a slow place and before one, two passes bound that. The forward pass lets u rise no faster than it may,
from 0 or from its present value; the backward pass does the same for braking, so the slowest places are passed level.
Where x bends downward, the greatest x below that bends less is a convex hull: that of x and what it may bend, summed up
twice.

What a pass computed is kept; where nothing has changed it is not computed again. A row is computed if it is ``touched``
or if the row before it in the pass came out differently.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Indices
from ....kernels.compiling import njit
from ..drive_limits import DriveLimits
from .acceleration_limits import AccelerationLimits, allocate_lines
from .reachability import find_acceleration, find_controllable
from .splines import JointRows

_LEAST = 0.1  # least fraction of a jerk limit that is left for s⃛


class Stretch(NamedTuple):
    """A stretch of a joint path from row ``start`` to row ``stop``, with the rows and limits of the whole path."""

    start: int
    stop: int
    rows: JointRows
    limits: DriveLimits


class StepBounds(NamedTuple):
    """Upper bounds of x, |u| and |s⃛| on each step, (steps,) each; they are lowered from round to round."""

    x: Array
    u: Array
    jerk: Array


class Pools(NamedTuple):
    """Scratch of :func:`flatten_peaks`, (rows,) each: pools of neighbouring steps that share one mean.

    allowance : the change of u that is allowed from the start to each step
    totals, widths, heads : each pool's sum of step·(u + allowance), its length, and its first step
    """

    allowance: Array
    totals: Array
    widths: Array
    heads: Indices


@njit(nogil=True, cache=True, error_model="numpy")
def _find_free_jerk(i, stretch, bounds, v, a, sign):
    """Find how far s⃛ may go up or down (``sign``) at row i, where ṡ and s̈ are v and a."""
    step, q, bend, jerk = stretch.rows.step, stretch.rows.joints, stretch.rows.curvature, stretch.limits.jerk
    before, after = i > stretch.start, i < stretch.stop
    most = min(bounds.jerk[i - 1] if before else np.inf, bounds.jerk[i] if after else np.inf)
    for j in range(len(jerk)):
        if jerk[j] == np.inf:
            continue
        slope, third = 0.0, 0.0
        if before:
            h = step[i - 1]
            slope = (q[i, j] - q[i - 1, j]) / h + h * (bend[i - 1, j] + 2.0 * bend[i, j]) / 6.0
            third = abs(bend[i, j] - bend[i - 1, j]) / h
        if after:
            h = step[i]
            slope = (q[i + 1, j] - q[i, j]) / h - h * (2.0 * bend[i, j] + bend[i + 1, j]) / 6.0
            third = max(third, abs(bend[i + 1, j] - bend[i, j]) / h)
        if slope != 0.0:
            rest = jerk[j] - third * v**3 - sign * np.sign(slope) * 3.0 * bend[i, j] * v * a
            most = min(most, max(rest, _LEAST * jerk[j]) / abs(slope))
    return most


@njit(nogil=True, cache=True, error_model="numpy")
def _start_from_rest(h, jerk):
    """Compute ṡ² at the end of a first step h from rest, at this constant s⃛."""
    return 0.25 * (6.0 * h) ** (4.0 / 3.0) * jerk ** (2.0 / 3.0)


@njit(nogil=True, cache=True, error_model="numpy")
def update_controllable(stretch, bounds, touched, controllable, moved):
    """Find the greatest x from which the path can be completed (backward pass), into ``controllable`` (rows,).

    moved : (rows,) becomes where it changed
    """
    start, stop = stretch.start, stretch.stop
    limits = AccelerationLimits(stretch.limits.acceleration, bounds.u)
    lines = allocate_lines(limits)
    moved[stop], controllable[stop] = False, 0.0
    for i in range(stop - 1, start - 1, -1):
        moved[i] = False
        if touched[i] or moved[i + 1]:
            top = min(bounds.x[i - 1], bounds.x[i]) if i > start else 0.0
            greatest = find_controllable(i, top, controllable[i + 1], stretch.rows, limits, lines)
            moved[i] = greatest != controllable[i]
            controllable[i] = greatest


@njit(nogil=True, cache=True, error_model="numpy")
def limit_rise(stretch, bounds, touched, controllable, moved, x, u):
    """Find the quickest x and u below ``controllable`` whose u rises no faster than it may (forward pass).

    x : (rows,); u : (steps,)
    moved : (rows,) where ``controllable`` changed; becomes where x did
    """
    start, stop, step = stretch.start, stretch.stop, stretch.rows.step
    limits = AccelerationLimits(stretch.limits.acceleration, bounds.u)
    lines = allocate_lines(limits)
    x[start], before, changed = 0.0, 0.0, moved[start]
    for i in range(start, stop):
        if touched[i] or changed or moved[i + 1]:
            h, v = step[i], np.sqrt(x[i])
            jerk = _find_free_jerk(i, stretch, bounds, v, before, 1.0)
            if i == start:
                most = 0.5 * _start_from_rest(h, jerk) / h
            else:
                fraction = 0.5 if u[i - 1] > 0.0 else 0.25  # a lowest place has two sides
                most = before + fraction * (step[i - 1] + h) * jerk / v
            rise = find_acceleration(i, x[i], controllable[i + 1], most, stretch.rows, limits, lines)
            after = min(max(x[i] + 2.0 * h * rise, 0.0), controllable[i + 1])
            moved[i + 1], changed = after != x[i + 1], after != x[i + 1] or rise != u[i]
            x[i + 1], u[i] = after, rise
        else:
            moved[i + 1] = changed = False
        before = max(u[i], 0.0)
    moved[start] = False


@njit(nogil=True, cache=True, error_model="numpy")
def limit_braking(stretch, bounds, touched, ceiling, moved, x, u):
    """Find x and u below ``ceiling`` (rows,) whose braking does not begin too late to end softly (backward pass).

    moved : (rows,) where ``ceiling`` changed
    """
    start, stop, step = stretch.start, stretch.stop, stretch.rows.step
    limits = AccelerationLimits(stretch.limits.acceleration, bounds.u)
    lines = allocate_lines(limits)
    x[stop], after, changed = 0.0, 0.0, False
    for i in range(stop - 1, start - 1, -1):
        if touched[i] or touched[i + 1] or changed or moved[i]:
            h, v = step[i], np.sqrt(x[i + 1])
            jerk = _find_free_jerk(i + 1, stretch, bounds, v, -after, 1.0)
            if i == stop - 1:
                most = _start_from_rest(h, jerk)
            else:
                fraction = 0.5 if u[i + 1] < 0.0 else 0.25
                most = x[i + 1] + 2.0 * h * (after + fraction * (h + step[i + 1]) * jerk / v)
            greatest = find_controllable(i, min(ceiling[i], most), x[i + 1], stretch.rows, limits, lines)
            rise = 0.5 * (x[i + 1] - greatest) / h
            changed = greatest != x[i] or rise != u[i]
            x[i], u[i] = greatest, rise
        else:
            changed = False
        after = max(-u[i], 0.0)


@njit(nogil=True, cache=True, error_model="numpy")
def flatten_peaks(stretch, bounds, x, u, pools):
    """Lower x where u falls faster than it may: pool adjacent violators, so that neighbours share their mean.

    pools : :class:`Pools`, overwritten
    """
    start, stop, step = stretch.start, stretch.stop, stretch.rows.step
    allowance, totals, widths, heads = pools.allowance, pools.totals, pools.widths, pools.heads
    count, allowance[start] = 0, 0.0
    for i in range(start, stop):
        if i > start:
            allowance[i] = allowance[i - 1]
            v, a = np.sqrt(x[i]), 0.5 * (u[i - 1] + u[i])
            jerk = _find_free_jerk(i, stretch, bounds, v, a, -1.0)
            allowance[i] += 0.5 * (step[i - 1] + step[i]) * jerk / v
        total, width, head = step[i] * (u[i] + allowance[i]), step[i], i
        while count > 0 and totals[count - 1] * width > total * widths[count - 1]:
            count -= 1
            total, width, head = total + totals[count], width + widths[count], heads[count]
        totals[count], widths[count], heads[count] = total, width, head
        count += 1
    for k in range(count):
        end = heads[k + 1] if k + 1 < count else stop
        if end - heads[k] > 1:
            for i in range(heads[k], end):
                u[i] = totals[k] / widths[k] - allowance[i]
            for i in range(heads[k], end - 1):
                x[i + 1] = max(x[i] + 2.0 * step[i] * u[i], 0.0)
            u[end - 1] = 0.5 * (x[end] - x[end - 1]) / step[end - 1]
