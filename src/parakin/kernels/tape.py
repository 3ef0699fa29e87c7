"""From a trace to a tape: the list of operations that the block kernels interpret, each on all lanes of a block.

A tape's registers are rows of ``LANES`` numbers; one is used again as soon as its value is dead, so that a block stays
in the first-level cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace
from ..arrays import Array, Indices
from .factoring import MatrixShape

# Opcodes. The number of summands is part of the code, so that the interpreter's loops have no inner ones.
CONST, LIN1, LIN2, LIN3, QUAD1, QUAD2, QUAD3, FMA, DIV, SQRT, SINCOS, ATAN2, MIN, MAX, ABS, COPYSIGN, SELECT = range(17)
_SAME = {
    alg.FMA: FMA,
    alg.DIV: DIV,
    alg.SQRT: SQRT,
    alg.ATAN2: ATAN2,
    alg.MIN: MIN,
    alg.MAX: MAX,
    alg.ABS: ABS,
    alg.COPYSIGN: COPYSIGN,
    alg.SELECT: SELECT,
}


class _TapeFields(NamedTuple):
    code: Indices
    constants: Array
    inputs: int
    outputs: int
    registers: int


class Tape(_TapeFields):
    """A compiled trace; tapes of the same content are equal.

    code : (n, 8) opcode, destination, up to six operand registers (SINCOS: sine, cosine, argument)
    constants : (n, 4) of each operation; of QUAD the factors, and last what is added
    inputs, outputs : how many there are; the inputs stand in the first registers, in their order, the outputs in the
        next
    registers : how many there are in all
    """

    @cached_property
    def content(self) -> tuple[bytes, int, int]:
        return self.code.tobytes() + self.constants.tobytes(), self.inputs, self.outputs

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tape) and self.content == other.content

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self.content)


class NewtonTapes(NamedTuple):
    """Newton's method on the closures f(y, q), in mm, of the motion's m coordinates y and the joints q.

    begin : takes a start and q to y
    closures : takes y and q to f
    closures_and_slopes : takes y and q to f and then ∂f/∂y, row by row
    end : takes y and q, and the start where it has inputs for it, to a row of the answer and then to margins
    """

    begin: Tape
    closures: Tape
    closures_and_slopes: Tape
    end: Tape

    @property
    def matrix_shape(self) -> MatrixShape:
        """The shape of ∂f/∂y."""
        closures = self.closures.outputs
        return MatrixShape(closures, self.closures_and_slopes.outputs // closures - 1)


def _find_opcode(term: Term) -> int:
    """Find the opcode of a term; the number of summands counts."""
    if term.op == alg.LIN:
        return CONST + len(term.args)
    if term.op == alg.STOP_GRADIENT:
        return LIN1
    if term.op == alg.QUAD:
        return QUAD1 + len(term.args) // 2 - 1
    return _SAME[term.op]


class _Registers:
    """The registers of a tape under compilation: outputs own theirs, the others are used again once they are free."""

    def __init__(self, inputs: int, results: Sequence[Term]):
        self._own = {term.index: inputs + number for number, term in enumerate(results)}
        self._of = dict[int, int]()
        self._free = list[int]()
        self.count = inputs + len(results)

    def __contains__(self, term: Term) -> bool:
        return term.index in self._of

    def __getitem__(self, term: Term) -> int:
        return self._of[term.index]

    def set(self, term: Term, register: int) -> None:
        self._of[term.index] = register

    def take(self, term: Term) -> int:
        """Take a register for a term: its own, else a free one, else a new one."""
        if term.index in self._own:
            self.set(term, self._own[term.index])
        elif self._free:
            self.set(term, self._free.pop())
        else:
            self.set(term, self.count)
            self.count += 1
        return self[term]

    def release(self, index: int) -> None:
        """Free the register of a term that is not used any more, unless it is an output's."""
        if index not in self._own:
            self._free.append(self._of[index])


def _separate_outputs(trace: Trace, outputs: Sequence[Scalar]) -> list[Term]:
    """Make a term for each output; one that is an input, or an output already, gets a copy outside the trace."""
    results: list[Term] = []
    for y in outputs:
        term = y if isinstance(y, Term) else trace.constant(y)
        if term.op == alg.INPUT or any(term is other for other in results):
            term = Term(trace, alg.LIN, (term,), (0.0, 1.0), -1 - len(results))
        results.append(term)
    return results


def _fold_lines(order: Sequence[Term], results: Sequence[Term]) -> list[Term]:
    """Compute k0 + k1·product from the product's operands: one operation instead of two where that is not used besides.

    It is so wherever such a line stands: a value has the same bits in every tape that computes it. A QUAD of the answer
    may have one more constant than products: what is added to them.
    """
    folded = [_fold_line(term) for term in order]
    wanted = {term.index for term in results}
    for term in reversed(folded):
        if term.index in wanted:
            wanted.update(arg.index for arg in term.args)
    return [term for term in folded if term.index in wanted]


def _fold_line(term: Term) -> Term:
    """Return k0 + k1·product as one operation, any other term as it is."""
    if term.op != alg.LIN or len(term.args) != 1 or term.args[0].op not in (alg.QUAD, alg.FMA):
        return term
    (product,) = term.args
    k = [term.k[1] * factor for factor in product.k]
    if product.op == alg.QUAD:
        k.append(term.k[0])
    else:
        k[2] += term.k[0]
    return Term(term.trace, product.op, product.args, tuple(k), term.index)


def _list_constants(term: Term) -> list[float]:
    """List the four constants of an operation; the last of QUAD is what is added to its products."""
    k = (0.0, 1.0) if term.op == alg.STOP_GRADIENT else term.k
    if term.op == alg.QUAD:
        products = len(term.args) // 2
        k = (*k[:products], *[0.0] * (3 - products), *k[products:])
    return [*k, *[0.0] * (4 - len(k))]


def compile_tape(trace: Trace, outputs: Sequence[Scalar], inputs: int) -> Tape:
    """Compile the tape of ``outputs`` (terms of ``trace``, or numbers) from the trace's first ``inputs`` inputs."""
    results = _separate_outputs(trace, outputs)
    copies = [term for term in results if term.index < 0]
    within = [term for term in results if term.index >= 0] + [arg for term in copies for arg in term.args]
    order = _fold_lines([trace.nodes[i] for i in alg.find_dependencies(within)] + copies, results)
    last_use = {arg.index: position for position, term in enumerate(order) for arg in term.args}
    registers = _Registers(inputs, results)
    code: list[list[int]] = []
    constants: list[list[float]] = []
    for position, term in enumerate(order):
        if term.op == alg.INPUT:
            registers.set(term, int(term.k[0]))
        elif term in registers:  # the cosine to a sine, or the reverse
            pass
        elif term.op in (alg.SIN, alg.COS):
            argument = term.args[0]
            pair = [trace.node(op, (argument,), ()) for op in (alg.SIN, alg.COS)]
            sine, cosine = (registers.take(term) for term in pair)
            code.append([SINCOS, sine, cosine, registers[argument], 0, 0, 0, 0])
            constants.append([0.0] * 4)
            for one in pair:
                if one.index not in last_use:  # one of the two may not be wanted
                    registers.release(one.index)
        else:  # the destination is never an operand's register: rows that don't overlap vectorise
            row = [_find_opcode(term), registers.take(term), *[registers[arg] for arg in term.args]]
            code.append(row + [0] * (8 - len(row)))
            constants.append(_list_constants(term))
        for index in {arg.index for arg in term.args}:
            if last_use[index] == position:
                registers.release(index)
    table = np.array(constants, np.float64).reshape(-1, 4)
    return Tape(np.array(code, np.int64).reshape(-1, 8), table, inputs, len(results), max(registers.count, 1))
