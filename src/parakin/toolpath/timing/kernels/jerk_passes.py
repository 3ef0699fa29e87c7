"""A law whose joints keep a limit of jerk too, near the quickest: passes over one stretch of a path.

With x = ṡ² over the path, u = ½·x' is s̈ and u'·ṡ is s⃛: a limit of jerk bounds how fast u may change. Where x bends
upward, behind a slow place and before one, two passes see to that. Forward u rises no faster than it may, from 0 or
from what it is, and backward the same is done for braking; so the slowest places are passed level. Where x bends down,
the greatest x below that bends less is a convex hull: that of x and what it may bend, summed up twice.

What a pass found is kept, and where nothing has changed it is not done again: a row is gone through if it is
``touched`` or the one before it in the pass came out otherwise.

low, cap, calm : (steps,) bounds of x, u and s⃛
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .reachability import braked, driven

_LEAST = 0.1  # share of a jerk that is left for s⃛ in any case


@njit(nogil=True, cache=True, error_model="numpy")
def _room(i, start, stop, step, q, bend, jerk, v, a, sign, calm):
    """How far s⃛ may go up or down (``sign``) at row i, where ṡ and s̈ are v and a."""
    most = min(calm[i - 1] if i > start else np.inf, calm[i] if i < stop else np.inf)
    for j in range(len(jerk)):
        if jerk[j] == np.inf:
            continue
        slope, third = 0.0, 0.0
        if i > start:
            h = step[i - 1]
            slope = (q[i, j] - q[i - 1, j]) / h + h * (bend[i - 1, j] + 2.0 * bend[i, j]) / 6.0
            third = abs(bend[i, j] - bend[i - 1, j]) / h
        if i < stop:
            h = step[i]
            slope = (q[i + 1, j] - q[i, j]) / h - h * (2.0 * bend[i, j] + bend[i + 1, j]) / 6.0
            third = max(third, abs(bend[i + 1, j] - bend[i, j]) / h)
        if slope != 0.0:
            rest = jerk[j] - third * v**3 - sign * np.sign(slope) * 3.0 * bend[i, j] * v * a
            most = min(most, max(rest, _LEAST * jerk[j]) / abs(slope))
    return most


@njit(nogil=True, cache=True, error_model="numpy")
def _from_rest(h, jerk):
    """ṡ² behind a way h that a motion with this s⃛ begins with."""
    return 0.25 * (6.0 * h) ** (4.0 / 3.0) * jerk ** (2.0 / 3.0)


@njit(nogil=True, cache=True, error_model="numpy")
def reached(start, stop, step, q, bend, limits, low, cap, touched, reachable, moved):
    """Backward: the greatest x from which the path can be gone on with. ``moved`` (rows,) becomes where it changed."""
    room = np.empty(8 + 6 * len(limits[1]))
    moved[stop], reachable[stop] = False, 0.0
    for i in range(stop - 1, start - 1, -1):
        moved[i] = False
        if touched[i] or moved[i + 1]:
            top = min(low[i - 1], low[i]) if i > start else 0.0
            found = braked(i, step[i], top, reachable[i + 1], q, bend, limits[1], cap, room)
            moved[i] = found != reachable[i]
            reachable[i] = found


@njit(nogil=True, cache=True, error_model="numpy")
def rising(start, stop, step, q, bend, limits, cap, calm, touched, reachable, moved, x, u):
    """Forward: the quickest law below ``reachable`` in which u rises no faster than it may.

    moved : (rows,) where ``reachable`` changed; becomes where x did
    """
    room = np.empty(8 + 6 * len(limits[1]))
    x[start], before, anew = 0.0, 0.0, moved[start]
    for i in range(start, stop):
        if touched[i] or anew or moved[i + 1]:
            h, v = step[i], np.sqrt(x[i])
            softly = _room(i, start, stop, step, q, bend, limits[2], v, before, 1.0, calm)
            if i == start:
                most = 0.5 * _from_rest(h, softly) / h
            else:
                part = 0.5 if u[i - 1] > 0.0 else 0.25  # a lowest place has two sides
                most = before + part * (step[i - 1] + h) * softly / v
            rise = driven(i, h, x[i], reachable[i + 1], most, q, bend, limits[1], cap, room)
            after = min(max(x[i] + 2.0 * h * rise, 0.0), reachable[i + 1])
            moved[i + 1], anew = after != x[i + 1], after != x[i + 1] or rise != u[i]
            x[i + 1], u[i] = after, rise
        else:
            moved[i + 1] = anew = False
        before = max(u[i], 0.0)
    moved[start] = False


@njit(nogil=True, cache=True, error_model="numpy")
def falling(start, stop, step, q, bend, limits, cap, calm, touched, ceiling, moved, x, u):
    """Backward: the law below ``ceiling`` (rows,) in which braking does not set in too late to end softly.

    moved : (rows,) where ``ceiling`` changed
    """
    room = np.empty(8 + 6 * len(limits[1]))
    x[stop], after, anew = 0.0, 0.0, False
    for i in range(stop - 1, start - 1, -1):
        if touched[i] or touched[i + 1] or anew or moved[i]:
            h, v = step[i], np.sqrt(x[i + 1])
            softly = _room(i + 1, start, stop, step, q, bend, limits[2], v, -after, 1.0, calm)
            if i == stop - 1:
                most = _from_rest(h, softly)
            else:
                part = 0.5 if u[i + 1] < 0.0 else 0.25
                most = x[i + 1] + 2.0 * h * (after + part * (h + step[i + 1]) * softly / v)
            found = braked(i, h, min(ceiling[i], most), x[i + 1], q, bend, limits[1], cap, room)
            rise = 0.5 * (x[i + 1] - found) / h
            anew = found != x[i] or rise != u[i]
            x[i], u[i] = found, rise
        else:
            anew = False
        after = max(-u[i], 0.0)


@njit(nogil=True, cache=True, error_model="numpy")
def pooled(start, stop, step, q, bend, limits, calm, x, u, bent, sums, widths, heads):
    """x is lowered on top where u falls faster than it may: neighbours that fall too fast share their mean."""
    blocks, bent[start] = 0, 0.0
    for i in range(start, stop):
        if i > start:
            bent[i] = bent[i - 1]
            v, a = np.sqrt(x[i]), 0.5 * (u[i - 1] + u[i])
            softly = _room(i, start, stop, step, q, bend, limits[2], v, a, -1.0, calm)
            bent[i] += 0.5 * (step[i - 1] + step[i]) * softly / v
        total, width, begin = step[i] * (u[i] + bent[i]), step[i], i
        while blocks > 0 and sums[blocks - 1] * width > total * widths[blocks - 1]:
            blocks -= 1
            total, width, begin = total + sums[blocks], width + widths[blocks], heads[blocks]
        sums[blocks], widths[blocks], heads[blocks] = total, width, begin
        blocks += 1
    for k in range(blocks):
        end = heads[k + 1] if k + 1 < blocks else stop
        if end - heads[k] > 1:
            for i in range(heads[k], end):
                u[i] = sums[k] / widths[k] - bent[i]
            for i in range(heads[k], end - 1):
                x[i + 1] = max(x[i] + 2.0 * step[i] * u[i], 0.0)
            u[end - 1] = 0.5 * (x[end] - x[end - 1]) / step[end - 1]
