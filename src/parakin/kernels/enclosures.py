"""The interpreter of tapes over intervals, a block of boxes at a time.

A register is a row of LANES lower bounds, then one of upper bounds. Every operation widens its result by eight
roundings of the sum of sizes that went into it, which covers its own and those of the tape's constants: no rounding
mode is set, and the loops vectorise. NaN becomes the whole line.
"""

from __future__ import annotations

import numpy as np

from .compiling import njit
from .elementary import GREATEST_ANGLE
from .numba_turns import atan2, sincos, use_widest_vectors
from .tape import (
    ABS,
    ATAN2,
    CONST,
    COPYSIGN,
    DIV,
    FMA,
    LIN1,
    LIN2,
    LIN3,
    MAX,
    MIN,
    QUAD1,
    QUAD2,
    QUAD3,
    SELECT,
    SINCOS,
    SQRT,
)

LANES = 128  # boxes of a block: its registers stay in the first-level cache
_WIDER = 2.0**-50  # eight units of roundoff
_TINY = 1e-300  # where numbers vanish: bounds hold to within it
_HUGE = 1e300  # where sums of sizes may overflow
_OFF = 2e-15  # sincos and atan2 are within 4e-16 of libm's, which is within 2e-16
MASK = (1 << 40) - 1  # of places that are not negative: loops over them vectorise
FAST = {"contract"}


@njit(nogil=True, cache=True)
def allocate_lanes(rows):
    """Allocate rows of LANES numbers that start on a cache line: vectors that cross lines take twice as long."""
    room = np.empty(rows * LANES + 8)
    skip = (-(room.ctypes.data // 8)) % 8
    return room[skip : skip + rows * LANES]


@njit(inline="always", fastmath=FAST)
def _round_down(x, size):
    """Round a lower bound down; a sum of zeros stays zero."""
    x = x - (size * _WIDER + (_TINY if size > 0.0 else 0.0))
    return x if x == x else -np.inf


@njit(inline="always", fastmath=FAST)
def _round_up(x, size):
    """Round an upper bound up; a sum of zeros stays zero."""
    x = x + (size * _WIDER + (_TINY if size > 0.0 else 0.0))
    return x if x == x else np.inf


@njit(inline="always", fastmath=FAST)
def _minimum(x, y):
    return x if x < y else y


@njit(inline="always", fastmath=FAST)
def _maximum(x, y):
    return x if x > y else y


@njit(inline="always", fastmath=FAST)
def _multiply_intervals(al, ah, bl, bh):
    """Bound the product of two intervals, not yet widened; 0·∞ is 0, for an infinite end is never reached."""
    p, q, s, t = al * bl, al * bh, ah * bl, ah * bh
    p = p if p == p else 0.0
    q = q if q == q else 0.0
    s = s if s == s else 0.0
    t = t if t == t else 0.0
    return _minimum(_minimum(p, q), _minimum(s, t)), _maximum(_maximum(p, q), _maximum(s, t))


@njit(inline="always", fastmath=FAST)
def _magnitude(low, high):
    return _maximum(abs(low), abs(high))


@njit(inline="always", fastmath=FAST)
def _bound_sine(at_low, at_high, low, high, phase):
    """Bound sin(x + phase) over [low, high] from its values at the ends."""
    down, up = _minimum(at_low, at_high) - _OFF, _maximum(at_low, at_high) + _OFF
    slack = 1e-15 * (1.0 + _magnitude(low, high))
    a = (low + phase - slack) * 0.15915494309189535
    b = (high + phase + slack) * 0.15915494309189535
    down = -1.0 if (np.floor(b + 0.25) >= np.ceil(a + 0.25)) | (down < -1.0) else down
    up = 1.0 if (np.floor(b - 0.25) >= np.ceil(a - 0.25)) | (up > 1.0) else up
    known = (abs(low) < GREATEST_ANGLE) & (abs(high) < GREATEST_ANGLE)
    return down if known else -1.0, up if known else 1.0


@njit(inline="always", fastmath=FAST)
def _bound_product(k, al, ah, bl, bh, same):
    """Bound k·a·b, not yet widened; ``same`` is true if a is b."""
    low, high = _multiply_intervals(al, ah, bl, bh)
    low = 0.0 if same & (low < 0.0) else low
    low, high = k * low, k * high
    return _minimum(low, high), _maximum(low, high)


@njit(inline="always", fastmath=FAST)
def _scale_interval(k, low, high):
    low, high = k * low, k * high
    return _minimum(low, high), _maximum(low, high)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def interpret(code, constants, r):
    """Run a tape once over the registers ``r``, (registers · 2 · LANES,)."""
    use_widest_vectors()
    for i in range(code.shape[0]):
        op = code[i, 0]
        d = (code[i, 1] & MASK) * (2 * LANES)
        a = (code[i, 2] & MASK) * (2 * LANES)
        b = (code[i, 3] & MASK) * (2 * LANES)
        c = (code[i, 4] & MASK) * (2 * LANES)
        e = (code[i, 5] & MASK) * (2 * LANES)
        f = (code[i, 6] & MASK) * (2 * LANES)
        g = (code[i, 7] & MASK) * (2 * LANES)
        k0, k1, k2, k3 = constants[i, 0], constants[i, 1], constants[i, 2], constants[i, 3]
        ab, ce, fg = a == b, c == e, f == g
        if op == QUAD1:
            for j in range(LANES):
                low, high = _bound_product(k0, r[a + j], r[a + LANES + j], r[b + j], r[b + LANES + j], ab)
                size = _magnitude(low, high) + abs(k3)
                r[d + j] = _round_down(low + k3, size)
                r[d + LANES + j] = _round_up(high + k3, size)
        elif op == QUAD2:
            for j in range(LANES):
                low, high = _bound_product(k0, r[a + j], r[a + LANES + j], r[b + j], r[b + LANES + j], ab)
                l2, h2 = _bound_product(k1, r[c + j], r[c + LANES + j], r[e + j], r[e + LANES + j], ce)
                size = _magnitude(low, high) + _magnitude(l2, h2) + abs(k3)
                r[d + j] = _round_down(low + l2 + k3, size)
                r[d + LANES + j] = _round_up(high + h2 + k3, size)
        elif op == QUAD3:
            for j in range(LANES):
                low, high = _bound_product(k0, r[a + j], r[a + LANES + j], r[b + j], r[b + LANES + j], ab)
                l2, h2 = _bound_product(k1, r[c + j], r[c + LANES + j], r[e + j], r[e + LANES + j], ce)
                l3, h3 = _bound_product(k2, r[f + j], r[f + LANES + j], r[g + j], r[g + LANES + j], fg)
                size = _magnitude(low, high) + _magnitude(l2, h2) + _magnitude(l3, h3) + abs(k3)
                r[d + j] = _round_down(low + l2 + l3 + k3, size)
                r[d + LANES + j] = _round_up(high + h2 + h3 + k3, size)
        elif op == FMA:
            for j in range(LANES):
                low, high = _bound_product(k0, r[a + j], r[a + LANES + j], r[b + j], r[b + LANES + j], ab)
                l2, h2 = _scale_interval(k1, r[c + j], r[c + LANES + j])
                size = _magnitude(low, high) + _magnitude(l2, h2) + abs(k2)
                r[d + j] = _round_down(low + l2 + k2, size)
                r[d + LANES + j] = _round_up(high + h2 + k2, size)
        elif op == LIN1:
            for j in range(LANES):
                low, high = _scale_interval(k1, r[a + j], r[a + LANES + j])
                size = abs(k0) + _magnitude(low, high)
                r[d + j] = _round_down(k0 + low, size)
                r[d + LANES + j] = _round_up(k0 + high, size)
        elif op == LIN2:
            for j in range(LANES):
                low, high = _scale_interval(k1, r[a + j], r[a + LANES + j])
                l2, h2 = _scale_interval(k2, r[b + j], r[b + LANES + j])
                size = abs(k0) + _magnitude(low, high) + _magnitude(l2, h2)
                r[d + j] = _round_down(k0 + low + l2, size)
                r[d + LANES + j] = _round_up(k0 + high + h2, size)
        elif op == LIN3:
            for j in range(LANES):
                low, high = _scale_interval(k1, r[a + j], r[a + LANES + j])
                l2, h2 = _scale_interval(k2, r[b + j], r[b + LANES + j])
                l3, h3 = _scale_interval(k3, r[c + j], r[c + LANES + j])
                size = abs(k0) + _magnitude(low, high) + _magnitude(l2, h2) + _magnitude(l3, h3)
                r[d + j] = _round_down(k0 + low + l2 + l3, size)
                r[d + LANES + j] = _round_up(k0 + high + h2 + h3, size)
        elif op == CONST:  # what is exactly zero stays zero: no rounding made it
            for j in range(LANES):
                r[d + j] = _round_down(k0, abs(k0)) if k0 != 0.0 else 0.0
                r[d + LANES + j] = _round_up(k0, abs(k0)) if k0 != 0.0 else 0.0
        elif op == DIV:
            for j in range(LANES):
                low, high = r[b + j], r[b + LANES + j]
                through = (low <= 0.0) & (high >= 0.0)
                il, ih = 1.0 / (1.0 if through else high), 1.0 / (1.0 if through else low)
                low, high = _multiply_intervals(r[a + j], r[a + LANES + j], il, ih)
                low, high = _round_down(low, 4.0 * abs(low)), _round_up(high, 4.0 * abs(high))
                r[d + j] = -np.inf if through else low
                r[d + LANES + j] = np.inf if through else high
        elif op == SQRT:
            for j in range(LANES):
                low, high = np.sqrt(_maximum(r[a + j], 0.0)), np.sqrt(_maximum(r[a + LANES + j], 0.0))
                r[d + j] = _maximum(_round_down(low, low), 0.0)
                r[d + LANES + j] = _round_up(high, high)
        elif op == SINCOS:  # into d and a, of b
            for j in range(LANES):
                low, high = r[b + j], r[b + LANES + j]
                (sl, cl), (sh, ch) = sincos(low), sincos(high)
                r[d + j], r[d + LANES + j] = _bound_sine(sl, sh, low, high, 0.0)
                r[a + j], r[a + LANES + j] = _bound_sine(cl, ch, low, high, 1.5707963267948966)
        elif op == ATAN2:
            for j in range(LANES):
                yl, yh, xl, xh = r[a + j], r[a + LANES + j], r[b + j], r[b + LANES + j]
                p, q, s, t = atan2(yl, xl), atan2(yl, xh), atan2(yh, xl), atan2(yh, xh)
                cut = (yl < 0.0) & (yh >= 0.0) & (xl <= 0.0)  # the angle jumps there, and at the origin it is any
                low = _minimum(_minimum(p, q), _minimum(s, t)) - _OFF
                high = _maximum(_maximum(p, q), _maximum(s, t)) + _OFF
                known = _magnitude(yl, yh) + _magnitude(xl, xh) < _HUGE  # what is greater, or infinite, gives any angle
                r[d + j] = low if known & (not cut) else -3.1415926535897936
                r[d + LANES + j] = high if known & (not cut) else 3.1415926535897936
        elif op == MIN:
            for j in range(LANES):
                r[d + j] = _minimum(r[a + j], r[b + j])
                r[d + LANES + j] = _minimum(r[a + LANES + j], r[b + LANES + j])
        elif op == MAX:
            for j in range(LANES):
                r[d + j] = _maximum(r[a + j], r[b + j])
                r[d + LANES + j] = _maximum(r[a + LANES + j], r[b + LANES + j])
        elif op == ABS:
            for j in range(LANES):
                low, high = r[a + j], r[a + LANES + j]
                least = _minimum(abs(low), abs(high))
                r[d + j] = 0.0 if (low <= 0.0) & (high >= 0.0) else least
                r[d + LANES + j] = _magnitude(low, high)
        elif op == COPYSIGN:
            for j in range(LANES):
                low, high = r[a + j], r[a + LANES + j]
                least = _minimum(abs(low), abs(high))
                least = 0.0 if (low <= 0.0) & (high >= 0.0) else least
                most = _magnitude(low, high)
                up, below = r[b + j] >= 0.0, r[b + LANES + j] < 0.0
                r[d + j] = least if up else -most
                r[d + LANES + j] = -least if below else most
        elif op == SELECT:
            for j in range(LANES):
                below = r[a + LANES + j] < r[b + j]
                above = r[a + j] >= r[b + LANES + j]
                cl, ch, el, eh = r[c + j], r[c + LANES + j], r[e + j], r[e + LANES + j]
                low, high = _minimum(cl, el), _maximum(ch, eh)
                r[d + j] = cl if below else (el if above else low)
                r[d + LANES + j] = ch if below else (eh if above else high)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def enclose_outputs(tape, low, high, down, up, start, stop):
    """Enclose a tape's outputs over the boxes [low, high] in (down, up), (N, outputs), for rows start ≤ i < stop."""
    r = allocate_lanes(2 * tape.registers)
    r[:] = 0.0
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        for c in range(tape.inputs):
            d = c * 2 * LANES
            for j in range(n):
                r[d + j] = low[row + j, c]
                r[d + LANES + j] = high[row + j, c]
        interpret(tape.code, tape.constants, r)
        for o in range(tape.outputs):
            d = (tape.inputs + o) * 2 * LANES
            for j in range(n):
                down[row + j, o] = r[d + j]
                up[row + j, o] = r[d + LANES + j]
