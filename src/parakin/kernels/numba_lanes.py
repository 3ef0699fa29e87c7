"""Eight numbers as one value in Numba's kernels: a lane each for paths that are tracked side by side.

Numba leaves it to LLVM to find vectors in loops, which it does not where loops are short or arrays may overlap. Values
of this type are vectors from the start. They stand as rows in arrays (count, LANES); a condition on them is an integer
with a bit for each lane.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

LANES = 8
ALL = (1 << LANES) - 1

_DOUBLE, _BIT, _INDEX = ir.DoubleType(), ir.IntType(1), ir.IntType(32)
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_CONDITION = ir.VectorType(_BIT, LANES)
_BYTE, _INTEGER = ir.IntType(LANES), ir.IntType(64)


class _Lanes(types.Type):  # type: ignore[misc]
    """The type of a vector of lanes."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{LANES}")


_lanes = _Lanes()


class _Vector(models.PrimitiveModel):  # type: ignore[misc]
    """What stands for lanes in LLVM's code."""

    def __init__(self, manager: Any, kind: Any):
        super().__init__(manager, kind, _VECTOR)


register_model(_Lanes)(_Vector)


def _locate(context: Any, builder: Any, kind: Any, array: Any, row: Any) -> Any:
    """Point to a row of an array (count, LANES)."""
    data = context.make_array(kind)(context, builder, array).data
    first = builder.gep(data, [builder.mul(row, row.type(LANES))])
    return builder.bitcast(first, _VECTOR.as_pointer())


@intrinsic
def load(typing, array, row):
    """Load a row."""

    def generate(context, builder, signature, args):
        return builder.load(_locate(context, builder, signature.args[0], *args), align=8)

    return _lanes(array, types.intp), generate


@intrinsic
def store(typing, array, row, value):
    """Store a row."""

    def generate(context, builder, signature, args):
        builder.store(args[2], _locate(context, builder, signature.args[0], *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, _lanes), generate


@intrinsic
def repeat(typing, number):
    """Give every lane the same number."""

    def generate(context, builder, signature, args):
        first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), args[0], _INDEX(0))
        order = ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)
        return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), order)

    return _lanes(types.float64), generate


def _define_operator(symbol: Any, instruction: str) -> None:
    """Define an operator on two vectors by LLVM's instruction."""

    @intrinsic
    def apply(typing, x, y):
        def generate(context, builder, signature, args):
            return getattr(builder, instruction)(*args, flags=("contract", "nsz"))

        return _lanes(_lanes, _lanes), generate

    def choose_operator(x, y):
        return (lambda x, y: apply(x, y)) if x == _lanes and y == _lanes else None

    overload(symbol)(choose_operator)


_define_operator(operator.add, "fadd")
_define_operator(operator.sub, "fsub")
_define_operator(operator.mul, "fmul")
_define_operator(operator.truediv, "fdiv")


@intrinsic
def is_greater(typing, x, y):
    """Tell in which lanes x > y, as bits; not where one is NaN."""

    def generate(context, builder, signature, args):
        condition = builder.fcmp_ordered(">", *args)
        return builder.zext(builder.bitcast(condition, _BYTE), _INTEGER)

    return types.int64(_lanes, _lanes), generate


@intrinsic
def choose(typing, bits, x, y):
    """Take x in the lanes of bits that are set, y in the others."""

    def generate(context, builder, signature, args):
        condition = builder.bitcast(builder.trunc(args[0], _BYTE), _CONDITION)
        return builder.select(condition, args[1], args[2])

    return _lanes(types.int64, _lanes, _lanes), generate


@intrinsic
def take_root(typing, x):
    """Take the square root."""

    def generate(context, builder, signature, args):
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(builder.module.declare_intrinsic(f"llvm.sqrt.v{LANES}f64", fnty=kind), args)

    return _lanes(_lanes), generate
