"""The values of a machine file as pydantic types: words, quantities, pairs, points, directions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import hypot, nan, pi
from typing import Annotated, Any, Literal, TypeAlias, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    PlainValidator,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from ..errors import InputError, quote, suggest
from ..model.elements import ABSOLUTE, Drive, Unit, Vector
from ..units import (
    ACCELERATION,
    ANGLE,
    ANGULAR_ACCELERATION,
    ANGULAR_JERK,
    ANGULAR_SPEED,
    ANGULAR_STIFFNESS,
    DENSITY,
    FORCE,
    INERTIA,
    JERK,
    LENGTH,
    LONGEST,
    MASS,
    MODULUS,
    NUMBER,
    POWER,
    SPEED,
    STIFFNESS,
    TORQUE,
    Quantity,
    QuantityError,
    QuantityKind,
    UnreadSizeError,
    name_display_unit,
    parse_quantity,
    to_display,
)
from .document import YamlList, YamlMap, YamlText


@dataclass
class ReadingContext:
    """What the values of one file share while they are read.

    source : the file's name as the user gave it
    sizes : the file's sizes; None for one that could not be read
    errors : those that leave the rest of a section readable
    joints : line and unit of each joint, by name
    motion : the words of the motion; None: not read, or not readable
    parasitic : those of them that follow from the others
    legs_read : whether all joints of legs are known
    """

    source: str
    sizes: Mapping[str, Quantity | None]
    errors: list[InputError] = field(default_factory=list)
    joints: dict[str, tuple[int, Unit]] = field(default_factory=dict)
    motion: tuple[str, ...] | None = None
    parasitic: tuple[str, ...] = ()
    legs_read: bool = False

    def report(self, message: str, line: int) -> None:
        self.errors.append(InputError(message, self.source, line))

    def add_joint(self, name: YamlText, unit: Unit) -> None:
        if not is_word(name):
            return  # reported where the word is read
        if name in self.joints:
            self.report(f"joint {quote(name)} is used twice, first in line {self.joints[name][0]}", name.line)
        else:
            self.joints[str(name)] = (name.line, unit)


def get_context(info: ValidationInfo) -> ReadingContext:
    """Return the context, which pydantic passes on untyped."""
    return cast(ReadingContext, info.context)


class PlacedError(ValueError):
    """An error with a line of its own, more exact than that of the value under validation."""

    def __init__(self, message: str, line: int):
        self.line = line
        super().__init__(message)


def describe_value(value: object) -> str:
    """Describe a value for a message."""
    return "a list" if isinstance(value, YamlList) else "a mapping" if isinstance(value, YamlMap) else quote(value)


# Words.


def _read_prose(value: object) -> str:
    if not isinstance(value, YamlText) or not value.strip():
        raise ValueError(f"expected some words, got {describe_value(value)}")
    return value.strip()


def is_word(value: str) -> bool:
    """Tell whether a text may name a machine, a size or a joint: a valid name in C and in G-code comments too."""
    return re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,39}", value) is not None


def _read_word(value: object) -> YamlText:
    if not isinstance(value, YamlText) or not is_word(value):
        raise ValueError(f"expected a plain word (letters, digits, _; at most 40), got {describe_value(value)}")
    return value


def _read_flag(value: object) -> bool:
    if value not in ("true", "false"):
        raise ValueError(f"expected true or false, got {describe_value(value)}")
    return value == "true"


def accept_words(what: str, *known: str) -> PlainValidator:
    """Make a validator that accepts one of the ``known`` words; ``what`` they are is for messages."""

    def read(value: object) -> str:
        if not isinstance(value, YamlText) or value not in known:
            raise ValueError(f"unknown {what} {describe_value(value)}{suggest(str(value), known)}")
        return str(value)

    return PlainValidator(read)


Prose = Annotated[str, PlainValidator(_read_prose)]
WordValue = Annotated[YamlText, PlainValidator(_read_word)]
Flag = Annotated[bool, PlainValidator(_read_flag)]


# Quantities.


ValidRange: TypeAlias = tuple[float, float, str]  # low < value ≤ high, and both in words

_SPEEDS = (SPEED, ANGULAR_SPEED, ACCELERATION, ANGULAR_ACCELERATION)
_JERKS = (JERK, ANGULAR_JERK)
_LOADS = (FORCE, TORQUE, POWER, MASS, INERTIA, DENSITY, STIFFNESS, ANGULAR_STIFFNESS, MODULUS)
# Far beyond any machine, and small enough that no result overflows.
_USUAL_BOUNDS: dict[QuantityKind, ValidRange] = {
    NUMBER: (-1e6, 1e6, "-1e6 to 1e6"),
    LENGTH: (-LONGEST, LONGEST, "-1 km to 1 km"),
    ANGLE: (-1e4, 1e4, "-10000 rad to 10000 rad"),
    **{kind: (0.0, 1e9, f"more than 0 ({kind.units})") for kind in _SPEEDS},
    **{kind: (0.0, 1e12, f"more than 0 ({kind.units})") for kind in (*_JERKS, *_LOADS)},
}


def read_quantity(value: object, kind: QuantityKind, info: ValidationInfo, bounds: ValidRange | None = None) -> float:
    """Read a value in mm, rad and s; NaN if it uses a size that is invalid."""
    if not isinstance(value, YamlText):
        raise ValueError(f"expected {kind.wanted}, got {describe_value(value)}")
    try:
        result = parse_quantity(value, kind, get_context(info).sizes)
    except UnreadSizeError:
        return nan  # the size has been reported
    except QuantityError as error:
        raise ValueError(str(error)) from None
    low, high, words = bounds or _USUAL_BOUNDS[kind]
    if result <= low or result > high:
        raise ValueError(f"{quote(value)} is out of range, expected {words}")
    return result


def accept_quantity(kind: QuantityKind, bounds: ValidRange | None = None) -> PlainValidator:
    """Make a validator that accepts quantities of a kind within bounds, by default the usual ones."""

    def read(value: object, info: ValidationInfo) -> float:
        return read_quantity(value, kind, info, bounds)

    return PlainValidator(read)


def _require_count(count: int, what: str) -> BeforeValidator:
    def check(value: object) -> object:
        if not isinstance(value, YamlList):
            raise ValueError(f"expected {what}, got {describe_value(value)}")
        if len(value) != count:
            raise ValueError(f"expected {what}, got {len(value)} value{'s' * (len(value) != 1)}")
        return value

    return BeforeValidator(check)


def _check_rising(value: Any, handler: ValidatorFunctionWrapHandler) -> tuple[float, float]:
    low, high = handler(value)
    if low >= high:
        raise ValueError(f"[{value[0]}, {value[1]}] is empty, expected [low, high] with low < high")
    return low, high


_ROUNDING = 1e-15  # by which the length of a unit vector, printed with all its digits, may miss 1


def _normalise_vector(value: Vector) -> Vector:
    length = hypot(*value)
    if length < 1e-9:
        raise ValueError("the zero vector, expected a direction")
    if abs(length - 1.0) < _ROUNDING:
        return value  # bit for bit what it was
    return (value[0] / length, value[1] / length, value[2] / length)


LengthValue = Annotated[float, accept_quantity(LENGTH)]
AngleValue = Annotated[float, accept_quantity(ANGLE)]
Number = Annotated[float, accept_quantity(NUMBER)]
Extent = Annotated[float, accept_quantity(LENGTH, (0.0, LONGEST, "more than 0 mm, at most 1 km"))]
Opening = Annotated[float, accept_quantity(ANGLE, (0.0, pi, "more than 0 deg, at most 180 deg"))]
_PAIR = _require_count(2, "a pair [low, high]")
LengthPair = Annotated[tuple[LengthValue, LengthValue], _PAIR, WrapValidator(_check_rising)]
AnglePair = Annotated[tuple[AngleValue, AngleValue], _PAIR, WrapValidator(_check_rising)]
PointValue = Annotated[tuple[LengthValue, LengthValue, LengthValue], _require_count(3, "a point [x, y, z]")]
DirectionValue = Annotated[
    tuple[Number, Number, Number], _require_count(3, "a direction [x, y, z]"), AfterValidator(_normalise_vector)
]


@dataclass(frozen=True)
class DriveTypes:
    """The pydantic types of a drive's values."""

    value: Any
    range: Any
    speed: Any
    acceleration: Any
    jerk: Any
    counts: Any
    lead: Any
    homing: Any
    offset: Any
    force: Any
    rated: Any
    power: Any
    inertia: Any
    stiffness: Any


DRIVE_KEYS = tuple(field.name for field in fields(DriveTypes) if field.name not in ("value", "range"))


def _refuse_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("zero, expected what the joint moves while the motor turns once")
    return value


def _accept_homing(kind: QuantityKind) -> PlainValidator:
    """Make a validator that accepts where a home switch is, or the word for an encoder that needs none."""

    def read(value: object, info: ValidationInfo) -> float | str:
        if value == ABSOLUTE:
            return ABSOLUTE
        try:
            return read_quantity(value, kind, info)
        except ValueError as error:
            raise ValueError(f"{error}, or the word {ABSOLUTE}") from None

    return PlainValidator(read)


def refuse_far_switch(homing: float | Literal["absolute"], pair: tuple[float, float], unit: Unit) -> None:
    """Refuse a home switch that lies far outside of the joint's range."""
    if not Drive("", unit, *pair, homing=homing).has_near_switch:
        place, low, high = (to_display(float(value), unit) for value in (homing, *pair))
        name = name_display_unit(unit)
        raise ValueError(
            f"the switch at {place:g} {name} is far outside of the joint's range, "
            f"expected one in {low:g} to {high:g} {name} or just beside"
        )


def _build_drive_types(value: Any, pair: Any, kind: QuantityKind, others: tuple[QuantityKind, ...]) -> DriveTypes:
    """Build the types of a drive's values from those of a position and of a range, and from the kinds of quantities."""
    speed, acceleration, jerk, force, inertia, stiffness = (Annotated[float, accept_quantity(kind)] for kind in others)
    power = Annotated[float, accept_quantity(POWER)]
    counts = Annotated[float, accept_quantity(NUMBER, (0.0, 1e9, "more than 0, at most 1e9"))]
    lead = Annotated[float, accept_quantity(kind), AfterValidator(_refuse_zero)]
    homing = Annotated[float | str, _accept_homing(kind)]
    of_load = force, force, power, inertia, stiffness
    return DriveTypes(value, pair, speed, acceleration, jerk, counts, lead, homing, value, *of_load)


DRIVE_TYPES: dict[Unit, DriveTypes] = {
    "mm": _build_drive_types(LengthValue, LengthPair, LENGTH, (SPEED, ACCELERATION, JERK, FORCE, MASS, STIFFNESS)),
    "rad": _build_drive_types(
        AngleValue,
        AnglePair,
        ANGLE,
        (ANGULAR_SPEED, ANGULAR_ACCELERATION, ANGULAR_JERK, TORQUE, INERTIA, ANGULAR_STIFFNESS),
    ),
}
