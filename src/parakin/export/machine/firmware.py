"""A delta as the configuration of a firmware: Klipper's printer.cfg sections, RepRapFirmware's M665, M666 and M669.

Both count a carriage's height from the nozzle's zero, z + √(L² - r²), and Klipper a rotary delta's arms from level up.
Where a machine counts from elsewhere, what is written is the same machine, and a comment tells how each joint differs.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from math import atan2, cos, degrees, hypot, isfinite, sin, sqrt
from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import NoMethodError
from ...machine import Machine
from ...version import __version__

_ALIKE = 1e-6  # mm; radii that differ by no more are one
_TOWERS = (210.0, 330.0, 90.0)  # deg, of towers X, Y and Z of RepRapFirmware


@dataclass(frozen=True)
class _Tower:
    """A tower as firmwares see it: its joint, where it stands, its rod, its carriage's range, the joint's offset."""

    joint: str
    radius: float
    angle: float  # deg, in [0, 360)
    rod: float
    low: float
    high: float
    offset: float  # joint less the firmware's height of the carriage, mm


@dataclass(frozen=True)
class _Arm:
    """An arm as Klipper sees it: its joint, its shoulder, the arm's and the rod's length, the nozzle's Z at the top."""

    joint: str
    radius: float
    height: float
    angle: float  # deg, in [0, 360)
    upper: float
    lower: float
    top: float
    rises: bool  # with the joint


def render_klipper(machine: Machine) -> str:
    """Render Klipper's sections of a linear or rotary delta, to be completed by pins and the like.

    Raises :class:`NoMethodError` for another machine.
    """
    rotary = all(leg.kind == "crank" for leg in machine.legs)
    head, steppers = _list_rotary_delta(machine) if rotary else _list_linear_delta(machine)
    what = (
        f"# {machine.name}, by parakin {__version__}: the sizes of a delta. Pins, endstops and speeds are to be added."
    )
    return "\n".join([what, "[printer]", *head, *steppers, ""])


def _list_linear_delta(machine: Machine) -> tuple[list[str], list[str]]:
    """List the lines of the section of a linear delta, and of its steppers."""
    towers = _list_towers(machine)
    lines = []
    for letter, tower in zip("abc", towers, strict=True):
        top = tower.high - sqrt(tower.rod**2 - tower.radius**2)
        lines += [
            "",
            f"[stepper_{letter}]  # {_describe_joint(tower)}",
            f"arm_length: {_format(tower.rod)}",
            f"angle: {_format(tower.angle)}",
            f"position_endstop: {_format(top)}",
        ]
    return ["kinematics: delta", f"delta_radius: {_format(towers[0].radius)}"], lines


def _list_rotary_delta(machine: Machine) -> tuple[list[str], list[str]]:
    """List the lines of the section of a rotary delta, and of its steppers."""
    shift = _find_shift(machine)
    arms = [_make_arm(machine, number, shift) for number in range(3)]
    for shoulders in ([arm.radius for arm in arms], [arm.height for arm in arms]):
        if max(shoulders) - min(shoulders) > _ALIKE:
            raise NoMethodError(
                f"{machine.name}: its shoulders differ in radius or height, which this firmware does not know"
            )
    if arms[0].height <= 0.0:
        raise NoMethodError(f"{machine.name}: its shoulders are not above Z 0, which this firmware asks for")
    lines = []
    for letter, arm in zip("abc", arms, strict=True):
        lines += [
            "",
            f"[stepper_{letter}]  # {arm.joint}{'' if arm.rises else ', which counts downward'}",
            f"upper_arm_length: {_format(arm.upper)}",
            f"lower_arm_length: {_format(arm.lower)}",
            f"angle: {_format(arm.angle)}",
            f"position_endstop: {_format(arm.top)}",
        ]
    sizes = [f"shoulder_radius: {_format(arms[0].radius)}", f"shoulder_height: {_format(arms[0].height)}"]
    return ["kinematics: rotary_delta", *sizes], lines


def _make_arm(machine: Machine, number: int, shift: Array) -> _Arm:
    leg, drive = machine.legs[number], machine.legs[number].drives[0]
    crank: Any = leg
    place = np.array(crank.pivot, float) - np.array(leg.platform, float) + shift
    zero, axis = np.array(crank.zero, float), np.array(crank.axis, float)
    radius, height = hypot(*place[:2]), float(place[2])
    out = np.array([*place[:2], 0.0]) / max(radius, _ALIKE)
    rises = bool(np.cross(axis, zero)[2] > 0.0)
    level = np.allclose(zero, out, atol=1e-9) and abs(axis[2]) < 1e-9
    if not level or crank.branch != ("-" if rises else "+"):
        raise NoMethodError(
            f"{machine.name}: {drive.name} is no arm that points outward at zero, with its knee outside and above"
        )
    high = drive.high if rises else -drive.low
    if not isfinite(high):
        raise NoMethodError(f"{machine.name}: {drive.name} has no limit for the endstop above")
    arm, rod = float(crank.arm), float(crank.rod)
    below = rod**2 - (radius + arm * cos(high)) ** 2
    top = arm * sin(high) - sqrt(max(below, 0.0))  # over the shoulder
    if below <= 0.0 or cos(high) * top + sin(high) * radius >= 0.0:
        raise NoMethodError(
            f"{machine.name}: with all arms at the upper limit of {drive.name} their knees are not outside: "
            "the firmware asks for an endstop that they reach"
        )
    angle = degrees(atan2(place[1], place[0])) % 360.0
    return _Arm(drive.name, radius, height, angle, arm, rod, height + top, rises)


def render_reprapfirmware(machine: Machine) -> str:
    """Render RepRapFirmware's M669, M665 and M666 of a linear delta.

    Raises :class:`NoMethodError` for another machine.
    """
    towers = min(permutations(_list_towers(machine)), key=lambda order: sum(map(abs, _correct_angles(order))))
    tops = [tower.high - sqrt(tower.rod**2 - tower.radius**2) for tower in towers]
    height = sum(tops) / len(tops)
    corrections = [f"{letter}{_format(turn)}" for letter, turn in zip("XYZ", _correct_angles(towers), strict=True)]
    endstops = [f"{letter}{_format(top - height)}" for letter, top in zip("XYZ", tops, strict=True)]
    rods = ":".join(dict.fromkeys(_format(tower.rod) for tower in towers))
    if ":" in rods:
        rods = ":".join(_format(tower.rod) for tower in towers)
    return "\n".join(
        [
            f"; {machine.name}, by parakin {__version__}",
            *(f"; tower {letter}: {_describe_joint(tower)}" for letter, tower in zip("XYZ", towers, strict=True)),
            "M669 K3",
            f"M665 R{_format(towers[0].radius)} L{rods} H{_format(height)} {' '.join(corrections)}",
            f"M666 {' '.join(endstops)}",
            "",
        ]
    )


def _list_towers(machine: Machine) -> list[_Tower]:
    """List the towers of a linear delta, in the order of its joints."""
    shift = _find_shift(machine)
    towers = [_make_tower(machine, number, shift) for number in range(3)]
    if max(tower.radius for tower in towers) - min(tower.radius for tower in towers) > _ALIKE:
        raise NoMethodError(f"{machine.name}: its towers stand at different radii, which this firmware does not know")
    return towers


def _find_shift(machine: Machine) -> Array:
    """Find how far the tip is from the platform's middle, and the base from the machine's origin, mm."""
    structure = machine.structure
    upright = np.allclose(np.array(structure.mount, float), np.eye(3), atol=1e-12)
    if machine.axes != ("X", "Y", "Z") or len(machine.legs) != 3 or not upright:
        raise NoMethodError(f"{machine.name}: only a delta of three legs can be written for this firmware")
    return np.asarray(np.array(structure.tip, float) + np.array(structure.base, float))


def _make_tower(machine: Machine, number: int, shift: Array) -> _Tower:
    leg = machine.legs[number]
    drive = leg.drives[0]
    rail = np.array(getattr(leg, "rail", (0.0, 0.0, 0.0)), float)
    if leg.kind != "slider" or not np.allclose(rail, [0.0, 0.0, 1.0], atol=1e-12) or getattr(leg, "branch", "") != "+":
        raise NoMethodError(f"{machine.name}: leg {drive.name} is no tower with its carriage above the platform")
    if not isfinite(drive.high):
        raise NoMethodError(f"{machine.name}: {drive.name} has no upper limit for the endstop")
    foot: Any = getattr(leg, "foot")  # noqa: B009  a slider's, as its kind says
    rod: Any = getattr(leg, "rod")  # noqa: B009
    place = np.array(foot, float) - np.array(leg.platform, float) + shift
    angle = degrees(atan2(place[1], place[0])) % 360.0
    height = float(place[2])  # of joint zero over the firmware's
    return _Tower(drive.name, hypot(*place[:2]), angle, float(rod), drive.low + height, drive.high + height, -height)


def _correct_angles(towers: tuple[_Tower, ...]) -> list[float]:
    """Compute how far towers stand from RepRapFirmware's directions, degrees within half a turn."""
    return [(tower.angle - usual + 180.0) % 360.0 - 180.0 for tower, usual in zip(towers, _TOWERS, strict=True)]


def _describe_joint(tower: _Tower) -> str:
    if abs(tower.offset) < _ALIKE:
        return tower.joint
    side = "above" if tower.offset < 0.0 else "below"
    return f"{tower.joint}, whose zero is {_format(abs(tower.offset))} mm {side} this one's"


def _format(value: float) -> str:
    """Format a number with all its digits but rounding's last ones."""
    return f"{round(value, 9) + 0.0:.12g}"
