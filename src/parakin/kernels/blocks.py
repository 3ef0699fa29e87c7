"""The interpreter of tapes over blocks of poses: compiled once, for every machine.

A block is LANES poses, transposed to rows (registers) so that every operation runs over lanes side by side. Inputs and
outputs are C-ordered (N, k) arrays of float64. Nothing here allocates but one block of registers a call.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from .elementary import FAST, atan2, sincos, sqrt, widest_vectors
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

LANES = 128
_MASK = (1 << 40) - 1  # tells the compiler that a register's number is not negative


@njit(nogil=True, cache=True)
def lanes(rows):
    """Rows of LANES numbers that start on a cache line: vectors that cross lines take twice as long."""
    room = np.empty(rows * LANES + 8)
    skip = (-(room.ctypes.data // 8)) % 8
    return room[skip : skip + rows * LANES]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def interpret(code, imm, r):
    """Run a tape once over the registers ``r``, (registers · LANES,)."""
    widest_vectors()
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
                r[d + j] = sqrt(r[a + j])
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
        elif op == SELECT:
            e = (code[i, 5] & _MASK) * LANES
            for j in range(LANES):
                r[d + j] = r[c + j] if r[a + j] < r[b + j] else r[e + j]
        elif op == CONST:
            for j in range(LANES):
                r[d + j] = k0


def _fetching(write):
    """A function that asks for a block's memory, to read or to write it, while another is computed.

    The kernel's bursts of reading and writing are too short for the processor to foresee; a fifth of the time was
    waiting.
    """

    @intrinsic
    def prefetch(typing, array, index):
        def generate(context, builder, signature, args):
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
            call = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
            line = builder.bitcast(builder.gep(data, [args[1]]), byte)
            builder.call(call, [line, word(write), word(3), word(1)])
            return context.get_dummy_value()

        return types.void(array, types.int64), generate

    @njit(nogil=True, cache=True)
    def fetch(x, row, stop):
        width = x.shape[1]
        flat = x.reshape(-1)
        for i in range(row * width, min(row + LANES, stop) * width, 8):
            prefetch(flat, i)

    return fetch


fetch_to_read, fetch_to_write = _fetching(0), _fetching(1)


def _transposing(width):
    """Load and store of a whole block of rows of ``width`` numbers: with both known when compiled, the compiler
    transposes with shuffles."""

    @njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
    def load_rows(flat, base, first, r, bad):
        for j in range(LANES):
            total = 0.0
            for c in range(width):
                v = flat[base + j * width + c]
                r[first + c * LANES + j] = v
                total += v
            bad[j] += 0.0 * total

    @njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
    def store_rows(flat, base, first, r, bad):
        for j in range(LANES):
            for c in range(width):
                flat[base + j * width + c] = r[first + c * LANES + j] + bad[j]

    return load_rows, store_rows


_load3, _store3 = _transposing(3)
_load5, _store5 = _transposing(5)
_load6, _store6 = _transposing(6)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def load(x, row, n, register, r, bad):
    """Rows of ``x`` from ``row`` on into registers from ``register`` on, a column each, padded with zeros.

    ``bad`` (LANES,) turns NaN where a number is not finite.
    """
    width = x.shape[1]
    flat = x.reshape(-1)
    base = (row * width) & _MASK
    first = (register & _MASK) * LANES
    if (n == LANES) & (width == 3):
        _load3(flat, base, first, r, bad)
    elif (n == LANES) & (width == 5):
        _load5(flat, base, first, r, bad)
    elif (n == LANES) & (width == 6):
        _load6(flat, base, first, r, bad)
    else:
        for c in range(width):
            for j in range(n):
                v = flat[base + j * width + c]
                r[first + c * LANES + j] = v
                bad[j] += 0.0 * v
            for j in range(n, LANES):
                r[first + c * LANES + j] = 0.0


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def store(y, row, n, register, r, bad):
    """Registers from ``register`` on, plus ``bad``, to the rows of ``y`` from ``row`` on."""
    width = y.shape[1]
    flat = y.reshape(-1)
    base = (row * width) & _MASK
    first = (register & _MASK) * LANES
    if (n == LANES) & (width == 3):
        _store3(flat, base, first, r, bad)
    elif (n == LANES) & (width == 5):
        _store5(flat, base, first, r, bad)
    elif (n == LANES) & (width == 6):
        _store6(flat, base, first, r, bad)
    else:
        for c in range(width):
            for j in range(n):
                flat[base + j * width + c] = r[first + c * LANES + j] + bad[j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate(code, imm, inputs, outputs, registers, whole, x, z, y, start, stop):
    """y[i] = tape(x[i], z[i]) for rows start ≤ i < stop.

    With ``whole`` a row is NaN where an input or output is not finite, else that spoils only what follows from it.
    """
    r = lanes(registers)
    bad = lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        load(x, row, n, 0, r, bad)
        load(z, row, n, x.shape[1], r, bad)
        fetch_to_read(x, row + LANES, stop)
        fetch_to_read(z, row + LANES, stop)
        fetch_to_write(y, row, stop)
        interpret(code, imm, r)
        if whole:
            for o in range(inputs, inputs + outputs):
                d = (o & _MASK) * LANES
                for j in range(LANES):
                    bad[j] += 0.0 * r[d + j]
        else:
            bad[:] = 0.0
        store(y, row, n, inputs, r, bad)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_checked(code, imm, inputs, outputs, registers, x, z, y, worst, start, stop):
    """The tape's first outputs to the rows of ``y``, the greatest size of the others to ``worst`` (N,); NaN for both
    where an input or output is not finite."""
    r = lanes(registers)
    bad = lanes(1)
    most = lanes(1)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        load(x, row, n, 0, r, bad)
        load(z, row, n, x.shape[1], r, bad)
        fetch_to_read(x, row + LANES, stop)
        fetch_to_read(z, row + LANES, stop)
        fetch_to_write(y, row, stop)
        interpret(code, imm, r)
        most[:] = 0.0
        for o in range(inputs, inputs + outputs):
            d = (o & _MASK) * LANES
            closure = o >= inputs + y.shape[1]
            for j in range(LANES):
                v = r[d + j]
                bad[j] += 0.0 * v
                most[j] = abs(v) if closure & (abs(v) > most[j]) else most[j]
        store(y, row, n, inputs, r, bad)
        for j in range(n):
            worst[row + j] = most[j] + bad[j]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def first_broken(code, imm, inputs, outputs, registers, x, z, y, start, stop):
    """y[i] = 0 where all outputs are ≥ 0, else 1 + the first that is not; NaN is not."""
    r = lanes(registers)
    bad = lanes(1)
    found = np.empty(LANES, np.int64)
    for row in range(start, stop, LANES):
        n = min(LANES, stop - row)
        bad[:] = 0.0
        load(x, row, n, 0, r, bad)
        load(z, row, n, x.shape[1], r, bad)
        fetch_to_read(x, row + LANES, stop)
        fetch_to_read(z, row + LANES, stop)
        interpret(code, imm, r)
        found[:] = 0
        for o in range(outputs - 1, -1, -1):
            d = ((inputs + o) & _MASK) * LANES
            for j in range(LANES):
                found[j] = found[j] if r[d + j] >= 0.0 else o + 1
        for j in range(n):
            y[row + j] = found[j] if (bad[j] == 0.0) | (found[j] > 0) else 1
