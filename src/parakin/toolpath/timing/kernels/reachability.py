"""The quickest law along a path of joints, by reachability, with limits that hold between the rows as well.

The joints are cubic splines of the path's parameter s: over a step h their second derivative is straight and the first
a parabola. With s̈ = u constant over a step, x = ṡ² is straight too, and a joint's acceleration q'·u + q''·x is a
parabola. Its three Bernstein coefficients are linear in u and the step's first x, and it lies between the least and
the greatest of them: a law that keeps these within the limit keeps it everywhere.

Every x that can still be braked in time is below a greatest one, found backward from the end (Pham and Pham, A new
approach to time-optimal path parameterization based on reachability analysis, IEEE T-RO 34, 2018); forward, the
greatest u that stays below is the quickest.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_TURNS = 60  # Newton's method on a convex function of straight pieces ends after a few
_SAFE = 1.0 - 1e-11  # what is reachable, less rounding
_CLEAR, _BESIDE = 0.02, 1e-5  # of a step: how near a new row may be to one that is there, and to a stop
_LITTLE = 1.1  # (q')²·x may exceed its ends by so much, and they be lowered for that


@njit(nogil=True, cache=True, error_model="numpy")
def _bernstein(i, j, h, q, bend, pairs):
    """The coefficients of joint j's acceleration α·u + β·x over step i: three pairs of α and β."""
    m0, m1 = bend[i, j], bend[i + 1, j]
    d = (q[i + 1, j] - q[i, j]) / h - h * (2.0 * m0 + m1) / 6.0
    pairs[0], pairs[1] = d, m0
    pairs[2], pairs[3] = d + 1.5 * h * m0, 0.5 * (m0 + m1)
    pairs[4], pairs[5] = d + h * (0.5 * m0 + 2.5 * m1), m1


@njit(nogil=True, cache=True, error_model="numpy")
def _lines(i, h, q, bend, limit, cap, pairs, reach, tilt):
    """Bounds of u over step i: ±reach - tilt·x. Returns how many, and a bound of x alone.

    limit : (joints,) of the acceleration, infinite for none; cap : (steps,) of u itself
    """
    n, most = 0, np.inf
    if cap[i] < np.inf:
        reach[0], tilt[0] = cap[i], 0.0
        n = 1
    for j in range(len(limit)):
        if limit[j] < np.inf:
            w = 1.0 / limit[j]
            _bernstein(i, j, h, q, bend, pairs)
            for k in range(0, 6, 2):
                a, b = pairs[k] * w, pairs[k + 1] * w
                if a != 0.0:
                    reach[n], tilt[n] = 1.0 / abs(a), b / a
                    n += 1
                elif b != 0.0:
                    most = min(most, 1.0 / abs(b))
    return n, most


@njit(nogil=True, cache=True, error_model="numpy")
def braked(i, h, x, after, q, bend, limit, cap, room):
    """The greatest ṡ² at row i, ``x`` at most, from which ``after`` is not exceeded at the next row.

    room : (8 + 6·joints,) is overwritten
    """
    lines = (len(room) - 6) // 2
    pairs, reach, tilt = room[:6], room[6 : 6 + lines], room[6 + lines :]
    n, most = _lines(i, h, q, bend, limit, cap, pairs, reach, tilt)
    x, half = min(x, most), 0.5 / h
    for _ in range(_TURNS):
        high, low = (after - x) * half, -x * half
        falls, rises = -half, -half
        for k in range(n):
            b = tilt[k] * x
            if reach[k] - b < high:
                high, falls = reach[k] - b, -tilt[k]
            if -reach[k] - b > low:
                low, rises = -reach[k] - b, -tilt[k]
        if low <= high:
            break
        less = (low - high) / (rises - falls)
        if not less > 1e-15 * x:
            break
        x = max(0.0, x - less)
    return x * _SAFE


@njit(nogil=True, cache=True, error_model="numpy")
def driven(i, h, x, after, most, q, bend, limit, cap, room):
    """The greatest s̈ over step i, ``most`` at most, with which ṡ² goes from ``x`` to no more than ``after``."""
    lines = (len(room) - 6) // 2
    pairs, reach, tilt = room[:6], room[6 : 6 + lines], room[6 + lines :]
    n, _ = _lines(i, h, q, bend, limit, cap, pairs, reach, tilt)
    half = 0.5 / h
    high, low = min(most, (after - x) * half), -x * half
    for k in range(n):
        b = tilt[k] * x
        high = min(high, reach[k] - b)
        low = max(low, -reach[k] - b)
    return max(high, low)


@njit(nogil=True, cache=True, error_model="numpy")
def backward(step, q, bend, limit, cap, ceiling, reachable, start, stop):
    """``reachable`` (rows,): the greatest x from which every limit can be kept up to row ``stop``, where x ends as 0.

    ceiling : (rows,) of x; 0 where the motion stops
    """
    room = np.empty(8 + 6 * len(limit))
    reachable[stop] = 0.0
    for i in range(stop - 1, start - 1, -1):
        reachable[i] = 0.0
        if step[i] > 0.0:
            reachable[i] = braked(i, step[i], ceiling[i], reachable[i + 1], q, bend, limit, cap, room)


@njit(nogil=True, cache=True, error_model="numpy")
def forward(step, q, bend, limit, cap, reachable, x, u, start, stop):
    """The quickest law: x (rows,) from 0 at row ``start`` on, and u (steps,)."""
    room = np.empty(8 + 6 * len(limit))
    x[start] = 0.0
    for i in range(start, stop):
        h = step[i]
        u[i], x[i + 1] = 0.0, 0.0
        if h > 0.0:
            u[i] = driven(i, h, x[i], reachable[i + 1], np.inf, q, bend, limit, cap, room)
            x[i + 1] = min(max(x[i] + 2.0 * h * u[i], 0.0), reachable[i + 1])


@njit(nogil=True, cache=True, error_model="numpy")
def ceilings(step, q, bend, speed, feed, most, left, right, start, stop):
    """What feed and the joints' speeds (joints,) allow for x at both ends of each step, and straight between them.

    feed : (steps,) of x; most : what x is bounded by in any case; left, right : (steps,) become the bounds
    """
    for i in range(start, stop):
        h = step[i]
        a = b = min(feed[i], most)
        for j in range(len(speed)):
            if h > 0.0 and speed[j] < np.inf:
                m0, m1 = bend[i, j], bend[i + 1, j]
                d0 = (q[i + 1, j] - q[i, j]) / h - h * (2.0 * m0 + m1) / 6.0
                d1, d2 = d0 + 0.5 * h * m0, d0 + 0.5 * h * (m0 + m1)
                # With x at both ends as the speed there allows, (q')²·x is no more between them than the greatest of
                # its Bernstein coefficients says; where that is too much, q' is taken as its greatest everywhere.
                l0, l2 = 1.0 / (d0 * d0), 1.0 / (d2 * d2)
                p1, p2, p3 = d0 * d1, (2.0 * d1 * d1 + d0 * d2) / 3.0, d1 * d2
                c1, c2 = 0.8 * p1 * l0 + 0.2 * d0 * d0 * l2, 0.6 * p2 * l0 + 0.4 * p1 * l2
                c3, c4 = 0.4 * p3 * l0 + 0.6 * p2 * l2, 0.2 * d2 * d2 * l0 + 0.8 * p3 * l2
                over = max(1.0, c1, c2, c3, c4)
                if over < _LITTLE:
                    l0, l2 = l0 / over, l2 / over
                else:
                    l0 = l2 = 1.0 / max(d0 * d0, d1 * d1, d2 * d2)
                a, b = min(a, speed[j] ** 2 * l0), min(b, speed[j] ** 2 * l2)
        left[i], right[i] = a, b


@njit(nogil=True, cache=True, error_model="numpy")
def slack(step, q, bend, limit, cap, left, right, x, u, first, second, start, stop):
    """What steps give away because u is one for all of each, s.

    left, right : (steps,) bounds of x, see :func:`ceilings`
    first, second : (steps,) become the fractions of a step at which a row is missing, 0 where none is: where the law
        could stop rising, and where it could begin to fall
    """
    pairs, reach, tilt = np.empty(6), np.empty(3 * len(limit) + 1), np.empty(3 * len(limit) + 1)
    total = 0.0
    for i in range(start, stop):
        first[i] = second[i] = 0.0
        h, here, after = step[i], x[i], x[i + 1]
        if h == 0.0:
            continue
        n, _ = _lines(i, h, q, bend, limit, cap, pairs, reach, tilt)
        high, low = np.inf, -np.inf
        for k in range(n):
            high = min(high, reach[k] - tilt[k] * here)
            low = max(low, -reach[k] - tilt[k] * here)
        if not (0.0 < high < np.inf and -np.inf < low < 0.0):
            continue
        # here + 2·high·r meets after - 2·low·(h - r) at the apex, or the bound before it
        high, low, slope = 2.0 * high, 2.0 * low, (right[i] - left[i]) / h
        rise = min(max((after - here - low * h) / (high - low), 0.0), h)
        fall, top = rise, here + high * rise
        bottom = top
        if top > left[i] + slope * rise:
            if not low < slope < high:
                continue
            rise, fall = (left[i] - here) / (high - slope), h - (right[i] - after) / (slope - low)
            top, bottom = left[i] + slope * rise, left[i] + slope * fall
        v0, v1, v2, v3 = np.sqrt(here), np.sqrt(top), np.sqrt(bottom), np.sqrt(after)
        best = 2.0 * (rise / (v0 + v1) + (h - fall) / (v2 + v3))
        if fall > rise:
            best += 2.0 * (fall - rise) / (v1 + v2)
        lost = 2.0 * h / (v0 + v3) - best
        if lost > 0.0:
            total += lost
            # A row may be as near to one that is there as rows are on its other side; nothing is there at a stop.
            near = min(_CLEAR * h, 0.2 * step[i - 1]) if here > 0.0 else _BESIDE * h
            far = h - (min(_CLEAR * h, 0.2 * step[i + 1]) if after > 0.0 else _BESIDE * h)
            if near < rise < far:
                first[i] = rise / h
            if near < fall < far and (first[i] == 0.0 or fall - rise > _CLEAR * h):
                second[i] = fall / h
    return total
