"""Numbers with units, and expressions of them: ``350 mm``, ``-(l1 + l2 + 800 mm)``, ``R * cos(30 deg)``.

Values are kept in mm, rad and s; a dimension is the powers of length, angle and time. Machine files and command lines
are the only places where other units live.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TypeAlias

Dimension: TypeAlias = tuple[int, int, int]  # powers of length, angle and time


@dataclass(frozen=True)
class Kind:
    """What a quantity is expected to be: its dimension, its name, units to propose."""

    dimension: Dimension
    name: str
    units: str

    @property
    def wanted(self) -> str:
        return f"{self.name} ({self.units})" if self.units else self.name


NUMBER = Kind((0, 0, 0), "a number", "")
LENGTH = Kind((1, 0, 0), "a length", "mm, cm, m, in")
ANGLE = Kind((0, 1, 0), "an angle", "deg, rad")
SPEED = Kind((1, 0, -1), "a speed", "mm/s, m/s, mm/min, m/min, in/min")
TURNING = Kind((0, 1, -1), "an angular speed", "deg/s, rad/s, rpm")
ACCELERATION = Kind((1, 0, -2), "an acceleration", "mm/s2, m/s2, in/s2")
SPINNING = Kind((0, 1, -2), "an angular acceleration", "deg/s2, rad/s2")
JERK = Kind((1, 0, -3), "a jerk", "mm/s3, m/s3, in/s3")
ANGULAR_JERK = Kind((0, 1, -3), "an angular jerk", "deg/s3, rad/s3")
_KINDS = {k.dimension: k for k in (NUMBER, LENGTH, ANGLE, SPEED, TURNING, ACCELERATION, SPINNING, JERK, ANGULAR_JERK)}


@dataclass(frozen=True)
class Quantity:
    """A value in mm, rad and s, with its dimension."""

    value: float
    dimension: Dimension = NUMBER.dimension

    @property
    def what(self) -> str:
        """``a length``, ``an angle``, ..., fit for a message."""
        if self.dimension in _KINDS:
            return _KINDS[self.dimension].name
        names = zip(("length", "angle", "time"), self.dimension, strict=True)
        return "a product of dimension " + " ".join(n if p == 1 else f"{n}^{p}" for n, p in names if p)


class QuantityError(ValueError):
    """A quantity that can't be read; one line, without its place."""


class UnreadSizeError(QuantityError):
    """The expression is good, but it needs a size that could not be read: one report of that is enough."""


def _units() -> dict[str, tuple[float, Dimension]]:
    lengths = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "um": 1e-3, "µm": 1e-3}
    angles = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}
    units = {"rpm": (2.0 * math.pi / 60.0, TURNING.dimension)}
    for base, powers in ((lengths, (1, 0)), (angles, (0, 1))):
        for name, factor in base.items():
            units[name] = (factor, (*powers, 0))
            units[f"{name}/s"] = (factor, (*powers, -1))
            units[f"{name}/min"] = (factor / 60.0, (*powers, -1))
            for square in ("/s2", "/s^2", "/s²"):
                units[name + square] = (factor, (*powers, -2))
            for cube in ("/s3", "/s^3", "/s³"):
                units[name + cube] = (factor, (*powers, -3))
    return units


UNITS = _units()


def nearest(word: str, known: Iterable[str], others: str = "") -> str:
    """How a message on an unknown word ends: ``, did you mean "x"?``, else what is expected (``others``: all known)."""
    words = list(known)
    # Long words are cut: difflib's time grows with the square, and nobody misspells forty letters.
    close = [w for w in words if w.lower() == word.lower()] or get_close_matches(word[:40], words, 1)
    if close:
        return f', did you mean "{close[0]}"?'
    others = others or (words[0] if len(words) == 1 else "one of " + ", ".join(words) if words else "")
    return f", expected {others}" if others else ""


def shown(text: object) -> str:
    """A user's text in quotes, on one line, cut if it is long."""
    line = " ".join(str(text).split())
    line = "".join(c if c.isprintable() else "?" for c in line)
    return f'"{line}"' if len(line) <= 60 else f'"{line[:57]}..."'


def quantity(text: str, kind: Kind, names: Mapping[str, Quantity | None] | None = None) -> float:
    """The value of an expression in mm, rad and s; it must be of the kind.

    Raises :class:`QuantityError` if it can't be read, is of another kind or has no unit.
    """
    result = evaluate(text, names)
    if result.dimension == NUMBER.dimension and result.value == 0.0:
        return 0.0  # nought is nought in every unit
    if result.dimension != kind.dimension:
        if result.dimension == NUMBER.dimension and not re.search(r"[^\W\d]", text):
            raise QuantityError(f"{shown(text)} needs a unit: {kind.units}")
        raise QuantityError(f"{shown(text)} is {result.what}, expected {kind.wanted}")
    return result.value


def evaluate(text: str, names: Mapping[str, Quantity | None] | None = None) -> Quantity:
    """The quantity an expression stands for; ``names`` are the sizes it may use (None: one that could not be read).

    Raises :class:`QuantityError`.
    """
    return _Parser(text, names or {}).result()


def is_reserved(name: str) -> bool:
    """Whether a size can't have this name: units and functions have it."""
    return name in _FUNCTIONS or name in _UNIT_WORDS


_UNIT_WORDS = {word for unit in UNITS for word in re.findall(r"[a-z]+", unit)}
_UNIT = "|".join(re.escape(u) for u in sorted(UNITS, key=len, reverse=True))
_TOKEN = re.compile(
    rf"""\s*(?:
        (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)
        (?:\s*(?P<unit>{_UNIT})(?![\w°]))?
      | (?P<name>[^\W\d]\w*)
      | (?P<sign>[-+*/()])
    )""",
    re.VERBOSE,
)


def _sqrt(x: Quantity) -> Quantity:
    if x.value < 0.0:
        raise QuantityError("square root of a negative value")
    if any(p % 2 for p in x.dimension):
        raise QuantityError(f"square root of {x.what}")
    length, angle, time = x.dimension
    return Quantity(math.sqrt(x.value), (length // 2, angle // 2, time // 2))


def _of_angle(function: Callable[[float], float]) -> Callable[[Quantity], Quantity]:
    def call(x: Quantity) -> Quantity:
        if x.dimension != ANGLE.dimension and x != Quantity(0.0):
            raise QuantityError(f"{function.__name__} of {x.what}, expected {ANGLE.wanted}")
        return Quantity(function(x.value))

    return call


_FUNCTIONS: dict[str, Callable[[Quantity], Quantity]] = {
    "sqrt": _sqrt,
    "sin": _of_angle(math.sin),
    "cos": _of_angle(math.cos),
    "tan": _of_angle(math.tan),
}
_DEEPEST = 40  # of brackets: far more than a person writes, far less than Python's stack holds


class _Parser:
    """Recursive descent: sum of products of factors."""

    def __init__(self, text: str, names: Mapping[str, Quantity | None]):
        self.text, self.names, self.at, self.depth = text.rstrip(), names, 0, 0
        if not self.text:
            raise QuantityError("nothing here, expected a number with its unit or an expression")
        if len(text) > 1000:
            raise QuantityError(f"{shown(text)} is too long for an expression")
        self._next()

    def result(self) -> Quantity:
        value = self._sum()
        if self.kind:
            raise self._unexpected()
        return value

    def _next(self) -> None:
        """Take the next token into ``kind``, ``word`` and ``unit``; at the end, ``kind`` is empty."""
        self.kind, self.word, self.unit = "", "", None
        if self.at >= len(self.text):
            return
        match = _TOKEN.match(self.text, self.at)
        if match is None:
            raise QuantityError(f"{shown(self.text)}: can't read {shown(self.text[self.at :].lstrip()[:1])}")
        self.kind = "number" if match["number"] else "name" if match["name"] else "sign"
        self.word, self.unit, self.at = match[self.kind], match["unit"], match.end()

    def _unexpected(self) -> QuantityError:
        found = shown(self.word) if self.kind else "the end"
        return QuantityError(f"{shown(self.text)}: {found} is not expected here")

    def _sum(self) -> Quantity:
        total = self._product()
        while self.kind == "sign" and self.word in "+-":
            sign = self._taken()
            term = self._product()
            if term.dimension != total.dimension:
                deed = "add" if sign == "+" else "subtract"
                raise QuantityError(f"{shown(self.text)}: can't {deed} {total.what} and {term.what}")
            total = self._finite(total.value + (term.value if sign == "+" else -term.value), total.dimension)
        return total

    def _product(self) -> Quantity:
        total = self._factor()
        while self.kind == "sign" and self.word in "*/":
            sign = 1 if self._taken() == "*" else -1
            term = self._factor()
            a, b, c = (p + sign * q for p, q in zip(total.dimension, term.dimension, strict=True))
            if sign < 0 and term.value == 0.0:
                raise QuantityError(f"{shown(self.text)}: division by zero")
            value = total.value * term.value if sign > 0 else total.value / term.value
            total = self._finite(value, (a, b, c))
        return total

    def _factor(self) -> Quantity:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise QuantityError(f"{shown(self.text)} is nested too deeply")
        value = self._unguarded_factor()
        self.depth -= 1
        return value

    def _unguarded_factor(self) -> Quantity:
        if self.kind == "number":
            return self._number()
        if self.kind == "name":
            return self._name()
        sign = self._taken() if self.kind == "sign" and self.word in "+-(" else ""
        if sign == "(":
            return self._closed()
        if sign == "":
            raise self._unexpected()
        value = self._factor()
        return value if sign == "+" else Quantity(-value.value, value.dimension)

    def _number(self) -> Quantity:
        factor, dimension = UNITS[self.unit] if self.unit else (1.0, NUMBER.dimension)
        value, bare = float(self.word) * factor, self.unit is None
        self._next()
        if bare and self.kind == "name":
            end = nearest(self.word, UNITS, "a unit such as mm, in or deg")
            raise QuantityError(f"{shown(self.text)}: unknown unit {shown(self.word)}{end}")
        return self._finite(value, dimension)

    def _name(self) -> Quantity:
        name = self._taken()
        if name in _FUNCTIONS:
            if self._taken() != "(":
                raise QuantityError(f"{shown(self.text)}: {name} needs its argument in brackets")
            argument = self._closed()
            try:
                return _FUNCTIONS[name](argument)
            except QuantityError as error:
                raise QuantityError(f"{shown(self.text)}: {error}") from None
        if name in self.names:
            size = self.names[name]
            if size is None:
                raise UnreadSizeError(name)
            return size
        raise QuantityError(f"{shown(self.text)}: undefined size {shown(name)}{nearest(name, self.names)}")

    def _closed(self) -> Quantity:
        value = self._sum()
        if self._taken() != ")":
            raise QuantityError(f"{shown(self.text)}: a bracket is not closed")
        return value

    def _taken(self) -> str:
        word = self.word
        self._next()
        return word

    def _finite(self, value: float, dimension: Dimension) -> Quantity:
        if not math.isfinite(value):
            raise QuantityError(f"{shown(self.text)} is not a finite value")
        return Quantity(value, dimension)
