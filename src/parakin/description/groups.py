"""Groups of legs. A group's model is made from the type hints of its leg kind, so a new kind needs nothing here."""

from __future__ import annotations

from dataclasses import MISSING, Field, fields, replace
from functools import cache
from typing import Annotated, Any, ClassVar, get_type_hints

from pydantic import (
    AfterValidator,
    BeforeValidator,
    PlainValidator,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    create_model,
)

from ..errors import suggest
from ..model.legs import KINDS, Leg
from ..model.parts import Direction, Drive, Point, Signs, Size
from .document import YamlList, YamlMap, YamlText
from .sections import Circle, Section
from .values import DRIVE_TYPES, DirectionValue, Extent, PlacedError, PointValue, Word, describe, get_context


class Group(Section):
    """Several legs of one kind. Each value has a row a leg; a row has one item, or one a joint of the leg."""

    place: ClassVar[str] = " in legs"
    leg: ClassVar[type[Leg]]

    kind: Any
    joints: Any
    range: Any
    speed: Any = None
    acceleration: Any = None
    jerk: Any = None

    def legs(self) -> list[Leg]:
        result = []
        for i, names in enumerate(self.joints):
            drives = []
            for j, unit in enumerate(self.leg.units):
                drive = Drive(str(names[j]), unit, *self.range[i][j])
                for what in ("speed", "acceleration", "jerk"):
                    rows = getattr(self, what)
                    drive = drive if rows is None else replace(drive, **{what: rows[i][j]})
                drives.append(drive)
            own = {spot.name: getattr(self, spot.name) for spot in _own_fields(self.leg)}
            given = {name: rows[i][0] for name, rows in own.items() if rows is not None}
            result.append(self.leg(drives=tuple(drives), **given))
        return result


def _own_fields(leg: type[Leg]) -> list[Field[Any]]:
    return [f for f in fields(leg) if f.name != "drives"]


def _levels(value: object) -> int:
    """How deep lists are nested, along the first items."""
    levels = 0
    while isinstance(value, YamlList):
        levels += 1
        value = value[0] if value else None
    return levels


def _list_of(items: tuple[Any, ...], read: Any) -> Any:
    row: Any = tuple.__class_getitem__(items)  # tuple[*items], made at run time
    return Annotated[list[row], WrapValidator(read)]


def _rows(items: tuple[Any, ...], levels: int) -> Any:
    """The type of a value given once for all legs, once for each joint of a leg, or once for each leg.

    ``items`` are the types of a leg's values, one or one a joint; each is itself lists nested ``levels`` deep.
    """
    slots = len(items)

    def read(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        joints = info.data.get("joints")
        per_leg = False
        if isinstance(value, YamlMap) and items == (PointValue,):
            points = Circle.model_validate(value, context=info.context).points()
            rows, per_leg = [(point,) for point in points], True
        else:
            extra = _levels(value) - levels
            if extra <= 0:
                table = [[value] * slots]
            elif extra == 1 and slots > 1:
                table = [value]
            else:
                table = [[row] for row in value] if slots == 1 else value
                per_leg = True
            for row in table:
                if not isinstance(row, list) or len(row) != slots:
                    raise ValueError(f"expected {slots} values, one a joint of the leg, got {describe(row)}")
            rows = handler(table)
        if joints is None:
            return rows
        if not per_leg:
            return rows * len(joints)
        if len(rows) != len(joints):
            raise ValueError(f"{len(rows)} values for {len(joints)} legs, expected one for all or one a leg")
        return rows

    return _list_of(items, read)


def _joints(leg: type[Leg]) -> Any:
    count = len(leg.units)
    expected = "a list of names, one a leg" if count == 1 else f"a list of {count} names a leg"

    def read(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if not isinstance(value, YamlList) or not value:
            raise ValueError(f"expected {expected}, got {describe(value)}")
        rows = [[name] for name in value] if count == 1 else value
        for row in rows:
            if not isinstance(row, list) or len(row) != count:
                raise ValueError(f"expected {expected}, got {describe(row)} for one leg")
            for name, unit in zip(row, leg.units, strict=True):
                if isinstance(name, YamlText):
                    get_context(info).add_joint(name, unit)
        return handler(rows)

    return _list_of((Word,) * count, read)


def _signs(leg: type[Leg]) -> Any:
    count = len(leg.branches)

    def read(value: object) -> Signs:
        if not isinstance(value, YamlText) or len(value) != count or set(value) - set("+-"):
            raise ValueError(f"expected {count} of the signs + and -, in quotes, got {describe(value)}")
        return Signs(str(value))

    return Annotated[Any, PlainValidator(read)]


def _upright(rows: Any, info: ValidationInfo) -> Any:
    """``zero`` is where a leg's arm points at q = 0: at right angles to the ``axis`` it turns about."""
    for (zero,), (axis,) in zip(rows, info.data.get("axis", ()), strict=False):
        if abs(sum(a * b for a, b in zip(zero, axis, strict=True))) > 1e-9:
            raise ValueError("this direction is not at right angles to axis, expected a right angle")
    return rows


@cache
def _model(kind: str) -> type[Group]:
    leg = KINDS[kind]
    hints = get_type_hints(leg)
    types: dict[Any, Any] = {
        Point: _rows((PointValue,), 1),
        Direction: _rows((DirectionValue,), 1),
        Size: _rows((Extent,), 0),
        Signs: _rows((_signs(leg),), 0),
    }
    own: dict[str, Any] = {}
    for spot in _own_fields(leg):
        type_ = types[hints[spot.name]]
        if spot.name == "zero":
            type_ = Annotated[type_, AfterValidator(_upright)]
        own[spot.name] = (type_, ... if spot.default is MISSING else None)
    drives = [DRIVE_TYPES[unit] for unit in leg.units]
    model = create_model(
        f"Group_{kind}",
        __base__=Group,
        joints=(_joints(leg), ...),
        range=(_rows(tuple(d.range for d in drives), 1), ...),
        speed=(_rows(tuple(d.speed for d in drives), 0), None),
        acceleration=(_rows(tuple(d.acceleration for d in drives), 0), None),
        jerk=(_rows(tuple(d.jerk for d in drives), 0), None),
        **own,
    )
    model.leg = leg
    return model


def _group(value: object, info: ValidationInfo) -> Group:
    if not isinstance(value, YamlMap):
        raise ValueError(f"expected a mapping with kind, joints, range, ..., got {describe(value)}")
    kind = value.get("kind")
    if kind is None:
        raise ValueError(f'missing key "kind", expected one of {", ".join(KINDS)}')
    if not isinstance(kind, YamlText) or kind not in KINDS:
        line = kind.line if isinstance(kind, YamlText) else value.line
        raise PlacedError(f"unknown leg kind {describe(kind)}{suggest(str(kind), KINDS)}", line)
    return _model(str(kind)).model_validate(value, context=info.context)


def _groups(value: object) -> object:
    if isinstance(value, YamlMap):
        return YamlList([value], value.line)
    if not isinstance(value, YamlList) or not value:
        raise ValueError(f"expected a group of legs or a list of groups, got {describe(value)}")
    return value


def _as_many(groups: list[Group], info: ValidationInfo) -> list[Group]:
    context = get_context(info)
    context.legs_read = True
    names = [str(name) for group in groups for leg in group.joints for name in leg]
    motion = context.motion
    if motion is not None and len(names) != len(motion):
        raise ValueError(
            f"{_counted(len(names), 'joint')} ({', '.join(names)}) for {_counted(len(motion), 'word')} of motion"
            f" ({' '.join(motion)}), expected as many joints as words"
        )
    return groups


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


Legs = Annotated[list[Annotated[Group, PlainValidator(_group)]], BeforeValidator(_groups), AfterValidator(_as_many)]
