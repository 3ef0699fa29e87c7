"""Traces over intervals: bounds that hold for every point of a box, many boxes at once, rounded outward."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace
from ..arrays import Array
from .batch import freeze_rows, run_in_threads
from .tape import Tape, compile_tape

Bounds = tuple[Array, Array]


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
        args = (self.tape, freeze_rows(np.ascontiguousarray(low)), freeze_rows(np.ascontiguousarray(high)), down, up)
        run_in_threads(len(low), lambda start, stop: enclose_outputs(*args, start, stop))
        return down, up
