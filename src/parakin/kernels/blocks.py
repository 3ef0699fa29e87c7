"""The interpreter of tapes over blocks of poses: compiled once, for every machine.

A block is LANES poses, transposed to rows (registers) so that every operation runs over lanes side by side. Inputs and
outputs are C-ordered (N, k) arrays of float64. Nothing here allocates but one block of registers a call.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .compiling import njit
from .elementary import FAST, atan2, sincos, sqrt, use_widest_vectors
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
def allocate_lanes(rows):
    """Allocate rows of LANES numbers that start on a cache line: vectors that cross lines take twice as long."""
    room = np.empty(rows * LANES + 8)
    skip = (-(room.ctypes.data // 8)) % 8
    return room[skip : skip + rows * LANES]


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def interpret(code, constants, r):
    """Run a tape once over the registers ``r``, (registers · LANES,)."""
    use_widest_vectors()
    for i in range(code.shape[0]):
        op = code[i, 0]
        d = (code[i, 1] & _MASK) * LANES
        a = (code[i, 2] & _MASK) * LANES
        b = (code[i, 3] & _MASK) * LANES
        c = (code[i, 4] & _MASK) * LANES
        k0, k1, k3 = constants[i, 0], constants[i, 1], constants[i, 3]
        if op == QUAD1:
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + k3
        elif op == QUAD2:
            e = (code[i, 5] & _MASK) * LANES
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + (k1 * r[c + j] * r[e + j] + k3)
        elif op == QUAD3:
            e = (code[i, 5] & _MASK) * LANES
            f = (code[i, 6] & _MASK) * LANES
            g = (code[i, 7] & _MASK) * LANES
            k2 = constants[i, 2]
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + k1 * r[c + j] * r[e + j] + (k2 * r[f + j] * r[g + j] + k3)
        elif op == FMA:
            k2 = constants[i, 2]
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + (k1 * r[c + j] + k2)
        elif op == LIN1:
            for j in range(LANES):
                r[d + j] = k0 + k1 * r[a + j]
        elif op == LIN2:
            k2 = constants[i, 2]
            for j in range(LANES):
                r[d + j] = k0 + k1 * r[a + j] + k2 * r[b + j]
        elif op == LIN3:
            k2 = constants[i, 2]
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


def _make_prefetch(write):
    """Make a function that asks for a block's memory, to read or to write it, while another block is computed.

    The kernel's bursts of reading and writing are too short for the processor's own prefetching; a fifth of the time
    was waiting.
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


fetch_to_read, fetch_to_write = _make_prefetch(0), _make_prefetch(1)


def _make_transposers(width):
    """Make load and store of a whole block of rows of ``width`` numbers.

    With both sizes known when compiled, the compiler transposes with shuffles.
    """

    @njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
    def load_whole(flat, base, first, r, bad):
        for j in range(LANES):
            total = 0.0
            for c in range(width):
                v = flat[base + j * width + c]
                r[first + c * LANES + j] = v
                total += v
            bad[j] += 0.0 * total

    @njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
    def store_whole(flat, base, first, r, bad):
        for j in range(LANES):
            for c in range(width):
                flat[base + j * width + c] = r[first + c * LANES + j] + bad[j]

    return load_whole, store_whole


_load3, _store3 = _make_transposers(3)
_load5, _store5 = _make_transposers(5)
_load6, _store6 = _make_transposers(6)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def load_rows(x, row, n, register, r, bad):
    """Load n rows of ``x`` from ``row`` on into registers from ``register`` on, a column each, padded with zeros.

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
def store_rows(y, row, n, register, r, bad):
    """Store registers from ``register`` on, plus ``bad``, to n rows of ``y`` from ``row`` on."""
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


@njit(inline="always")
def _load_inputs(x, z, row, stop, r, bad):
    """Load rows of ``x`` and ``z`` as the inputs of a block, and ask for those of the next; returns how many."""
    n = min(LANES, stop - row)
    bad[:] = 0.0
    register = x.shape[1] + z.shape[1]  # backwards, for load_rows is compiled once more for a register that is told: 0
    for rows in (z, x):
        register -= rows.shape[1]
        load_rows(rows, row, n, register, r, bad)
        fetch_to_read(rows, row + LANES, stop)
    return n


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_rows(tape, whole, x, z, y, start, stop):
    """Evaluate y[i] = tape(x[i], z[i]) for rows start ≤ i < stop.

    With ``whole`` a row is NaN where an input or output is not finite; else that spoils only what follows from it.
    """
    r = allocate_lanes(tape.registers)
    bad = allocate_lanes(1)
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        fetch_to_write(y, row, stop)
        interpret(tape.code, tape.constants, r)
        if whole:
            for o in range(tape.inputs, tape.inputs + tape.outputs):
                d = (o & _MASK) * LANES
                for j in range(LANES):
                    bad[j] += 0.0 * r[d + j]
        else:
            bad[:] = 0.0
        store_rows(y, row, n, tape.inputs, r, bad)


@njit(inline="always")
def find_positive(r, first, stop, holds):
    """Find the lanes in which registers ``first`` to ``stop`` are all positive: 1 in ``holds`` (LANES,), else 0."""
    holds[:] = 1.0
    for o in range(first, stop):
        d = (o & _MASK) * LANES
        for j in range(LANES):
            holds[j] = holds[j] if r[d + j] > 0.0 else 0.0  # false for NaN


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_with_residual(tape, limits, x, z, results, start, stop):
    """Evaluate a tape: its first outputs are rows, the next closures, the others margins.

    limits : :class:`~.batch.ClosureLimits`
    results : :class:`~.batch.ClosedRows`, overwritten; NaN where an input, an output of the row or a closure is not
        finite
    """
    y, residual, settled, closed = results.rows, results.residual, results.settled, limits.closed
    r = allocate_lanes(tape.registers)
    bad = allocate_lanes(1)
    most = allocate_lanes(1)
    holds = allocate_lanes(1)
    closures = tape.inputs + y.shape[1]
    margins = closures + limits.closures
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        fetch_to_write(y, row, stop)
        interpret(tape.code, tape.constants, r)
        for o in range(tape.inputs, closures):
            d = (o & _MASK) * LANES
            for j in range(LANES):
                bad[j] += 0.0 * r[d + j]
        most[:] = 0.0
        for o in range(closures, margins):
            d = (o & _MASK) * LANES
            for j in range(LANES):
                v = r[d + j]
                bad[j] += 0.0 * v
                most[j] = abs(v) if abs(v) > most[j] else most[j]
        find_positive(r, margins, tape.inputs + tape.outputs, holds)
        store_rows(y, row, n, tape.inputs, r, bad)
        for j in range(n):
            worst = most[j] + bad[j]
            residual[row + j] = worst
            settled[row + j] = (holds[j] > 0.0) & (worst <= closed)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def find_negative(tape, x, z, y, start, stop):
    """Find y[i] = 0 where all outputs are ≥ 0, else 1 + the first that is not; NaN is not."""
    r = allocate_lanes(tape.registers)
    bad = allocate_lanes(1)
    first = np.empty(LANES, np.int64)
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        interpret(tape.code, tape.constants, r)
        first[:] = 0
        for o in range(tape.outputs - 1, -1, -1):
            d = ((tape.inputs + o) & _MASK) * LANES
            for j in range(LANES):
                first[j] = first[j] if r[d + j] >= 0.0 else o + 1
        for j in range(n):
            y[row + j] = first[j] if (bad[j] == 0.0) | (first[j] > 0) else 1
