"""What each operation of a tape means, on lanes of any kind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from . import tape as t
from .elementary import Lane, Lanes
from .tape import Tape


def _scale(k: float, x: Lane) -> Lane:
    return x if k == 1.0 else -x if k == -1.0 else k * x


def _add_products(pairs: Sequence[tuple[float, Lane, Lane]], constant: float) -> Lane:
    """Compute Σ k·a·b + constant, from the last summand to the first."""
    total: Lane = None if constant == 0.0 else constant
    for k, a, b in reversed(pairs):
        product = _scale(k, a) * b
        total = product if total is None else product + total
    return total


def _add_multiples(pairs: Sequence[tuple[float, Lane]], constant: float) -> Lane:
    """Compute constant + Σ k·a, from the first summand to the last."""
    total: Lane = None if constant == 0.0 else constant
    for k, a in pairs:
        total = _scale(k, a) if total is None else total - a if k == -1.0 else total + _scale(k, a)
    return total


def _copy_sign(lanes: Lanes, x: Lane, y: Lane) -> Lane:
    return lanes.select(y < 0.0, -abs(x), abs(x)) + 0.0 * y


_FUNCTIONS: dict[int, Callable[..., Any]] = {
    t.SQRT: lambda lanes, x: lanes.sqrt(x),
    t.DIV: lambda lanes, x, y: x / y,
    t.ATAN2: lambda lanes, y, x: lanes.atan2(y, x),
    t.MIN: lambda lanes, x, y: lanes.select((x < y) | (x != x), x, y),
    t.MAX: lambda lanes, x, y: lanes.select((x > y) | (x != x), x, y),
    t.ABS: lambda lanes, x: abs(x),
    t.COPYSIGN: _copy_sign,
    t.SELECT: lambda lanes, x, y, below, otherwise: lanes.select(x < y, below, otherwise),
}
_OPERANDS = {t.SQRT: 1, t.ABS: 1, t.SELECT: 4}  # two for the others


def run_operations(lanes: Lanes, tape: Tape, registers: dict[int, Lane], start: int, stop: int) -> None:
    """Run the tape's operations from ``start`` to ``stop`` on its registers, in place."""
    for row, k in zip(tape.code[start:stop].tolist(), tape.constants[start:stop].tolist(), strict=True):
        op, target, operands = row[0], row[1], row[2:]
        if op == t.SINCOS:
            registers[target], registers[operands[0]] = lanes.sincos(registers[operands[1]])
            continue
        if op == t.CONST:
            value = lanes.constant(k[0])
        elif op in (t.LIN1, t.LIN2, t.LIN3):
            value = _add_multiples([(k[1 + i], registers[operands[i]]) for i in range(op - t.CONST)], k[0])
        elif op in (t.QUAD1, t.QUAD2, t.QUAD3):
            a = [registers[number] for number in operands[: 2 * (op - t.QUAD1 + 1)]]
            value = _add_products([(k[i], a[2 * i], a[2 * i + 1]) for i in range(len(a) // 2)], k[3])
        elif op == t.FMA:
            a, b, c = (registers[number] for number in operands[:3])
            value = _scale(k[0], a) * b + _add_multiples([(k[1], c)], k[2])
        else:
            value = _FUNCTIONS[op](lanes, *[registers[number] for number in operands[: _OPERANDS.get(op, 2)]])
        registers[target] = value


def evaluate(lanes: Lanes, tape: Tape, inputs: Sequence[Lane]) -> list[Lane]:
    """Evaluate a tape's outputs for lanes of inputs."""
    registers = dict(enumerate(inputs))
    run_operations(lanes, tape, registers, 0, len(tape.code))
    return [registers[tape.inputs + i] for i in range(tape.outputs)]
