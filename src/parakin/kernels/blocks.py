"""The interpreter of tapes over blocks of poses: compiled once, for every machine.

A block is LANES poses, transposed to rows (registers) so that every operation runs over lanes side by side. Inputs and
outputs are C-ordered (N, k) arrays of float64. Nothing here allocates but one block of registers a call.
"""

from __future__ import annotations

from typing import NamedTuple

from ..arrays import Array
from .compiling import njit
from .elementary import FAST, atan2, sincos, sqrt, use_widest_vectors
from .lanes import LANES, MASK, allocate_lanes, fetch_to_read, fetch_to_write, load_rows, store_rows
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


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def interpret(code, constants, r):
    """Run a tape once over the registers ``r``, (registers · LANES,)."""
    use_widest_vectors()
    for i in range(code.shape[0]):
        op = code[i, 0]
        d = (code[i, 1] & MASK) * LANES
        a = (code[i, 2] & MASK) * LANES
        b = (code[i, 3] & MASK) * LANES
        c = (code[i, 4] & MASK) * LANES
        k0, k1, k3 = constants[i, 0], constants[i, 1], constants[i, 3]
        if op == QUAD1:
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + k3
        elif op == QUAD2:
            e = (code[i, 5] & MASK) * LANES
            for j in range(LANES):
                r[d + j] = k0 * r[a + j] * r[b + j] + (k1 * r[c + j] * r[e + j] + k3)
        elif op == QUAD3:
            e = (code[i, 5] & MASK) * LANES
            f = (code[i, 6] & MASK) * LANES
            g = (code[i, 7] & MASK) * LANES
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
            e = (code[i, 5] & MASK) * LANES
            for j in range(LANES):
                x, y = r[c + j], r[e + j]  # both are read: a read that hangs on a condition is not done side by side
                r[d + j] = x if r[a + j] < r[b + j] else y
        elif op == CONST:
            for j in range(LANES):
                r[d + j] = k0


class BlockLanes(NamedTuple):
    """The working arrays of one block.

    registers : of the tape
    bad : what turns NaN in the lanes where a number is not finite
    most, holds : of each lane, the greatest closure, and 1 where all margins are positive
    """

    registers: Array
    bad: Array
    most: Array
    holds: Array


@njit(inline="always")
def _allocate_block(tape):
    """Allocate the working arrays for a tape; its kernel takes them, so that it allocates nothing itself."""
    return BlockLanes(allocate_lanes(tape.registers), allocate_lanes(1), allocate_lanes(1), allocate_lanes(1))


@njit(inline="always")
def _load_inputs(x, z, row, stop, r, bad):
    """Load rows of ``x`` and ``z`` as the inputs of a block, and ask for those of the next; returns how many."""
    n = min(LANES, stop - row)
    bad[:] = 0.0
    first, second = x.shape[1], z.shape[1]
    load_rows(x, row, n, first, r, bad)
    load_rows(z, row, n, first + second, r, bad)
    fetch_to_read(x, row + LANES, stop)
    fetch_to_read(z, row + LANES, stop)
    return n


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_rows(tape, whole, x, z, y, start, stop):
    """Evaluate y[i] = tape(x[i], z[i]) for rows start ≤ i < stop.

    With ``whole`` a row is NaN where an input or output is not finite; else that spoils only what follows from it.
    """
    _evaluate_rows(tape, whole, x, z, y, _allocate_block(tape), start, stop)


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _evaluate_rows(tape, whole, x, z, y, block, start, stop):
    r, bad = block.registers, block.bad
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        fetch_to_write(y, row, stop)
        interpret(tape.code, tape.constants, r)
        if whole:
            for o in range(tape.inputs, tape.inputs + tape.outputs):
                d = (o & MASK) * LANES
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
        d = (o & MASK) * LANES
        for j in range(LANES):
            holds[j] = holds[j] if r[d + j] > 0.0 else 0.0  # false for NaN


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def evaluate_with_residual(tape, limits, x, z, results, start, stop):
    """Evaluate a tape: its first outputs are rows, the next closures, the others margins.

    limits : :class:`~.batch.ClosureLimits`
    results : :class:`~.batch.ClosedRows`, overwritten; NaN where an input, an output of the row or a closure is not
        finite
    """
    _evaluate_with_residual(tape, limits, x, z, results, _allocate_block(tape), start, stop)


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _evaluate_with_residual(tape, limits, x, z, results, block, start, stop):
    y, residual, settled = results.rows, results.residual, results.settled
    r, bad, most, holds = block.registers, block.bad, block.most, block.holds
    closures = tape.inputs + y.shape[1]
    margins, closed = closures + limits.closures, limits.closed
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        fetch_to_write(y, row, stop)
        interpret(tape.code, tape.constants, r)
        for o in range(tape.inputs, closures):
            d = (o & MASK) * LANES
            for j in range(LANES):
                bad[j] += 0.0 * r[d + j]
        most[:] = 0.0
        for o in range(closures, margins):
            d = (o & MASK) * LANES
            for j in range(LANES):
                v = r[d + j]
                bad[j] += 0.0 * v
                most[j] = abs(v) if abs(v) > most[j] else most[j]
        find_positive(r, margins, tape.inputs + tape.outputs, holds)
        store_rows(y, row, n, tape.inputs, r, bad)
        base = row & MASK
        for j in range(n):
            worst = most[j] + bad[j]
            residual[base + j] = worst
            settled[base + j] = (holds[j] > 0.0) & (worst <= closed)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def find_negative(tape, x, z, y, start, stop):
    """Find y[i] = 0 where all outputs are ≥ 0, else 1 + the first that is not; NaN is not."""
    _find_negative(tape, x, z, y, _allocate_block(tape), start, stop)


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _find_negative(tape, x, z, y, block, start, stop):
    r, bad, first = block.registers, block.bad, block.most
    for row in range(start, stop, LANES):
        n = _load_inputs(x, z, row, stop, r, bad)
        interpret(tape.code, tape.constants, r)
        first[:] = 0.0
        for o in range(tape.outputs - 1, -1, -1):
            d, number = ((tape.inputs + o) & MASK) * LANES, o + 1.0
            for j in range(LANES):
                first[j] = first[j] if r[d + j] >= 0.0 else number
        base = row & MASK
        for j in range(n):
            y[base + j] = int(first[j]) if (bad[j] == 0.0) | (first[j] > 0.0) else 1
