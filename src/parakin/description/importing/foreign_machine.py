"""A machine that another program's configuration describes, as legs of parakin's kinds, and its machine file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import degrees, hypot, inf, isfinite, pi
from pathlib import Path

import numpy as np

from ...algebra import IDENTITY
from ...errors import InputError
from ...model.elements import Drive, Vector
from ...model.legs import Leg
from ...model.legs.length import Length

_HEIGHTS = 2000  # of the tip that are tried for a home
_WIDE = 10.0  # of a machine's size: a range without an end in the configuration ends there


@dataclass(frozen=True)
class ForeignMachine:
    """A machine of another program.

    kinematics : the program's name of its kinematics
    side : on which side of the base the platform works, 1 above, -1 below, 0 either
    level : height of the base, mm
    turning_axes : names of the pose's angles
    box : limits of X, Y and Z, mm, where the configuration has them
    missing : files that the configuration names, and that are not there
    """

    program: str
    kinematics: str
    source: str
    motion: str
    legs: tuple[Leg, ...]
    side: int = 0
    level: float = 0.0
    turning_axes: tuple[str, ...] = ()
    box: tuple[tuple[float, float], ...] = ((-inf, inf),) * 3
    missing: tuple[str, ...] = ()


def format_machine_yaml(machine: ForeignMachine, name: str) -> str:
    """Format the machine file, with all digits.

    Raises :class:`InputError` where no pose over the middle of the feet is within all ranges.
    """
    size = _measure_size(machine)
    x, y, z = _find_home(machine, size)
    turns = "".join(f", {letter}: 0 deg" for letter in machine.turning_axes)
    return "\n".join(
        [
            f"# {machine.kinematics} of {machine.program}, as its configuration has it.",
            f"name: {name}",
            f"title: {machine.kinematics} of {machine.program}",
            "source: >",
            f"  Imported by parakin from {Path(machine.source).name}.",
            f"  Joints are counted as {machine.program} counts them.",
            *(f"  Not read, for it was not there: {name}." for name in machine.missing),
            f"motion: {machine.motion}",
            "legs:",
            *(line for leg in machine.legs for line in _format_leg(leg, size)),
            f"home: {{X: {x!r} mm, Y: {y!r} mm, Z: {z!r} mm{turns}}}  # chosen, far from all limits",
            "",
        ]
    )


def _format_leg(leg: Leg, size: float) -> list[str]:
    """Format a leg, a line for each of its sizes and limits."""
    drive = leg.drives[0]
    lines = [f"  - kind: {leg.kind}", f"    joints: [{drive.name}]"]
    for field in fields(leg):
        value = getattr(leg, field.name)
        if field.name == "drives":
            continue
        if field.type == "Signs":
            text = f'"{value}"'
        elif field.type == "Direction":
            text = f"[{', '.join(repr(v + 0.0) for v in value)}]"
        elif field.type == "Point":
            text = f"[{', '.join(f'{_round(v)!r} mm' for v in value)}]"
        else:
            text = f"{_round(value)!r} mm"
        lines.append(f"    {field.name}: {text}")
    low, high = _bound_range(drive, size)
    note = "" if isfinite(drive.low) and isfinite(drive.high) else "  # wide: the configuration has no limit there"
    lines.append(f"    range: [{_format_value(low, drive)}, {_format_value(high, drive)}]{note}")
    for key, suffix in (("speed", "/s"), ("acceleration", "/s2")):
        if isfinite(getattr(drive, key)):
            lines.append(f"    {key}: {_format_value(getattr(drive, key), drive)}{suffix}")
    return lines


def _bound_range(drive: Drive, size: float) -> tuple[float, float]:
    """Return a drive's range, with wide ends where it has none."""
    wide = pi if drive.unit == "rad" else _WIDE * size
    return (drive.low if isfinite(drive.low) else -wide), (drive.high if isfinite(drive.high) else wide)


def _round(value: float) -> float:
    """Round a length to a picometre, which takes off what its conversion to mm has added."""
    return round(float(value), 9) + 0.0


def _format_value(value: float, drive: Drive) -> str:
    return f"{round(degrees(value), 9)!r} deg" if drive.unit == "rad" else f"{_round(value)!r} mm"


def _find_home(machine: ForeignMachine, size: float) -> Vector:
    """Find the tip at which the least margin is greatest, over the middles of the feet and of the axes' limits.

    Poses within the axes' limits are preferred; joints' ranges are kept in any case.
    """
    starts = [_get_start(leg) for leg in machine.legs]
    columns = [tuple(sum(start[i] for start in starts) / len(starts) for i in range(2))]
    if all(isfinite(end) for limits in machine.box[:2] for end in limits):
        columns.append((sum(machine.box[0]) / 2.0, sum(machine.box[1]) / 2.0))
    signs = [sign for sign in (1.0, -1.0) if not machine.side * sign < 0.0]
    tips = [
        (round(x, 3) + 0.0, round(y, 3) + 0.0, round(machine.level + sign * 3.0 * size * step / _HEIGHTS, 3))
        for x, y in columns
        for step in range(1, _HEIGHTS)
        for sign in signs
    ]
    with np.errstate(all="ignore"):  # a pose where a leg's direction is undefined has no margin
        margins = [min(_measure_margin(leg, tip, size) for leg in machine.legs) for tip in tips]
    inside = [_is_inside(tip, machine.box) for tip in tips]
    best = max(range(len(tips)), key=lambda i: (margins[i] > 0.0 and inside[i], margins[i]))
    if not margins[best] > 0.0:
        raise InputError("no pose over the middle of its feet is within the ranges of all joints", machine.source)
    return tips[best]


def _is_inside(tip: Vector, box: tuple[tuple[float, float], ...]) -> bool:
    return all(low <= value <= high for value, (low, high) in zip(tip, box, strict=True))


def _measure_margin(leg: Leg, tip: Vector, size: float) -> float:
    """Measure how far a leg is from its limits, as a fraction, with the platform level; NaN or negative out of them."""
    point = tuple(float(x) for x in leg.place_joint(IDENTITY, tip))
    drive, inverse = leg.drives[0], leg.inverse(point, getattr(leg, "branch", ""))
    if not isfinite(inverse.joints[0]) or any(not reach.margin > 0.0 for reach in inverse.reach):
        return -inf
    q, (low, high) = float(inverse.joints[0]), _bound_range(drive, size)
    margins = [2.0 * (q - low) / (high - low), 2.0 * (high - q) / (high - low)]
    if drive.unit == "rad":
        margins += [float(reach.margin) / size**2 for reach in inverse.reach]
    if isinstance(leg, Length):  # near its base a platform is singular
        margins.append(abs(point[2] - leg.foot[2]) / size)
    return min(margins)


def _get_start(leg: Leg) -> Sequence[float]:
    """Return where a leg stands on the base."""
    start: Sequence[float] = getattr(leg, "pivot" if leg.kind == "crank" else "foot")
    return start


def _measure_size(machine: ForeignMachine) -> float:
    """Measure a machine: the greatest size of a leg, mm."""
    sizes = [hypot(*_get_start(leg)) for leg in machine.legs]
    return max([*sizes, *(float(getattr(leg, name, 0.0)) for leg in machine.legs for name in ("rod", "arm"))])
