"""Groups of legs as pydantic models, built from the type hints of their leg kind: a new kind needs nothing here."""

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
from ..model.elements import Direction, Drive, Point, Signs, Size
from ..model.legs import KINDS, Leg
from .document import YamlList, YamlMap, YamlText
from .sections import CirclePoints, FileSection
from .values import (
    DRIVE_KEYS,
    DRIVE_TYPES,
    DirectionValue,
    Extent,
    PlacedError,
    PointValue,
    WordValue,
    describe_value,
    get_context,
    refuse_far_switch,
)


class LegGroup(FileSection):
    """Several legs of one kind. A value has a row for each leg; a row has one item, or one for each of its joints."""

    where: ClassVar[str] = " in legs"
    leg: ClassVar[type[Leg]]

    kind: Any
    joints: Any
    range: Any
    speed: Any = None
    acceleration: Any = None
    jerk: Any = None
    counts: Any = None
    lead: Any = None
    homing: Any = None
    offset: Any = None
    force: Any = None
    rated: Any = None
    power: Any = None
    inertia: Any = None
    stiffness: Any = None

    def build_legs(self) -> list[Leg]:
        """Build the legs with their drives."""
        result = []
        for i, names in enumerate(self.joints):
            drives = []
            for j, unit in enumerate(self.leg.units):
                drive = Drive(str(names[j]), unit, *self.range[i][j])
                for what in DRIVE_KEYS:
                    rows = getattr(self, what)
                    drive = drive if rows is None else replace(drive, **{what: rows[i][j]})
                drives.append(drive)
            own = {spec.name: getattr(self, spec.name) for spec in _list_own_fields(self.leg)}
            given = {name: rows[i][0] for name, rows in own.items() if rows is not None}
            result.append(self.leg(drives=tuple(drives), **given))
        return result


def _list_own_fields(leg: type[Leg]) -> list[Field[Any]]:
    """List the fields of a leg kind beside its drives."""
    return [f for f in fields(leg) if f.name != "drives"]


def _count_levels(value: object) -> int:
    """Count how deep lists are nested, along the first items."""
    levels = 0
    while isinstance(value, YamlList):
        levels += 1
        value = value[0] if value else None
    return levels


def _make_list_type(items: tuple[Any, ...], read: Any) -> Any:
    row: Any = tuple.__class_getitem__(items)  # tuple[*items], made at run time
    return Annotated[list[row], WrapValidator(read)]


def _make_rows_type(items: tuple[Any, ...], levels: int) -> Any:
    """Make the type of a value given once for all legs, once for each joint of a leg, or once for each leg.

    items : the types of a leg's values, one or one for each joint
    levels : how deep lists are nested in each
    """
    slots = len(items)

    def read(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        joints = info.data.get("joints")
        per_leg = False
        if isinstance(value, YamlMap) and items == (PointValue,):
            points = CirclePoints.model_validate(value, context=info.context).compute_points()
            rows, per_leg = [(point,) for point in points], True
        else:
            extra = _count_levels(value) - levels
            if extra <= 0:
                table = [[value] * slots]
            elif extra == 1 and slots > 1:
                table = [value]
            else:
                table = [[row] for row in value] if slots == 1 else value
                per_leg = True
            for row in table:
                if not isinstance(row, list) or len(row) != slots:
                    raise ValueError(f"expected {slots} values, one a joint of the leg, got {describe_value(row)}")
            rows = handler(table)
        if joints is None:
            return rows
        if not per_leg:
            return rows * len(joints)
        if len(rows) != len(joints):
            raise ValueError(f"{len(rows)} values for {len(joints)} legs, expected one for all or one a leg")
        return rows

    return _make_list_type(items, read)


def _make_joints_type(leg: type[Leg]) -> Any:
    count = len(leg.units)
    expected = "a list of names, one a leg" if count == 1 else f"a list of {count} names a leg"

    def read(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if not isinstance(value, YamlList) or not value:
            raise ValueError(f"expected {expected}, got {describe_value(value)}")
        rows = [[name] for name in value] if count == 1 else value
        for row in rows:
            if not isinstance(row, list) or len(row) != count:
                raise ValueError(f"expected {expected}, got {describe_value(row)} for one leg")
            for name, unit in zip(row, leg.units, strict=True):
                if isinstance(name, YamlText):
                    get_context(info).add_joint(name, unit)
        return handler(rows)

    return _make_list_type((WordValue,) * count, read)


def _make_signs_type(leg: type[Leg]) -> Any:
    count = len(leg.branches)

    def read(value: object) -> Signs:
        if not isinstance(value, YamlText) or len(value) != count or set(value) - set("+-"):
            raise ValueError(f"expected {count} of the signs + and -, in quotes, got {describe_value(value)}")
        return Signs(str(value))

    return Annotated[Any, PlainValidator(read)]


def _check_right_angle(rows: Any, info: ValidationInfo) -> Any:
    """Refuse a ``zero``, the arm's direction at q = 0, that is not at right angles to the ``axis`` it turns about."""
    for (zero,), (axis,) in zip(rows, info.data.get("axis", ()), strict=False):
        if abs(sum(a * b for a, b in zip(zero, axis, strict=True))) > 1e-9:
            raise ValueError("this direction is not at right angles to axis, expected a right angle")
    return rows


def _make_switches_type(leg: type[Leg], switches: Any) -> Any:
    """Make the type of home switches, which refuses those that lie far outside of their joints' ranges."""

    def check(rows: Any, info: ValidationInfo) -> Any:
        for row, ranges in zip(rows, info.data.get("range", ()), strict=False):
            for switch, pair, unit in zip(row, ranges, leg.units, strict=True):
                refuse_far_switch(switch, pair, unit)
        return rows

    return Annotated[switches, AfterValidator(check)]


@cache
def _build_group_model(kind: str) -> type[LegGroup]:
    leg = KINDS[kind]
    hints = get_type_hints(leg)
    types: dict[Any, Any] = {
        Point: _make_rows_type((PointValue,), 1),
        Direction: _make_rows_type((DirectionValue,), 1),
        Size: _make_rows_type((Extent,), 0),
        Signs: _make_rows_type((_make_signs_type(leg),), 0),
    }
    own: dict[str, Any] = {}
    for spec in _list_own_fields(leg):
        type_ = types[hints[spec.name]]
        if spec.name == "zero":
            type_ = Annotated[type_, AfterValidator(_check_right_angle)]
        own[spec.name] = (type_, ... if spec.default is MISSING else None)
    drives = [DRIVE_TYPES[unit] for unit in leg.units]
    for key in DRIVE_KEYS:
        own[key] = (_make_rows_type(tuple(getattr(drive, key) for drive in drives), 0), None)
    own["homing"] = (_make_switches_type(leg, own["homing"][0]), None)
    model = create_model(
        f"Group_{kind}",
        __base__=LegGroup,
        joints=(_make_joints_type(leg), ...),
        range=(_make_rows_type(tuple(d.range for d in drives), 1), ...),
        **own,
    )
    model.leg = leg
    return model


def _read_group(value: object, info: ValidationInfo) -> LegGroup:
    if not isinstance(value, YamlMap):
        raise ValueError(f"expected a mapping with kind, joints, range, ..., got {describe_value(value)}")
    kind = value.get("kind")
    if kind is None:
        raise ValueError(f'missing key "kind", expected one of {", ".join(KINDS)}')
    if not isinstance(kind, YamlText) or kind not in KINDS:
        line = kind.line if isinstance(kind, YamlText) else value.line
        raise PlacedError(f"unknown leg kind {describe_value(kind)}{suggest(str(kind), KINDS)}", line)
    return _build_group_model(str(kind)).model_validate(value, context=info.context)


def _wrap_single_group(value: object) -> object:
    if isinstance(value, YamlMap):
        return YamlList([value], value.line)
    if not isinstance(value, YamlList) or not value:
        raise ValueError(f"expected a group of legs or a list of groups, got {describe_value(value)}")
    return value


def _check_joint_count(groups: list[LegGroup], info: ValidationInfo) -> list[LegGroup]:
    context = get_context(info)
    context.legs_read = True
    names = [str(name) for group in groups for leg in group.joints for name in leg]
    motion = None if context.motion is None else [word for word in context.motion if word not in context.parasitic]
    if motion is not None and len(names) < len(motion):
        what = "independent word" if context.parasitic else "word"
        count = _format_count(len(motion), what)
        raise ValueError(
            f"{_format_count(len(names), 'joint')} ({', '.join(names)}) for {count} of motion ({' '.join(motion)}), "
            "expected at least as many joints as words"
        )
    return groups


def _format_count(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


Legs = Annotated[
    list[Annotated[LegGroup, PlainValidator(_read_group)]],
    BeforeValidator(_wrap_single_group),
    AfterValidator(_check_joint_count),
]
