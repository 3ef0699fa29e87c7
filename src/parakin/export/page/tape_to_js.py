"""Write a tape as straight-line JavaScript: an interpreter of descriptions without loops, for one pose at a time."""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels import tape as t
from ...kernels.tape import Tape
from ...kernels.tape_text import InputVector, Language, list_statements

# elementary.js defines what JavaScript lacks.
JAVASCRIPT = Language(
    {
        t.SINCOS: "sin({0}) cos({0})",
        t.DIV: "{0} / {1}",
        t.SQRT: "sqrt({0})",
        t.ATAN2: "angleOf({0}, {1})",
        t.MIN: "lesser({0}, {1})",
        t.MAX: "greater({0}, {1})",
        t.ABS: "abs({0})",
        t.COPYSIGN: "withSign({0}, {1})",
        t.SELECT: "{0} < {1} ? {2} : {3}",
    },
    "Infinity",
)


def write_function(name: str, tape: Tape, inputs: Sequence[InputVector], shared: Sequence[InputVector]) -> str:
    """Write ``function name(vectors of inputs)``, which returns the tape's outputs as an array.

    The tape's last inputs are vectors that all functions share, by their names.
    """
    statements, results = list_statements(tape, [*inputs, *shared], JAVASCRIPT)
    arguments = ", ".join(vector.name for vector in inputs)
    constants = ",\n".join(f"{name}={value.replace(' ', '')}" for name, value in statements)
    body = f"const {constants};\n" if constants else ""
    return f"function {name}({arguments}) {{\n{body}return [{','.join(results)}];\n}}\n"
