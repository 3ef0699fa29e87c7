"""The interpreter of tapes over blocks of poses: compiled once, for every machine.

A block is LANES poses, transposed to rows (registers) so that every operation runs over lanes side by side. Inputs and
outputs are C-ordered (N, k) arrays of float64. Nothing here allocates but one block of registers a call.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .elementary import FAST, atan2, sincos
from .tape import ABS, ATAN2, CONST, COPYSIGN, DIV, FMA, LIN1, LIN2, LIN3, MAX, MIN, QUAD1, QUAD2, QUAD3, SINCOS, SQRT

LANES = 128
_MASK = (1 << 40) - 1  # tells the compiler that a register's number is not negative


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def interpret(code, imm, r):
    """Run a tape once over the registers ``r``, (registers · LANES,)."""
    for i in range(code.shape[0]):
        op = code[i, 0]
        d = (code[i, 1] & _MASK) * LANES
        a = (code[i, 2] & _MASK) * LANES
        b = (code[i, 3] & _MASK) * LANES
        c = (code[i, 4] & _MASK) * LANES
        k0, k1 = imm[i, 0], imm[i, 1]
        if op == QUAD1:
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j]
        elif op == QUAD2:
            e = (code[i, 5] & _MASK) * LANES
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + k1 * r[c + j] * r[e + j]
        elif op == QUAD3:
            e = (code[i, 5] & _MASK) * LANES
            f = (code[i, 6] & _MASK) * LANES
            g = (code[i, 7] & _MASK) * LANES
            k2 = imm[i, 2]
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + k1 * r[c + j] * r[e + j] + k2 * r[f + j] * r[g + j]
        elif op == FMA:
            k2 = imm[i, 2]
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + (k1 * r[c + j] + k2)
        elif op == LIN1:
            for j in range(LANES):
                r[d + j] = k0 + k1 * r[a + j]
        elif op == LIN2:
            k2 = imm[i, 2]
            for j in range(LANES):
                r[d + j] = k0 + k1 * r[a + j] + k2 * r[b + j]
        elif op == LIN3:
            k2 = imm[i, 2]
            k3 = imm[i, 3]
            for j in range(LANES):
                r[d + j] = k0 + k1 * r[a + j] + k2 * r[b + j] + k3 * r[c + j]
        elif op == SQRT:
            for j in range(LANES):
                r[d + j] = np.sqrt(r[a + j])
        elif op == DIV:
            for j in range(LANES):
                r[d + j] = r[a + j] / r[b + j]
        elif op == SINCOS:
            for j in range(LANES):
                r[d + j], r[a + j] = sincos(r[b + j])
        elif op == ATAN2:
            for j in range(LANES):
                r[d + j] = atan2(r[a + j], r[b + j])
        elif op == MIN:
            for j in range(LANES):
                x, y = r[a + j], r[b + j]
                r[d + j] = x if (x < y) | (x != x) else y
        elif op == MAX:
            for j in range(LANES):
                x, y = r[a + j], r[b + j]
                r[d + j] = x if (x > y) | (x != x) else y
        elif op == ABS:
            for j in range(LANES):
                r[d + j] = abs(r[a + j])
        elif op == COPYSIGN:
            for j in range(LANES):
                x, y = r[a + j], r[b + j]
                r[d + j] = (-abs(x) if y < 0.0 else abs(x)) + 0.0 * y
        elif op == CONST:
            for j in range(LANES):
                r[d + j] = k0


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def load(x, row, n, inputs, first, r, bad):
    """Columns of ``x`` from ``row`` on into their registers, padded with zeros; inputs are numbered from ``first``.

    ``bad`` (LANES,) turns NaN where a number is not finite, in columns that the tape does not read too.
    """
    width = x.shape[1]
    flat = x.reshape(-1)
    base = (row * width) & _MASK
    for column in range(width):
        d = -1
        for i in range(inputs.shape[0]):
            if inputs[i, 0] == first + column:
                d = inputs[i, 1] * LANES
        if d >= 0:
            for j in range(n):
                v = flat[base + column + j * width]
                r[d + j] = v
                bad[j] += 0.0 * v
            for j in range(n, LANES):
                r[d + j] = 0.0
        else:
            for j in range(n):
                bad[j] += 0.0 * flat[base + column + j * width]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def store(y, row, n, outputs, r, bad):
    """Registers ``outputs`` to the columns of ``y``; the whole row is NaN where an output is not finite."""
    width = y.shape[1]
    flat = y.reshape(-1)
    base = (row * width) & _MASK
    for o in range(outputs.shape[0]):
        d = (outputs[o] & _MASK) * LANES
        for j in range(LANES):
            bad[j] += 0.0 * r[d + j]
    for j in range(n):
        for o in range(width):
            flat[base + j * width + o] = r[(outputs[o] & _MASK) * LANES + j] + bad[j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate(code, imm, inputs, outputs, registers, x, z, y, start, stop):
    """y[i] = tape(x[i], z[i]) for rows start ≤ i < stop; the row is NaN where an input or output is not finite."""
    r = np.empty(registers * LANES)
    bad = np.empty(LANES)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        load(x, row, n, inputs, 0, r, bad)
        load(z, row, n, inputs, x.shape[1], r, bad)
        interpret(code, imm, r)
        store(y, row, n, outputs, r, bad)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_loose(code, imm, inputs, outputs, registers, x, z, y, start, stop):
    """As :func:`evaluate`, but what is not finite spoils only what follows from it."""
    r = np.empty(registers * LANES)
    bad = np.empty(LANES)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        load(x, row, n, inputs, 0, r, bad)
        load(z, row, n, inputs, x.shape[1], r, bad)
        interpret(code, imm, r)
        for o in range(outputs.shape[0]):
            d = (outputs[o] & _MASK) * LANES
            for j in range(n):
                y[row + j, o] = r[d + j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def first_broken(code, imm, inputs, outputs, registers, x, z, y, start, stop):
    """y[i] = 0 where all outputs are ≥ 0, else 1 + the first that is not; NaN is not."""
    r = np.empty(registers * LANES)
    bad = np.empty(LANES)
    found = np.empty(LANES, np.int64)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        load(x, row, n, inputs, 0, r, bad)
        load(z, row, n, inputs, x.shape[1], r, bad)
        interpret(code, imm, r)
        found[:] = 0
        for o in range(outputs.shape[0] - 1, -1, -1):
            d = (outputs[o] & _MASK) * LANES
            for j in range(LANES):
                found[j] = found[j] if r[d + j] >= 0.0 else o + 1
        for j in range(n):
            y[row + j] = found[j] if bad[j] == 0.0 or found[j] > 0 else 1
