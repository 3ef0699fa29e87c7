"""Blocks of LANES rows: rows of numbers in memory to registers, a column each, and back."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .compiling import njit
from .elementary import FAST, use_widest_vectors

LANES = 128
MASK = (1 << 40) - 1  # tells the compiler that a register's number is not negative
WIDEST = 6  # numbers of a row that are transposed with shuffles: each more takes longer to compile

_GROUP = 8  # rows that are transposed at once
_WORD, _INDEX = ir.IntType(32), ir.IntType(64)
_VECTOR = ir.VectorType(ir.DoubleType(), _GROUP)


@njit(nogil=True, cache=True)
def allocate_lanes(rows):
    """Allocate rows of LANES numbers that start on a cache line: vectors that cross lines take twice as long."""
    room = np.empty(rows * LANES + 8)
    skip = (-(room.ctypes.data // 8)) % 8
    return room[skip : skip + rows * LANES]


def _make_prefetch(write):
    """Make a function that asks for a block's memory, to read or to write it, while another block is computed.

    The kernel's bursts of reading and writing are too short for the processor's own prefetching; a fifth of the time
    was waiting.
    """

    @intrinsic
    def prefetch(typing, array, index):
        def generate(context, builder, signature, args):
            data = context.make_array(signature.args[0])(context, builder, args[0]).data
            byte = ir.IntType(8).as_pointer()
            kind = ir.FunctionType(ir.VoidType(), [byte, _WORD, _WORD, _WORD])
            call = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
            line = builder.bitcast(builder.gep(data, [args[1]]), byte)
            builder.call(call, [line, _WORD(write), _WORD(3), _WORD(1)])
            return context.get_dummy_value()

        return types.void(array, types.int64), generate

    @njit(allocates=False, nogil=True, cache=True)
    def fetch(x, row, stop):
        width, flat = x.shape[1], x.reshape(-1)
        for i in range(row * width, min(row + LANES, stop) * width, 8):
            prefetch(flat, i)

    return fetch


fetch_to_read, fetch_to_write = _make_prefetch(0), _make_prefetch(1)


def _gather_entries(builder, vectors, entries):
    """Make one vector of entries, each a vector's number and a place in it, by shuffles of two vectors at a time."""

    def shuffle(one, other, mask):
        return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(_WORD, _GROUP), mask))

    first, *others = dict.fromkeys(number for number, _ in entries)
    result = shuffle(vectors[first], vectors[first], [place if n == first else 0 for n, place in entries])
    for other in others:
        mask = [_GROUP + place if n == other else i for i, (n, place) in enumerate(entries)]
        result = shuffle(result, vectors[other], mask)
    return result


def _make_transposer(transpose):
    """Make a function that transposes a block: flat rows and the first number's index, width, registers, first, lanes.

    ``transpose`` generates it for _GROUP rows of a width, from a function that points to a vector of an array (0 rows,
    1 registers, 2 lanes) at an offset. With a width known when compiled, it is done by shuffles; the compiler's own
    loops over columns are scalar for most widths, and take six times as long.
    """

    @intrinsic
    def transpose_block(typing, flat, base, width, r, first, bad):
        def generate(context, builder, signature, args):
            data = [context.make_array(signature.args[i])(context, builder, args[i]).data for i in (0, 3, 5)]
            for columns in range(1, WIDEST + 1):
                with (
                    builder.if_then(builder.icmp_signed("==", args[2], _INDEX(columns))),
                    cgutils.for_range(builder, _INDEX(LANES // _GROUP)) as loop,
                ):
                    lane = builder.mul(loop.index, _INDEX(_GROUP))
                    row = builder.add(args[1], builder.mul(lane, _INDEX(columns)))
                    starts = row, builder.add(args[4], lane), lane

                    def point(array, offset, starts=starts):
                        place = builder.gep(data[array], [builder.add(starts[array], _INDEX(offset))])
                        return builder.bitcast(place, _VECTOR.as_pointer())

                    transpose(builder, columns, point)
            return context.get_dummy_value()

        return types.void(flat, types.int64, types.int64, r, types.int64, bad), generate

    return transpose_block


def _load_columns(builder, width, point):
    """Load rows to registers; where a number is not finite the lane turns NaN."""
    rows = [builder.load(point(0, _GROUP * i), align=8) for i in range(width)]
    total = ir.Constant(_VECTOR, [0.0] * _GROUP)
    for c in range(width):
        column = _gather_entries(builder, rows, [divmod(j * width + c, _GROUP) for j in range(_GROUP)])
        builder.store(column, point(1, c * LANES), align=8)
        total = builder.fadd(total, column)
    bad = builder.load(point(2, 0), align=8)
    nothing = builder.fmul(total, ir.Constant(_VECTOR, [0.0] * _GROUP))
    builder.store(builder.fadd(bad, nothing), point(2, 0), align=8)


def _store_columns(builder, width, point):
    """Store registers to rows; NaN where the lane is."""
    bad = builder.load(point(2, 0), align=8)
    columns = [builder.fadd(builder.load(point(1, c * LANES), align=8), bad) for c in range(width)]
    for i in range(width):
        entries = [divmod(_GROUP * i + k, width)[::-1] for k in range(_GROUP)]
        builder.store(_gather_entries(builder, columns, entries), point(0, _GROUP * i), align=8)


_load_block, _store_block = _make_transposer(_load_columns), _make_transposer(_store_columns)


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def load_rows(x, row, n, end, r, bad):
    """Load n rows of ``x`` from ``row`` on into the registers up to ``end``, a column each, padded with zeros.

    bad : (LANES,) turns NaN where a number is not finite
    """
    use_widest_vectors()
    width, flat = x.shape[1], x.reshape(-1)
    base = (row * width) & MASK
    first = ((end - width) & MASK) * LANES
    if (n == LANES) & (width <= WIDEST):
        _load_block(flat, base, width, r, first, bad)
    else:
        for c in range(width):
            for j in range(n):
                v = flat[base + j * width + c]
                r[first + c * LANES + j] = v
                bad[j] += 0.0 * v
            for j in range(n, LANES):
                r[first + c * LANES + j] = 0.0


@njit(allocates=False, nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def store_rows(y, row, n, register, r, bad):
    """Store registers from ``register`` on, plus ``bad``, to n rows of ``y`` from ``row`` on."""
    use_widest_vectors()
    width, flat = y.shape[1], y.reshape(-1)
    base = (row * width) & MASK
    first = (register & MASK) * LANES
    if (n == LANES) & (width <= WIDEST):
        _store_block(flat, base, width, r, first, bad)
    else:
        for c in range(width):
            for j in range(n):
                flat[base + j * width + c] = r[first + c * LANES + j] + bad[j]
