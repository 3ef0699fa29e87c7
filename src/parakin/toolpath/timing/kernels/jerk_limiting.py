"""Kernels that limit jerk: plan each stretch, measure it, and lower the bounds of steps where a limit does not hold.

A joint's jerk is q'·s⃛ + 3q''·ṡ·s̈ + q'''·ṡ³. The last two terms are bounded to fractions of the limit beforehand. What
remains beyond a limit in the end is so little that the trajectory is stretched in time as a whole; see
:mod:`.utilisation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Flags
from ....kernels.compiling import njit
from .jerk_passes import Pools, StepBounds, Stretch, flatten_peaks, limit_braking, limit_rise, update_controllable
from .utilisation import Utilisation, measure_utilisation

_ACROSS, _BOTH = 0.5, 0.3  # fractions of a jerk limit that q'''·ṡ³ and 3q''·ṡ·s̈ may take
_CLOSE = 1e-3  # beyond a limit: less is left to stretching, and after many rounds more from round to round
_PATIENT, _ROUNDS = 20, 60
_SAME = 1e-6  # smaller changes, relative to a piece's speed and jerk, count as none
_PLACES = 4  # places on each piece where utilisation is measured
_ALONE = 2  # rounds after which a step's neighbours are made softer with it
_AT_ONCE = 0.4  # least ratio of a step's s⃛ to that of the round before
_SURE = 1.0001  # the profile is slowed by this × the worst utilisation, which is measured at some places only


class JerkScratch(NamedTuple):
    """Arrays that planning overwrites, of n rows; x is ṡ² and u is s̈.

    bounds : of x, u and s⃛ on each step
    x, u : (n,) the profile; x comes as the quickest profile's
    controllable, rising_x, rising_u, braking_x, braking_u : (n,) what the three passes computed last
    acceleration : (n,) s̈ at the rows
    pools, use : of the last pass, and of the pieces
    touched, moved : (n,) rows whose bounds changed, and rows whose x changed in a pass
    least_kept : (n - 1,) the least fraction of s⃛ that is left on each step, 1 at first
    """

    bounds: StepBounds
    x: Array
    u: Array
    controllable: Array
    rising_x: Array
    rising_u: Array
    braking_x: Array
    braking_u: Array
    acceleration: Array
    pools: Pools
    use: Utilisation
    touched: Flags
    moved: Flags
    least_kept: Array


@njit(nogil=True, cache=True, error_model="numpy")
def _smooth_acceleration(stretch, x, u, acceleration):
    """Compute s̈ at the rows from its means ``u`` over the steps."""
    start, stop, step = stretch.start, stretch.stop, stretch.rows.step
    acceleration[start] = acceleration[stop] = 0.0
    for i in range(start + 1, stop):
        h, g = step[i - 1], step[i]
        most = np.inf  # with more of it a step could not be passed at the mean speed of its ends
        for n in range(i - 1, i + 1):
            fraction = 0.7 if n == start or n == stop - 1 else 0.35
            most = min(most, fraction * (np.sqrt(x[n]) + np.sqrt(x[n + 1])) ** 2 / step[n])
        acceleration[i] = min(max((u[i - 1] * g + u[i] * h) / (h + g), -most), most)


@njit(nogil=True, cache=True, error_model="numpy")
def _write_pieces(stretch, x, row_acceleration, profile, first, changed):
    """Write two pieces of constant s⃛ for each step to the profile, from piece ``first`` on; returns their end.

    changed : (steps,) becomes where the pieces changed
    """
    step, speed, jerk = stretch.rows.step, profile.speed, profile.jerk
    n, t = first, 0.0
    for i in range(stretch.start, stretch.stop):
        profile.row_times[i] = t
        a = row_acceleration[i]
        v, w, more = np.sqrt(x[i]), np.sqrt(x[i + 1]), row_acceleration[i + 1] - a
        mean = 0.5 * (v + w)
        dt = 2.0 * step[i] / (mean + np.sqrt(max(mean * mean - more * step[i] / 3.0, 0.0)))
        half = 0.5 * dt
        e = 4.0 * (w - v - a * dt) / (dt * dt) - more / dt
        after = 2.0 * more / dt - e
        same = abs(speed[n] - v) <= _SAME * v and abs(jerk[n] - e) <= _SAME * abs(e)
        changed[i] = not (same and abs(jerk[n + 1] - after) <= _SAME * abs(after) and profile.row[n] == i)
        profile.time[n], profile.row[n], profile.shift[n] = t, i, 0.0
        speed[n], profile.acceleration[n], jerk[n] = v, a, e
        profile.time[n + 1], profile.row[n + 1] = t + half, i
        profile.shift[n + 1] = min(half * (v + half * (0.5 * a + half * e / 6.0)), step[i])
        speed[n + 1] = max(0.0, v + half * (a + 0.5 * half * e))
        profile.acceleration[n + 1], jerk[n + 1] = a + half * e, after
        t, n = t + dt, n + 2
    profile.row_times[stretch.stop] = profile.time[n] = t
    return n


@njit(nogil=True, cache=True, error_model="numpy")
def _bound_by_jerk(stretch, x, most):
    """Bound s̈ so that its part in the joints' jerks is bounded at speeds as great as x has them: ``most`` (steps,)."""
    bend, jerk = stretch.rows.curvature, stretch.limits.jerk
    for i in range(stretch.start, stretch.stop):
        v, most[i] = np.sqrt(max(x[i], x[i + 1])), np.inf
        for j in range(len(jerk)):
            most[i] = min(most[i], _BOTH * jerk[j] / (3.0 * max(abs(bend[i, j]), abs(bend[i + 1, j])) * v))


@njit(nogil=True, cache=True, error_model="numpy")
def _set_bounds(stretch, ceiling, bounds):
    """Set the bounds of each step from ``ceiling`` (steps,) of x and from the curvature of the joints."""
    step, bend, limits = stretch.rows.step, stretch.rows.curvature, stretch.limits
    for i in range(stretch.start, stretch.stop):
        bounds.x[i], bounds.jerk[i] = ceiling[i], np.inf
        for j in range(bend.shape[1]):
            third = abs(bend[i + 1, j] - bend[i, j]) / step[i]
            level = limits.acceleration[j] / max(abs(bend[i, j]), abs(bend[i + 1, j]))  # with more, u could not be 0
            bounds.x[i] = min(bounds.x[i], (_ACROSS * limits.jerk[j] / third) ** (2.0 / 3.0), level)


@njit(nogil=True, cache=True, error_model="numpy")
def _find_step_jerk(i, stretch, x, u):
    """Find the greater |s⃛| at both rows of step i, infinite at a stop."""
    step = stretch.rows.step
    if i == stretch.start or i == stretch.stop - 1:
        return np.inf
    before = abs(u[i] - u[i - 1]) * np.sqrt(x[i]) / (step[i] + step[i - 1])
    after = abs(u[i + 1] - u[i]) * np.sqrt(x[i + 1]) / (step[i] + step[i + 1])
    return 2.0 * max(before, after)


@njit(nogil=True, cache=True, error_model="numpy")
def _tighten_bounds(stretch, scratch, jerk, first, beside):
    """Lower the bounds of steps whose pieces break a limit; ``touched`` becomes the rows beside them.

    jerk : (pieces,); first : the stretch's first piece; beside : the number of neighbours that are made softer too
    """
    start, stop = stretch.start, stretch.stop
    bounds, kept, touched, x, u = scratch.bounds, scratch.use.kept, scratch.touched, scratch.x, scratch.u
    touched[start : stop + 1] = False
    for i in range(start, stop):
        p = first + 2 * (i - start)
        if max(kept[p, 3], kept[p + 1, 3]) <= 1.0 + _CLOSE:
            continue
        kept_speed, kept_acceleration = min(kept[p, 0], kept[p + 1, 0]), min(kept[p, 1], kept[p + 1, 1])
        kept_jerk = min(kept[p, 2], kept[p + 1, 2])
        scratch.least_kept[i] = min(scratch.least_kept[i], kept_jerk)
        if kept_speed < 1.0:
            bounds.x[i] = min(bounds.x[i], kept_speed**2 * max(x[i], x[i + 1]))
            touched[i] = touched[i + 1] = True
        if kept_acceleration < 1.0:
            most = max(abs(u[i]), abs(u[max(start, i - 1)]), abs(u[min(stop - 1, i + 1)]))
            for n in range(max(start, i - 1), min(stop, i + 2)):
                bounds.u[n] = min(bounds.u[n], kept_acceleration * most)
                touched[n] = touched[n + 1] = True
        if kept_jerk < 1.0:
            now = min(_find_step_jerk(i, stretch, x, u), max(abs(jerk[p]), abs(jerk[p + 1])))
            for n in range(max(start, i - beside), min(stop, i + beside + 1)):
                bounds.jerk[n] = max(kept_jerk, _AT_ONCE) * min(bounds.jerk[n], now)
                touched[n] = touched[n + 1] = True


@njit(nogil=True, cache=True, error_model="numpy")
def _run_passes(stretch, scratch):
    """Compute the profile x, u of a stretch within its bounds: three passes, and flattened peaks."""
    start, stop = stretch.start, stretch.stop
    bounds, touched, moved = scratch.bounds, scratch.touched, scratch.moved
    update_controllable(stretch, bounds, touched, scratch.controllable, moved)
    limit_rise(stretch, bounds, touched, scratch.controllable, moved, scratch.rising_x, scratch.rising_u)
    limit_braking(stretch, bounds, touched, scratch.rising_x, moved, scratch.braking_x, scratch.braking_u)
    scratch.x[start : stop + 1] = scratch.braking_x[start : stop + 1]
    scratch.u[start:stop] = scratch.braking_u[start:stop]
    flatten_peaks(stretch, bounds, scratch.x, scratch.u, scratch.pools)


@njit(nogil=True, cache=True, error_model="numpy")
def _plan_stretch(stretch, ceiling, profile, scratch, first, rounds):
    """Plan one stretch; returns the end of its pieces, and the factor by which it has still to be stretched in time."""
    start, stop, rows, limits = stretch.start, stretch.stop, stretch.rows, stretch.limits
    bounds, use = scratch.bounds, scratch.use
    _set_bounds(stretch, ceiling, bounds)
    _bound_by_jerk(stretch, scratch.x, bounds.u)
    last, worst = first, 1.0
    for again in range(1 + rounds):
        if again < 2:
            scratch.touched[start : stop + 1] = True
        _run_passes(stretch, scratch)
        if again == 0:
            _bound_by_jerk(stretch, scratch.x, bounds.u)
            continue
        _smooth_acceleration(stretch, scratch.x, scratch.u, scratch.acceleration)
        last = _write_pieces(stretch, scratch.x, scratch.acceleration, profile, first, use.changed)
        if again == 1:
            use.changed[start:stop] = True
        worst = measure_utilisation(rows, limits, profile, use, _PLACES, first, last)
        if worst <= 1.0 + _CLOSE * max(3, again - _PATIENT):
            break
        _tighten_bounds(stretch, scratch, profile.jerk, first, 1 if again > _ALONE else 0)
    use.changed[start:stop] = True  # at a row both steps that meet there decide what binds
    measure_utilisation(rows, limits, profile, use, _PLACES, first, last)
    return last, worst


@njit(nogil=True, cache=True, error_model="numpy")
def plan_jerk_limited(rows, limits, ceiling, profile, scratch, rounds):
    """Plan all stretches, one after another, so that speeds, accelerations and jerks are kept; returns the pieces' end.

    rows : :class:`~.splines.JointRows`
    limits : :class:`~parakin.toolpath.timing.drive_limits.DriveLimits`
    ceiling : (steps,) of ṡ²
    profile : :class:`~parakin.toolpath.timing.speed_profile.SpeedProfile` of two pieces a step, overwritten
    scratch : :class:`JerkScratch`, of which ``use.binding`` and ``least_kept`` are results too
    rounds : after which the rest is left to stretching in time, 0 for as many as make sense
    """
    n, start, count, now = 0, 0, len(rows.step) + 1, 0.0
    time, row_times = profile.time, profile.row_times
    speed, acceleration, jerk = profile.speed, profile.acceleration, profile.jerk
    while start < count - 1:
        stop = start
        while stop < count - 1 and rows.step[stop] > 0.0:
            stop += 1
        stretch = Stretch(start, stop, rows, limits)
        last, worst = _plan_stretch(stretch, ceiling, profile, scratch, n, rounds or _ROUNDS)
        wider = max(1.0, _SURE * worst)
        for p in range(n, last):
            time[p] = now + wider * time[p]
            speed[p], acceleration[p], jerk[p] = speed[p] / wider, acceleration[p] / wider**2, jerk[p] / wider**3
        for i in range(start, stop + 1):
            row_times[i] = now + wider * row_times[i]
        now += wider * time[last]
        time[last] = now
        n, start = last, stop + 1
    return n
