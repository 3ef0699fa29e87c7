"""Margins as the sweeping kernels take them: a tape in stages, with the limits to be tested after each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import algebra as alg
from ..algebra import Scalar, Term, Trace, find_dependencies
from .tape import SINCOS, Tape, compile_tape

_LONG = 8  # operations: a stage as long is worth a look at whether any lane is left


class StagedProgram(NamedTuple):
    """Margins, to be computed one after the other until one is broken.

    tape : takes the places, and what is the same for all places
    stages : of each, where in the code each stage begins and ends, and the tests that follow it, from and to
    tests : a register r and the indices of two limits; one limit alone stands twice
    lines : their lines k0 + k1·r, which must be ≥ 0
    """

    tape: Tape
    stages: tuple[tuple[int, ...], ...]
    tests: tuple[tuple[int, ...], ...]
    lines: tuple[tuple[float, ...], ...]


class StagedMargins(NamedTuple):
    """Margins of places and turns.

    program : takes the places and what ``fixed`` gives
    fixed : takes places (any) and turns, and gives all that depends on turns alone, the same for all places
    """

    program: StagedProgram
    fixed: Tape


def stage_margins(trace: Trace, margins: Sequence[Scalar], places: int, turns: int) -> StagedMargins:
    """Stage the margins, terms of ``trace`` or numbers, whose inputs are first the ``places``, then the ``turns``.

    A value is computed as late as it is used; of a margin k0 + k1·y only y is computed.
    """
    values, tests, lines = _collect_values(margins)
    terms, fixed = _separate_fixed(trace, values, places)
    outputs = list({term.index: term for term in terms}.values())
    tape = compile_tape(terms[0].trace if terms else Trace(), outputs, places + len(fixed))
    ready = 0
    stages = [[0, 0, 0, 0]]
    for k, term in enumerate(terms):
        tests[k][0] = register = tape.inputs + outputs.index(term)
        made = (tape.code[:, 1] == register) | ((tape.code[:, 0] == SINCOS) & (tape.code[:, 2] == register))
        ready = max(ready, int(made.argmax()) + 1)
        if ready > stages[-1][1] and stages[-1][1] - stages[-1][0] >= _LONG:
            stages.append([stages[-1][1], 0, k, 0])
        stages[-1][1], stages[-1][3] = ready, k + 1
    program = StagedProgram(
        tape,
        tuple(map(tuple, stages)),
        tuple(map(tuple, tests)),
        tuple(map(tuple, lines)),
    )
    return StagedMargins(program, compile_tape(trace, [trace.nodes[i] for i in fixed], places + turns))


def _collect_values(margins: Sequence[Scalar]) -> tuple[list[Scalar], list[list[int]], list[list[float]]]:
    """Collect the values that margins are lines of, and each one's test and lines; two limits may share a value."""
    values: list[Scalar] = []
    tests: list[list[int]] = []
    lines: list[list[float]] = []
    for number, margin in enumerate(margins):
        value, line = _peel_line(margin)
        if not isinstance(value, Term) and value >= 0.0:
            continue  # a number, never broken
        if values and values[-1] is value and tests[-1][1] == tests[-1][2]:
            tests[-1][2], lines[-1][2:] = number, line
            continue
        values.append(value)
        tests.append([0, number, number])
        lines.append([*line, *line])
    return values, tests, lines


def _peel_line(margin: Scalar) -> tuple[Scalar, list[float]]:
    """Find y with k0 + k1·y ≥ 0 where the margin is: the same y for a lower and an upper bound; returns y, [k0, k1]."""
    if not (isinstance(margin, Term) and margin.op == alg.LIN and margin.args):
        return margin, [0.0, 1.0]
    k0, k1 = margin.k[0], margin.k[1]
    if len(margin.args) > 1:
        sign = -1.0 if k1 < 0.0 else 1.0
        return margin.trace.node(alg.LIN, margin.args, (0.0, *[sign * k for k in margin.k[1:]])), [k0, sign]
    value = margin.args[0]
    if value.op == alg.ATAN2 and k0 > abs(k1) * np.pi:  # an angle of any size will do, if it is a number
        return value.args[0] + value.args[1], [0.0, 0.0]
    return value, [k0, k1]


def _separate_fixed(trace: Trace, values: Sequence[Scalar], places: int) -> tuple[list[Term], list[int]]:
    """Copy the values to a trace of their own, each as late as it is used; returns indices of the nodes it is given.

    Its inputs are the ``places``, then those nodes: what depends on turns alone and is the same for all places.
    """
    new, known, moving = Trace(), dict[int, Term](), set[int]()
    fixed: list[int] = []

    def copy_term(term: Term) -> Term:
        if term.index in known:
            return known[term.index]
        fixed.append(term.index)
        known[term.index] = new.input(places + len(fixed) - 1)
        return known[term.index]

    copies = []
    for value in values:
        if not isinstance(value, Term):
            copies.append(new.constant(value))
            continue
        for i in find_dependencies([value], moving):
            node = trace.nodes[i]
            if node.op == alg.LIN and not node.args:
                known[i] = new.node(node.op, (), node.k)
            elif (node.op == alg.INPUT and node.k[0] < places) or any(arg.index in moving for arg in node.args):
                moving.add(i)
                known[i] = new.node(node.op, tuple(copy_term(arg) for arg in node.args), node.k)
        term = copy_term(value)
        copies.append(new.node(alg.LIN, (term,), (0.0, 1.0)) if term.op == alg.INPUT else term)
    return copies, fixed
