"""From a trace to a tape: the list of operations that the block kernels interpret, each on all lanes of a block.

A tape's registers are rows of ``LANES`` numbers; one is used again as soon as its value is dead, so that a block stays
in the first-level cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace

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


@dataclass(frozen=True, eq=False)
class Tape:
    """A compiled trace.

    ``code`` (n, 8) int64: opcode, destination, up to six operand registers (SINCOS: sine, cosine, argument);
    ``imm`` (n, 4): constants. Inputs stand in the first registers, in their order, and outputs in the next.
    """

    code: NDArray[np.int64]
    imm: NDArray[np.float64]
    inputs: int
    outputs: int
    registers: int

    @property
    def parts(self) -> tuple[NDArray[np.int64], NDArray[np.float64], int, int, int]:
        """As the kernels take them."""
        return self.code, self.imm, self.inputs, self.outputs, self.registers


def _opcode(term: Term) -> int:
    if term.op == alg.LIN:
        return CONST + len(term.args)
    if term.op == alg.HELD:
        return LIN1
    if term.op == alg.QUAD:
        return QUAD1 + len(term.k) - 1
    return _SAME[term.op]


def compile_tape(trace: Trace, outputs: Sequence[Scalar], inputs: int) -> Tape:
    """The tape that computes ``outputs`` (terms of ``trace``, or numbers) from the trace's first ``inputs`` inputs."""
    results: list[Term] = []
    for y in outputs:
        term = y if isinstance(y, Term) else trace.constant(y)
        if term.op == alg.INPUT or any(term is other for other in results):
            # An output has a register of its own: a copy, outside the trace.
            term = Term(trace, alg.LIN, (term,), (0.0, 1.0), -1 - len(results))
        results.append(term)
    copies = [term for term in results if term.index < 0]
    within = [term for term in results if term.index >= 0] + [arg for term in copies for arg in term.args]
    order = [trace.nodes[i] for i in alg.needed(within)] + copies
    last: dict[int, int] = {}
    for position, term in enumerate(order):
        for arg in term.args:
            last[arg.index] = position
    own = {term.index: inputs + number for number, term in enumerate(results)}
    register: dict[int, int] = {}
    free: list[int] = []
    count = inputs + len(results)

    def take(term: Term) -> int:
        nonlocal count
        if term.index in own:
            register[term.index] = own[term.index]
        elif free:
            register[term.index] = free.pop()
        else:
            register[term.index] = count
            count += 1
        return register[term.index]

    code: list[list[int]] = []
    imm: list[list[float]] = []
    for position, term in enumerate(order):
        if term.op == alg.INPUT:
            register[term.index] = int(term.k[0])
        elif term.index in register:  # the cosine to a sine, or the reverse
            pass
        elif term.op in (alg.SIN, alg.COS):
            argument = term.args[0]
            pair = [trace.node(op, (argument,), ()) for op in (alg.SIN, alg.COS)]
            sine, cosine = (take(part) for part in pair)
            code.append([SINCOS, sine, cosine, register[argument.index], 0, 0, 0, 0])
            imm.append([0.0] * 4)
            # One of the two may not be wanted.
            free += [register[part.index] for part in pair if part.index not in last and part.index not in own]
        else:  # the destination is never an operand's register: rows that don't overlap vectorise
            row = [_opcode(term), take(term), *[register[arg.index] for arg in term.args]]
            code.append(row + [0] * (8 - len(row)))
            k = (0.0, 1.0) if term.op == alg.HELD else term.k
            imm.append([*k, *[0.0] * (4 - len(k))])
        for index in {arg.index for arg in term.args}:
            if last[index] == position and index not in own:
                free.append(register[index])
    return Tape(
        np.array(code, np.int64).reshape(-1, 8),
        np.array(imm, np.float64).reshape(-1, 4),
        inputs,
        len(results),
        max(count, 1),
    )
