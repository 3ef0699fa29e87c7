"""From a trace to a tape: the list of operations that the block kernels interpret, each on all lanes of a block.

A tape's registers are rows of ``LANES`` numbers; one is used again as soon as its value is dead, so that a block stays
in the first-level cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model import algebra as alg
from ..model.algebra import Scalar, Term, Trace

# Opcodes. The number of summands is part of the code, so that the interpreter's loops have no inner ones.
CONST, LIN1, LIN2, LIN3, QUAD1, QUAD2, QUAD3, FMA, DIV, SQRT, SINCOS, ATAN2, MIN, MAX, ABS, COPYSIGN = range(16)
_SAME = {
    alg.FMA: FMA,
    alg.DIV: DIV,
    alg.SQRT: SQRT,
    alg.ATAN2: ATAN2,
    alg.MIN: MIN,
    alg.MAX: MAX,
    alg.ABS: ABS,
    alg.COPYSIGN: COPYSIGN,
}


@dataclass(frozen=True, eq=False)
class Tape:
    """A compiled trace.

    ``code`` (n, 8) int64: opcode, destination, up to six operand registers (SINCOS: sine, cosine, argument);
    ``imm`` (n, 4): constants; ``inputs`` (i, 2): number of the input and its register; ``outputs`` (o,): registers.
    """

    code: NDArray[np.int64]
    imm: NDArray[np.float64]
    inputs: NDArray[np.int64]
    outputs: NDArray[np.int64]
    registers: int


def _opcode(term: Term) -> int:
    if term.op == alg.LIN:
        return CONST + len(term.args)
    if term.op == alg.QUAD:
        return QUAD1 + len(term.k) - 1
    return _SAME[term.op]


def compile_tape(trace: Trace, outputs: Sequence[Scalar]) -> Tape:
    """The tape that computes ``outputs`` (terms of ``trace``, or numbers) from the trace's inputs."""
    results = [y if isinstance(y, Term) else trace.constant(y) for y in outputs]
    needed: set[int] = set()
    stack = list(results)
    while stack:
        term = stack.pop()
        if term.index not in needed:
            needed.add(term.index)
            stack.extend(term.args)
    order = [trace.nodes[i] for i in sorted(needed)]
    last: dict[int, int] = {}
    for position, term in enumerate(order):
        for arg in term.args:
            last[arg.index] = position
    for term in results:
        last[term.index] = len(order)

    register: dict[int, int] = {}
    free: list[int] = []
    count = 0

    def take(term: Term) -> int:
        nonlocal count
        if free:
            register[term.index] = free.pop()
        else:
            register[term.index] = count
            count += 1
        return register[term.index]

    inputs = [(int(term.k[0]), take(term)) for term in order if term.op == alg.INPUT]
    code: list[list[int]] = []
    imm: list[list[float]] = []
    angle_done: set[int] = set()
    for position, term in enumerate(order):
        if term.op == alg.INPUT:
            continue
        if term.op in (alg.SIN, alg.COS):
            arg = term.args[0]
            if term.index not in angle_done:
                pair = [trace.node(op, (arg,), ()) for op in (alg.SIN, alg.COS)]
                angle_done.update(t.index for t in pair)
                sine, cosine = (take(t) for t in pair)
                code.append([SINCOS, sine, cosine, register[arg.index], 0, 0, 0, 0])
                imm.append([0.0] * 4)
                for t in pair:  # one of the two may not be wanted
                    if t.index not in last:
                        free.append(register[t.index])
        else:  # the destination is never an operand's register: rows that don't overlap vectorise
            target = take(term)
            row = [_opcode(term), target, *[register[arg.index] for arg in term.args]]
            code.append(row + [0] * (8 - len(row)))
            imm.append([*term.k, *[0.0] * (4 - len(term.k))])
        for arg in {a.index for a in term.args}:
            if last[arg] == position:
                free.append(register[arg])
    return Tape(
        np.array(code, np.int64).reshape(-1, 8),
        np.array(imm, np.float64).reshape(-1, 4),
        np.array(inputs, np.int64).reshape(-1, 2),
        np.array([register[term.index] for term in results], np.int64),
        max(count, 1),
    )
