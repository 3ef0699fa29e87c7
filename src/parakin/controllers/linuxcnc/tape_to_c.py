"""Write a tape as straight-line C: an interpreter of descriptions without loops, for one pose at a time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isinf

from ...kernels import tape as t
from ...kernels.tape import Tape

# The operations without constants; the runtime defines what C lacks. A sine and a cosine are two results, by two words.
CALLS = {
    t.SINCOS: "sine({0}) cosine({0})",
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
class CVector:
    """A vector of C by its name and length."""

    name: str
    length: int


def write_function(name: str, tape: Tape, inputs: Sequence[CVector], outputs: Sequence[CVector]) -> str:
    """Write ``void name(const double *..., double *...)``, which computes the tape's outputs from its inputs."""
    lines, results = _write_statements(tape, inputs)
    into = [f"{vector.name}[{i}]" for vector in outputs for i in range(vector.length)]
    lines += [f"    {place} = {value};" for place, value in zip(into, results, strict=True)]
    arguments = [f"const double *{vector.name}" for vector in inputs] + [f"double *{vector.name}" for vector in outputs]
    return _write_definition(f"MODEL void {name}({', '.join(arguments)})", lines, inputs)


def write_test(name: str, tape: Tape, inputs: Sequence[CVector]) -> str:
    """Write ``int name(const double *...)``: whether all outputs of the tape are ≥ 0; NaN is not."""
    lines, results = _write_statements(tape, inputs)
    conditions = [f"{value} >= 0.0" for value in results] or ["1"]
    lines.append("    return " + "\n        && ".join(conditions) + ";")
    return _write_definition(f"MODEL int {name}({', '.join(f'const double *{v.name}' for v in inputs)})", lines, inputs)


def format_c(value: float) -> str:
    """Format a constant of C that is exactly this double."""
    if isinf(value):
        return "HUGE_VAL" if value > 0.0 else "-HUGE_VAL"
    return repr(float(value))


def _write_definition(head: str, lines: Sequence[str], inputs: Sequence[CVector]) -> str:
    body = "\n".join(lines)
    unused = [f"    (void){vector.name};" for vector in inputs if f"{vector.name}[" not in body]
    return "\n".join([head, "{", *unused, *lines, "}", ""])


def _write_statements(tape: Tape, inputs: Sequence[CVector]) -> tuple[list[str], list[str]]:
    """Write the statements of C; return them and the names of the outputs."""
    statements, results = list_statements(tape, inputs)
    return [f"    const double {name} = {value};" for name, value in statements], results


def list_statements(
    tape: Tape, inputs: Sequence[CVector], calls: Mapping[int, str] = CALLS
) -> tuple[list[tuple[str, str]], list[str]]:
    """List names and expressions, one for each operation; return them and the names of the outputs.

    A tape reuses its registers; the names are not reused, so that the compiler sees what depends on what. ``calls`` are
    the operations that another language writes in another way.
    """
    names = dict(enumerate(f"{vector.name}[{i}]" for vector in inputs for i in range(vector.length)))
    values: dict[str, str] = {}

    def let(register: int, expression: str) -> None:
        names[register] = f"t{len(values)}"
        values[names[register]] = expression

    for row, constants in zip(tape.code.tolist(), tape.constants.tolist(), strict=True):
        operation, target, *operands = row
        if operation == t.SINCOS:
            sine, cosine = calls[operation].format(names[operands[1]]).split()
            let(target, sine)
            let(operands[0], cosine)
        else:
            operand_names = [names.get(operand, "") for operand in operands]
            let(target, _write_expression(operation, operand_names, constants, calls))
    results = [names[tape.inputs + i] for i in range(tape.outputs)]
    wanted = set(results)  # a sine or a cosine may be computed in vain
    for name, value in reversed(values.items()):
        if name in wanted:
            wanted.update(re.findall(r"\bt\d+\b", value))
    return [(name, value) for name, value in values.items() if name in wanted], results


def _write_expression(operation: int, a: Sequence[str], k: Sequence[float], calls: Mapping[int, str]) -> str:
    if operation in _SUMS:
        terms = [_write_product(factor, name) for factor, name in zip(k[1:], a[: _SUMS[operation]], strict=False)]
        return _write_sum([format_c(k[0]), *terms] if k[0] != 0.0 or not terms else terms)
    if operation in _PRODUCTS:
        pairs = [f"{a[2 * i]} * {a[2 * i + 1]}" for i in range(_PRODUCTS[operation])]
        terms = [_write_product(factor, pair) for factor, pair in zip(k, pairs, strict=False)]
        return _write_sum([*terms, format_c(k[3])] if k[3] != 0.0 else terms)
    if operation == t.FMA:
        terms = [_write_product(k[0], f"{a[0]} * {a[1]}"), _write_product(k[1], a[2])]
        return _write_sum([*terms, format_c(k[2])] if k[2] != 0.0 else terms)
    return calls[operation].format(*a)


def _write_product(factor: float, name: str) -> str:
    if abs(factor) == 1.0:
        return name if factor > 0.0 else f"-{name}"
    return f"{format_c(factor)} * {name}"


def _write_sum(terms: Sequence[str]) -> str:
    return terms[0] + "".join(f" - {term[1:]}" if term.startswith("-") else f" + {term}" for term in terms[1:])
