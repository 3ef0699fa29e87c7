"""Traces over intervals: bounds that hold for every point of a box, many boxes at once, rounded outward."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace, norm
from ..arrays import Array
from .batch import run_in_threads
from .tape import Tape, compile_tape

Bounds = tuple[Array, Array]


class JumpFreeTrace(Trace):
    """A trace in which the sine and cosine of an arc tangent are quotients: their bounds have no jump at ±180°."""

    def node(self, op: int, args: tuple[Term, ...], k: tuple[float, ...]) -> Term:
        if op in (alg.SIN, alg.COS):
            both = self._derive_sincos(args[0])
            if both is not None:
                sine, cosine = both
                result: Term = sine if op == alg.SIN else cosine
                return result
        return super().node(op, args, k)

    @staticmethod
    def _derive_sincos(angle: Term) -> tuple[Scalar, Scalar] | None:
        """Derive sine and cosine of ±atan2(y, x) + offset as quotients; None for other angles."""
        offset, sign, inner = 0.0, 1.0, angle
        if angle.op == alg.LIN and len(angle.args) == 1 and abs(angle.k[1]) == 1.0:
            (offset, sign), inner = angle.k, angle.args[0]
        if inner.op != alg.ATAN2:
            return None
        y, x = inner.args
        size = norm((x, y))
        s, c = sign * y / size, x / size
        if offset == 0.0:
            return s, c
        so, co = np.sin(offset), np.cos(offset)
        return co * s + so * c, co * c - so * s


def freeze_rows(rows: Array) -> Array:
    """Return a read-only view in C order; Numba compiles the kernel for read-only arrays alone."""
    view = np.ascontiguousarray(rows).view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, eq=False)
class IntervalProgram:
    """The outputs of a trace, to be evaluated over boxes."""

    trace: Trace
    outputs: Sequence[Scalar]

    @cached_property
    def inputs(self) -> int:
        """The number of columns of a box: one more than the greatest number of an input."""
        nodes = [self.trace.nodes[i] for i in alg.find_dependencies([y for y in self.outputs if isinstance(y, Term)])]
        return max((int(node.k[0]) + 1 for node in nodes if node.op == alg.INPUT), default=0)

    @cached_property
    def tape(self) -> Tape:
        """The tape of all outputs."""
        return compile_tape(self.trace, self.outputs, self.inputs)

    def __call__(self, low: Array, high: Array) -> Bounds:
        """Bound every output, (boxes, outputs), over boxes (boxes, inputs or more).

        Roots are taken of the part of an interval that is not negative; a quotient by an interval that holds 0 is the
        whole line. So bounds hold wherever the output exists.
        """
        from .enclosures import enclose_outputs

        down, up = np.empty((len(low), len(self.outputs))), np.empty((len(low), len(self.outputs)))
        args = (self.tape, freeze_rows(low), freeze_rows(high), down, up)
        run_in_threads(len(low), lambda start, stop: enclose_outputs(*args, start, stop))
        return down, up
