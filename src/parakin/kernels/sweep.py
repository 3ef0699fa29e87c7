"""Many places through the limits' tape: a number a place, 0 where it is allowed, else 1 + the first limit broken.

A program is ``code``, ``imm`` and ``registers`` of a tape, cut into ``parts`` (P, 4): where in the code each begins and
ends, and which tests follow it. A test is a register r and two limits' indices (``tests``, (T, 3)) with their lines
k0 + k1·r that must be ≥ 0 (``lines``, (T, 4)); one limit alone stands twice. A block ends as soon as no lane is left.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .blocks import LANES, interpret, lanes
from .elementary import FAST, widest_vectors

_MASK = (1 << 40) - 1  # tells the compiler that a register's number is not negative


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _tested(code, imm, parts, tests, lines, r, found):
    """Lanes of ``found`` (LANES,) that are 0 become 1 + the first limit broken; NaN breaks one."""
    widest_vectors()
    for p in range(len(parts)):
        interpret(code[parts[p, 0] : parts[p, 1]], imm[parts[p, 0] : parts[p, 1]], r)
        for t in range(parts[p, 2], parts[p, 3]):
            a = (tests[t, 0] & _MASK) * LANES
            first, second = tests[t, 1] + 1.0, tests[t, 2] + 1.0
            k0, k1, l0, l1 = lines[t, 0], lines[t, 1], lines[t, 2], lines[t, 3]
            for j in range(LANES):
                v = r[a + j]
                now = 0.0 if l0 + l1 * v >= 0.0 else second
                now = now if k0 + k1 * v >= 0.0 else first
                found[j] = found[j] if found[j] > 0.0 else now
        left = 0
        for j in range(LANES):
            left += 1 if found[j] == 0.0 else 0
        if left == 0:
            break


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _filled(axes, counts, row, n, r):
    """The places ``row`` to ``row + n`` of a grid into the first registers, the last axis running fastest."""
    widest_vectors()
    d = len(counts)
    length = counts[d - 1]
    line, k = row // length, row % length
    j = 0
    while j < n:
        m = min(n - j, length - k)
        rest, end = line, len(axes)
        for a in range(d - 1, -1, -1):
            end -= counts[a]
            first = (a * LANES + j) & _MASK
            if a == d - 1:
                start = (end + k) & _MASK
                for q in range(m):
                    r[first + q] = axes[start + q]
            else:
                value = axes[end + rest % counts[a]]
                rest //= counts[a]
                for q in range(m):
                    r[first + q] = value
        j += m
        line, k = line + 1, 0
    for a in range(d):
        r[a * LANES + n : (a + 1) * LANES] = 0.0


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def on_grid(code, imm, registers, parts, tests, lines, axes, counts, out, start, stop):
    """The places ``start`` to ``stop`` of a grid, C-ordered, into ``out``.

    axes : coordinates of all axes, one axis after the other; counts : (d,) how many each has
    """
    r = lanes(registers)
    found = lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        _filled(axes, counts, row, n, r)
        found[:n] = 0.0
        found[n:] = 1.0
        _tested(code, imm, parts, tests, lines, r, found)
        for j in range(n):
            out[row + j] = np.int32(found[j])


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def in_turns(code, imm, registers, parts, tests, lines, places, fixed, every, out, start, stop):
    """Places (N, d) in all rows of ``fixed``, (S, u): what the tape is given besides, once for each turn.

    With ``every``, places of ``out`` that are 0 get the first limit broken in the first turn that breaks one; else
    those that are not become 0 where a turn breaks none.
    """
    r = lanes(registers)
    d = places.shape[1]
    x = lanes(d)
    now = lanes(1)
    found = lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        for a in range(d):
            for j in range(n):
                x[a * LANES + j] = places[row + j, a]
            x[a * LANES + n : (a + 1) * LANES] = 0.0
        for j in range(n):
            now[j] = out[row + j]
        now[n:] = 1.0 if every else 0.0
        for s in range(len(fixed)):
            left = 0
            for j in range(LANES):
                found[j] = now[j] if every else (0.0 if now[j] > 0.0 else 1.0)
                left += 1 if found[j] == 0.0 else 0
            if left == 0:
                break
            for i in range(d * LANES):
                r[i] = x[i]
            for u in range(fixed.shape[1]):
                first = ((d + u) & _MASK) * LANES
                for j in range(LANES):
                    r[first + j] = fixed[s, u]
            _tested(code, imm, parts, tests, lines, r, found)
            for j in range(LANES):
                now[j] = found[j] if every else (0.0 if found[j] == 0.0 else now[j])
        for j in range(n):
            out[row + j] = np.int32(now[j])
