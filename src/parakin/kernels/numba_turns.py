"""Sine, cosine and arc tangent for Numba's kernels, and how these are compiled."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from .compiling import njit
from .elementary import define_turns

# Contraction is welcome. NaN and infinity carry meaning and must survive: no reassociation, which cancels x - x.
FAST = {"contract", "arcp", "nsz", "afn"}


@intrinsic
def use_widest_vectors(typing):
    """Make the calling function use the machine's widest vectors; LLVM's default halves them on many x86."""

    def generate(context, builder, signature, args):
        # llvmlite's own check knows enumerated attributes only.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def _read_bits(typing, x):
    """Return the bits of a float64 as an integer."""

    def generate(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def _make_number(typing, bits):
    """Return the float64 that has these bits."""

    def generate(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), generate


@njit(inline="always")
def _select(condition, x, y):
    return x if condition else y


sincos, atan2 = (
    njit(inline="always", fastmath=FAST)(function) for function in define_turns(_select, _read_bits, _make_number)
)
