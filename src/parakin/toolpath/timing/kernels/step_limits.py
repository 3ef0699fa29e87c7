"""Kernels of one step of a jerk-limited speed profile: two pieces of constant s⃛, and how much of the limits they take.

A step leads from x = ṡ² and a = s̈ at one row to those at the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit
from .splines import compute_start_slope

_STILL = 1e-9  # of ṡ: below 0 by less is rounding


class StepLimits(NamedTuple):
    """The joints over each step and what bounds them: the problem that the interior point method solves.

    step : (steps,) mm; slope : (steps, joints) q' at each step's start; curvature : (rows, joints) q''
    ceiling_start, ceiling_end : (steps,) of x; between them it goes straight
    per_acceleration, per_jerk : (joints,) the reciprocals of the limits
    along, across : (rows, c) bounds of the drives' forces, as of :class:`~.splines.ForceRows`
    tightening : (steps,) the factor in time by which the limits of each step are tightened, 1 or more
    """

    step: Array
    slope: Array
    curvature: Array
    ceiling_start: Array
    ceiling_end: Array
    per_acceleration: Array
    per_jerk: Array
    along: Array
    across: Array
    tightening: Array


@njit(nogil=True, cache=True, error_model="numpy")
def compute_slopes(rows, speed, slope, slowness, first, last):
    """Compute q' at the start of steps ``first`` to ``last``, and the greatest of |q'|/``speed`` (joints,).

    rows : :class:`~.splines.JointRows`; both are 0 for a step of length 0
    """
    q, bend = rows.joints, rows.curvature
    for i in range(first, last):
        h, slowness[i] = rows.step[i], 0.0
        for j in range(len(speed)):
            slope[i, j] = 0.0
            if h > 0.0:
                slope[i, j] = compute_start_slope(q, bend, h, i, j)
                slowness[i] = max(slowness[i], abs(slope[i, j]) / speed[j])


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def join_step(h, x0, a0, x1, a1):
    """Join two rows by two pieces of equal time: the time of both, ṡ and s̈ between them, s⃛ of both, mm to the middle.

    The time is negative where they can't be joined.
    """
    v0, v1, more = np.sqrt(x0), np.sqrt(x1), a1 - a0
    mean = 0.5 * (v0 + v1)
    root = mean * mean - more * h / 3.0
    if not root > 0.0:
        return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t = 2.0 * h / (mean + np.sqrt(root))
    v, a = mean - 0.125 * more * t, 2.0 * (v1 - v0) / t - 0.5 * (a0 + a1)
    e0, e1 = 2.0 * (a - a0) / t, 2.0 * (a1 - a) / t
    middle = 0.5 * t * (v0 + 0.25 * t * (a0 + t * e0 / 6.0))
    least = min(v0 + 0.25 * t * a0, v1 - 0.25 * t * a1)
    if not (v > 0.0 and 0.0 < middle < h and least >= -_STILL * v):
        return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return t, v, a, e0, e1, middle


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _use_limits(i, limits, x0, a0, x1, a1):
    """Measure a step: its time, the greatest fraction c of a ceiling, of an acceleration and of a jerk, and a product.

    The product is that of 1 - c² for all of them, and of 1 - c for forces, which count as accelerations. The time is
    negative where the rows can't be joined.
    """
    h = limits.step[i]
    t, v, a, e0, e1, o = join_step(h, x0, a0, x1, a1)
    if t < 0.0:
        return -1.0, np.inf, np.inf, np.inf, 0.0
    v0, v1, x, tight = np.sqrt(x0), np.sqrt(x1), v * v, limits.tightening[i]
    c0, c2 = x0 / limits.ceiling_start[i], x1 / limits.ceiling_end[i]
    c1 = x / (limits.ceiling_start[i] + (limits.ceiling_end[i] - limits.ceiling_start[i]) * o / h)
    product = (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2)
    # Between the rows ṡ lies within its Bernstein coefficients
    early, late, mean = v0 + 0.25 * t * a0, v1 - 0.25 * t * a1, 0.5 * (v0 + v1)
    flow = 2.0 * h / (t * mean) - 1.0  # 0 where the rows can just be joined; ṡ does not fall to 0 on the way
    if x0 > 0.0:
        flow *= early / mean
    if x1 > 0.0:
        flow *= late / mean
    early *= early / (0.75 * limits.ceiling_start[i] + 0.25 * limits.ceiling_end[i])
    late *= late / (0.25 * limits.ceiling_start[i] + 0.75 * limits.ceiling_end[i])
    product *= (1.0 - early) * (1.0 - late) * max(flow, 0.0)
    of_ceiling, of_acceleration, of_jerk = max(max(c0, c1, c2), max(early, late)), 0.0, 0.0
    for j in range(len(limits.per_jerk)):
        bend0, bend1, slope0 = limits.curvature[i, j], limits.curvature[i + 1, j], limits.slope[i, j]
        third = (bend1 - bend0) / h
        slope, bend, slope1 = (
            slope0 + o * (bend0 + 0.5 * third * o),
            bend0 + third * o,
            slope0 + 0.5 * h * (bend0 + bend1),
        )
        w = limits.per_acceleration[j] * tight**2
        c0, c1 = abs(slope0 * a0 + bend0 * x0) * w, abs(slope * a + bend * x) * w
        c2 = abs(slope1 * a1 + bend1 * x1) * w
        of_acceleration = max(of_acceleration, c0, c1, c2)
        product *= (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2)
        w = limits.per_jerk[j] * tight**3
        if w > 0.0:
            c0 = abs(slope0 * e0 + v0 * (3.0 * bend0 * a0 + third * x0)) * w
            both = v * (3.0 * bend * a + third * x)
            c1, c2 = abs(slope * e0 + both) * w, abs(slope * e1 + both) * w
            c3 = abs(slope1 * e1 + v1 * (3.0 * bend1 * a1 + third * x1)) * w
            of_jerk = max(of_jerk, max(c0, c1), max(c2, c3))
            product *= (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2) * (1.0 - c3 * c3)
    share, w = o / h, tight**2
    for k in range(limits.along.shape[1]):
        along0, across0 = limits.along[i, k] * w, limits.across[i, k] * w
        along1, across1 = limits.along[i + 1, k] * w, limits.across[i + 1, k] * w
        c0, c2 = along0 * a0 + across0 * x0, along1 * a1 + across1 * x1
        c1 = (along0 + share * (along1 - along0)) * a + (across0 + share * (across1 - across0)) * x
        of_acceleration = max(of_acceleration, c0, c1, c2)
        product *= (1.0 - c0) * (1.0 - c1) * (1.0 - c2)
    return t, of_ceiling, of_acceleration, of_jerk, product


@njit(nogil=True, cache=True, error_model="numpy")
def measure_step(i, limits, x0, a0, x1, a1):
    """Measure a step: its time, and the product of what all limits leave; 0 where one is broken."""
    t, of_ceiling, of_acceleration, of_jerk, product = _use_limits(i, limits, x0, a0, x1, a1)
    return t, product if of_ceiling < 1.0 and of_acceleration < 1.0 and of_jerk < 1.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def measure_excess(i, limits, x0, a0, x1, a1):
    """Measure the factor by which a step would have to be stretched in time to keep every limit just so."""
    _, of_ceiling, of_acceleration, of_jerk, _ = _use_limits(i, limits, x0, a0, x1, a1)
    return max(np.sqrt(of_ceiling), np.sqrt(of_acceleration), np.cbrt(of_jerk))


@njit(nogil=True, cache=True, error_model="numpy")
def tighten_steps(steps, factors, limits, x, a, tighter):
    """Find how much to tighten the limits of steps (k,) that take ``factors`` (k,) of them somewhere.

    tighter : (steps,) becomes the factor in time, where it is more
    """
    for k in range(len(steps)):
        i = steps[k]
        excess = measure_excess(i, limits, x[i], a[i], x[i + 1], a[i + 1])
        tighter[i] = max(tighter[i], factors[k] / excess)


@njit(nogil=True, cache=True, error_model="numpy")
def measure_steps(limits, x, a, time, use, start, stop):
    """Measure steps from ``start`` to ``stop``: their ``time`` and the ``use`` of the most used jerk limit (steps,)."""
    for i in range(start, stop):
        time[i], use[i] = 0.0, 0.0
        if limits.step[i] > 0.0:
            t, _, _, jerk, _ = _use_limits(i, limits, x[i], a[i], x[i + 1], a[i + 1])
            time[i], use[i] = t, jerk


@njit(nogil=True, cache=True, error_model="numpy")
def locate_times(limits, x, a, steps, times, states):
    """Find where the motion is ``times`` (k,) after the start of ``steps``: ``states`` (k, 3), mm, ṡ² and s̈."""
    for k in range(len(steps)):
        i, after = steps[k], times[k]
        t, v, rise, e0, e1, o = join_step(limits.step[i], x[i], a[i], x[i + 1], a[i + 1])
        begin, speed, jerk = 0.0, np.sqrt(x[i]), e0
        base = a[i]
        if after > 0.5 * t:
            after, begin, speed, base, jerk = after - 0.5 * t, o, v, rise, e1
        states[k, 0] = begin + after * (speed + after * (0.5 * base + after * jerk / 6.0))
        states[k, 1] = (speed + after * (base + 0.5 * after * jerk)) ** 2
        states[k, 2] = base + after * jerk


@njit(nogil=True, cache=True, error_model="numpy")
def write_pieces(steps, limits, x, a, profile, span, first, last):
    """Write two pieces of constant s⃛ for ``steps`` from ``first`` to ``last`` to the profile, and the ``span`` of both.

    steps : (k,) all that are not of length 0, ascending; the profile's times are left to :func:`write_times`
    """
    speed, rise, jerk = profile.speed, profile.acceleration, profile.jerk
    for k in range(first, last):
        i, n = steps[k], 2 * k
        span[k], v, middle, e0, e1, o = join_step(limits.step[i], x[i], a[i], x[i + 1], a[i + 1])
        profile.row[n], profile.shift[n] = i, 0.0
        speed[n], rise[n], jerk[n] = np.sqrt(x[i]), a[i], e0
        profile.row[n + 1], profile.shift[n + 1] = i, o
        speed[n + 1], rise[n + 1], jerk[n + 1] = v, middle, e1


@njit(nogil=True, cache=True, error_model="numpy")
def write_times(edges, span, profile):
    """Write the times of pieces, two of equal time for each ``span`` (k,), and of the rows of the stretches."""
    k, now = 0, 0.0
    for n in range(len(edges)):
        for i in range(edges[n, 0], edges[n, 1]):
            profile.row_times[i] = profile.time[2 * k] = now
            profile.time[2 * k + 1] = now + 0.5 * span[k]
            now, k = now + span[k], k + 1
        profile.row_times[edges[n, 1]] = profile.time[2 * k] = now


@njit(nogil=True, cache=True, error_model="numpy")
def stretch_pieces(edges, profile, worst):
    """Stretch the time of each stretch by its factor ``worst`` (k,)."""
    time, row_times = profile.time, profile.row_times
    n, now = 0, 0.0
    for k in range(len(edges)):
        first, last, wider = edges[k, 0], edges[k, 1], worst[k]
        before = row_times[first]
        span = wider * (row_times[last] - before)
        for i in range(first, last):
            row_times[i] = now + wider * (row_times[i] - before)
            for _ in range(2):
                time[n] = now + wider * (time[n] - before)
                profile.speed[n] /= wider
                profile.acceleration[n] /= wider * wider
                profile.jerk[n] /= wider * wider * wider
                n += 1
        now += span
        row_times[last] = now
    time[n] = now
