"""Write a machine's description as a machine file with every number explicit: no sizes, no circles, a group a leg.

Reading it gives the same numbers bit for bit, so that the machine computes the same. A calibrated machine is such a
file, where each leg has its own numbers.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import fields
from math import isfinite
from typing import Any, get_type_hints

from ..model.elements import (
    ABSOLUTE,
    MOTION_UNITS,
    Direction,
    Drive,
    Point,
    RodConstraint,
    Signs,
    Size,
    Step,
    Unit,
    Vector,
)
from ..model.legs import Leg
from ..model.spec import Spec
from ..units import AXIS_UNITS

_BODY_UNITS = {"density": "t/mm3", "modulus": "N/mm2", "diameter": "mm", "wall": "mm", "mass": "t"}


def format_spec(spec: Spec) -> str:
    """Format a description as the text of a machine file."""
    lines = [
        f"name: {spec.name}",
        f"title: {json.dumps(spec.title, ensure_ascii=False)}",
        f"source: {json.dumps(' '.join(spec.source.split()), ensure_ascii=False)}",
        *_list_steps("mounting", spec.mounting),
        f"motion: {' '.join(spec.motion)}",
        *([f"parasitic: {' '.join(spec.parasitic)}"] if spec.parasitic else []),
        "legs:",
    ]
    for leg in spec.legs:
        lines += _list_leg(leg)
    lines += _list_constraints(spec)
    lines += [*_list_steps("head", spec.head), *_list_steps("table", spec.table), *_list_limits(spec)]
    lines += _list_bodies(spec)
    home = ", ".join(f"{axis}: {_format_quantity(value, AXIS_UNITS[axis])}" for axis, value in spec.home.items())
    return "\n".join([*lines, f"home: {{{home}}}", ""])


def _format_quantity(value: float, unit: str) -> str:
    return f"{float(value)!r} {unit}"


def _format_pair(pair: Sequence[float], unit: str) -> str:
    return f"[{', '.join(_format_quantity(value, unit) for value in pair)}]"


def _format_direction(direction: Vector) -> str:
    return f"[{', '.join(repr(float(value)) for value in direction)}]"


def _list_drive_values(drive: Drive) -> Iterator[tuple[str, str]]:
    """List a drive's range, rates and homing by their keys, as far as they are stated."""
    yield "range", _format_pair((drive.low, drive.high), drive.unit)
    for key, per in (("speed", "/s"), ("acceleration", "/s2"), ("jerk", "/s3")):
        if isfinite(getattr(drive, key)):
            yield key, _format_quantity(getattr(drive, key), drive.unit + per)
    per_kind = ("N", "t", "N/mm") if drive.unit == "mm" else ("Nmm", "t mm2", "Nmm/rad")
    force, inertia, stiffness = per_kind
    for key, unit in (("force", force), ("rated", force), ("power", "Nmm/s")):
        if isfinite(getattr(drive, key)):
            yield key, _format_quantity(getattr(drive, key), unit)
    if drive.inertia:
        yield "inertia", _format_quantity(drive.inertia, inertia)
    if drive.stiffness is not None:
        yield "stiffness", _format_quantity(drive.stiffness, stiffness)
    if drive.counts is not None:
        yield "counts", repr(float(drive.counts))
    if drive.lead is not None:
        yield "lead", _format_quantity(drive.lead, drive.unit)
    if drive.homing is not None:
        yield "homing", ABSOLUTE if drive.homing == ABSOLUTE else _format_quantity(drive.homing, drive.unit)


def _list_leg(leg: Leg) -> Iterator[str]:
    """List the lines of a leg as a group of its own."""
    names = [drive.name for drive in leg.drives]
    yield f"  - kind: {leg.kind}"
    yield f"    joints: [{names[0] if len(names) == 1 else '[' + ', '.join(names) + ']'}]"
    hints = get_type_hints(type(leg))
    for spec in fields(leg):
        if spec.name != "drives":
            yield f"    {spec.name}: {_format_leg_value(getattr(leg, spec.name), hints[spec.name])}"
    values = [dict(_list_drive_values(drive)) for drive in leg.drives]
    if any(drive.offset for drive in leg.drives):
        for drive, of_drive in zip(leg.drives, values, strict=True):
            of_drive["offset"] = _format_quantity(drive.offset, drive.unit)
    for key in dict.fromkeys(key for of_drive in values for key in of_drive):
        row = [of_drive[key] for of_drive in values if key in of_drive]
        yield f"    {key}: {row[0] if len(row) == 1 else '[' + ', '.join(row) + ']'}"


def _format_leg_value(value: Any, hint: Any) -> str:
    if hint is Point:
        return _format_pair(value, "mm")
    if hint is Direction:
        return _format_direction(value)
    if hint is Size:
        return _format_quantity(value, "mm")
    assert hint is Signs
    return f'"{value}"'


def _list_constraints(spec: Spec) -> Iterator[str]:
    if spec.constraints:
        yield "constraints:"
    for constraint in spec.constraints:
        yield f"  - platform: {_format_pair(constraint.platform, 'mm')}"
        yield f"    foot: {_format_pair(constraint.foot, 'mm')}"
        if isinstance(constraint, RodConstraint):
            yield f"    rod: {_format_quantity(constraint.rod, 'mm')}"
            if constraint.drive is not None:
                yield f"    on: {constraint.drive}"
        else:
            yield f"    plane_of: {constraint.plane_of}"
            yield f"    normal: {_format_direction(constraint.normal)}"


def _list_steps(key: str, steps: Sequence[Step]) -> Iterator[str]:
    """List the lines of a chain of elementary transforms; none for an empty one."""
    if steps:
        yield f"{key}:"
    for step in steps:
        yield f"  - {step.axis}: {_format_step(step, MOTION_UNITS[step.axis])}"


def _format_step(step: Step, unit: Unit) -> str:
    if step.drive is None:
        return _format_quantity(step.value, unit)
    values = {
        "joint": step.drive.name,
        **dict(_list_drive_values(step.drive)),
        "reverse": "true" if step.sign < 0.0 else "false",
        "offset": _format_quantity(step.value, unit),
    }
    return f"{{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"


def _list_limits(spec: Spec) -> Iterator[str]:
    limits = spec.limits
    lines: list[str] = []
    if limits.passive:
        ranges = (f"{r.name}: {_format_pair((r.low, r.high), MOTION_UNITS[r.name])}" for r in limits.passive)
        lines.append(f"  passive: {{{', '.join(ranges)}}}")
    if limits.gaps:
        lines.append("  gaps:")
    for gap in limits.gaps:
        bounds = _format_pair((gap.low, gap.high), "mm")
        lines.append(f"    - {{between: [{gap.first}, {gap.second}], range: {bounds}}}")
    if limits.cones:
        lines.append("  cones:")
    for cone in limits.cones:
        axis = "" if cone.axis is None else f", axis: {_format_direction(cone.axis)}"
        lines.append(f"    - {{at: {cone.at}, angle: {_format_quantity(cone.angle, 'rad')}{axis}}}")
    if limits.clearance is not None:
        lines.append(f"  clearance: {_format_quantity(limits.clearance, 'mm')}")
    if limits.joined is not None:
        lines.append(f"  joined: [{', '.join(f'[{one}, {two}]' for one, two in limits.joined)}]")
    if lines:
        yield "limits:"
        yield from lines


def _list_bodies(spec: Spec) -> Iterator[str]:
    if spec.bodies:
        yield "bodies:"
    for kind, build in spec.bodies.items():
        values = {"rods": repr(build.rods)} if build.rods != 1 else {}
        for key, unit in _BODY_UNITS.items():
            if getattr(build, key) is not None:
                values[key] = _format_quantity(getattr(build, key), unit)
        yield f"  {kind}: {{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"
