"""Every geometric number of a machine by its name, and descriptions with other numbers in place of some of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import Any, get_type_hints

from ..algebra import Scalar, Vec, add, cross, dot, norm, scale, sub
from ..errors import DescriptionError, PoseError, quote, suggest
from .elements import MOTION_UNITS, ROTATIONS, Direction, Drive, Point, Size, Step, Unit
from .legs import Leg
from .nominal_values import find_nominal_value
from .spec import Spec
from .structures import make_structure

SIZES = "sizes"  # the group of the named sizes of a machine file
_AXES = ("x", "y", "z")
_NEAREST, _LONGEST_NAME = 3, 40  # of names that are told, and letters that are compared
_TRIAL = 1e-3  # mm or rad, by which a fixed transform is changed to see whether the machine stays one
_GROUPS = {"foot": "feet", "pivot": "feet", "platform": "platform"}  # of points; sizes and directions follow their type


@dataclass(frozen=True)
class Parameter:
    """A number of a machine that can be an input.

    name : a named size's own, or such as ``legs.d1.foot.x``, ``legs.d1.rod``, ``legs.d1.rail.ry`` (a small turn of a
        direction about an axis of the base), ``joints.d1.offset`` (what is added to what the drive says),
        ``head.1.tz``; legs go by their first drive, transforms by their place from 1
    unit, value : ``mm`` or ``rad``, and how many the machine has of it
    group : ``sizes``, ``feet``, ``platform``, ``rods``, ``rails``, ``encoders``, ``mounting``, ``head`` or ``table``
    deviation : its standard deviation, mm or rad; None where it is not known
    """

    name: str
    unit: Unit
    value: float
    group: str
    deviation: float | None = None


def list_parameters(spec: Spec) -> tuple[Parameter, ...]:
    """List every geometric number of a machine: the legs', the drives' offsets, the fixed transforms'."""
    offsets = (Parameter(f"joints.{d.name}.offset", d.unit, d.offset, "encoders") for d in spec.drives)
    legs = (parameter for leg in spec.legs for parameter in _list_leg(leg))
    chains = (p for key in ("mounting", "head", "table") for p in _list_steps(spec, key))
    return (*legs, *offsets, *chains)


def _list_fields(leg: Leg) -> Iterator[tuple[str, Any, Any]]:
    """List name, type and value of a leg's fields besides its drives."""
    hints = get_type_hints(type(leg))
    for field in fields(leg):
        if field.name != "drives":
            yield field.name, hints[field.name], getattr(leg, field.name)


def _list_leg(leg: Leg) -> Iterator[Parameter]:
    for key, hint, value in _list_fields(leg):
        name = f"legs.{leg.drives[0].name}.{key}"
        if hint is Point:
            for letter, coordinate in zip(_AXES, value, strict=True):
                if key == "platform" and letter not in leg.platform_parameters:
                    continue
                yield Parameter(f"{name}.{letter}", "mm", coordinate, _GROUPS.get(key, key))
        elif hint is Size:
            yield Parameter(name, "mm", value, "rods")
        elif hint is Direction and key != "zero":  # that stays at right angles to its axis; its turn is an offset
            for letter in _list_tilts(value):
                yield Parameter(f"{name}.r{letter}", "rad", 0.0, "rails")


def _list_tilts(direction: Vec) -> list[str]:
    """List the two axes that a direction is turned about: those that it is farther from."""
    along = max(range(3), key=lambda i: abs(find_nominal_value(direction[i])))
    return [letter for i, letter in enumerate(_AXES) if i != along]


def _list_steps(spec: Spec, key: str) -> Iterator[Parameter]:
    """List the fixed transforms of a chain that may change: no turn where two turning axes point the tool."""
    pointed = make_structure(spec).pointing is not None
    for number, step in enumerate(getattr(spec, key), 1):
        name = f"{key}.{number}.{step.axis}"
        if step.drive is not None or (pointed and step.axis in ROTATIONS):
            continue
        try:
            make_structure(replace_parameters(spec, {name: step.value + _TRIAL}))
        except DescriptionError:
            continue
        yield Parameter(name, MOTION_UNITS[step.axis], step.value, key)


def suggest_parameter(name: str, known: Sequence[Parameter], with_groups: bool = False) -> str:
    """Complete a message on an unknown parameter: the nearest few, groups where they may stand, and what lists all."""
    names = [parameter.name for parameter in known]
    nearest = get_close_matches(name[:_LONGEST_NAME], names, _NEAREST, 0.0)
    groups = sorted({parameter.group for parameter in known}) if with_groups else []
    others = f", a pattern, or a group ({', '.join(groups)})" if groups else ""
    others = f"a name such as {', '.join(nearest)}{others}; Machine.parameters lists all {len(names)}"
    return suggest(name, [*groups, *nearest], others)


def replace_parameters(spec: Spec, values: Mapping[str, Scalar]) -> Spec:
    """Replace numbers of a description by others, scalars of any kind, by the names of :func:`list_parameters`."""

    def get(name: str, value: Scalar) -> Scalar:
        return values.get(name, value)

    mounting, head, table = (_replace_steps(key, getattr(spec, key), get) for key in ("mounting", "head", "table"))
    legs = tuple(_replace_leg(leg, get) for leg in spec.legs)
    return replace(spec, legs=legs, mounting=mounting, head=head, table=table)


_Get = Callable[[str, Scalar], Scalar]


def _replace_leg(leg: Leg, get: _Get) -> Leg:
    own: dict[str, Any] = {"drives": tuple(_replace_offset(drive, get) for drive in leg.drives)}
    for key, hint, value in _list_fields(leg):
        name = f"legs.{leg.drives[0].name}.{key}"
        if hint is Point:
            own[key] = tuple(get(f"{name}.{letter}", x) for letter, x in zip(_AXES, value, strict=True))
        elif hint is Size:
            own[key] = get(name, value)
        elif hint is Direction and key != "zero":
            tilts = [get(f"{name}.r{letter}", 0.0) if letter in _list_tilts(value) else 0.0 for letter in _AXES]
            own[key] = _tilt_direction(value, tilts)
            if hasattr(leg, "zero") and own[key] is not value:
                own["zero"] = _square_direction(leg.zero, own[key])
    return replace(leg, **own)


def _replace_offset(drive: Drive, get: _Get) -> Drive:
    return replace(drive, offset=get(f"joints.{drive.name}.offset", drive.offset))


def _tilt_direction(direction: Vec, turns: Vec) -> Vec:
    """Tilt a unit vector by small turns about the axes: by the arc tangent of their size, where they are across it."""
    if all(isinstance(turn, float) and turn == 0.0 for turn in turns):
        return direction
    tilted = add(direction, cross(turns, direction))
    return scale(tilted, 1.0 / norm(tilted))


def _square_direction(direction: Vec, axis: Vec) -> Vec:
    """Bring a direction to right angles to an axis."""
    across = sub(direction, scale(axis, dot(direction, axis)))
    return scale(across, 1.0 / norm(across))


def _replace_steps(key: str, steps: tuple[Step, ...], get: _Get) -> tuple[Step, ...]:
    result = []
    for number, step in enumerate(steps, 1):
        if step.drive is None:
            result.append(replace(step, value=get(f"{key}.{number}.{step.axis}", step.value)))
        else:
            result.append(replace(step, drive=_replace_offset(step.drive, get)))
    return tuple(result)


def settle_offsets(spec: Spec) -> Spec:
    """Add the offsets of head's and table's drives to their transforms, where a machine file has them."""

    def settle(step: Step) -> Step:
        if step.drive is None or step.drive.offset == 0.0:
            return step
        return replace(step, value=step.value + step.sign * step.drive.offset, drive=replace(step.drive, offset=0.0))

    return replace(spec, head=tuple(map(settle, spec.head)), table=tuple(map(settle, spec.table)))


def replace_ranges(spec: Spec, ranges: Mapping[str, tuple[float, float]]) -> Spec:
    """Replace the ranges of the legs' drives, by their names; others keep theirs.

    A home switch that is far outside of the new range is dropped. Raises :class:`PoseError` for a name that no drive
    of a leg has.
    """
    known = [drive.name for leg in spec.legs for drive in leg.drives]
    for name in ranges:
        if name not in known:
            raise PoseError(f"ranges: unknown {quote(name)}{suggest(name, known)}")

    def fit(drive: Drive) -> Drive:
        low, high = ranges.get(drive.name, (drive.low, drive.high))
        fitted = replace(drive, low=low, high=high)
        return fitted if fitted.has_near_switch else replace(fitted, homing=None)

    return replace(spec, legs=tuple(replace(leg, drives=tuple(map(fit, leg.drives))) for leg in spec.legs))
