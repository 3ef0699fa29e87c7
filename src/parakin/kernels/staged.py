"""Margins as the sweeping kernels take them: a tape cut into parts, with what is to be tested after each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace, needed
from .tape import SINCOS, Tape, compile_tape

_LONG = 8  # operations worth a look at what is left


@dataclass(frozen=True, eq=False)
class Parts:
    """Margins of places and turns, to be computed one after the other until one is broken.

    ``given`` is described in :mod:`parakin.kernels.sweep`. Its tape takes the places and what ``fixed`` makes of
    places (any) and turns: all that hangs on turns alone and is the same for all places.
    """

    tape: Tape
    parts: NDArray[np.int64]
    tests: NDArray[np.int64]
    lines: NDArray[np.float64]
    fixed: Tape

    @property
    def given(self) -> tuple[Any, ...]:
        """As the kernels take them."""
        return self.tape.code, self.tape.imm, self.tape.registers, self.parts, self.tests, self.lines


def in_parts(trace: Trace, margins: Sequence[Scalar], places: int, turns: int) -> Parts:
    """Terms of ``trace``, or numbers, whose inputs are first the ``places``, then the ``turns``.

    A value comes as late as it is wanted; of a margin k0 + k1·y only y is computed.
    """
    values: list[Scalar] = []
    tests: list[list[int]] = []
    lines: list[list[float]] = []
    for number, margin in enumerate(margins):
        value, line = _peeled(margin)
        if not isinstance(value, Term) and value >= 0.0:
            continue  # a number, never broken
        if values and values[-1] is value and tests[-1][1] == tests[-1][2]:
            tests[-1][2], lines[-1][2:] = number, line
            continue
        values.append(value)
        tests.append([0, number, number])
        lines.append([*line, *line])
    terms, fixed = _apart(trace, values, places)
    outputs = list({term.index: term for term in terms}.values())
    tape = compile_tape(terms[0].trace if terms else Trace(), outputs, places + len(fixed))
    ready = 0
    parts = [[0, 0, 0, 0]]
    for k, term in enumerate(terms):
        tests[k][0] = register = tape.inputs + outputs.index(term)
        made = (tape.code[:, 1] == register) | ((tape.code[:, 0] == SINCOS) & (tape.code[:, 2] == register))
        ready = max(ready, int(made.argmax()) + 1)
        if ready > parts[-1][1] and parts[-1][1] - parts[-1][0] >= _LONG:
            parts.append([parts[-1][1], 0, k, 0])
        parts[-1][1], parts[-1][3] = ready, k + 1
    return Parts(
        tape,
        np.array(parts, np.int64),
        np.array(tests, np.int64).reshape(-1, 3),
        np.array(lines, float).reshape(-1, 4),
        compile_tape(trace, [trace.nodes[i] for i in fixed], places + turns),
    )


def _peeled(margin: Scalar) -> tuple[Scalar, list[float]]:
    """A value y with k0 + k1·y ≥ 0 where the margin is: the same one for a lower and an upper bound."""
    if not (isinstance(margin, Term) and margin.op == alg.LIN and margin.args):
        return margin, [0.0, 1.0]
    k0, k1 = margin.k[0], margin.k[1]
    if len(margin.args) > 1:
        sign = -1.0 if k1 < 0.0 else 1.0
        return margin.trace.node(alg.LIN, margin.args, (0.0, *[sign * k for k in margin.k[1:]])), [k0, sign]
    value = margin.args[0]
    if value.op == alg.ATAN2 and k0 > abs(k1) * np.pi:  # an angle of any size will do, if it is one
        return value.args[0] + value.args[1], [0.0, 0.0]
    return value, [k0, k1]


def _apart(trace: Trace, values: Sequence[Scalar], places: int) -> tuple[list[Term], list[int]]:
    """The values in a trace of their own, each made as late as it is wanted, and indices of the nodes it is given.

    Its inputs are the ``places``, then those nodes: what hangs on turns alone and is the same for all places.
    """
    new, known, moving = Trace(), dict[int, Term](), set[int]()
    fixed: list[int] = []

    def given(term: Term) -> Term:
        if term.index in known:
            return known[term.index]
        fixed.append(term.index)
        known[term.index] = new.input(places + len(fixed) - 1)
        return known[term.index]

    found = []
    for value in values:
        if not isinstance(value, Term):
            found.append(new.constant(value))
            continue
        for i in needed([value], moving):
            node = trace.nodes[i]
            if node.op == alg.LIN and not node.args:
                known[i] = new.node(node.op, (), node.k)
            elif (node.op == alg.INPUT and node.k[0] < places) or any(arg.index in moving for arg in node.args):
                moving.add(i)
                known[i] = new.node(node.op, tuple(given(arg) for arg in node.args), node.k)
        term = given(value)
        found.append(new.node(alg.LIN, (term,), (0.0, 1.0)) if term.op == alg.INPUT else term)
    return found, fixed
