"""Write a tape as straight-line C: an interpreter of descriptions without loops, for one pose at a time."""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels import tape as t
from ...kernels.tape import Tape
from ...kernels.tape_text import InputVector, Language, list_statements

# The runtime defines what C lacks.
C = Language(
    {
        t.SINCOS: "sine({0}) cosine({0})",
        t.DIV: "{0} / {1}",
        t.SQRT: "sqrt({0})",
        t.ATAN2: "angle_of({0}, {1})",
        t.MIN: "lesser({0}, {1})",
        t.MAX: "greater({0}, {1})",
        t.ABS: "fabs({0})",
        t.COPYSIGN: "with_sign({0}, {1})",
        t.SELECT: "{0} < {1} ? {2} : {3}",
    },
    "HUGE_VAL",
)


def write_function(name: str, tape: Tape, inputs: Sequence[InputVector], outputs: Sequence[InputVector]) -> str:
    """Write ``void name(const double *..., double *...)``, which computes the tape's outputs from its inputs."""
    lines, results = _write_statements(tape, inputs)
    into = [f"{vector.name}[{i}]" for vector in outputs for i in range(vector.length)]
    lines += [f"    {place} = {value};" for place, value in zip(into, results, strict=True)]
    arguments = [f"const double *{vector.name}" for vector in inputs] + [f"double *{vector.name}" for vector in outputs]
    return _write_definition(f"MODEL void {name}({', '.join(arguments)})", lines, inputs)


def write_test(name: str, tape: Tape, inputs: Sequence[InputVector]) -> str:
    """Write ``int name(const double *...)``: whether all outputs of the tape are ≥ 0; NaN is not."""
    lines, results = _write_statements(tape, inputs)
    conditions = [f"{value} >= 0.0" for value in results] or ["1"]
    lines.append("    return " + "\n        && ".join(conditions) + ";")
    return _write_definition(f"MODEL int {name}({', '.join(f'const double *{v.name}' for v in inputs)})", lines, inputs)


def format_c(value: float) -> str:
    """Format a constant of C that is exactly this double."""
    return C.format_constant(value)


def _write_definition(head: str, lines: Sequence[str], inputs: Sequence[InputVector]) -> str:
    body = "\n".join(lines)
    unused = [f"    (void){vector.name};" for vector in inputs if f"{vector.name}[" not in body]
    return "\n".join([head, "{", *unused, *lines, "}", ""])


def _write_statements(tape: Tape, inputs: Sequence[InputVector]) -> tuple[list[str], list[str]]:
    """Write the statements of C; return them and the names of the outputs."""
    statements, results = list_statements(tape, inputs, C)
    return [f"    const double {name} = {value};" for name, value in statements], results
