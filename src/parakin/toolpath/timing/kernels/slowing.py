"""Kernels that make a speed profile keep every limit by slowing it down, smoothly in time.

First the speed is lowered to the least within a ramp's time and averaged (a grey erosion and a box filter): that bounds
how fast s̈ changes. Then the profile is slowed by exp(-L), L ≥ 0 a smooth function of time: x = ṡ² becomes x·exp(-2L),
and s̈ follows. L is as high as a broken step needs it, everywhere within a span of time around the step. Where that is
not enough the span is doubled, at last to the whole stretch between two stops; slowing that down keeps any limit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Indices
from ....kernels.compiling import njit
from .step_limits import measure_excess, measure_step

_ROOM = 0.997  # fraction of the speed that just keeps all limits
_ROUNDS = 40  # each halves what is too fast, or more
_WHOLE = 4.0  # spans in a stretch's time: if fewer, it is slowed down as a whole
_LEVEL = 0.35  # of s̈ with which a step can be passed at all; twice as much beside a stop
_DIP = 0.9  # of s̈ with which ṡ would come to 0 between two rows


class TimeScratch(NamedTuple):
    """Arrays that are overwritten, of n rows.

    times : (n,) s at each row; reach : (n,) s to either side of a row that are looked at
    values, spread, total, mean, rate : (n,) a function of time, its greatest values, its integral, its mean, and its
        mean's rate
    queue : (n,) rows whose values are still greatest
    """

    times: Array
    reach: Array
    values: Array
    spread: Array
    total: Array
    mean: Array
    rate: Array
    queue: Indices


@njit(nogil=True, cache=True)
def allocate_scratch(n):
    """Allocate the scratch for n rows."""
    return TimeScratch(
        np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int64)
    )


@njit(nogil=True, cache=True, error_model="numpy")
def _spread_greatest(first, last, scratch):
    """Find the greatest of ``values`` within ``reach`` of each row: ``spread`` (a queue of falling values)."""
    times, reach, values, queue = scratch.times, scratch.reach, scratch.values, scratch.queue
    head, tail, coming = 0, 0, first
    for i in range(first, last + 1):
        while coming <= last and (coming <= i or times[coming] <= times[i] + reach[i]):
            while tail > head and values[queue[tail - 1]] <= values[coming]:
                tail -= 1
            queue[tail] = coming
            tail, coming = tail + 1, coming + 1
        while queue[head] < i and times[queue[head]] < times[i] - reach[i]:
            head += 1
        scratch.spread[i] = values[queue[head]]


@njit(nogil=True, cache=True, error_model="numpy")
def _integrate(i, last, times, values, total, time):
    """Integrate the piecewise linear ``values`` to a time after row i, and evaluate them there."""
    dt = time - times[i]
    if dt <= 0.0 or i >= last:
        return total[i] + values[i] * dt, values[i]
    slope = (values[i + 1] - values[i]) / (times[i + 1] - times[i])
    return total[i] + dt * (values[i] + 0.5 * slope * dt), values[i] + slope * dt


@njit(nogil=True, cache=True, error_model="numpy")
def _average(first, last, scratch, values, mean):
    """Average ``values`` within ``reach`` of each row into ``mean``; for a constant reach ``rate`` is its derivative.

    Beyond the ends values stay as they are there.
    """
    times, reach, total, rate = scratch.times, scratch.reach, scratch.total, scratch.rate
    total[first] = 0.0
    for i in range(first, last):
        total[i + 1] = total[i] + 0.5 * (values[i] + values[i + 1]) * (times[i + 1] - times[i])
    low, high = first, first
    for i in range(first, last + 1):
        mean[i], rate[i] = values[i], 0.0
        if reach[i] > 0.0:
            begin, end = times[i] - reach[i], times[i] + reach[i]
            while low < last and times[low + 1] < begin:
                low += 1
            while high < last and times[high + 1] < end:
                high += 1
            before, at_begin = _integrate(low, last, times, values, total, begin)
            after, at_end = _integrate(high, last, times, values, total, end)
            mean[i], rate[i] = (after - before) / (end - begin), (at_end - at_begin) / (end - begin)


@njit(nogil=True, cache=True, error_model="numpy")
def _clip_acceleration(first, last, step, x, a):
    """Clip s̈ at the rows of a stretch so that every step can be passed at the mean speed of its ends."""
    x[first] = x[last] = a[first] = a[last] = 0.0
    for i in range(first + 1, last):
        most = np.inf
        for n in range(i - 1, i + 1):
            fraction = 2.0 * _LEVEL if n == first or n == last - 1 else _LEVEL
            both = np.sqrt(x[n]) + np.sqrt(x[n + 1])
            most = min(most, fraction * both * both / step[n], _DIP * np.sqrt(x[i]) * both / step[n])
        a[i] = min(max(a[i], -most), most)


@njit(nogil=True, cache=True, error_model="numpy")
def smooth_speeds(first, last, step, span, x, a, scratch):
    """Lower the speed to its least within ``span`` s, and average it twice, from row ``first`` to ``last``, at rest.

    x : (rows,) ṡ², changed; a : (rows,) becomes s̈
    """
    times, reach, values, spread = scratch.times, scratch.reach, scratch.values, scratch.spread
    times[first] = 0.0
    for i in range(first, last):
        times[i + 1] = times[i] + 2.0 * step[i] / (np.sqrt(x[i]) + np.sqrt(x[i + 1]))
    for i in range(first, last + 1):  # half the way to a stop at most: there nothing would move
        reach[i] = 0.5 * min(span, times[i], times[last] - times[i])
        values[i] = -np.sqrt(x[i])
    _spread_greatest(first, last, scratch)
    for i in range(first, last + 1):
        reach[i] = min(0.25 * span, times[i], times[last] - times[i])
        values[i] = -spread[i]
    _average(first, last, scratch, values, scratch.mean)
    _average(first, last, scratch, scratch.mean, values)
    for i in range(first + 1, last):
        x[i] = values[i] * values[i]
    for i in range(first + 1, last):
        h, g = step[i - 1], step[i]
        a[i] = 0.5 * ((x[i] - x[i - 1]) * g / h + (x[i + 1] - x[i]) * h / g) / (h + g)
    _clip_acceleration(first, last, step, x, a)


@njit(nogil=True, cache=True, error_model="numpy")
def measure_needs(limits, x, a, needs, start, stop):
    """Measure steps from ``start`` to ``stop``: their time, s, and how much slower, as a logarithm, they have to be.

    needs : (steps, 2), overwritten; the time of a step that can't be passed at all is below 0
    """
    for i in range(start, stop):
        if limits.step[i] > 0.0:
            needs[i, 0], product = measure_step(i, limits, x[i], a[i], x[i + 1], a[i + 1])
            needs[i, 1] = 0.0
            if not product > 0.0:
                excess = measure_excess(i, limits, x[i], a[i], x[i + 1], a[i + 1])
                needs[i, 1] = np.log(max(excess, 1.0) / _ROOM) if excess < np.inf else 1.0


@njit(nogil=True, cache=True, error_model="numpy")
def _gather_needs(first, last, limits, x, needs, scratch):
    """Gather the needs of a stretch's steps at its rows in ``values``, and the rows' times.

    Returns the greatest need, and whether a step can't be passed at all.
    """
    times, values, worst, lost = scratch.times, scratch.values, 0.0, False
    times[first] = values[first] = 0.0
    for i in range(first, last):
        t, need = needs[i, 0], needs[i, 1]
        values[i], values[i + 1], worst = max(values[i], need), need, max(worst, need)
        if t < 0.0:
            lost = True
            t = 2.0 * limits.step[i] / (np.sqrt(x[i]) + np.sqrt(x[i + 1]))
        times[i + 1] = times[i] + t
    return worst, lost


@njit(nogil=True, cache=True, error_model="numpy")
def slow_down(first, last, limits, ramp, x, a, needs, scratch):
    """Slow a stretch down until it keeps all limits, from row ``first`` to ``last``, at rest; returns whether it does.

    limits : :class:`~.step_limits.StepLimits`; ramp : the first span, s; x, a : (rows,) ṡ² and s̈, changed
    needs : of :func:`measure_needs`, changed
    """
    span, values, mean, rate = ramp, scratch.values, scratch.mean, scratch.rate
    for _ in range(_ROUNDS):
        worst, lost = _gather_needs(first, last, limits, x, needs, scratch)
        if lost:
            _clip_acceleration(first, last, limits.step, x, a)
            measure_needs(limits, x, a, needs, first, last)
            worst, lost = _gather_needs(first, last, limits, x, needs, scratch)
        if worst == 0.0:
            return True
        if _WHOLE * span >= scratch.times[last]:
            mean[first : last + 1], rate[first : last + 1] = worst, 0.0
        else:
            scratch.reach[first : last + 1] = 1.5 * span
            _spread_greatest(first, last, scratch)
            scratch.reach[first : last + 1] = 0.5 * span
            _average(first, last, scratch, scratch.spread, values)
            _average(first, last, scratch, values, scratch.spread)
            _average(first, last, scratch, scratch.spread, mean)
        slowed = False
        for i in range(first, last + 1):
            before, slowed = slowed, mean[i] != 0.0 or rate[i] != 0.0
            if slowed:
                slower = np.exp(-2.0 * mean[i])
                x[i], a[i] = x[i] * slower, (a[i] - np.sqrt(x[i]) * rate[i]) * slower
            if i > first and (before or slowed):
                measure_needs(limits, x, a, needs, i - 1, i)
        span *= 2.0
    return False
