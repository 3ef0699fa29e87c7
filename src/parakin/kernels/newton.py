"""Newton's method on the legs' closures, many poses side by side: the general direct problem.

Every lane takes the same steps, so a block ends when its slowest lane has converged. The matrix is factored only while
it still matters; the last steps keep it (a chord step costs a tenth). Row exchanges are chosen lane by lane, and passed
over where no lane wants one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .blocks import _MASK, LANES, fetch_to_read, fetch_to_write, interpret, lanes, load, store
from .elementary import FAST, widest_vectors

CLOSE = 1e-6  # mm: from a closure this good one more step ends below rounding
WORTH = 1e-4  # mm: where a step will end no worse than this, the matrix at hand serves on
SLOW = 0.05  # a kept matrix that gains less than this a step is made anew
FINE = 1e-12  # mm: where the next step is foreseen to end, it is the last
PIVOT = 4.0  # how many times greater an entry must be to become the pivot


@njit(nogil=True, cache=True)
def copy(a, i, b, j, rows):
    """Rows from the i-th of ``a`` to the j-th on of ``b``; a slice would take seconds to compile, for its messages."""
    s, t = (i & _MASK) * LANES, (j & _MASK) * LANES
    for c in range(rows * LANES):
        b[t + c] = a[s + c]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def factor(a, m, swaps, wanted, det):
    """Factor ``a`` (m·m·LANES,), row by row, in place: multipliers below, reciprocal pivots on the diagonal.

    ``swaps`` (m·m·LANES,) is 1 where a lane exchanged rows k and i at k·m + i, ``wanted`` (m·m,) where any did; ``det``
    (LANES,) is the determinant.
    """
    widest_vectors()
    det[:] = 1.0
    for k in range(m):
        p = ((k * m + k) & _MASK) * LANES
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            w = ((k * m + i) & _MASK) * LANES
            count = 0.0
            for j in range(LANES):
                swap = 1.0 if abs(a[q + j]) > PIVOT * abs(a[p + j]) else 0.0
                swaps[w + j] = swap
                count = max(count, swap)
            wanted[k * m + i] = count > 0.0
            if count > 0.0:
                for j in range(LANES):
                    det[j] = -det[j] if swaps[w + j] > 0.0 else det[j]
                for c in range(k, m):
                    s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                    for j in range(LANES):
                        x, y = a[s + j], a[t + j]
                        a[s + j] = y if swaps[w + j] > 0.0 else x
                        a[t + j] = x if swaps[w + j] > 0.0 else y
        for j in range(LANES):
            det[j] *= a[p + j]
            a[p + j] = 1.0 / a[p + j]
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            for j in range(LANES):
                a[q + j] *= a[p + j]
            for c in range(k + 1, m):
                s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                for j in range(LANES):
                    a[t + j] -= a[q + j] * a[s + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def substitute(a, m, swaps, wanted, f):
    """Solve with what :func:`factor` left: ``f`` (m·LANES,) becomes the solution."""
    widest_vectors()
    for k in range(m):
        fk = (k & _MASK) * LANES
        for i in range(k + 1, m):
            if wanted[k * m + i]:
                fi, w = (i & _MASK) * LANES, ((k * m + i) & _MASK) * LANES
                for j in range(LANES):
                    x, y = f[fk + j], f[fi + j]
                    f[fk + j] = y if swaps[w + j] > 0.0 else x
                    f[fi + j] = x if swaps[w + j] > 0.0 else y
        for i in range(k + 1, m):
            fi, q = (i & _MASK) * LANES, ((i * m + k) & _MASK) * LANES
            for j in range(LANES):
                f[fi + j] -= a[q + j] * f[fk + j]
    for k in range(m - 1, -1, -1):
        fk, p = (k & _MASK) * LANES, ((k * m + k) & _MASK) * LANES
        for c in range(k + 1, m):
            s, fc = ((k * m + c) & _MASK) * LANES, (c & _MASK) * LANES
            for j in range(LANES):
                f[fk + j] -= a[s + j] * f[fc + j]
        for j in range(LANES):
            f[fk + j] *= a[p + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def closures(code, imm, inputs, m, held, r, f, worst, n):
    """Run a tape that gives m closures first; ``f`` and the greatest of each lane, and of the block's first n lanes."""
    copy(held, 0, r, 0, inputs)
    interpret(code, imm, r)
    worst[:] = 0.0
    for i in range(m):
        s, t = ((inputs + i) & _MASK) * LANES, (i & _MASK) * LANES
        for j in range(LANES):
            v = r[s + j]
            f[t + j] = v
            worst[j] = abs(v) if (abs(v) > worst[j]) | (v != v) else worst[j]
    greatest = 0.0
    for j in range(n):
        greatest = worst[j] if worst[j] > greatest else greatest  # false for NaN: such a lane is done
    return greatest


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def descend(full, light, m, q, caps, size, most, room, n):
    """Newton on one block, in its working arrays ``room``; the number of steps.

    ``held`` (m + joints rows) has the start and ends with the root, ``worst`` is each lane's greatest closure left,
    ``turn0`` and ``turn`` are the determinants at the start and at the last factoring.
    """
    held, r, a, swaps, wanted, f, turn, turn0, worst, shrink = room
    inputs = m + q
    refactor, last = True, False
    before = np.inf
    for step in range(most + 1):
        if refactor:
            greatest = closures(full[0], full[1], inputs, m, held, r, f, worst, n)
            copy(r, inputs + m, a, 0, m * m)
            factor(a, m, swaps, wanted, turn)
            if step == 0:
                copy(turn, 0, turn0, 0, 1)
            refactor = greatest * greatest > WORTH * size
            enough = greatest < CLOSE
        else:
            greatest = closures(light[0], light[1], inputs, m, held, r, f, worst, n)
            ratio = greatest / before
            refactor = ratio > SLOW
            enough = (ratio <= SLOW) & (greatest * ratio < FINE)
        if last or step == most:
            return step
        last = enough
        before = greatest
        substitute(a, m, swaps, wanted, f)
        for j in range(LANES):  # a lane that is done stays: beside a slow one it would take steps of pure rounding
            shrink[j] = 0.0 if worst[j] < FINE else 1.0
        for i in range(m):
            s = (i & _MASK) * LANES
            for j in range(LANES):
                over = abs(f[s + j]) * shrink[j]
                shrink[j] = shrink[j] * (caps[i] / over) if over > caps[i] else shrink[j]
        for i in range(m):
            s = (i & _MASK) * LANES
            for j in range(LANES):
                held[s + j] -= shrink[j] * f[s + j] if shrink[j] > 0.0 else 0.0
    return most


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def newton(
    begin, full, light, end, registers, near, q, caps, size, most, side, out, residual, steps, turned, start, stop
):
    """Solve f(y, q) = 0 for rows start ≤ i < stop of ``q``.

    Tapes, as (code, imm): ``begin`` takes a row of ``near`` (N or 1, k) and q to the coordinates y (m), ``full`` takes
    y and q to f, mm, then ∂f/∂y, ``light`` to f only, ``end`` takes y and q to a row of ``out``. ``caps`` (m,) bounds a
    step's coordinates; ``size`` is the legs' length, mm. ``residual`` (N,) is the greatest |f| left, mm,
    NaN where the row of ``out`` is; ``turned``
    (N,) the determinant at the last factoring times ``side``: a row's own or a common one, or, where there is none, the
    determinant at the start. Below 0 the root is on the other side of a singularity.
    """
    m = caps.shape[0]
    given, joints = near.shape[1], q.shape[1]
    r, held = lanes(registers), lanes(m + joints)
    a, swaps, f = lanes(m * m), lanes(m * m), lanes(m)
    wanted = np.zeros(m * m, np.bool_)
    turn, turn0, worst, shrink, bad = lanes(1), lanes(1), lanes(1), lanes(1), lanes(1)
    common = near.shape[0] == 1
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        if common:
            for i in range(given):
                r[i * LANES : (i + 1) * LANES] = near[0, i]
        else:
            load(near, row, n, 0, r, bad)
        load(q, row, n, m, held, bad)
        copy(held, m, r, given, joints)
        fetch_to_read(q, row + LANES, stop)
        if not common:
            fetch_to_read(near, row + LANES, stop)
        fetch_to_write(out, row, stop)
        interpret(begin[0], begin[1], r)
        copy(r, given + joints, held, 0, m)
        room = (held, r, a, swaps, wanted, f, turn, turn0, worst, shrink)
        step = descend(full, light, m, joints, caps, size, most, room, n)
        for j in range(n):
            steps[row + j] = step
            if side.shape[0] == 0:
                turned[row + j] = turn[j] * turn0[j]
            else:
                turned[row + j] = turn[j] * side[0 if side.shape[0] == 1 else row + j]
        copy(held, 0, r, 0, m + joints)
        interpret(end[0], end[1], r)
        for i in range(out.shape[1]):
            s = ((m + joints + i) & _MASK) * LANES
            for j in range(LANES):
                bad[j] += 0.0 * r[s + j]
        store(out, row, n, m + joints, r, bad)
        for j in range(n):
            residual[row + j] = worst[j] + bad[j]
