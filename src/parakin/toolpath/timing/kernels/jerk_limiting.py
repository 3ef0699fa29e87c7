"""Laws that keep jerks, checked and made slower, flatter or softer where a limit does not hold.

Of a joint's own curve, 3q''·ṡ·s̈ + q'''·ṡ³ is part of its jerk; that is bounded by shares. In the end no more is missing
than that a law be stretched in time by a trifle as a whole: that divides speeds by the stretching, accelerations by
its square, jerks by its cube.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .jerk_passes import falling, pooled, reached, rising
from .utilisation import judged

_ACROSS, _BOTH = 0.5, 0.3  # shares of a jerk that q'''·ṡ³ and 3q''·ṡ·s̈ may take
_CLOSE = 1e-3  # beyond a limit: less is left to stretching, and after many rounds more from round to round
_PATIENT, _ROUNDS = 20, 60
_SAME = 1e-6  # of a piece's speed and jerk: what is not a change
_PLACES = 4  # of each piece at which limits are looked at
_ALONE = 2  # rounds after which a step's neighbours are made softer with it
_AT_ONCE = 0.4  # no less of s⃛ is left from one round to the next
_SURE = 1.0001  # what the limits may be exceeded between the places where they are checked


@njit(nogil=True, cache=True, error_model="numpy")
def _rises(start, stop, step, x, u, rise):
    """s̈ at the rows, from its means over the steps."""
    rise[start] = rise[stop] = 0.0
    for i in range(start + 1, stop):
        h, g = step[i - 1], step[i]
        most = np.inf  # with more of it a step could not be passed at the mean speed of its ends
        for n in range(i - 1, i + 1):
            part = 0.7 if n == start or n == stop - 1 else 0.35
            most = min(most, part * (np.sqrt(x[n]) + np.sqrt(x[n + 1])) ** 2 / step[n])
        rise[i] = min(max((u[i - 1] * g + u[i] * h) / (h + g), -most), most)


@njit(nogil=True, cache=True, error_model="numpy")
def _written(start, stop, step, x, rise, pieces, first, passed, fresh):
    """Two pieces of constant s⃛ for each step, from ``first`` on; ``fresh`` (steps,) becomes where they changed."""
    time, cell, shift, speed, ramp, jerk = pieces
    n, t = first, 0.0
    for i in range(start, stop):
        passed[i] = t
        v, w, more = np.sqrt(x[i]), np.sqrt(x[i + 1]), rise[i + 1] - rise[i]
        mean = 0.5 * (v + w)
        dt = 2.0 * step[i] / (mean + np.sqrt(max(mean * mean - more * step[i] / 3.0, 0.0)))
        half = 0.5 * dt
        e = 4.0 * (w - v - rise[i] * dt) / (dt * dt) - more / dt
        after = 2.0 * more / dt - e
        same = abs(speed[n] - v) <= _SAME * v and abs(jerk[n] - e) <= _SAME * abs(e)
        fresh[i] = not (same and abs(jerk[n + 1] - after) <= _SAME * abs(after) and cell[n] == i)
        time[n], cell[n], shift[n], speed[n], ramp[n], jerk[n] = t, i, 0.0, v, rise[i], e
        time[n + 1], cell[n + 1], ramp[n + 1], jerk[n + 1] = t + half, i, rise[i] + half * e, after
        speed[n + 1] = max(0.0, v + half * (rise[i] + 0.5 * half * e))
        shift[n + 1] = min(half * (v + half * (0.5 * rise[i] + half * e / 6.0)), step[i])
        t, n = t + dt, n + 2
    passed[stop] = time[n] = t
    return n


@njit(nogil=True, cache=True, error_model="numpy")
def _bounded(start, stop, bend, jerk, x, cap):
    """Bound s̈ so that its share in the joints' jerks is bounded, at speeds as great as x has them."""
    for i in range(start, stop):
        v, cap[i] = np.sqrt(max(x[i], x[i + 1])), np.inf
        for j in range(len(jerk)):
            cap[i] = min(cap[i], _BOTH * jerk[j] / (3.0 * max(abs(bend[i, j]), abs(bend[i + 1, j])) * v))


@njit(nogil=True, cache=True, error_model="numpy")
def _bent(i, start, stop, step, x, u):
    """The greater s⃛ at both rows of step i, infinite at a stop."""
    if i == start or i == stop - 1:
        return np.inf
    before = abs(u[i] - u[i - 1]) * np.sqrt(x[i]) / (step[i] + step[i - 1])
    after = abs(u[i + 1] - u[i]) * np.sqrt(x[i + 1]) / (step[i] + step[i + 1])
    return 2.0 * max(before, after)


@njit(nogil=True, cache=True, error_model="numpy")
def _tightened(start, stop, step, x, u, jerk, parts, first, beside, bounds, touched, rough):
    """Tighten the bounds of steps whose pieces don't keep a limit; ``touched`` (rows,) becomes where that was done."""
    low, cap, calm = bounds
    touched[start : stop + 1] = False
    for i in range(start, stop):
        p = first + 2 * (i - start)
        if max(parts[p, 3], parts[p + 1, 3]) <= 1.0 + _CLOSE:
            continue
        slower, flatter = min(parts[p, 0], parts[p + 1, 0]), min(parts[p, 1], parts[p + 1, 1])
        softer = min(parts[p, 2], parts[p + 1, 2])
        rough[i] = min(rough[i], softer)
        if slower < 1.0:
            low[i] = min(low[i], slower**2 * max(x[i], x[i + 1]))
            touched[i] = touched[i + 1] = True
        if flatter < 1.0:
            most = max(abs(u[i]), abs(u[max(start, i - 1)]), abs(u[min(stop - 1, i + 1)]))
            for n in range(max(start, i - 1), min(stop, i + 2)):
                cap[n] = min(cap[n], flatter * most)
                touched[n] = touched[n + 1] = True
        if softer < 1.0:
            now = min(_bent(i, start, stop, step, x, u), max(abs(jerk[p]), abs(jerk[p + 1])))
            for n in range(max(start, i - beside), min(stop, i + beside + 1)):
                calm[n] = max(softer, _AT_ONCE) * min(calm[n], now)
                touched[n] = touched[n + 1] = True


@njit(nogil=True, cache=True, error_model="numpy")
def _tempered(start, stop, step, q, bend, feed, ceiling, limits, pieces, first, passed, binding, rough, room, rounds):
    """The law of one stretch; returns the end of its pieces, and by how much it has still to be stretched."""
    (low, cap, calm, reachable, x, u, upward, rises, level, falls), (bent, sums, widths, rise), parts, heads, flags = (
        room
    )
    touched, moved, fresh = flags
    for i in range(start, stop):
        low[i], calm[i] = ceiling[i], np.inf
        for j in range(q.shape[1]):
            third = abs(bend[i + 1, j] - bend[i, j]) / step[i]
            even = limits[1][j] / max(abs(bend[i, j]), abs(bend[i + 1, j]))  # with more, u could not be 0
            low[i] = min(low[i], (_ACROSS * limits[2][j] / third) ** (2.0 / 3.0), even)
    _bounded(start, stop, bend, limits[2], x, cap)
    last, worst = first, 1.0
    for again in range(1 + rounds):
        if again < 2:
            touched[start : stop + 1] = True
        reached(start, stop, step, q, bend, limits, low, cap, touched, reachable, moved)
        rising(start, stop, step, q, bend, limits, cap, calm, touched, reachable, moved, upward, rises)
        falling(start, stop, step, q, bend, limits, cap, calm, touched, upward, moved, level, falls)
        x[start : stop + 1], u[start:stop] = level[start : stop + 1], falls[start:stop]
        pooled(start, stop, step, q, bend, limits, calm, x, u, bent, sums, widths, heads)
        if again == 0:
            _bounded(start, stop, bend, limits[2], x, cap)
            continue
        _rises(start, stop, step, x, u, rise)
        last = _written(start, stop, step, x, rise, pieces, first, passed, fresh)
        if again == 1:
            fresh[start:stop] = True
        worst = judged(step, q, bend, feed, limits, pieces, first, last, parts, binding, fresh, _PLACES)
        if worst <= 1.0 + _CLOSE * max(3, again - _PATIENT):
            break
        beside = 1 if again > _ALONE else 0
        _tightened(start, stop, step, x, u, pieces[5], parts, first, beside, (low, cap, calm), touched, rough)
    fresh[start:stop] = True  # what binds the law where it passes from one step to the next takes both
    judged(step, q, bend, feed, limits, pieces, first, last, parts, binding, fresh, _PLACES)
    return last, worst


@njit(nogil=True, cache=True, error_model="numpy")
def smoothed(step, q, bend, feed, ceiling, limits, pieces, passed, binding, rough, room, rounds):
    """Laws of all stretches, one after another, that keep speeds, accelerations and jerks. Returns the pieces' end.

    ceiling : (steps,) of x; the rest as in :func:`~.shares.judged`
    passed : (rows,) becomes when each row is passed
    rough : (steps,) of 1, becomes the least part of s⃛ that was left on each step
    room : arrays that are overwritten: ten (rows,), of which the fifth comes as the quickest law's x, four (rows,), one
        (pieces, 4), one (rows,) of int64 and three of bool
    rounds : after which a law is stretched for the rest, 0 for as many as make sense
    """
    n, start, count, now = 0, 0, len(step) + 1, 0.0
    time, speed, rise, jerk = pieces[0], pieces[3], pieces[4], pieces[5]
    while start < count - 1:
        stop = start
        while stop < count - 1 and step[stop] > 0.0:
            stop += 1
        last, worst = _tempered(
            start, stop, step, q, bend, feed, ceiling, limits, pieces, n, passed, binding, rough, room,
            rounds or _ROUNDS,
        )  # fmt: skip
        wider = max(1.0, _SURE * worst)
        for p in range(n, last):
            time[p] = now + wider * time[p]
            speed[p], rise[p], jerk[p] = speed[p] / wider, rise[p] / wider**2, jerk[p] / wider**3
        for i in range(start, stop + 1):
            passed[i] = now + wider * passed[i]
        now += wider * time[last]
        time[last] = now
        n, start = last, stop + 1
    return n
