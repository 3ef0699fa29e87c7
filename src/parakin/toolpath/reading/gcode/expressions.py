"""Evaluate the expressions of RS274/NGC: numbers, [...], functions, parameters. Errors name no file and no line."""

import math
import operator
import re
from collections.abc import Callable
from typing import Protocol

from ..text import quote_short, refuse

Key = int | str  # a parameter's number, or its name in lower case without blanks

DEEPEST = 40  # brackets, functions and signs within one another
_EQUAL = 1e-4  # numbers as near as that are EQ, as LinuxCNC has it
_WHOLE = 1e-4  # so far off a whole number may a parameter's number be, as LinuxCNC has it
_BLANKS = re.compile(r"[ \t]*")
_NUMBER = re.compile(r"[+-]?[ \t]*(?:\d[\d \t]*(?:\.[\d \t]*)?|\.[ \t]*\d[\d \t]*)", re.ASCII)
_NAME = re.compile(r"<([^<>]*)>")
_FUNCTION = re.compile(r"((?:[A-Za-z][ \t]*)+)(?=\[)")
_OPERATOR = re.compile(r"\*[ \t]*\*|[-+*/\]]|(?:[A-Za-z][ \t]*){2,3}")


class ParameterStore(Protocol):
    """What an expression asks for."""

    def read(self, key: Key) -> float:
        """Return a parameter's value; refuse one that is not known."""

    def exists(self, key: Key) -> bool:
        """Tell whether a parameter has a value."""


def read_value(text: str, at: int, store: ParameterStore, depth: int = 0) -> tuple[float, int]:
    """Evaluate the value that begins at ``at``: a number, [...], a parameter, a function, each with a sign or none.

    Returns the value and where the text goes on.
    """
    at = skip_blanks(text, at)
    if depth > DEEPEST:
        refuse(f"an expression of more than {DEEPEST} levels; expected a simpler one")
    sign = text[at : at + 1]
    number = _NUMBER.match(text, at)
    if number is not None:
        return float("".join(number[0].split())), number.end()
    if sign == "[":
        return _read_brackets(text, at + 1, store, depth + 1)
    if sign == "#":
        key, at = read_key(text, at + 1, store, depth + 1)
        return store.read(key), at
    if sign in ("+", "-"):
        value, at = read_value(text, at + 1, store, depth + 1)
        return (-value if sign == "-" else value), at
    function = _FUNCTION.match(text, at)
    if function is None:
        refuse(
            f"{quote_short(text[at:])}: expected a number, a parameter or an expression"
            if sign
            else "a value is missing"
        )
    return _read_function("".join(function[1].split()).upper(), text, function.end() + 1, store, depth + 1)


def read_key(text: str, at: int, store: ParameterStore, depth: int = 0) -> tuple[Key, int]:
    """Read what follows #: a name in angle brackets, or a value that is a whole number."""
    at = skip_blanks(text, at)
    name = _NAME.match(text, at)
    if name is not None:
        return "".join(name[1].split()).lower(), name.end()
    value, at = read_value(text, at, store, depth)
    if not abs(value - round(value)) <= _WHOLE:
        refuse(f"#{value:g}: expected a whole number of a parameter")
    return round(value), at


def skip_blanks(text: str, at: int) -> int:
    """Return where the blanks at ``at`` end."""
    match = _BLANKS.match(text, at)
    return match.end() if match else at


def _read_brackets(text: str, at: int, store: ParameterStore, depth: int) -> tuple[float, int]:
    """Evaluate an expression up to its closing bracket: operators of one rank from the left, the stronger first."""
    values: list[float] = []
    operators: list[str] = []
    while True:
        value, at = read_value(text, at, store, depth)
        values.append(value)
        at = skip_blanks(text, at)
        match = _OPERATOR.match(text, at)
        name = "".join(match[0].split()).upper() if match else ""
        if name not in _RANKS:
            name = next((known for known in ("OR", "EQ", "NE", "GT", "GE", "LT", "LE") if name.startswith(known)), "")
        if match is None or not name:
            refuse("an expression without an end" if at == len(text) else f"{quote_short(text[at:])}: no operator")
        at = _skip_letters(text, at, len(name))
        while operators and _RANKS[operators[-1]] >= _RANKS[name]:
            right, left = values.pop(), values.pop()
            values.append(_check_finite(_OPERATIONS[operators.pop()](left, right)))
        if name == "]":
            return values[0], at
        operators.append(name)


def _skip_letters(text: str, at: int, count: int) -> int:
    """Return where ``count`` characters other than blanks have passed."""
    while count:
        count -= text[at] not in " \t"
        at += 1
    return at


def _read_function(name: str, text: str, at: int, store: ParameterStore, depth: int) -> tuple[float, int]:
    """Evaluate a function; ``at`` stands behind its opening bracket. Angles are degrees."""
    if name == "EXISTS":
        at = skip_blanks(text, at)
        parameter = _NAME.match(text, at + 1)
        end = skip_blanks(text, parameter.end()) if parameter else at
        if text[at : at + 1] != "#" or parameter is None or text[end : end + 1] != "]":
            refuse("EXISTS expected a named parameter, as in EXISTS[#<name>]")
        return float(store.exists("".join(parameter[1].split()).lower())), end + 1
    if name != "ATAN" and name not in _FUNCTIONS:
        refuse(f"{quote_short(name)}: no function of RS274/NGC")
    value, at = _read_brackets(text, at, store, depth)
    if name == "ATAN":
        at = skip_blanks(text, at)
        behind = skip_blanks(text, at + 1)
        if text[at : at + 1] != "/" or text[behind : behind + 1] != "[":
            refuse("ATAN expected two values, as in ATAN[1]/[2]")
        across, at = _read_brackets(text, behind + 1, store, depth)
        return math.degrees(math.atan2(value, across)), at
    try:
        return _check_finite(_FUNCTIONS[name](value)), at
    except (ValueError, OverflowError):
        refuse(f"{name}[{value:g}] has no value")


def _check_finite(value: float) -> float:
    if not math.isfinite(value):
        refuse("an expression whose value is out of range")
    return value


def _divide_numbers(left: float, right: float) -> float:
    if right == 0.0:
        refuse("a division by zero")
    return left / right


def _find_remainder(left: float, right: float) -> float:
    if right == 0.0:
        refuse("MOD by zero")
    rest = math.fmod(left, right)
    return rest + abs(right) if rest < 0.0 else rest


def _raise_power(left: float, right: float) -> float:
    if (left < 0.0 and right != math.floor(right)) or (left == 0.0 and right < 0.0):
        refuse(f"{left:g}**{right:g} has no value")
    try:
        return float(left**right)
    except OverflowError:
        return math.inf


def _round_half_away(value: float) -> float:
    return float(math.floor(value + 0.5) if value >= 0.0 else math.ceil(value - 0.5))


_RANKS = (
    {"]": 1}
    | dict.fromkeys(("AND", "OR", "XOR"), 2)
    | dict.fromkeys(("EQ", "NE", "GT", "GE", "LT", "LE"), 3)
    | dict.fromkeys("+-", 4)
    | dict.fromkeys(("*", "/", "MOD"), 5)
    | {"**": 6}
)
_OPERATIONS: dict[str, Callable[[float, float], float]] = {
    "AND": lambda left, right: float(left != 0.0 and right != 0.0),
    "OR": lambda left, right: float(left != 0.0 or right != 0.0),
    "XOR": lambda left, right: float((left != 0.0) != (right != 0.0)),
    "EQ": lambda left, right: float(abs(left - right) < _EQUAL),
    "NE": lambda left, right: float(abs(left - right) >= _EQUAL),
    "GT": lambda left, right: float(left > right),
    "GE": lambda left, right: float(left >= right),
    "LT": lambda left, right: float(left < right),
    "LE": lambda left, right: float(left <= right),
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _divide_numbers,
    "MOD": _find_remainder,
    "**": _raise_power,
}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": lambda value: math.degrees(math.acos(value)),
    "ASIN": lambda value: math.degrees(math.asin(value)),
    "COS": lambda value: math.cos(math.radians(value)),
    "EXP": math.exp,
    "FIX": lambda value: float(math.floor(value)),
    "FUP": lambda value: -float(math.floor(-value)) if value else value,  # keeps the sign of zero
    "LN": math.log,
    "ROUND": _round_half_away,
    "SIN": lambda value: math.sin(math.radians(value)),
    "SQRT": math.sqrt,
    "TAN": lambda value: math.tan(math.radians(value)),
}
