"""Traces over intervals: bounds that hold for every point of a box, many boxes at once, rounded outward."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace
from .batch import split, still
from .tape import Tape, compile_tape

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class IntervalProgram:
    """The outputs of a trace, to be evaluated over boxes."""

    trace: Trace
    outputs: Sequence[Scalar]

    @cached_property
    def inputs(self) -> int:
        """Columns of a box: one more than the greatest number of an input."""
        nodes = [self.trace.nodes[i] for i in alg.needed([y for y in self.outputs if isinstance(y, Term)])]
        return max((int(node.k[0]) + 1 for node in nodes if node.op == alg.INPUT), default=0)

    @cached_property
    def tape(self) -> Tape:
        return compile_tape(self.trace, self.outputs, self.inputs)

    def __call__(self, low: Array, high: Array) -> Bounds:
        """Bounds (boxes, outputs) of every output over boxes (boxes, inputs or more).

        Roots are taken of the part of an interval that is not negative, and a quotient by an interval that holds 0 is
        the whole line. So bounds hold wherever the output exists.
        """
        from .enclosures import enclose

        down, up = np.empty((len(low), len(self.outputs))), np.empty((len(low), len(self.outputs)))
        args = (*self.tape.parts, still(np.ascontiguousarray(low)), still(np.ascontiguousarray(high)), down, up)
        split(len(low), lambda start, stop: enclose(*args, start, stop))
        return down, up
