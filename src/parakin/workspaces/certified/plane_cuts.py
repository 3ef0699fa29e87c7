"""What a margin cuts off a box, proved: straight bounds of the margin, and the share of the box above them.

Over a box of half widths h about c a margin g is bounded by g(c) + m·(x - c) and what its derivatives' bounds leave
open, of the order of h². A straight cut's share of a box has a closed form, so what is inside and what is outside is
known far closer than by whole boxes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_FLAT = 1e-4  # a slope less than this share of the steepest counts as open: the closed form cancels below
_ROUNDING = 1e-7  # what the closed form may be off, with slopes no flatter than that

KEPT, CLEARED, EXCLUDED = 0, 1, 2


@njit(nogil=True, cache=True)
def _above(b, w, n):
    """Share of the v in [-1, 1]^n with b + w·v ≥ 0, for n ≤ 3 positive w."""
    total = 0.0
    for k in range(n):
        total += w[k]
    if b >= total:
        return 1.0
    if b <= -total:
        return 0.0
    t = 0.5 * (total - abs(b))  # the smaller of both parts, cut off a corner
    if n == 1:
        part = t / w[0]
    elif n == 2:
        p, q = max(t - w[0], 0.0), max(t - w[1], 0.0)
        part = (t * t - p * p - q * q) / (2.0 * w[0] * w[1])  # t ≤ (w0 + w1)/2: the far corner is not reached
    else:
        part = t * t * t
        for k in range(3):
            p = max(t - w[k], 0.0)
            q = max(t - w[k] - w[(k + 1) % 3], 0.0)
            part += q * q * q - p * p * p
        part /= 6.0 * w[0] * w[1] * w[2]
    return 1.0 - part if b > 0.0 else part


@njit(nogil=True, cache=True)
def share(b, slopes, room):
    """(least, greatest) share of the box above b + slopes·v, v in [-1, 1]^d, whatever the rounding.

    ``room`` (3,) is overwritten.
    """
    steepest, total = 0.0, 0.0
    for slope in slopes:
        steepest = max(steepest, abs(slope))
        total += abs(slope)
    if b >= total:
        return 1.0, 1.0
    if b < -total:
        return 0.0, 0.0
    if b != b:
        return 0.0, 1.0
    n, flat = 0, 0.0
    for slope in slopes:
        if abs(slope) > _FLAT * steepest:
            room[n] = abs(slope) / steepest
            n += 1
        else:
            flat += abs(slope) / steepest
    # A part that rounds to all or to nothing is neither: what is cut off at a corner can be smaller than a rounding.
    least = max(0.0, _above(b / steepest - flat, room, n) - _ROUNDING)
    most = min(1.0, _above(b / steepest + flat, room, n) + _ROUNDING)
    return least, most


@njit(nogil=True, cache=True)
def lines(
    smooth, over_down, over_up, at_down, at_up, half, d, every, state, turn, low, high, slopes, spread, start, stop
):
    """Straight bounds of one margin over boxes (x, θ), and what they decide.

    over_down, over_up, at_down, at_up : (N, .) bounds that the programs of a constraint give over the box and in its
        middle; see :class:`parakin.workspaces.certified.constraints.Constraint`
    half : (N, d + s) half widths
    every : the margin must hold for all θ (else for one)
    state : (N,) KEPT, CLEARED where it holds over the whole box, EXCLUDED where it is broken for all x
    turn : (N, s) int8, -1 or 1 where the least margin (``every``) stands at the lower or upper end of θ; else 0
    low, high, slopes : (N,), (N,), (N, d): slopes·v + low ≤ margin, for all θ with ``every``, else in the middle one;
        margin ≤ slopes·v + high, in the middle θ with ``every``, else for all; v in [-1, 1]^d
    spread : (N, s) what each θ leaves open
    """
    s = half.shape[1] - d
    for i in range(start, stop):
        less, more, steep, turns = 0.0, 0.0, 0.0, 0.0
        column = 2 + s
        for k in range(d):
            if smooth:
                a, b = at_down[i, 1 + k], at_up[i, 1 + k]
                for n in range(k, d):
                    p, q = over_down[i, column], over_up[i, column]
                    column += 1
                    if n == k:
                        scale = 0.5 * half[i, k] * half[i, k]
                        less += max(-p, 0.0) * scale
                        more += max(q, 0.0) * scale
                    else:
                        scale = max(abs(p), abs(q)) * half[i, k] * half[i, n]
                        less += scale
                        more += scale
            else:
                a, b = over_down[i, column], over_up[i, column]
                column += 1
            slopes[i, k] = 0.5 * (a + b) * half[i, k]
            steep += abs(slopes[i, k])
            left = (0.5 * (b - a) + 1e-15 * max(abs(a), abs(b))) * half[i, k]
            less += left
            more += left
        for k in range(s):
            a, b = over_down[i, 2 + k], over_up[i, 2 + k]
            spread[i, k] = max(abs(a), abs(b)) * half[i, d + k] if half[i, d + k] > 0.0 else 0.0
            turns += spread[i, k]
            turn[i, k] = 0
            if (half[i, d + k] > 0.0) & (over_down[i, 1] > 0.0):
                turn[i, k] = -1 if a >= 0.0 else (1 if b <= 0.0 else 0)
        less, more = less * (1.0 + 1e-14), more * (1.0 + 1e-14)
        straight = np.isfinite(at_down[i, 0] + at_up[i, 0] + steep + less + more + turns) & (over_down[i, 1] > 0.0)
        bottom, top = over_down[i, 0], over_up[i, 0]
        top_there = top  # for every x, in the middle θ
        if straight:
            low[i], high[i] = at_down[i, 0] - less, at_up[i, 0] + more
            bottom = max(bottom, low[i] - steep - turns)
            top = min(top, high[i] + steep + turns)
            top_there = min(top, high[i] + steep)
            if every:
                low[i] -= turns
            else:
                high[i] += turns
        else:
            low[i], high[i] = bottom, top
            for k in range(d):
                slopes[i, k] = 0.0
            for k in range(s):
                spread[i, k] = np.inf if half[i, d + k] > 0.0 else 0.0
        if bottom >= 0.0:
            state[i] = CLEARED
        elif (top_there if every else top) < 0.0:
            state[i] = EXCLUDED
        else:
            state[i] = KEPT


@njit(nogil=True, cache=True)
def gather(cell, half, low, high, slopes, number, bad, outer, lost, near, limit, area, start, stop):
    """Add one limit's cuts to what is known of every cell.

    cell : (N,) of each item, sorted; items of one cell are parts of the θ that must all hold
    half : (cells, d) half widths
    bad : Σ of the shares that a limit may cut off; outer : the least share any leaves; lost, near : the same for the
    middle of the bounds; limit : the one that leaves least, and its ``area`` a unit of volume
    """
    d = slopes.shape[1]
    room, merged = np.empty(3), np.empty(d)
    while 0 < start < len(cell) and cell[start] == cell[start - 1]:  # a cell belongs to where its items begin
        start += 1
    i = start
    while i < stop:
        c = cell[i]
        end = i
        while end < len(cell) and cell[end] == c:
            end += 1
        worst = i
        for j in range(i, end):
            if low[j] < low[worst]:
                worst = j
        least, middle = low[worst], 0.5 * (low[worst] + high[worst])
        for j in range(i, end):
            shift = 0.0
            for k in range(d):
                shift += abs(slopes[j, k] - slopes[worst, k])
            least = min(least, low[j] - shift)
            outer[c] = min(outer[c], share(high[j], slopes[j], room)[1])
        merged[:] = slopes[worst]
        bad[c] += 1.0 - share(least, merged, room)[0]
        part = share(middle, merged, room)
        part_here = 0.5 * (part[0] + part[1])
        lost[c] += 1.0 - part_here
        if part_here < near[c]:
            near[c] = part_here
            limit[c] = number
            steep, gradient = 0.0, 0.0
            for k in range(d):
                steep += abs(merged[k])
                gradient += (merged[k] / half[c, k]) ** 2
            step = 1e-3 * steep
            area[c] = 0.0
            if step > 0.0:
                more, less = share(middle + step, merged, room)[0], share(middle - step, merged, room)[0]
                area[c] = (more - less) / (2.0 * step) * np.sqrt(gradient)
        i = end


@njit(nogil=True, cache=True)
def narrowest(box, high, slopes, outer, line, start, stop):
    """Of every box the upper bound that leaves it least: that share to ``outer``, slopes and height to ``line``.

    box : (N,) of each bound, none twice; line : (boxes, d + 1)
    """
    room = np.empty(3)
    for i in range(start, stop):
        most = share(high[i], slopes[i], room)[1]
        c = box[i]
        if most < outer[c]:
            outer[c] = most
            line[c, :-1] = slopes[i]
            line[c, -1] = high[i]


@njit(nogil=True, cache=True)
def united(cell, first, line, outer, result):
    """Of every cell no more than what some leaf's bound leaves, of leaves whose bounds lie much the same way.

    cell : (N,) of each leaf; first : (cells,) its leaf that leaves most; line, outer : of the leaves, as from
    :func:`narrowest`, a line of length 1; result : (cells,) shares. What is above one line is above the first cell's,
    moved by as much as the two differ within the box.
    """
    d = line.shape[1] - 1
    room = np.empty(3)
    height = np.full(len(first), -np.inf)
    total = np.zeros(len(first))
    for i in range(len(cell)):
        reference = line[first[cell[i]]]
        moved = line[i, d]
        for k in range(d):
            moved += abs(line[i, k] - reference[k])
        height[cell[i]] = max(height[cell[i]], moved)
        total[cell[i]] += outer[i]
    for c in range(len(first)):
        result[c] = 0.0
        if first[c] >= 0:
            result[c] = min(1.0, total[c], share(height[c], line[first[c], :d], room)[1])


@njit(nogil=True, cache=True)
def surpassed(cell, witness, sure, line, result):
    """Whether a leaf adds nothing to what its cell's witness is proved to hold.

    witness : (cells,) a leaf, or -1; sure : (N,) height of the line above which a leaf is proved to hold, in the
    direction of its ``line`` (N, d + 1), as in :func:`united`
    """
    d = line.shape[1] - 1
    for i in range(len(cell)):
        w = witness[cell[i]]
        result[i] = False
        if w >= 0 and w != i:
            moved = line[i, d]
            for k in range(d):
                moved += abs(line[i, k] - line[w, k])
            result[i] = sure[w] >= moved
