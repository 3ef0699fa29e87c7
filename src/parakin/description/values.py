"""The values of a machine file as pydantic types: words, quantities, pairs, points, directions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import hypot, nan, pi
from typing import Annotated, Any, TypeAlias, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    PlainValidator,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from ..errors import InputError, quote, suggest
from ..model.parts import Unit, Vector
from ..units import (
    ACCELERATION,
    ANGLE,
    ANGULAR_ACCELERATION,
    ANGULAR_JERK,
    ANGULAR_SPEED,
    JERK,
    LENGTH,
    NUMBER,
    SPEED,
    Kind,
    Quantity,
    QuantityError,
    UnreadSizeError,
    parse_quantity,
)
from .document import YamlList, YamlMap, YamlText


@dataclass
class Context:
    """What the values of one file share while they are read."""

    source: str
    sizes: Mapping[str, Quantity | None]
    errors: list[InputError] = field(default_factory=list)  # those that don't keep a section from being read
    joints: dict[str, tuple[int, Unit]] = field(default_factory=dict)  # name: line, unit
    motion: tuple[str, ...] | None = None  # None: not read, or not readable
    legs_read: bool = False

    def report(self, message: str, line: int) -> None:
        self.errors.append(InputError(message, self.source, line))

    def add_joint(self, name: YamlText, unit: Unit) -> None:
        if not is_word(name):
            return  # which is reported where the word is read
        if name in self.joints:
            self.report(f"joint {quote(name)} is used twice, first in line {self.joints[name][0]}", name.line)
        else:
            self.joints[str(name)] = (name.line, unit)


def get_context(info: ValidationInfo) -> Context:
    """The context, which pydantic hands on untyped."""
    return cast(Context, info.context)


class PlacedError(ValueError):
    """An error that knows its line better than the value under validation does."""

    def __init__(self, message: str, line: int):
        self.line = line
        super().__init__(message)


def describe(value: object) -> str:
    """What was found, fit for a message."""
    return "a list" if isinstance(value, YamlList) else "a mapping" if isinstance(value, YamlMap) else quote(value)


# Words.


def _prose(value: object) -> str:
    if not isinstance(value, YamlText) or not value.strip():
        raise ValueError(f"expected some words, got {describe(value)}")
    return value.strip()


def is_word(value: str) -> bool:
    """Whether this may name a machine, a size or a joint: it has to pass for a name in C and in G-code comments too."""
    return re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,39}", value) is not None


def _word(value: object) -> YamlText:
    if not isinstance(value, YamlText) or not is_word(value):
        raise ValueError(f"expected a plain word (letters, digits, _; at most 40), got {describe(value)}")
    return value


def _flag(value: object) -> bool:
    if value not in ("true", "false"):
        raise ValueError(f"expected true or false, got {describe(value)}")
    return value == "true"


def one_of(what: str, *known: str) -> PlainValidator:
    """One of the ``known`` words."""

    def read(value: object) -> str:
        if not isinstance(value, YamlText) or value not in known:
            raise ValueError(f"unknown {what} {describe(value)}{suggest(str(value), known)}")
        return str(value)

    return PlainValidator(read)


Prose = Annotated[str, PlainValidator(_prose)]
Word = Annotated[YamlText, PlainValidator(_word)]
Flag = Annotated[bool, PlainValidator(_flag)]


# Quantities.


Bounds: TypeAlias = tuple[float, float, str]  # low < value ≤ high, and that in words

_SPEEDS = (SPEED, ANGULAR_SPEED, ACCELERATION, ANGULAR_ACCELERATION)
_JERKS = (JERK, ANGULAR_JERK)
# Far beyond any machine, and small enough that nothing computed from them overflows.
_USUAL: dict[Kind, Bounds] = {
    NUMBER: (-1e6, 1e6, "-1e6 to 1e6"),
    LENGTH: (-1e6, 1e6, "-1 km to 1 km"),
    ANGLE: (-1e4, 1e4, "-10000 rad to 10000 rad"),
    **{kind: (0.0, 1e9, f"more than 0 ({kind.units})") for kind in _SPEEDS},
    **{kind: (0.0, 1e12, f"more than 0 ({kind.units})") for kind in _JERKS},
}


def read_quantity(value: object, kind: Kind, info: ValidationInfo, bounds: Bounds | None = None) -> float:
    """A value in mm, rad and s; NaN if a size in it is itself in error."""
    if not isinstance(value, YamlText):
        raise ValueError(f"expected {kind.wanted}, got {describe(value)}")
    try:
        result = parse_quantity(value, kind, get_context(info).sizes)
    except UnreadSizeError:
        return nan  # the size has been reported; once is enough
    except QuantityError as error:
        raise ValueError(str(error)) from None
    low, high, words = bounds or _USUAL[kind]
    if result <= low or result > high:
        raise ValueError(f"{quote(value)} is out of range, expected {words}")
    return result


def of(kind: Kind, bounds: Bounds | None = None) -> PlainValidator:
    """Quantities of a kind."""

    def read(value: object, info: ValidationInfo) -> float:
        return read_quantity(value, kind, info, bounds)

    return PlainValidator(read)


def _several(count: int, what: str) -> BeforeValidator:
    def check(value: object) -> object:
        if not isinstance(value, YamlList):
            raise ValueError(f"expected {what}, got {describe(value)}")
        if len(value) != count:
            raise ValueError(f"expected {what}, got {len(value)} value{'s' * (len(value) != 1)}")
        return value

    return BeforeValidator(check)


def _rising(value: Any, handler: ValidatorFunctionWrapHandler) -> tuple[float, float]:
    low, high = handler(value)
    if low >= high:
        raise ValueError(f"[{value[0]}, {value[1]}] is empty, expected [low, high] with low < high")
    return low, high


def _unit_vector(value: Vector) -> Vector:
    length = hypot(*value)
    if length < 1e-9:
        raise ValueError("the zero vector, expected a direction")
    return (value[0] / length, value[1] / length, value[2] / length)


Length = Annotated[float, of(LENGTH)]
Angle = Annotated[float, of(ANGLE)]
Number = Annotated[float, of(NUMBER)]
Extent = Annotated[float, of(LENGTH, (0.0, 1e6, "more than 0 mm, at most 1 km"))]
Opening = Annotated[float, of(ANGLE, (0.0, pi, "more than 0 deg, at most 180 deg"))]
_PAIR = _several(2, "a pair [low, high]")
LengthPair = Annotated[tuple[Length, Length], _PAIR, WrapValidator(_rising)]
AnglePair = Annotated[tuple[Angle, Angle], _PAIR, WrapValidator(_rising)]
PointValue = Annotated[tuple[Length, Length, Length], _several(3, "a point [x, y, z]")]
DirectionValue = Annotated[
    tuple[Number, Number, Number], _several(3, "a direction [x, y, z]"), AfterValidator(_unit_vector)
]


@dataclass(frozen=True)
class DriveTypes:
    """The types of a drive's values."""

    value: Any
    range: Any
    speed: Any
    acceleration: Any
    jerk: Any


DRIVE_TYPES: dict[Unit, DriveTypes] = {
    "mm": DriveTypes(Length, LengthPair, *(Annotated[float, of(kind)] for kind in (SPEED, ACCELERATION, JERK))),
    "rad": DriveTypes(
        Angle, AnglePair, *(Annotated[float, of(kind)] for kind in (ANGULAR_SPEED, ANGULAR_ACCELERATION, ANGULAR_JERK))
    ),
}
