"""How near a law comes to its limits, and which of them it meets."""

from __future__ import annotations

import numpy as np
from numba import njit

_PLACES = 5  # of a piece, both ends among them, at which limits are looked at


@njit(nogil=True, cache=True, error_model="numpy")
def _shares(c, place, step, q, bend, limits, most, which, along, across):
    """Shares of the joints' limits at places (places, 4) on step c: mm after its row, ṡ, s̈ and s⃛.

    most, which : (places, 3) become the greatest shares of a speed, an acceleration and a jerk, and of which joint
    along, across : (2,) become the greatest ones of an acceleration and a jerk, where s̈ or s⃛ has the greater part in
        it, and where ṡ has
    """
    h = step[c]
    for n in range(3):
        for k in range(len(place)):
            most[k, n], which[k, n] = 0.0, 0
    for n in range(2):
        along[n] = across[n] = 0.0
    speed, acceleration, jerk = limits
    for j in range(q.shape[1]):
        bend0, third = bend[c, j], (bend[c + 1, j] - bend[c, j]) / h
        slope0 = (q[c + 1, j] - q[c, j]) / h - h * (2.0 * bend0 + bend[c + 1, j]) / 6.0
        per_speed, per = 1.0 / speed[j], (1.0 / acceleration[j], 1.0 / jerk[j])
        for k in range(len(place)):
            o, v, a, e = place[k, 0], place[k, 1], place[k, 2], place[k, 3]
            second, slope = bend0 + third * o, slope0 + o * (bend0 + 0.5 * third * o)
            share = abs(slope * v) * per_speed
            if share > most[k, 0]:
                most[k, 0], which[k, 0] = share, j
            own = (slope * a, slope * e)
            other = (second * v * v, (3.0 * second * a + third * v * v) * v)
            for n in range(2):
                share = abs(own[n] + other[n]) * per[n]
                if share > most[k, 1 + n]:
                    most[k, 1 + n], which[k, 1 + n] = share, j
                if abs(own[n]) > abs(other[n]):
                    along[n] = max(along[n], share)
                else:
                    across[n] = max(across[n], share)


@njit(nogil=True, cache=True, error_model="numpy")
def _greatest(k, fed, most, which, joints):
    """By how much the law would have to be stretched at place k, and the number of the limit that says so."""
    asked, name = fed, 0
    if most[k, 0] > asked:
        asked, name = most[k, 0], 1 + which[k, 0]
    if most[k, 1] > asked**2:
        asked, name = np.sqrt(most[k, 1]), 1 + joints + which[k, 1]
    if most[k, 2] > asked**3:
        asked, name = np.cbrt(most[k, 2]), 1 + 2 * joints + which[k, 2]
    return asked, name


@njit(nogil=True, cache=True, error_model="numpy")
def judged(step, q, bend, feed, limits, pieces, first, last, slower, gentler, binding):
    """By how much a law would have to be stretched in time to keep every limit, at some places of each of its pieces.

    feed : (steps,) of ṡ²; limits : speed, acceleration and jerk, (joints,) each
    pieces : time, cell, shift, speed, rise, jerk; see :class:`~parakin.toolpath.feed.law.Pace`
    slower : (steps,) becomes what ṡ asks for on each step; gentler : (pieces,) what s̈ and s⃛ do on each piece
    binding : (rows,) becomes what limits the law most where it passes each row: 0 the feed, 1 + j the speed of joint j,
        1 + m + j its acceleration, 1 + 2m + j its jerk
    """
    time, cell, shift, speed, rise, jerk = pieces
    place, along, across = np.empty((_PLACES, 4)), np.empty(2), np.empty(2)
    most, which = np.empty((_PLACES, 3)), np.empty((_PLACES, 3), np.int64)
    joints, worst, before = q.shape[1], 0.0, 0.0
    for c in range(cell[first], cell[last - 1] + 1):
        slower[c] = 0.0
    for p in range(first, last):
        c, dt, v, a, e = cell[p], time[p + 1] - time[p], speed[p], rise[p], jerk[p]
        per_feed, fastest, fed = 1.0 / np.sqrt(feed[c]), 0.0, 0.0
        for k in range(_PLACES):
            t = k * dt / (_PLACES - 1)
            place[k, 0] = min(shift[p] + t * (v + t * (0.5 * a + t * e / 6.0)), step[c])
            place[k, 1], place[k, 2], place[k, 3] = max(0.0, v + t * (a + 0.5 * t * e)), a + t * e, e
            fed = place[k, 1] * per_feed
            fastest = max(fastest, fed)
        _shares(c, place, step, q, bend, limits, most, which, along, across)
        asked, name = _greatest(0, v * per_feed, most, which, joints)
        if p == first or cell[p - 1] < c - 1 or (cell[p - 1] == c - 1 and asked > before):
            binding[c] = name
        before, name = _greatest(_PLACES - 1, fed, most, which, joints)
        if p == last - 1 or cell[p + 1] != c:
            binding[c + 1] = name
        swift = max(fastest, np.sqrt(across[0]), np.cbrt(across[1]))
        for k in range(_PLACES):
            swift = max(swift, most[k, 0])
        slower[c] = max(slower[c], swift)
        gentler[p] = max(np.sqrt(along[0]), np.cbrt(along[1]))
        worst = max(worst, swift, gentler[p])
    return worst
