"""The sections of a machine file as pydantic models; legs are in :mod:`.groups`."""

from __future__ import annotations

from math import cos, inf, sin
from typing import Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainValidator,
    ValidationInfo,
    create_model,
    model_validator,
)

from ..errors import quote, suggest
from ..model.elements import (
    MOTION_UNITS,
    ROTATIONS,
    TRANSLATIONS,
    Cone,
    Direction,
    Drive,
    Gap,
    Limits,
    PlaneConstraint,
    Point,
    Range,
    RodConstraint,
    Size,
    Step,
    Unit,
    Vector,
)
from ..units import ANGLE, LENGTH
from .document import YamlList, YamlMap, YamlText
from .values import (
    DRIVE_KEYS,
    DRIVE_TYPES,
    AnglePair,
    AngleValue,
    DirectionValue,
    Extent,
    Flag,
    LengthPair,
    LengthValue,
    Opening,
    PlacedError,
    PointValue,
    WordValue,
    accept_words,
    describe_value,
    get_context,
    read_quantity,
    refuse_far_switch,
)

TRANSFORMS = (*TRANSLATIONS, *ROTATIONS)


class FileSection(BaseModel):
    """A mapping of known keys. An unknown key is reported, and the others are still read."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    where: ClassVar[str] = ""  # for messages: " in legs"

    @model_validator(mode="before")
    @classmethod
    def _report_unknown_keys(cls, value: object, info: ValidationInfo) -> object:
        keys = list(cls.model_fields)
        if not isinstance(value, YamlMap):
            raise ValueError(f"expected a mapping with the keys {', '.join(keys)}, got {describe_value(value)}")
        for key in value:
            if key not in keys:
                get_context(info).report(f"unknown key {quote(key)}{cls.where}{suggest(key, keys)}", key.line)
        return YamlMap({k: v for k, v in value.items() if k in keys}, value.line)


def _check_list(value: object) -> object:
    if not isinstance(value, YamlList):
        raise ValueError(f"expected a list, got {describe_value(value)}")
    return value


ListOf = BeforeValidator(_check_list)  # pydantic's own message would name Python types


class CirclePoints(FileSection):
    """Points on a circle about the frame's Z: ``{circle: R, at: [0 deg, 120 deg, 240 deg], z: 0 mm}``."""

    where: ClassVar[str] = " in a circle of points"

    circle: Extent
    at: Annotated[list[AngleValue], ListOf]
    z: LengthValue = 0.0

    def compute_points(self) -> list[Vector]:
        """Compute the points, mm; a cosine of 6e-17 (90 deg) is exactly zero."""
        turns = [tuple(0.0 if abs(t) < 1e-15 else t for t in (cos(a), sin(a))) for a in self.at]
        return [(self.circle * c, self.circle * s, self.z) for c, s in turns]


# Heads, tables, mountings.


class _DrivenStep(FileSection):
    where: ClassVar[str] = " in a driven transform"

    joint: WordValue
    range: tuple[float, float]
    reverse: Flag = False
    offset: float = 0.0
    speed: float = inf
    acceleration: float = inf
    jerk: float = inf
    counts: float | None = None
    lead: float | None = None
    homing: Any = None
    force: float = inf
    rated: float = inf
    power: float = inf
    inertia: float = 0.0
    stiffness: float | None = None

    def build_step(self, axis: str, unit: Unit) -> Step:
        values = {key: getattr(self, key) for key in DRIVE_KEYS if key != "offset"}  # that of a step is its own
        drive = Drive(str(self.joint), unit, *self.range, **values)
        return Step(axis, self.offset, drive, -1.0 if self.reverse else 1.0)


def _build_driven_model(unit: Unit) -> type[_DrivenStep]:
    types = DRIVE_TYPES[unit]
    own: dict[str, Any] = {
        key: (getattr(types, key) | None, _DrivenStep.model_fields[key].default)
        for key in DRIVE_KEYS
        if key != "offset"
    }
    offset = (types.value, 0.0)

    def check_switch(switch: Any, info: ValidationInfo) -> Any:
        if switch is not None and "range" in info.data:
            refuse_far_switch(switch, info.data["range"], unit)
        return switch

    homing: Any = types.homing | None
    own["homing"] = (Annotated[homing, AfterValidator(check_switch)], None)
    return create_model(f"Driven_{unit}", __base__=_DrivenStep, range=types.range, offset=offset, **own)


_DRIVEN: dict[Unit, type[_DrivenStep]] = {"mm": _build_driven_model("mm"), "rad": _build_driven_model("rad")}


def _read_step(value: object, info: ValidationInfo) -> Step:
    if not isinstance(value, YamlMap) or len(value) != 1:
        raise ValueError(f"expected one transform such as tz: 100 mm, got {describe_value(value)}")
    ((axis, content),) = value.items()
    if axis not in TRANSFORMS:
        raise PlacedError(f"unknown transform {quote(axis)}{suggest(axis, TRANSFORMS)}", axis.line)
    unit = MOTION_UNITS[axis]
    if not isinstance(content, YamlMap):
        return Step(str(axis), read_quantity(content, LENGTH if unit == "mm" else ANGLE, info))
    joint = content.get("joint")
    if isinstance(joint, YamlText):
        get_context(info).add_joint(joint, unit)
    return _DRIVEN[unit].model_validate(content, context=info.context).build_step(str(axis), unit)


StepValue = Annotated[Step, PlainValidator(_read_step)]
Steps = Annotated[tuple[StepValue, ...], ListOf]


def _expand_mounting(value: object, info: ValidationInfo) -> object:
    """Expand a word such as horizontal to its turn about X, by which a hanging tool points along +Y."""
    if not isinstance(value, YamlText):
        return value
    way, _, angle = value.strip().partition(" ")
    if value.strip() == "vertical":
        return YamlList([], value.line)
    if value.strip() == "horizontal":
        angle = "90 deg"
    elif way != "inclined":
        known = ("vertical", "horizontal", "inclined")
        others = "vertical, horizontal, inclined by an angle (inclined 45 deg) or a list of transforms"
        raise ValueError(f"unknown mounting {quote(value)}{suggest(way, known, others)}")
    return YamlList([YamlMap({YamlText("rx", value.line): YamlText(angle, value.line)}, value.line)], value.line)


def _refuse_driven_steps(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    for step in steps:
        if step.drive is not None:
            raise ValueError(f"joint {quote(step.drive.name)} can't be in the mounting, expected head or table")
    return steps


Mounting = Annotated[
    tuple[StepValue, ...], ListOf, BeforeValidator(_expand_mounting), AfterValidator(_refuse_driven_steps)
]


# Limits.


class _PassiveSection(FileSection):
    where: ClassVar[str] = " in passive"

    tx: LengthPair | None = None
    ty: LengthPair | None = None
    tz: LengthPair | None = None
    rx: AnglePair | None = None
    ry: AnglePair | None = None
    rz: AnglePair | None = None

    @model_validator(mode="before")
    @classmethod
    def _report_fixed_coordinates(cls, value: object, info: ValidationInfo) -> object:
        context = get_context(info)
        motion = context.motion or TRANSFORMS
        for key in value if isinstance(value, YamlMap) else ():
            if key in TRANSFORMS and key not in motion:
                context.report(f"passive limit of {key}, which is not in the motion {' '.join(motion)}", key.line)
        return value

    def build_ranges(self) -> tuple[Range, ...]:
        return tuple(Range(name, *getattr(self, name)) for name in TRANSFORMS if getattr(self, name) is not None)


def _read_slider_name(value: object, info: ValidationInfo) -> str:
    context = get_context(info)
    if not isinstance(value, YamlText):
        raise ValueError(f"expected a joint's name, got {describe_value(value)}")
    if context.legs_read and value not in context.joints:
        raise ValueError(f"unknown joint {quote(value)}{suggest(value, context.joints)}")
    if value in context.joints and context.joints[value][1] != "mm":
        raise ValueError(f"joint {quote(value)} turns, expected one that slides")
    return str(value)


def _check_pair(value: object) -> object:
    if not isinstance(value, YamlList) or len(value) != 2:
        raise ValueError(f"expected the names of two joints, got {describe_value(value)}")
    return value


_SliderName = Annotated[str, PlainValidator(_read_slider_name)]


def _read_strut_name(value: object) -> str:
    if not isinstance(value, YamlText):
        raise ValueError(f"expected a strut's name, got {describe_value(value)}")
    return str(value)


_StrutName = Annotated[str, PlainValidator(_read_strut_name)]
_StrutPair = Annotated[tuple[_StrutName, _StrutName], BeforeValidator(_check_pair)]


class _GapSection(FileSection):
    where: ClassVar[str] = " in gaps"

    between: Annotated[tuple[_SliderName, _SliderName], BeforeValidator(_check_pair)]
    range: LengthPair


class _ConeSection(FileSection):
    where: ClassVar[str] = " in cones"

    at: Annotated[Any, accept_words("end of a leg", "foot", "platform")]
    angle: Opening
    axis: DirectionValue | None = None


class LimitsSection(FileSection):
    where: ClassVar[str] = " in limits"

    passive: _PassiveSection | None = None
    gaps: Annotated[list[_GapSection], ListOf] = []
    cones: Annotated[list[_ConeSection], ListOf] = []
    clearance: Extent | None = None
    joined: Annotated[list[_StrutPair], ListOf] | None = None

    def build_limits(self) -> Limits:
        return Limits(
            self.passive.build_ranges() if self.passive else (),
            tuple(Gap(*gap.between, *gap.range) for gap in self.gaps),
            tuple(Cone(c.at, c.angle, Direction(c.axis) if c.axis else None) for c in self.cones),
            self.clearance,
            None if self.joined is None else tuple(self.joined),
        )


class _PlaneSection(FileSection):
    """A point of one body that stays in a plane of the other."""

    where: ClassVar[str] = " in constraints"

    plane_of: Annotated[Any, accept_words("body that carries the plane", "base", "platform")]
    platform: PointValue
    foot: PointValue
    normal: DirectionValue

    def build(self) -> PlaneConstraint:
        return PlaneConstraint(self.plane_of, Point(self.platform), Point(self.foot), Direction(self.normal))


class _RodSection(FileSection):
    """A rod without a drive, from the platform to the base or to what a leg moves."""

    where: ClassVar[str] = " in constraints"

    rod: Extent
    platform: PointValue
    foot: PointValue
    on: WordValue | None = None

    def build(self) -> RodConstraint:
        drive = None if self.on is None else str(self.on)
        return RodConstraint(Point(self.platform), Point(self.foot), Size(self.rod), drive)


def _read_constraint(value: object, info: ValidationInfo) -> PlaneConstraint | RodConstraint:
    if not isinstance(value, YamlMap) or ("rod" in value) == ("plane_of" in value):
        raise ValueError(f"expected a mapping with plane_of, or one with rod, got {describe_value(value)}")
    section = _RodSection if "rod" in value else _PlaneSection
    built = section.model_validate(value, context=info.context).build()
    joints = get_context(info).joints
    if isinstance(built, RodConstraint) and built.drive is not None and built.drive not in joints:
        raise ValueError(f"on: unknown joint {quote(built.drive)}{suggest(built.drive, joints)}")
    return built


ConstraintValue = Annotated[PlaneConstraint | RodConstraint, PlainValidator(_read_constraint)]


class HomeSection(FileSection):
    """The home pose by the names of its axes."""

    where: ClassVar[str] = " in home"

    X: LengthValue | None = None
    Y: LengthValue | None = None
    Z: LengthValue | None = None
    A: AngleValue | None = None
    B: AngleValue | None = None
    C: AngleValue | None = None

    def get_pose(self) -> dict[str, float]:
        """Return the given coordinates by axis name, mm and rad."""
        return {name: value for name, value in self if value is not None}
