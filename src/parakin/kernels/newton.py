"""Newton's method on the legs' closures, many poses side by side: the general direct problem.

Every lane takes the same steps, so a block ends when its slowest lane has converged; the linear systems are solved by
elimination with row exchanges chosen lane by lane.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .blocks import _MASK, LANES, interpret, load
from .elementary import FAST

CLOSE = 1e-6  # mm: from a closure this good one more quadratic step ends below rounding


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def eliminate(a, f, m, det):
    """Solve a·x = f lane by lane; ``a`` (m·m·LANES,) row by row, ``f`` (m·LANES,) becomes x, ``det`` the determinant."""
    det[:] = 1.0
    for k in range(m):
        p = ((k * m + k) & _MASK) * LANES
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            fk, fi = (k & _MASK) * LANES, (i & _MASK) * LANES
            for j in range(LANES):
                swap = abs(a[q + j]) > abs(a[p + j])
                x, y = f[fk + j], f[fi + j]
                f[fk + j] = y if swap else x
                f[fi + j] = x if swap else y
                det[j] = -det[j] if swap else det[j]
            for c in range(m - 1, k - 1, -1):  # the pivot's column last: the choice hangs on it
                s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                for j in range(LANES):
                    swap = abs(a[q + j]) > abs(a[p + j])
                    x, y = a[s + j], a[t + j]
                    a[s + j] = y if swap else x
                    a[t + j] = x if swap else y
        for j in range(LANES):
            det[j] *= a[p + j]
        for i in range(k + 1, m):
            q = ((i * m + k) & _MASK) * LANES
            for j in range(LANES):
                a[q + j] /= a[p + j]
            fk, fi = (k & _MASK) * LANES, (i & _MASK) * LANES
            for j in range(LANES):
                f[fi + j] -= a[q + j] * f[fk + j]
            for c in range(k + 1, m):
                s, t = ((k * m + c) & _MASK) * LANES, ((i * m + c) & _MASK) * LANES
                for j in range(LANES):
                    a[t + j] -= a[q + j] * a[s + j]
    for k in range(m - 1, -1, -1):
        fk = (k & _MASK) * LANES
        for c in range(k + 1, m):
            s, fc = ((k * m + c) & _MASK) * LANES, (c & _MASK) * LANES
            for j in range(LANES):
                f[fk + j] -= a[s + j] * f[fc + j]
        p = ((k * m + k) & _MASK) * LANES
        for j in range(LANES):
            f[fk + j] /= a[p + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def newton(code, imm, inputs, outputs, registers, y0, q, caps, most, y, residual, steps, sign, start, stop):
    """Solve f(y, q) = 0 for rows start ≤ i < stop of ``y`` (N, m) from ``y0`` (N, m) or (1, m).

    The tape gives f (m), in mm, then ∂f/∂y (m·m). ``caps`` (m,) bounds a step's coordinates. ``residual`` (N,) is the
    greatest |f| left, mm; ``sign`` (N,) that of the determinant at the solution.
    """
    m = y.shape[1]
    r = np.empty(registers * LANES)
    held = np.empty((m + q.shape[1]) * LANES)
    a = np.empty(m * m * LANES)
    f = np.empty(m * LANES)
    det, worst, shrink, bad = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    columns = np.empty((m + q.shape[1], 2), np.int64)
    for i in range(m + q.shape[1]):
        columns[i, 0], columns[i, 1] = i, i
    common = y0.shape[0] == 1
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        if common:
            for i in range(m):
                for j in range(LANES):
                    held[i * LANES + j] = y0[0, i]
        else:
            load(y0, row, n, columns, 0, held, bad)
        load(q, row, n, columns, m, held, bad)
        last = False
        for step in range(most + 1):
            for i in range(inputs.shape[0]):
                s, t = (inputs[i, 0] & _MASK) * LANES, (inputs[i, 1] & _MASK) * LANES
                for j in range(LANES):
                    r[t + j] = held[s + j]
            interpret(code, imm, r)
            worst[:] = 0.0
            for i in range(m):
                s, t = (outputs[i] & _MASK) * LANES, (i & _MASK) * LANES
                for j in range(LANES):
                    v = r[s + j]
                    f[t + j] = v
                    worst[j] = abs(v) if (abs(v) > worst[j]) | (v != v) else worst[j]
            for i in range(m * m):
                s, t = (outputs[m + i] & _MASK) * LANES, (i & _MASK) * LANES
                for j in range(LANES):
                    a[t + j] = r[s + j]
            greatest = 0.0
            for j in range(n):
                greatest = worst[j] if worst[j] > greatest else greatest  # false for NaN: such a lane is done
            eliminate(a, f, m, det)
            if last or step == most:
                break
            last = greatest < CLOSE
            shrink[:] = 1.0
            for i in range(m):
                s = (i & _MASK) * LANES
                for j in range(LANES):
                    over = abs(f[s + j]) * shrink[j]
                    shrink[j] = shrink[j] * (caps[i] / over) if over > caps[i] else shrink[j]
            for i in range(m):
                s = (i & _MASK) * LANES
                for j in range(LANES):
                    held[s + j] -= shrink[j] * f[s + j]
        for j in range(n):
            steps[row + j] = step
            residual[row + j] = worst[j] + bad[j]
            sign[row + j] = det[j]
        for j in range(n):
            for i in range(m):
                y[row + j, i] = held[i * LANES + j] + bad[j]
