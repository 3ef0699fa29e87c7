"""A law whose joints keep a limit of jerk too: the quickest one without, averaged over a moving window of time.

Averaged over τ a law's s⃛ is what s̈ changes over the window, divided by τ. The path is not left, for s is averaged and
not the joints; but what is within the limits on one part of a window may not be on the next. So the law is checked and
slowed where it was too fast, and averaged again, until no more is missing than that it be stretched in time by a
trifle as a whole: that divides speeds by the stretching, accelerations by its square and jerks by its cube.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .shares import judged
from .timing import backward, forward

_CLOSE = 1.005  # a law that has to be stretched by no more is good
_SLOWER, _GENTLER = 2.2, 2.2  # powers of the stretching a place asks for, by which its ṡ² or s̈ is bounded
_TRIES, _MOST = 6, 40  # rounds for a window on trial, and for the one taken
_SHORTER = 0.7  # a window's next size on trial
_TRIAL = 5_000  # rows of a stretch that windows are tried on
_SURE = 1.0001  # what the limits may be exceeded between the places where they are checked
_IDLE = 1e-3  # s: a window where no joint moves that it would be for
_NEWTON = 30


@njit(nogil=True, cache=True, error_model="numpy")
def _crossing(way, dt, v, a, e):
    """When way = v·t + a·t²/2 + e·t³/6, t in (0, dt), for a motion that never goes back."""
    low, high = 0.0, dt
    t = 0.5 * dt
    for _ in range(_NEWTON):
        off = t * (v + t * (0.5 * a + t * e / 6.0)) - way
        if off > 0.0:
            high = t
        else:
            low = t
        slope = v + t * (a + 0.5 * t * e)
        after = t - off / slope if slope > 0.0 else low
        if abs(after - t) <= 1e-15 * dt:
            return after
        t = after if low < after < high else 0.5 * (low + high)
    return t


@njit(nogil=True, cache=True, error_model="numpy")
def averaged(step, x, u, tau, start, stop, pieces, window, first, times, passed):
    """The law of rows start to stop averaged over ``tau``; its pieces from ``first`` on. Returns their end.

    pieces : see :func:`~.shares.judged`; none reaches over a row
    window : (pieces, 2) becomes the steps in which the window begins and ends
    times : (rows,) room; passed : (rows,) becomes when the rows are passed
    """
    time, cell, shift, speed, rise, jerk = pieces
    times[start] = 0.0
    for i in range(start, stop):
        times[i + 1] = times[i] + 2.0 * step[i] / (np.sqrt(x[i]) + np.sqrt(x[i + 1]))
    end = times[stop] + tau
    passed[start], passed[stop] = 0.0, end
    new, old = start, start - 1  # the steps that the window's ends are in; before and after all the law stands still
    n, t, c, o = first, 0.0, start, 0.0
    wide = 0.0  # mm between the starts of these steps
    while t < end:
        after = times[new + 1] if new < stop else end
        if old < stop:
            after = min(after, times[old + 1] + tau)
        after = min(after, end)
        span, va, ua, vb, ub = wide, 0.0, 0.0, 0.0, 0.0
        if new < stop:
            d, ua, va = t - times[new], u[new], np.sqrt(x[new])
            span += d * (va + 0.5 * ua * d)
            va += ua * d
        if start <= old < stop:
            d, ub, vb = t - tau - times[old], u[old], np.sqrt(x[old])
            span -= d * (vb + 0.5 * ub * d)
            vb += ub * d
        v, a, e = max(0.0, span / tau), (va - vb) / tau, (ua - ub) / tau
        while t < after:
            dt = after - t
            way = dt * (v + dt * (0.5 * a + dt * e / 6.0))
            over = o + way > step[c] and c < stop - 1
            if over:
                dt = _crossing(step[c] - o, dt, v, a, e)
            time[n], cell[n], shift[n], speed[n], rise[n], jerk[n] = t, c, o, v, a, e
            window[n, 0], window[n, 1] = max(old, start), min(new, stop - 1)
            n += 1
            if not over:
                o += way
                break
            t += dt
            v, a = max(0.0, v + dt * (a + 0.5 * dt * e)), a + dt * e
            o, c = 0.0, c + 1
            passed[c] = t
        if new < stop and after >= times[new + 1]:
            wide += step[new]
            new += 1
        if old < stop and after >= times[old + 1] + tau:
            wide -= step[old] if old >= start else 0.0
            old += 1
        t = after
    for i in range(c + 1, stop):
        passed[i] = end
    time[n] = end
    return n


@njit(nogil=True, cache=True, error_model="numpy")
def _tempered(tau, rounds, start, stop, step, q, bend, feed, ceiling, limits, pieces, first, passed, binding, room):
    """The law of one stretch averaged over ``tau``, and slowed where it has to be.

    Returns the end of its pieces, and by how much it has still to be stretched.
    """
    (low, ease, eased, top, reachable, x, u, times, slower), gentler, window = room
    limit = np.empty(q.shape[1])
    for j in range(len(limit)):
        limit[j] = min(limits[1][j], 0.5 * tau * limits[2][j])
    for i in range(start, stop):
        low[i], ease[i] = ceiling[i], 1.0
        for j in range(q.shape[1]):
            third = abs(bend[i + 1, j] - bend[i, j]) / step[i]
            low[i] = min(low[i], (0.5 * limits[2][j] / third) ** (2.0 / 3.0))  # leaves half for the rest
    last, worst = first, 1.0
    for again in range(rounds):
        top[start] = top[stop] = 0.0
        for i in range(start + 1, stop):
            top[i] = min(low[i - 1], low[i])
        backward(step, q, bend, limit, ease, top, reachable, start, stop)
        forward(step, q, bend, limit, ease, reachable, x, u, start, stop)
        last = averaged(step, x, u, tau, start, stop, pieces, window, first, times, passed)
        worst = judged(step, q, bend, feed, limits, pieces, first, last, slower, gentler, binding)
        if worst <= _CLOSE or again == rounds - 1:
            break
        for i in range(start, stop):
            if slower[i] > 1.0:
                low[i] = min(low[i], max(x[i], x[i + 1])) / slower[i] ** _SLOWER
            eased[i] = ease[i]
        for p in range(first, last):
            if gentler[p] > 1.0:
                for k in range(2):
                    i = window[p, k]
                    ease[i] = min(ease[i], eased[i] / gentler[p] ** _GENTLER)
    return last, worst


@njit(nogil=True, cache=True, error_model="numpy")
def _longest(start, stop, step, q, limits):
    """The longest window worth a trial: over it s̈ can go from one limit to the other, or the whole stretch is done."""
    length, by_way, by_rise = 0.0, np.inf, 0.0
    for i in range(start, stop):
        length += step[i]
    for j in range(q.shape[1]):
        if limits[2][j] < np.inf:
            by_rise = max(by_rise, 2.0 * limits[1][j] / limits[2][j])
            for i in range(start, stop):
                if q[i + 1, j] != q[i, j]:
                    by_way = min(by_way, limits[2][j] * step[i] / abs(q[i + 1, j] - q[i, j]))
    if by_way == np.inf:
        return _IDLE
    return min(by_rise, 2.0 * np.cbrt(2.0 * length / by_way))


@njit(nogil=True, cache=True, error_model="numpy")
def smoothed(step, q, bend, feed, ceiling, limits, pieces, passed, binding, room):
    """Laws of all stretches, one after another, that keep speeds, accelerations and jerks. Returns the pieces' end.

    ceiling : (steps,) of x; the rest as in :func:`~.shares.judged`
    passed : (rows,) becomes when each row is passed
    room : arrays that are overwritten: nine (rows,), one (pieces,), one (pieces, 2)
    """
    n, start, count, now = 0, 0, len(step) + 1, 0.0
    time, speed, rise, jerk = pieces[0], pieces[3], pieces[4], pieces[5]
    while start < count - 1:
        stop = start
        while stop < count - 1 and step[stop] > 0.0:
            stop += 1
        args = (step, q, bend, feed, ceiling, limits, pieces, n, passed, binding, room)
        begin = start + max(0, (stop - start - _TRIAL) // 2)
        trial, end, rounds = True, min(stop, begin + _TRIAL), _TRIES
        tau, best, last, worst = _longest(start, stop, step, q, limits), np.inf, n, 1.0
        while True:
            last, worst = _tempered(tau, rounds, begin, end, *args)
            if not trial:
                break
            seconds = time[last] * max(1.0, worst)
            if seconds < best:
                best, tau = seconds, tau * _SHORTER
            else:  # the one before it was the best
                trial, tau, begin, end, rounds = False, tau / _SHORTER, start, stop, _MOST
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
