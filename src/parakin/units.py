"""Numbers with units, and expressions of them: ``350 mm``, ``-(l1 + l2 + 800 mm)``, ``R * cos(30 deg)``.

Values are in mm, rad, s and N (so masses are in t); a dimension is the powers of length, angle, time and force. Only
machine files and command lines use other units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from .errors import quote, suggest

INCH = 25.4  # mm
# Units of a pose's axes and a frame's values, ISO 841.
AXIS_UNITS = {"X": "mm", "Y": "mm", "Z": "mm", "A": "rad", "B": "rad", "C": "rad"}

Dimension: TypeAlias = tuple[int, int, int, int]  # powers of length, angle, time and force


@dataclass(frozen=True)
class QuantityKind:
    """An expected kind of quantity: its dimension, its name for messages, and units to propose."""

    dimension: Dimension
    name: str
    units: str

    @property
    def wanted(self) -> str:
        return f"{self.name} ({self.units})" if self.units else self.name


NUMBER = QuantityKind((0, 0, 0, 0), "a number", "")
LENGTH = QuantityKind((1, 0, 0, 0), "a length", "mm, cm, m, in")
VOLUME = QuantityKind((3, 0, 0, 0), "a volume", "mm**3")
ANGLE = QuantityKind((0, 1, 0, 0), "an angle", "deg, rad")
TIME = QuantityKind((0, 0, 1, 0), "a time", "s, min")
SPEED = QuantityKind((1, 0, -1, 0), "a speed", "mm/s, m/s, mm/min, m/min, in/min")
ANGULAR_SPEED = QuantityKind((0, 1, -1, 0), "an angular speed", "deg/s, rad/s, rpm")
ACCELERATION = QuantityKind((1, 0, -2, 0), "an acceleration", "mm/s2, m/s2, in/s2")
ANGULAR_ACCELERATION = QuantityKind((0, 1, -2, 0), "an angular acceleration", "deg/s2, rad/s2")
JERK = QuantityKind((1, 0, -3, 0), "a jerk", "mm/s3, m/s3, in/s3")
ANGULAR_JERK = QuantityKind((0, 1, -3, 0), "an angular jerk", "deg/s3, rad/s3")
FORCE = QuantityKind((0, 0, 0, 1), "a force", "N, kN")
TORQUE = QuantityKind((1, 0, 0, 1), "a torque", "Nm, Nmm")
POWER = QuantityKind((1, 0, -1, 1), "a power", "W, kW")
MASS = QuantityKind((-1, 0, 2, 1), "a mass", "kg, g, t")
INERTIA = QuantityKind((1, 0, 2, 1), "a moment of inertia", "kg m2, g m2")
DENSITY = QuantityKind((-4, 0, 2, 1), "a density", "kg/m3, g/cm3")
STIFFNESS = QuantityKind((-1, 0, 0, 1), "a stiffness", "N/um, kN/mm, N/mm")
ANGULAR_STIFFNESS = QuantityKind((1, -1, 0, 1), "an angular stiffness", "Nm/rad, kNm/rad")
MODULUS = QuantityKind((-2, 0, 0, 1), "a modulus of elasticity", "GPa, MPa")
_STRAIGHT = (LENGTH, SPEED, ACCELERATION, JERK)
_ANGULAR = (ANGLE, ANGULAR_SPEED, ANGULAR_ACCELERATION, ANGULAR_JERK)
_LOADS = (FORCE, TORQUE, POWER, MASS, INERTIA, DENSITY, STIFFNESS, ANGULAR_STIFFNESS, MODULUS)
_KINDS = {kind.dimension: kind for kind in (NUMBER, TIME, *_STRAIGHT, *_ANGULAR, *_LOADS)}


@dataclass(frozen=True)
class Quantity:
    """A value in mm, rad, s and N, with its dimension."""

    value: float
    dimension: Dimension = NUMBER.dimension

    @property
    def what(self) -> str:
        """The kind's name for a message: ``a length``, ``an angle``, ..."""
        if self.dimension in _KINDS:
            return _KINDS[self.dimension].name
        names = zip(("length", "angle", "time", "force"), self.dimension, strict=True)
        return "a product of dimension " + " ".join(n if p == 1 else f"{n}^{p}" for n, p in names if p)


class QuantityError(ValueError):
    """A quantity that can't be read; one line, without file and line."""


class UnreadSizeError(QuantityError):
    """A valid expression uses a size that could not be read, which has been reported already."""


def _build_units() -> dict[str, tuple[float, Dimension]]:
    lengths = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": INCH, "um": 1e-3, "µm": 1e-3}
    angles = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}
    units = {"rpm": (2.0 * math.pi / 60.0, ANGULAR_SPEED.dimension)}
    units |= {"s": (1.0, TIME.dimension), "min": (60.0, TIME.dimension)}
    for base, powers in ((lengths, (1, 0)), (angles, (0, 1))):
        for name, factor in base.items():
            units[name] = (factor, (*powers, 0, 0))
            units[f"{name}/s"] = (factor, (*powers, -1, 0))
            units[f"{name}/min"] = (factor / 60.0, (*powers, -1, 0))
            for square in ("/s2", "/s^2", "/s²"):
                units[name + square] = (factor, (*powers, -2, 0))
            for cube in ("/s3", "/s^3", "/s³"):
                units[name + cube] = (factor, (*powers, -3, 0))
    return units


def _build_load_units() -> dict[str, tuple[float, Dimension]]:
    factors: dict[QuantityKind, dict[str, float]] = {
        FORCE: {"N": 1.0, "kN": 1e3, "MN": 1e6},
        TORQUE: {"Nmm": 1.0, "Nm": 1e3, "kNm": 1e6},
        POWER: {"W": 1e3, "kW": 1e6, "Nmm/s": 1.0},
        MASS: {"kg": 1e-3, "g": 1e-6, "t": 1.0},
        INERTIA: {"kg m2": 1e3, "kgm2": 1e3, "kg m²": 1e3, "g m2": 1.0, "kg mm2": 1e-3, "t mm2": 1.0},
        DENSITY: {"kg/m3": 1e-12, "kg/m³": 1e-12, "g/cm3": 1e-9, "t/mm3": 1.0},
        STIFFNESS: {"N/um": 1e3, "N/µm": 1e3, "kN/um": 1e6, "kN/mm": 1e3, "MN/m": 1e3, "N/mm": 1.0, "N/m": 1e-3},
        ANGULAR_STIFFNESS: {"Nm/rad": 1e3, "kNm/rad": 1e6, "Nmm/rad": 1.0},
        MODULUS: {"GPa": 1e3, "MPa": 1.0, "N/mm2": 1.0},
    }
    factors[ANGULAR_STIFFNESS] |= {f"{name}/deg": math.degrees(factors[TORQUE][name]) for name in ("Nm", "kNm")}
    return {name: (factor, kind.dimension) for kind, names in factors.items() for name, factor in names.items()}


_MOTION_UNITS = _build_units()
UNITS = _MOTION_UNITS | _build_load_units()  # factor to mm, rad, s and N, and dimension, by name


LONGEST = 1e6  # mm, 1 km: far beyond any machine, and small enough that no result overflows


def parse_quantity(text: str, kind: QuantityKind, names: Mapping[str, Quantity | None] | None = None) -> float:
    """Evaluate an expression that must be of a kind; return its value in mm, rad and s. A bare 0 needs no unit.

    Raises :class:`QuantityError` if it can't be read, is of another kind or has no unit.
    """
    result = evaluate_expression(text, names)
    if result.dimension == NUMBER.dimension and result.value == 0.0:
        return 0.0  # zero in every unit
    if result.dimension != kind.dimension:
        if result.dimension == NUMBER.dimension and not re.search(r"[^\W\d]", text):
            raise QuantityError(f"{quote(text)} needs a unit: {kind.units}")
        raise QuantityError(f"{quote(text)} is {result.what}, expected {kind.wanted}")
    return result.value


def evaluate_expression(text: str, names: Mapping[str, Quantity | None] | None = None) -> Quantity:
    """Evaluate an expression of numbers, units and named sizes; a size of None could not be read.

    Raises :class:`QuantityError`.
    """
    return _ExpressionParser(text, names).parse()


def to_display(value: float, unit: str) -> float:
    """Convert a value in mm or rad to mm or degrees; any other unit stays."""
    return math.degrees(value) if unit == "rad" else value


def name_display_unit(unit: str) -> str:
    """Name the unit on a display: ``deg`` for ``rad``."""
    return "deg" if unit == "rad" else unit


def is_reserved(name: str) -> bool:
    """Tell whether a unit or a function has this name, so that a size can't have it."""
    return name in _FUNCTIONS or name in _UNIT_WORDS


_UNIT_WORDS = {word for unit in _MOTION_UNITS for word in re.findall(r"[a-z]+", unit)}
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
    length, angle, time, force = x.dimension
    return Quantity(math.sqrt(x.value), (length // 2, angle // 2, time // 2, force // 2))


def _accept_angle(function: Callable[[float], float]) -> Callable[[Quantity], Quantity]:
    """Make a function of a quantity from a function of an angle; a bare 0 is accepted too."""

    def call(x: Quantity) -> Quantity:
        if x.dimension != ANGLE.dimension and x != Quantity(0.0):
            raise QuantityError(f"{function.__name__} of {x.what}, expected {ANGLE.wanted}")
        return Quantity(function(x.value))

    return call


_FUNCTIONS: dict[str, Callable[[Quantity], Quantity]] = {
    "sqrt": _sqrt,
    "sin": _accept_angle(math.sin),
    "cos": _accept_angle(math.cos),
    "tan": _accept_angle(math.tan),
}
_DEEPEST = 40  # nested factors: far more than a person writes, far fewer than Python's stack holds


class _ExpressionParser:
    """Parse by recursive descent: a sum of products of factors, with signs, brackets and functions."""

    def __init__(self, text: str, names: Mapping[str, Quantity | None] | None):
        self.text, self.names, self.at, self.depth = text.rstrip(), names, 0, 0
        if not self.text:
            raise QuantityError("nothing here, expected a number with its unit or an expression")
        if len(text) > 1000:
            raise QuantityError(f"{quote(text)} is too long for an expression")
        self._advance()

    def parse(self) -> Quantity:
        value = self._parse_sum()
        if self.kind:
            raise self._unexpected_token()
        return value

    def _advance(self) -> None:
        """Read the next token into ``kind``, ``word`` and ``unit``; at the end ``kind`` is empty."""
        self.kind, self.word, self.unit = "", "", None
        if self.at >= len(self.text):
            return
        match = _TOKEN.match(self.text, self.at)
        if match is None:
            raise QuantityError(f"{quote(self.text)}: can't read {quote(self.text[self.at :].lstrip()[:1])}")
        self.kind = "number" if match["number"] else "name" if match["name"] else "sign"
        self.word, self.unit, self.at = match[self.kind], match["unit"], match.end()

    def _unexpected_token(self) -> QuantityError:
        token = quote(self.word) if self.kind else "the end"
        return QuantityError(f"{quote(self.text)}: {token} is not expected here")

    def _parse_sum(self) -> Quantity:
        total = self._parse_product()
        while self.kind == "sign" and self.word in "+-":
            sign = self._take_word()
            term = self._parse_product()
            if term.dimension != total.dimension:
                verb = "add" if sign == "+" else "subtract"
                raise QuantityError(f"{quote(self.text)}: can't {verb} {total.what} and {term.what}")
            total = self._make_finite(total.value + (term.value if sign == "+" else -term.value), total.dimension)
        return total

    def _parse_product(self) -> Quantity:
        total = self._parse_factor()
        while self.kind == "sign" and self.word in "*/":
            sign = 1 if self._take_word() == "*" else -1
            term = self._parse_factor()
            a, b, c, d = (p + sign * q for p, q in zip(total.dimension, term.dimension, strict=True))
            if sign < 0 and term.value == 0.0:
                raise QuantityError(f"{quote(self.text)}: division by zero")
            value = total.value * term.value if sign > 0 else total.value / term.value
            total = self._make_finite(value, (a, b, c, d))
        return total

    def _parse_factor(self) -> Quantity:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise QuantityError(f"{quote(self.text)} is nested too deeply")
        value = self._parse_signed_factor()
        self.depth -= 1
        return value

    def _parse_signed_factor(self) -> Quantity:
        if self.kind == "number":
            return self._parse_number()
        if self.kind == "name":
            return self._parse_name()
        sign = self._take_word() if self.kind == "sign" and self.word in "+-(" else ""
        if sign == "(":
            return self._parse_closed()
        if sign == "":
            raise self._unexpected_token()
        value = self._parse_factor()
        return value if sign == "+" else Quantity(-value.value, value.dimension)

    def _parse_number(self) -> Quantity:
        factor, dimension = UNITS[self.unit] if self.unit else (1.0, NUMBER.dimension)
        value, bare = float(self.word) * factor, self.unit is None
        self._advance()
        if bare and self.kind == "name":
            end = suggest(self.word, UNITS, "a unit such as mm, in or deg")
            raise QuantityError(f"{quote(self.text)}: unknown unit {quote(self.word)}{end}")
        return self._make_finite(value, dimension)

    def _parse_name(self) -> Quantity:
        name = self._take_word()
        if name in _FUNCTIONS:
            if self._take_word() != "(":
                raise QuantityError(f"{quote(self.text)}: {name} needs its argument in brackets")
            argument = self._parse_closed()
            try:
                return _FUNCTIONS[name](argument)
            except QuantityError as error:
                raise QuantityError(f"{quote(self.text)}: {error}") from None
        if self.names is None:
            raise QuantityError(f"{quote(self.text)}: expected a number, got {quote(name)}")
        if name in self.names:
            size = self.names[name]
            if size is None:
                raise UnreadSizeError(name)
            return size
        raise QuantityError(f"{quote(self.text)}: undefined size {quote(name)}{suggest(name, self.names)}")

    def _parse_closed(self) -> Quantity:
        """Parse a sum up to its closing bracket."""
        value = self._parse_sum()
        if self._take_word() != ")":
            raise QuantityError(f"{quote(self.text)}: a bracket is not closed")
        return value

    def _take_word(self) -> str:
        word = self.word
        self._advance()
        return word

    def _make_finite(self, value: float, dimension: Dimension) -> Quantity:
        if not math.isfinite(value):
            raise QuantityError(f"{quote(self.text)} is not a finite value")
        return Quantity(value, dimension)
