"""From the workpiece frame to a machine's poses: where W lies in M, and what turns a tool's axis asks for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, quote, suggest
from ...machine import Machine
from ...units import ANGLE, LENGTH, QuantityError, parse_quantity
from ..path import Floats
from ..reading.cl.tokens import LARGEST, is_number, number
from .programmed_angles import programmed, rotations
from .tool_axis import BLOCK, turning_of
from .turn_steps import thickened

__all__ = ["OwnLimit", "composed", "parse_value", "parse_workpiece", "tool_poses", "transform"]

_SOURCE = "--workpiece"
_AXES = "XYZABC"
_FORM = 'expected x,y,z or x,y,z,a,b,c (mm, degrees), or names as in "X=10,Z=-1400,C=30"'

LEAN = 1e-4  # rad a tool axis may lean where the machine can't tilt it: rounding in the file
OFF_PLANE = 1e-6  # mm, the same across the plane of a machine that works in one


def parse_workpiece(text: str) -> Floats:
    """The transform of a ``--workpiece`` option, (3, 4): R = Rz(C)·Ry(B)·Rx(A) and the origin, mm.

    ``x,y,z`` or ``x,y,z,a,b,c``, or any of them by name: ``X=10,Z=-1400,C=30``. Plain numbers are mm and degrees; a
    unit may follow (``X=2in``, ``C=0.5rad``).

    Raises :class:`InputError`.
    """
    parts = [part.strip() for part in text.split(",")]
    named = ["=" in part for part in parts]
    values = dict.fromkeys(_AXES, 0.0)
    if any(named) and not all(named):
        raise InputError(f"{quote(text)} has values with a name and without one; {_FORM}", _SOURCE)
    if not all(named) and len(parts) not in (3, 6):
        raise InputError(f"{quote(text)} has {len(parts)} value{'s' * (len(parts) != 1)}; {_FORM}", _SOURCE)
    if all(named):
        pairs = [(name.strip().upper(), value.strip()) for name, _, value in (part.partition("=") for part in parts)]
    else:
        pairs = list(zip(_AXES, parts, strict=False))
    seen = set()
    for name, value in pairs:
        if name not in values:
            raise InputError(f"unknown axis {quote(name)}{suggest(name, _AXES)}", _SOURCE)
        if name in seen:
            raise InputError(f"{name} is given twice", _SOURCE)
        seen.add(name)
        values[name] = parse_value(name, value, _SOURCE)
    return transform(*values.values())


def parse_value(name: str, text: str, source: str, unit: str | None = None) -> float:
    """A value in mm or degrees as a user writes it, with or without a unit; returns mm or rad.

    ``unit`` is the value's own, ``mm`` or ``rad``; without it the axis letter says.
    """
    angular = name in "ABC" if unit is None else unit == "rad"
    try:
        if is_number(text):
            value = number(text)
            return math.radians(value) if angular else value
        value = parse_quantity(text, ANGLE if angular else LENGTH)
    except (QuantityError, InputError) as error:
        message = error.message if isinstance(error, InputError) else str(error)
        raise InputError(f"{name}: {message}", source) from None
    if abs(value) > LARGEST:
        raise InputError(f"{name}: {quote(text)} is out of range", source)
    return value


def transform(x: float, y: float, z: float, a: float, b: float, c: float) -> Floats:
    """(3, 4): Rz(c)·Ry(b)·Rx(a) and the origin; mm, rad."""
    (sa, ca), (sb, cb), (sc, cc) = ((math.sin(t), math.cos(t)) for t in (a, b, c))
    return np.array(
        [
            [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa, x],
            [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa, y],
            [-sb, cb * sa, cb * ca, z],
        ]
    )


def composed(outer: Floats | None, inner: Floats | None) -> Floats:
    """``outer`` after ``inner``, (3, 4); None stands for no change."""
    outer = transform(0, 0, 0, 0, 0, 0) if outer is None else outer
    if inner is None:
        return outer
    rotation = outer[:, :3] @ inner[:, :3]
    return np.column_stack([rotation, outer[:, :3] @ inner[:, 3] + outer[:, 3]])


@dataclass(frozen=True, eq=False)
class OwnLimit:
    """What a machine with fewer axes than a path may ask for can't do: a limit of the path, not of the machine.

    name : ``tilt``, ``X``, ``Y`` or ``Z``
    unit : ``mm`` or ``rad``
    values : (n,) what the machine would have to do and can't
    tolerance : of ``values``
    text : what to say of a value
    """

    name: str
    unit: str
    values: Floats
    tolerance: float
    text: Callable[[str], str]

    @property
    def broken(self) -> NDArray[np.bool_]:
        return ~(np.abs(self.values) <= self.tolerance)


def tool_poses(
    machine: Machine, tip: Floats, axis: Floats, frame: Floats, turns: Floats | None = None
) -> tuple[Floats, tuple[OwnLimit, ...]]:
    """Poses for tool tips and axes, (n, 3) each, and what the machine's axes can't follow; ``frame`` leads into M.

    ``turns`` (n, 3), rad, are A, B, C as a program gives them, with the axes that follow from them. A machine that
    turns three ways, or turns its tool about the tool's own axis, takes the whole orientation; one with B and C takes
    these as programmed where A is 0 and the frame turns about Z alone: see :func:`~.programmed.programmed`.

    Else a turn about the tool's axis is free: C is as at home where the machine turns three ways, and B and C tell the
    axis's direction where it turns two (B from 0 to 180°, but below 0 where a path has passed over B = 0, so that C
    does not jump by half a turn; at B = 0 C keeps the neighbour's value).

    Raises :class:`PoseError` for a motion of thousands of turns, where they have to be followed.
    """
    turning = turning_of(machine)
    rotation = frame[:, :3]
    poses = np.empty((len(tip), len(machine.axes)))
    off = {letter: np.empty(len(tip)) for letter in "XYZ" if letter not in machine.axes}
    into = [off[letter] if letter in off else poses[:, machine.axes.index(letter)] for letter in "XYZ"]
    across = np.ascontiguousarray(rotation.T)
    for start in range(0, len(tip), BLOCK):
        part = slice(start, start + BLOCK)
        for place, values in zip(into, (tip[part] @ across + frame[:, 3]).T, strict=True):
            place[part] = values
    angles = None if turns is None else programmed(turning, turns, frame)
    if angles is None or turning.lean:
        pointed, lean = turning.along(axis, rotation)
        if angles is None and turns is not None and turning.letters:
            thick, at = thickened(turns, range(3))
            if len(thick) > len(turns):
                pointed = turning.along(rotations(thick)[:, :, 2], rotation)[0][at]
        angles = pointed if angles is None else angles
    for column, letter in enumerate(turning.letters):
        poses[:, machine.axes.index(letter)] = angles[:, column]
    own = [OwnLimit(letter, "mm", values, OFF_PLANE, _off_plane(letter)) for letter, values in off.items()]
    if turning.lean:
        text = f"tool axis would lean {{}}, the machine {turning.lean}".format
        own.insert(0, OwnLimit("tilt", "rad", lean, LEAN, text))
    return poses, tuple(own)


def _off_plane(letter: str) -> Callable[[str], str]:
    return f"{letter} would be {{}}, the machine works in {letter} = 0".format
