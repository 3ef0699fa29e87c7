"""Kernels that test the limits at many places: 0 where a place is allowed, else 1 + the first limit broken.

``program`` is a :class:`~.staged.StagedProgram`: a tape in stages, with tests after each. A block ends as soon as no
lane is left.
"""

from __future__ import annotations

import numpy as np

from .blocks import interpret
from .compiling import njit
from .elementary import FAST, use_widest_vectors
from .lanes import LANES, MASK, allocate_lanes


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _test_block(program, r, broken):
    """Test a block: lanes of ``broken`` (LANES,) that are 0 become 1 + the first limit broken; NaN breaks one."""
    use_widest_vectors()
    stages, tests, lines = program.stages, program.tests, program.lines
    code, constants = program.tape.code, program.tape.constants
    for p in range(len(stages)):
        interpret(code[stages[p, 0] : stages[p, 1]], constants[stages[p, 0] : stages[p, 1]], r)
        for t in range(stages[p, 2], stages[p, 3]):
            a = (tests[t, 0] & MASK) * LANES
            first, second = tests[t, 1] + 1.0, tests[t, 2] + 1.0
            k0, k1, l0, l1 = lines[t, 0], lines[t, 1], lines[t, 2], lines[t, 3]
            for j in range(LANES):
                v = r[a + j]
                now = 0.0 if l0 + l1 * v >= 0.0 else second
                now = now if k0 + k1 * v >= 0.0 else first
                broken[j] = broken[j] if broken[j] > 0.0 else now
        left = 0
        for j in range(LANES):
            left += 1 if broken[j] == 0.0 else 0
        if left == 0:
            break


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _fill_places(axes, counts, row, n, r):
    """Fill the first registers with the places ``row`` to ``row + n`` of a grid, the last axis running fastest."""
    use_widest_vectors()
    d = len(counts)
    length = counts[d - 1]
    line, k = row // length, row % length
    j = 0
    while j < n:
        m = min(n - j, length - k)
        rest, end = line, len(axes)
        for a in range(d - 1, -1, -1):
            end -= counts[a]
            first = (a * LANES + j) & MASK
            if a == d - 1:
                start = (end + k) & MASK
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
def sweep_grid(program, axes, counts, out, start, stop):
    """Test the places ``start`` to ``stop`` of a grid, C-ordered, into ``out``.

    axes : coordinates of all axes, one axis after the other; counts : (d,) how many each has
    """
    r = allocate_lanes(program.tape.registers)
    broken = allocate_lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        _fill_places(axes, counts, row, n, r)
        broken[:n] = 0.0
        broken[n:] = 1.0
        _test_block(program, r, broken)
        for j in range(n):
            out[row + j] = np.int32(broken[j])


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def sweep_turns(program, places, fixed, every, out, start, stop):
    """Test places (N, d) with all rows of ``fixed``, (S, u): the rest of the tape's inputs, one row for each turn.

    With ``every``, places of ``out`` that are 0 get the first limit broken in the first turn that breaks one; else
    those that are not become 0 where a turn breaks none.
    """
    r = allocate_lanes(program.tape.registers)
    d = places.shape[1]
    x = allocate_lanes(d)
    verdict = allocate_lanes(1)
    broken = allocate_lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        for a in range(d):
            for j in range(n):
                x[a * LANES + j] = places[row + j, a]
            x[a * LANES + n : (a + 1) * LANES] = 0.0
        for j in range(n):
            verdict[j] = out[row + j]
        verdict[n:] = 1.0 if every else 0.0
        for s in range(len(fixed)):
            left = 0
            for j in range(LANES):
                broken[j] = verdict[j] if every else (0.0 if verdict[j] > 0.0 else 1.0)
                left += 1 if broken[j] == 0.0 else 0
            if left == 0:
                break
            for i in range(d * LANES):
                r[i] = x[i]
            for u in range(fixed.shape[1]):
                first = ((d + u) & MASK) * LANES
                for j in range(LANES):
                    r[first + j] = fixed[s, u]
            _test_block(program, r, broken)
            for j in range(LANES):
                verdict[j] = broken[j] if every else (0.0 if broken[j] == 0.0 else verdict[j])
        for j in range(n):
            out[row + j] = np.int32(verdict[j])
