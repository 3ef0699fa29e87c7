"""List a tape's operations as the names and expressions of a language: straight-line code for one pose at a time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isinf

from . import tape as t
from .tape import Tape

_SUMS = {t.CONST: 0, t.LIN1: 1, t.LIN2: 2, t.LIN3: 3}
_PRODUCTS = {t.QUAD1: 1, t.QUAD2: 2, t.QUAD3: 3}


@dataclass(frozen=True)
class Language:
    """How a language writes what differs between languages.

    calls : a template for each operation without constants; that of SINCOS is two words, the sine and the cosine
    infinity : the constant
    """

    calls: Mapping[int, str]
    infinity: str

    def format_constant(self, value: float) -> str:
        """Format a constant that is exactly this double."""
        if isinf(value):
            return self.infinity if value > 0.0 else f"-{self.infinity}"
        return repr(float(value))


@dataclass(frozen=True)
class InputVector:
    """A vector of inputs by its name and length; a vector of outputs likewise."""

    name: str
    length: int


def list_statements(
    tape: Tape, inputs: Sequence[InputVector], language: Language
) -> tuple[list[tuple[str, str]], list[str]]:
    """List names and expressions, one for each operation; return them and the names of the outputs.

    A tape reuses its registers; the names are not reused, so that a compiler sees what depends on what.
    """
    names = dict(enumerate(f"{vector.name}[{i}]" for vector in inputs for i in range(vector.length)))
    values: dict[str, str] = {}

    def let(register: int, expression: str) -> None:
        names[register] = f"t{len(values)}"
        values[names[register]] = expression

    for row, constants in zip(tape.code.tolist(), tape.constants.tolist(), strict=True):
        operation, target, *operands = row
        if operation == t.SINCOS:
            sine, cosine = language.calls[operation].format(names[operands[1]]).split()
            let(target, sine)
            let(operands[0], cosine)
        else:
            operand_names = [names.get(operand, "") for operand in operands]
            let(target, _write_expression(operation, operand_names, constants, language))
    results = [names[tape.inputs + i] for i in range(tape.outputs)]
    wanted = set(results)  # a sine or a cosine may be computed in vain
    for name, value in reversed(values.items()):
        if name in wanted:
            wanted.update(re.findall(r"\bt\d+\b", value))
    return [(name, value) for name, value in values.items() if name in wanted], results


def _write_expression(operation: int, a: Sequence[str], k: Sequence[float], language: Language) -> str:
    number = language.format_constant
    if operation in _SUMS:
        factors = zip(k[1:], a[: _SUMS[operation]], strict=False)
        terms = [_write_product(factor, name, language) for factor, name in factors]
        return _write_sum([number(k[0]), *terms] if k[0] != 0.0 or not terms else terms)
    if operation in _PRODUCTS:
        pairs = [f"{a[2 * i]} * {a[2 * i + 1]}" for i in range(_PRODUCTS[operation])]
        terms = [_write_product(factor, pair, language) for factor, pair in zip(k, pairs, strict=False)]
        return _write_sum([*terms, number(k[3])] if k[3] != 0.0 else terms)
    if operation == t.FMA:
        terms = [_write_product(k[0], f"{a[0]} * {a[1]}", language), _write_product(k[1], a[2], language)]
        return _write_sum([*terms, number(k[2])] if k[2] != 0.0 else terms)
    return language.calls[operation].format(*a)


def _write_product(factor: float, name: str, language: Language) -> str:
    if abs(factor) == 1.0:
        return name if factor > 0.0 else f"-{name}"
    return f"{language.format_constant(factor)} * {name}"


def _write_sum(terms: Sequence[str]) -> str:
    return terms[0] + "".join(f" - {term[1:]}" if term.startswith("-") else f" + {term}" for term in terms[1:])
