"""Kernels for the quickest trajectory along a joint path: reachability analysis with the joints' acceleration limits.

With x = ṡ² and u = s̈ constant over a step, the limits bound u by lines in the step's first x; see
:mod:`.acceleration_limits`.

The controllable x at a row, those from which the path can be completed, lie below a greatest one. The backward pass
finds it, from the end (Pham and Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE T-RO 34, 2018). The forward pass takes the greatest u whose x is reachable and stays controllable; that
is the quickest trajectory.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit
from .acceleration_limits import allocate_lines, bound_acceleration

_TURNS = 60  # Newton's method on a convex, piecewise linear function ends after a few steps
_SAFE = 1.0 - 1e-11  # fraction of the controllable speed that is used; the rest is for rounding
_CLEAR, _BESIDE = 0.02, 1e-5  # of a step: how near a new row may be to an existing one, and to a stop


class Switches(NamedTuple):
    """Where rows are missing within steps, as fractions of each step, (steps,), 0 for none.

    rise_end : where the trajectory could stop accelerating
    fall_start : where it could begin to brake
    """

    rise_end: Array
    fall_start: Array


@njit(nogil=True, cache=True, error_model="numpy")
def find_controllable(i, x, after, rows, limits, lines):
    """Find the greatest ṡ² at row i, ``x`` at most, from which ``after`` is not exceeded at the next row.

    Newton's method on the gap between the greatest and the least u, a convex, piecewise linear function of x.
    """
    count, highest = bound_acceleration(i, rows, limits, lines)
    x, half = min(x, highest), 0.5 / rows.step[i]
    for _ in range(_TURNS):
        high, low = (after - x) * half, -x * half
        falls, rises = -half, -half
        for k in range(count):
            b = lines.tilt[k] * x
            if lines.upper[k] - b < high:
                high, falls = lines.upper[k] - b, -lines.tilt[k]
            if -lines.lower[k] - b > low:
                low, rises = -lines.lower[k] - b, -lines.tilt[k]
        if low <= high:
            break
        less = (low - high) / (rises - falls)
        if not less > 1e-15 * x:
            break
        x = max(0.0, x - less)
    return x * _SAFE


@njit(nogil=True, cache=True, error_model="numpy")
def find_acceleration(i, x, after, most, rows, limits, lines):
    """Find the greatest u over step i, ``most`` at most, with which ṡ² goes from ``x`` to no more than ``after``."""
    count, _ = bound_acceleration(i, rows, limits, lines)
    half = 0.5 / rows.step[i]
    high, low = min(most, (after - x) * half), -x * half
    for k in range(count):
        b = lines.tilt[k] * x
        high = min(high, lines.upper[k] - b)
        low = max(low, -lines.lower[k] - b)
    return max(high, low)


@njit(nogil=True, cache=True, error_model="numpy")
def compute_controllable(rows, limits, ceiling, controllable, start, stop):
    """Find the greatest x from which every limit can be kept up to row ``stop``, where x ends as 0 (backward pass).

    rows : :class:`~.splines.JointRows`; limits : :class:`AccelerationLimits`
    ceiling : (rows,) of x, 0 where the motion stops; controllable : (rows,) becomes the result
    """
    lines = allocate_lines(rows, limits)
    controllable[stop] = 0.0
    for i in range(stop - 1, start - 1, -1):
        controllable[i] = 0.0
        if rows.step[i] > 0.0:
            controllable[i] = find_controllable(i, ceiling[i], controllable[i + 1], rows, limits, lines)


@njit(nogil=True, cache=True, error_model="numpy")
def compute_reachable(rows, limits, controllable, x, u, start, stop):
    """Find the quickest trajectory, x (rows,) from 0 at row ``start`` on, and u (steps,) (forward pass)."""
    lines = allocate_lines(rows, limits)
    x[start] = 0.0
    for i in range(start, stop):
        h = rows.step[i]
        u[i], x[i + 1] = 0.0, 0.0
        if h > 0.0:
            u[i] = find_acceleration(i, x[i], controllable[i + 1], np.inf, rows, limits, lines)
            x[i + 1] = min(max(x[i] + 2.0 * h * u[i], 0.0), controllable[i + 1])


@njit(nogil=True, cache=True, error_model="numpy")
def find_switches(rows, limits, ceilings, x, switches, start, stop):
    """Find where steps lose time because u is constant over each; returns the time lost, s.

    ceilings : :class:`~.speed_ceilings.StepCeilings` of x; switches : :class:`Switches`, overwritten
    """
    lines = allocate_lines(rows, limits)
    total = 0.0
    for i in range(start, stop):
        switches.rise_end[i] = switches.fall_start[i] = 0.0
        h, here, after = rows.step[i], x[i], x[i + 1]
        if h == 0.0:
            continue
        count, _ = bound_acceleration(i, rows, limits, lines)
        high, low = np.inf, -np.inf
        for k in range(count):
            high = min(high, lines.upper[k] - lines.tilt[k] * here)
            low = max(low, -lines.lower[k] - lines.tilt[k] * here)
        if not (0.0 < high < np.inf and -np.inf < low < 0.0):
            continue
        # here + 2·high·r meets after - 2·low·(h - r) at the apex, or the ceiling before it
        left, right = ceilings.start[i], ceilings.end[i]
        high, low, slope = 2.0 * high, 2.0 * low, (right - left) / h
        rise = min(max((after - here - low * h) / (high - low), 0.0), h)
        fall, top = rise, here + high * rise
        bottom = top
        if top > left + slope * rise:
            if not low < slope < high:
                continue
            rise, fall = (left - here) / (high - slope), h - (right - after) / (slope - low)
            top, bottom = left + slope * rise, left + slope * fall
        v0, v1, v2, v3 = np.sqrt(here), np.sqrt(top), np.sqrt(bottom), np.sqrt(after)
        best = 2.0 * (rise / (v0 + v1) + (h - fall) / (v2 + v3))
        if fall > rise:
            best += 2.0 * (fall - rise) / (v1 + v2)
        lost = 2.0 * h / (v0 + v3) - best
        if lost > 0.0:
            total += lost
            # A row may be as near to an existing one as rows are on its other side; at a stop there is none.
            near = min(_CLEAR * h, 0.2 * rows.step[i - 1]) if here > 0.0 else _BESIDE * h
            far = h - (min(_CLEAR * h, 0.2 * rows.step[i + 1]) if after > 0.0 else _BESIDE * h)
            if here == 0.0 and rise <= near:  # a slow feed is reached at once: the row next to the stop does
                rise = 1.001 * near
            if after == 0.0 and fall >= far:
                fall = h - 1.001 * (h - far)
            if near < rise < far:
                switches.rise_end[i] = rise / h
            if near < fall < far and (switches.rise_end[i] == 0.0 or fall - rise > _CLEAR * h):
                switches.fall_start[i] = fall / h
    return total
