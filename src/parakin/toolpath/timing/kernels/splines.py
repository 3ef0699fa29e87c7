"""Poses along rounded corners, and cubic splines through rows of joints.

A path is straight pieces with its corners rounded. Over ``reach`` on either side of a corner the slope turns from that
of one piece to that of the next; its rate of turning, the pose's second derivative, rises straight to its greatest at
the corner and falls again. That adds turn·reach/6·(1 - d/reach)³ to the straight pieces at the distance d from the
corner, so the roundings of neighbours may overlap up to each other's corners: they add up.

Rows are places on the path: a piece (``segment``) and the distance from its start (``offset``); ``step`` leads from one
row to the next. A step of 0 parts two stretches, at a corner that is not rounded.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SLIVER = 2e-3  # of a piece: knots nearer than this are one


@njit(nogil=True, cache=True)
def _pieces(k, length, reach, ends):
    """The knots of piece k between its corners in ``ends`` (4,), and how many there are."""
    whole = length[k]
    a, b = min(reach[k], whole), max(whole - reach[k + 1], 0.0)
    a, b = min(a, b), max(a, b)
    near = SLIVER * whole
    ends[0] = 0.0
    n = 1
    if near < a < whole - near:
        ends[n] = a
        n += 1
    if max(near, ends[n - 1] + near) < b < whole - near:
        ends[n] = b
        n += 1
    ends[n] = whole
    return n + 1


@njit(nogil=True, cache=True)
def rows_of(length, reach, parted, parts, longest, segment, offset):
    """Fill ``segment`` and ``offset``, if they have room; returns how many rows a path has.

    length : (k,) of the pieces; reach, parted : (k + 1,) of the corners, ``parted`` where the path is not smooth
    parts : (k + 1,) steps between two knots, at least, where a corner is rounded
    longest : no step is longer
    """
    ends = np.empty(4)
    r = 0
    for k in range(len(length)):
        n = _pieces(k, length, reach, ends)
        for i in range(n - 1):
            span = ends[i + 1] - ends[i]
            count = max(2, int(np.ceil(span / longest)))
            if ends[i] + 0.5 * span < reach[k]:
                count = max(count, parts[k])
            if ends[i + 1] - 0.5 * span > length[k] - reach[k + 1]:
                count = max(count, parts[k + 1])
            for p in range(count):
                if r < len(segment):
                    segment[r], offset[r] = k, ends[i] + span * p / count
                r += 1
        if parted[k + 1] or k == len(length) - 1:
            if r < len(segment):
                segment[r], offset[r] = k, length[k]
            r += 1
    return r


@njit(nogil=True, cache=True)
def blended(segment, offset, corner, length, slope, turn, reach, out, start, stop):
    """Poses of rows into ``out`` (rows, axes).

    corner, turn : (k + 1, axes); slope : (k, axes) of the straight pieces
    """
    for r in range(start, stop):
        k, o = segment[r], offset[r]
        rest = length[k] - o
        a = max(0.0, 1.0 - o / reach[k]) if reach[k] > 0.0 else 0.0
        b = max(0.0, 1.0 - rest / reach[k + 1]) if reach[k + 1] > 0.0 else 0.0
        a, b = reach[k] * a * a * a / 6.0, reach[k + 1] * b * b * b / 6.0
        for c in range(out.shape[1]):
            out[r, c] = corner[k, c] + slope[k, c] * o + turn[k, c] * a + turn[k + 1, c] * b


@njit(nogil=True, cache=True, error_model="numpy")
def swiftness(segment, offset, step, tip, length, slope, turn, reach, feed, most, out, start, stop):
    """The greatest ṡ² over each step, (rows - 1,), for which the tip keeps to the feed.

    tip : columns of the pose that are lengths; feed, most : (k,) mm/s of the tip, and of s itself, on the pieces

    Over a step the slope is a parabola, so it stays within its three Bernstein coefficients.
    """
    for r in range(start, stop):
        k, o, h = segment[r], offset[r], step[r]
        s0, s1, s2 = 0.0, 0.0, 0.0
        a, b = 0.0, 0.0
        a1, b1 = 0.0, 0.0
        if reach[k] > 0.0:
            a, a1 = max(0.0, 1.0 - o / reach[k]), max(0.0, 1.0 - (o + h) / reach[k])
        if reach[k + 1] > 0.0:
            rest = length[k] - o
            b, b1 = max(0.0, 1.0 - rest / reach[k + 1]), max(0.0, 1.0 - (rest - h) / reach[k + 1])
        for c in tip:
            first = slope[k, c] - 0.5 * a * a * turn[k, c] + 0.5 * b * b * turn[k + 1, c]
            last = slope[k, c] - 0.5 * a1 * a1 * turn[k, c] + 0.5 * b1 * b1 * turn[k + 1, c]
            bend = 0.0
            if reach[k] > 0.0:
                bend += turn[k, c] * a / reach[k]
            if reach[k + 1] > 0.0:
                bend += turn[k + 1, c] * b / reach[k + 1]
            middle = first + 0.5 * h * bend
            s0 += first * first
            s1 += middle * middle
            s2 += last * last
        out[r] = most[k] * most[k]
        if feed[k] < np.inf:
            out[r] = min(out[r], feed[k] * feed[k] / max(s0, s1, s2))


@njit(nogil=True, cache=True, error_model="numpy")
def bends(step, q, out, room):
    """Second derivatives at the rows of the cubic splines through ``q`` (rows, joints), a spline a stretch.

    At a stretch's ends the first two and the last two steps share one cubic. ``room`` (rows,) is overwritten.
    """
    count, m = q.shape
    start = np.int64(0)
    while start < count:
        stop = start
        while stop < count - 1 and step[stop] > 0.0:
            stop += 1
        if stop - start > 2:
            _bends(start, stop, step, q, out, room)
        else:
            for j in range(m):
                bend = 0.0
                if stop - start == 2:
                    h, g = step[start], step[start + 1]
                    bend = 2.0 * ((q[stop, j] - q[start + 1, j]) / g - (q[start + 1, j] - q[start, j]) / h) / (h + g)
                for i in range(start, stop + 1):
                    out[i, j] = bend
        start = stop + 1


@njit(nogil=True, cache=True, error_model="numpy")
def _bends(start, stop, step, q, out, room):
    """One stretch of at least three steps: elimination downward, then upward."""
    m = q.shape[1]
    for i in range(start + 1, stop):
        h, g = step[i - 1], step[i]
        below, middle, above = h, 2.0 * (h + g), g
        if i == start + 1:
            middle, above, below = middle + h + h * h / g, above - h * h / g, 0.0
        if i == stop - 1:
            middle, below, above = middle + g + g * g / h, below - g * g / h, 0.0
        pivot = 1.0 / (middle - below * room[i - 1]) if i > start + 1 else 1.0 / middle
        room[i] = above * pivot
        h, g = 6.0 / h, 6.0 / g
        for j in range(m):
            right = (q[i + 1, j] - q[i, j]) * g - (q[i, j] - q[i - 1, j]) * h
            if i > start + 1:
                right -= below * out[i - 1, j]
            out[i, j] = right * pivot
    for i in range(stop - 2, start, -1):
        for j in range(m):
            out[i, j] -= room[i] * out[i + 1, j]
    ratio, other = step[start] / step[start + 1], step[stop - 1] / step[stop - 2]
    for j in range(m):
        out[start, j] = (1.0 + ratio) * out[start + 1, j] - ratio * out[start + 2, j]
        out[stop, j] = (1.0 + other) * out[stop - 1, j] - other * out[stop - 2, j]


@njit(nogil=True, cache=True, error_model="numpy")
def nearest(here, there, guess, turning, scale, start, stop):
    """Take rows of ``there`` into ``here`` (rows, joints) where they are nearer to ``guess``, whole turns apart.

    turning : (joints,) which count turns; scale : (joints,) what a joint's distance is measured by
    """
    for r in range(start, stop):
        first, second = 0.0, 0.0
        for j in range(guess.shape[1]):
            a, b = here[r, j], there[r, j]
            if turning[j]:
                a -= 2.0 * np.pi * np.round((a - guess[r, j]) / (2.0 * np.pi))
                b -= 2.0 * np.pi * np.round((b - guess[r, j]) / (2.0 * np.pi))
            here[r, j], there[r, j] = a, b
            first += abs(a - guess[r, j]) / scale[j]
            second += abs(b - guess[r, j]) / scale[j]
        if second < first or first != first:
            for j in range(guess.shape[1]):
                here[r, j] = there[r, j]


@njit(nogil=True, cache=True, error_model="numpy")
def astray(cell, step, bend, feed, middle, guess, near, limit, close, grain, out, start, stop):
    """Mark the steps ``cell`` over which splines are not the joints, by what both are in the middle (cells, joints).

    feed, limit : (steps,) of ṡ², (joints,) of the accelerations; no acceleration may be off by ``close`` of its limit
    near : (joints,) what a joint may be off; grain : (cells, joints) of its size, what it may be off by rounding
    """
    for r in range(start, stop):
        i = cell[r]
        fast = feed[i]
        for j in range(len(limit)):  # no acceleration lets the path be passed faster, but for a moment
            fast = min(fast, limit[j] / max(abs(bend[i, j]), abs(bend[i + 1, j])))
        out[r] = False
        for j in range(len(limit)):
            off = abs(middle[r, j] - guess[r, j])
            if off > grain[r, j] * max(1.0, abs(guess[r, j])):
                # a spline off in the middle is off 32/h² times as much in its second derivative
                out[r] |= off > near[j] or (limit[j] < np.inf and 32.0 * off / step[i] ** 2 * fast > close * limit[j])
            elif off != off:
                out[r] = True


@njit(nogil=True, cache=True, error_model="numpy")
def along(cell, shift, speed, rise, step, q, bend, joints, speeds, accelerations, start, stop):
    """Joints, their speeds and accelerations ``shift`` after the rows ``cell``, where ṡ and s̈ are speed and rise."""
    for r in range(start, stop):
        i, o = cell[r], shift[r]
        h = step[i] if step[i] > 0.0 else 1.0
        for j in range(q.shape[1]):
            third = (bend[i + 1, j] - bend[i, j]) / h
            first = (q[i + 1, j] - q[i, j]) / h - h * (2.0 * bend[i, j] + bend[i + 1, j]) / 6.0
            second = bend[i, j] + third * o
            slope = first + o * (bend[i, j] + 0.5 * third * o)
            joints[r, j] = q[i, j] + o * (first + o * (0.5 * bend[i, j] + third * o / 6.0))
            speeds[r, j] = slope * speed[r]
            accelerations[r, j] = slope * rise[r] + second * speed[r] * speed[r]
