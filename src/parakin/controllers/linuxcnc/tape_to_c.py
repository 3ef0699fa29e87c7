"""A tape as straight-line C: the interpreter of descriptions that has no loop, for one pose at a time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isinf

from ...kernels import tape as t
from ...kernels.tape import Tape

# The operations with one result and no constants; the runtime defines what C lacks.
_CALLS = {
    t.DIV: "{0} / {1}",
    t.SQRT: "sqrt({0})",
    t.ATAN2: "angle_of({0}, {1})",
    t.MIN: "lesser({0}, {1})",
    t.MAX: "greater({0}, {1})",
    t.ABS: "fabs({0})",
    t.COPYSIGN: "with_sign({0}, {1})",
    t.SELECT: "{0} < {1} ? {2} : {3}",
}
_SUMS = {t.CONST: 0, t.LIN1: 1, t.LIN2: 2, t.LIN3: 3}
_PRODUCTS = {t.QUAD1: 1, t.QUAD2: 2, t.QUAD3: 3}


@dataclass(frozen=True)
class Vector:
    """A vector of C by its name and length."""

    name: str
    length: int


def function(name: str, tape: Tape, inputs: Sequence[Vector], outputs: Sequence[Vector]) -> str:
    """``static void name(const double *..., double *...)`` that computes the tape's outputs from its inputs."""
    lines, results = _statements(tape, inputs)
    into = [f"{vector.name}[{i}]" for vector in outputs for i in range(vector.length)]
    lines += [f"    {place} = {value};" for place, value in zip(into, results, strict=True)]
    arguments = [f"const double *{vector.name}" for vector in inputs] + [f"double *{vector.name}" for vector in outputs]
    return _definition(f"static void {name}({', '.join(arguments)})", lines, inputs)


def test(name: str, tape: Tape, inputs: Sequence[Vector]) -> str:
    """``static int name(const double *...)``: whether all outputs of the tape are ≥ 0; NaN is not."""
    lines, results = _statements(tape, inputs)
    conditions = [f"{value} >= 0.0" for value in results] or ["1"]
    lines.append("    return " + "\n        && ".join(conditions) + ";")
    return _definition(f"static int {name}({', '.join(f'const double *{v.name}' for v in inputs)})", lines, inputs)


def number(value: float) -> str:
    """A constant of C that is exactly this double."""
    if isinf(value):
        return "HUGE_VAL" if value > 0.0 else "-HUGE_VAL"
    return repr(float(value))


def _definition(head: str, lines: Sequence[str], inputs: Sequence[Vector]) -> str:
    body = "\n".join(lines)
    unused = [f"    (void){vector.name};" for vector in inputs if f"{vector.name}[" not in body]
    return "\n".join([head, "{", *unused, *lines, "}", ""])


def _statements(tape: Tape, inputs: Sequence[Vector]) -> tuple[list[str], list[str]]:
    """One statement an operation, each with a name of its own, and the names of the outputs.

    A tape's registers are used again and again; a name is not, so that the compiler sees what depends on what.
    """
    names = dict(enumerate(f"{vector.name}[{i}]" for vector in inputs for i in range(vector.length)))
    values: dict[str, str] = {}

    def let(register: int, expression: str) -> None:
        names[register] = f"t{len(values)}"
        values[names[register]] = expression

    for row, constants in zip(tape.code.tolist(), tape.constants.tolist(), strict=True):
        operation, target, *operands = row
        if operation == t.SINCOS:
            argument = names[operands[1]]
            let(target, f"sin({argument})")
            let(operands[0], f"cos({argument})")
        else:
            let(target, _expression(operation, [names.get(operand, "") for operand in operands], constants))
    results = [names[tape.inputs + i] for i in range(tape.outputs)]
    wanted = set(results)  # of a sine and a cosine one may not be
    for name, value in reversed(values.items()):
        if name in wanted:
            wanted.update(re.findall(r"\bt\d+\b", value))
    return [f"    const double {name} = {value};" for name, value in values.items() if name in wanted], results


def _expression(operation: int, a: Sequence[str], k: Sequence[float]) -> str:
    if operation in _SUMS:
        terms = [_times(factor, name) for factor, name in zip(k[1:], a[: _SUMS[operation]], strict=False)]
        return _sum([number(k[0]), *terms] if k[0] != 0.0 or not terms else terms)
    if operation in _PRODUCTS:
        pairs = [f"{a[2 * i]} * {a[2 * i + 1]}" for i in range(_PRODUCTS[operation])]
        return _sum([_times(factor, pair) for factor, pair in zip(k, pairs, strict=False)])
    if operation == t.FMA:
        terms = [_times(k[0], f"{a[0]} * {a[1]}"), _times(k[1], a[2])]
        return _sum([*terms, number(k[2])] if k[2] != 0.0 else terms)
    return _CALLS[operation].format(*a)


def _times(factor: float, name: str) -> str:
    if abs(factor) == 1.0:
        return name if factor > 0.0 else f"-{name}"
    return f"{number(factor)} * {name}"


def _sum(terms: Sequence[str]) -> str:
    return terms[0] + "".join(f" - {term[1:]}" if term.startswith("-") else f" + {term}" for term in terms[1:])
