"""From the workpiece frame to a machine's poses: where W lies in M, and what turns a tool's axis asks for."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import apply
from ..errors import InputError
from ..kinematics.path import neighbours, over_the_pole, swings, unwound
from ..machine import Machine
from ..model.structures import Free
from ..quantities import ANGLE, LENGTH, QuantityError, nearest, quantity, shown
from .cl_words import LARGEST, is_number, number
from .program import Floats

_SOURCE = "--workpiece"
_AXES = "XYZABC"
_BLOCK = 1 << 13  # records
_FORM = 'expected x,y,z or x,y,z,a,b,c (mm, degrees), or names as in "X=10,Z=-1400,C=30"'

LEAN = 1e-4  # rad a tool axis may lean where the machine can't tilt it: rounding in the file
ROUNDED = 2e-6  # rad from a turning axis: a CL file with six decimals can't tell the angle about it
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
        raise InputError(f"{shown(text)} has values with a name and without one; {_FORM}", _SOURCE)
    if not all(named) and len(parts) not in (3, 6):
        raise InputError(f"{shown(text)} has {len(parts)} value{'s' * (len(parts) != 1)}; {_FORM}", _SOURCE)
    if all(named):
        pairs = [(name.strip().upper(), value.strip()) for name, _, value in (part.partition("=") for part in parts)]
    else:
        pairs = list(zip(_AXES, parts, strict=False))
    seen = set()
    for name, value in pairs:
        if name not in values:
            raise InputError(f"unknown axis {shown(name)}{nearest(name, _AXES)}", _SOURCE)
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
        value = quantity(text, ANGLE if angular else LENGTH)
    except (QuantityError, InputError) as error:
        message = error.message if isinstance(error, InputError) else str(error)
        raise InputError(f"{name}: {message}", source) from None
    if abs(value) > LARGEST:
        raise InputError(f"{name}: {shown(text)} is out of range", source)
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


def tool_poses(machine: Machine, tip: Floats, axis: Floats, frame: Floats) -> tuple[Floats, tuple[OwnLimit, ...]]:
    """Poses for tool tips and axes, (n, 3) each, and what the machine's axes can't follow; ``frame`` leads into M.

    A turn about the tool's axis is free: C is 0 where the machine turns three ways, and B and C tell the axis's
    direction where it turns two (B from 0 to 180°, but below 0 where a path has passed over B = 0, so that C does not
    jump by half a turn; at B = 0 C keeps the neighbour's value).
    """
    count = len(tip)
    turns = [letter for letter in machine.axes if letter in "ABC"]
    turning = _turning(machine, turns)
    poses = np.empty((count, len(machine.axes)))
    free: Any = np.zeros(count, bool)
    lean = np.zeros(count) if turning.lean else None
    off = {letter: np.empty(count) for letter in "XYZ" if letter not in machine.axes}
    rotation, origin = np.ascontiguousarray(frame[:, :3].T), frame[:, 3]
    # In blocks the many intermediate arrays stay in the cache.
    for start in range(0, count, _BLOCK):
        part = slice(start, start + _BLOCK)
        point, k = tip[part] @ rotation + origin, axis[part] @ rotation
        for column, letter in enumerate("XYZ"):
            into = off[letter][part] if letter in off else poses[part, machine.axes.index(letter)]
            into[...] = point[:, column]
        angles, free[part], leaning = turning.angles(k)
        for letter, values in zip(turns, angles, strict=True):
            poses[part, machine.axes.index(letter)] = values
        if lean is not None:
            lean[part] = leaning
    if turns == ["B", "C"]:
        _go_on_over_the_pole(poses, machine.axes.index("B"), machine.axes.index("C"), np.flatnonzero(~free))
    if turning.wound is not None:
        column = machine.axes.index(turning.wound)
        poses[:, column] = _continuous(poses[:, column], free)
    own = [OwnLimit(letter, "mm", values, OFF_PLANE, _off_plane(letter)) for letter, values in off.items()]
    if lean is not None:
        own.insert(
            0, OwnLimit("tilt", "rad", lean, LEAN, f"tool axis would lean {{}}, the machine {turning.lean}".format)
        )
    return poses, tuple(own)


def _off_plane(letter: str) -> Callable[[str], str]:
    return f"{letter} would be {{}}, the machine works in {letter} = 0".format


def _go_on_over_the_pole(poses: Floats, b: int, c: int, at: Any) -> None:
    """B and C that point the same way, with B of the other sign where that keeps C continuous; in place."""
    here = poses[at][:, [c, b]]
    if swings(here):
        there = np.column_stack([here[:, 0] + math.pi, -here[:, 1]])
        across = over_the_pole(here, there)
        poses[at[across], c], poses[at[across], b] = there[across].T


def _continuous(angle: Floats, free: Any) -> Floats:
    """The angle without jumps; where it is free, it keeps the neighbour's value."""
    if free.any():
        angle = np.zeros_like(angle) if free.all() else neighbours(angle, free)
    jumps = bool(np.any(np.abs(np.diff(angle)) > math.pi))
    return unwound(angle) if jumps else angle


@dataclass(frozen=True)
class _Turning:
    """How a machine points its tool.

    angles : from axes k (n, 3) in M: an angle for each of its turns, where the one that is wound is free, and how far
        the tool then still leans off k
    wound : the letter that is made continuous
    lean : what the machine does where k asks for another tilt; empty where it can have every one
    """

    angles: Callable[[Floats], tuple[Sequence[Floats], Any, Any]]
    wound: str | None
    lean: str = ""


def _turning(machine: Machine, turns: list[str]) -> _Turning:
    if len(turns) == 3:
        return _Turning(_three_turns, "B")
    if turns == ["B", "C"]:
        return _Turning(_two_turns, "C")
    structure = machine.model.structure
    assert isinstance(structure, Free)
    fixed = np.array(apply(structure.mount, apply(structure.tool, (0.0, 0.0, 1.0))), dtype=np.float64)
    upright = abs(fixed[2] - 1.0) < 1e-12
    about = np.eye(3)["ABC".index(turns[0])] if turns else fixed
    share = float(about @ fixed)
    if 1.0 - share * share < 1e-18:  # no turn, or one about the tool's own axis: it changes nothing
        lean = "keeps it upright" if upright else "keeps its direction"
        return _Turning(lambda k: ([np.zeros(len(k))] * len(turns), False, _angle(k, fixed)), None, lean)
    return _Turning(lambda k: _one_turn(k, about, fixed, share), turns[0], "can't follow")


def _two_turns(k: Floats) -> tuple[Sequence[Floats], Any, Any]:
    kx, ky, kz = k.T
    square = kx * kx + ky * ky
    return [np.arctan2(np.sqrt(square), kz), np.arctan2(ky, kx)], square < ROUNDED * ROUNDED, None


def _three_turns(k: Floats) -> tuple[Sequence[Floats], Any, Any]:
    """C = 0: k = Ry(B)·Rx(A)·z = (sin B cos A, -sin A, cos B cos A)."""
    kx, ky, kz = k.T
    square = kx * kx + kz * kz
    return [np.arctan2(-ky, np.sqrt(square)), np.arctan2(kx, kz), np.zeros(len(k))], square < ROUNDED * ROUNDED, None


def _one_turn(k: Floats, about: Floats, fixed: Floats, share: float) -> tuple[Sequence[Floats], Any, Any]:
    """The angle about ``about`` that brings ``fixed`` nearest to k; ``share`` is the fixed axis's part along it."""
    along = k @ about
    across = np.sqrt(np.maximum(0.0, 1.0 - along * along))
    angle = np.arctan2(k @ np.cross(about, fixed), k @ fixed - share * along)
    return [angle], across * across < ROUNDED * ROUNDED, np.abs(np.arctan2(along, across) - math.asin(share))


def _angle(k: Floats, fixed: Floats) -> Floats:
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(k, fixed), axis=1), k @ fixed)
    return angle
