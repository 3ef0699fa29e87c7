"""How near a law comes to its limits, and which of them it meets."""

from __future__ import annotations

import numpy as np
from numba import njit

_MORE = 1.1  # power of what is asked for that is done


@njit(nogil=True, cache=True, error_model="numpy")
def _shares(c, place, step, q, bend, limits, most, which, ways):
    """Shares of the joints' limits at places (places, 4) on step c: mm after its row, ṡ, s̈ and s⃛.

    most, which : (places, 3) become the greatest shares of a speed, an acceleration and a jerk, and of which joint
    ways : (places, 5) become the greatest ones of an acceleration in which s̈ has the greater part, and ṡ; and of a
        jerk in which s⃛ has, ṡ with s̈, and ṡ alone
    """
    h = step[c]
    most[:], which[:], ways[:] = 0.0, 0, 0.0
    speed, acceleration, jerk = limits
    for j in range(q.shape[1]):
        bend0, third = bend[c, j], (bend[c + 1, j] - bend[c, j]) / h
        slope0 = (q[c + 1, j] - q[c, j]) / h - h * (2.0 * bend0 + bend[c + 1, j]) / 6.0
        per_speed, per_acceleration, per_jerk = 1.0 / speed[j], 1.0 / acceleration[j], 1.0 / jerk[j]
        for k in range(len(place)):
            o, v, a, e = place[k, 0], place[k, 1], place[k, 2], place[k, 3]
            second, slope = bend0 + third * o, slope0 + o * (bend0 + 0.5 * third * o)
            share = abs(slope * v) * per_speed
            if share > most[k, 0]:
                most[k, 0], which[k, 0] = share, j
            along, across = slope * a, second * v * v
            share = abs(along + across) * per_acceleration
            if share > most[k, 1]:
                most[k, 1], which[k, 1] = share, j
            way = 0 if abs(along) > abs(across) else 1
            ways[k, way] = max(ways[k, way], share)
            along, both, across = slope * e, 3.0 * second * v * a, third * v**3
            share = abs(along + both + across) * per_jerk
            if share > most[k, 2]:
                most[k, 2], which[k, 2] = share, j
            way = 2 if abs(along) > abs(both + across) else 3 if abs(both) > abs(across) else 4
            ways[k, way] = max(ways[k, way], share)


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
def judged(step, q, bend, feed, limits, pieces, first, last, parts, binding, fresh, places):
    """By how much a law would have to be stretched in time to keep every limit, at some places of each of its pieces.

    feed : (steps,) of ṡ²; limits : speed, acceleration and jerk, (joints,) each
    pieces : time, cell, shift, speed, rise, jerk; see :class:`~parakin.toolpath.timing.trajectory.Pace`
    parts : (pieces, 4) becomes the parts of its ṡ, s̈ and s⃛ with which each piece would keep them, 1 where it does,
        and by how much it would have to be stretched
    binding : (rows,) becomes what limits the law most where it passes each row: 0 the feed, 1 + j the speed of joint j,
        1 + m + j its acceleration, 1 + 2m + j its jerk
    fresh : (steps,) where pieces are to be looked at; for the others ``parts`` holds
    places : of each piece, both ends among them
    """
    time, cell, shift, speed, rise, jerk = pieces
    place, ways = np.empty((places, 4)), np.empty((places, 5))
    most, which = np.empty((places, 3)), np.empty((places, 3), np.int64)
    joints, worst, before = q.shape[1], 0.0, 0.0
    for p in range(first, last):
        c, dt, v, a, e = cell[p], time[p + 1] - time[p], speed[p], rise[p], jerk[p]
        if not fresh[c]:
            worst = max(worst, parts[p, 3])
            continue
        per_feed = 1.0 / np.sqrt(feed[c])
        for k in range(places):
            t = k * dt / (places - 1)
            if k == 1 and 0.0 < -a / e < dt:
                t = -a / e  # where ṡ is least or greatest
            place[k, 0] = min(shift[p] + t * (v + t * (0.5 * a + t * e / 6.0)), step[c])
            place[k, 1], place[k, 2], place[k, 3] = max(0.0, v + t * (a + 0.5 * t * e)), a + t * e, e
        _shares(c, place, step, q, bend, limits, most, which, ways)
        parts[p, :3], parts[p, 3] = 1.0, 0.0
        for k in range(places):
            fed = place[k, 1] * per_feed
            asked, name = _greatest(k, fed, most, which, joints)
            parts[p, 3] = max(parts[p, 3], asked)
            if k == 0 and (p == first or cell[p - 1] < c - 1 or (cell[p - 1] == c - 1 and asked > before)):
                binding[c] = name
            if asked > 1.0:
                _part(max(fed, most[k, 0]), ways[k], parts[p])
            before = asked
        if p == last - 1 or cell[p + 1] != c:
            binding[c + 1] = name
        worst = max(worst, parts[p, 3])
    return worst


@njit(nogil=True, cache=True, error_model="numpy")
def _part(fast, ways, parts):
    """Lower the parts of ṡ, s̈ and s⃛ by what goes beyond a limit at a place; a little more than that alone would ask."""
    swift = max(fast, np.sqrt(ways[1]), np.cbrt(ways[4]), np.cbrt(ways[3]))
    steep = max(ways[0], ways[3] ** (2.0 / 3.0))
    parts[0] = min(parts[0], swift**-_MORE)
    parts[1] = min(parts[1], steep**-_MORE)
    parts[2] = min(parts[2], ways[2] ** -_MORE)
