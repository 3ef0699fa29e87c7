"""From the workpiece frame to a machine's poses: where W lies in M, and what turns a tool's axis asks for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...machine import Machine
from ..path import Floats
from .programmed_angles import compute_rotations, find_programmed_angles
from .tool_orientation import BLOCK, find_tool_orientation
from .turn_steps import add_turn_steps

__all__ = ["PathLimit", "compose_frames", "compute_poses", "frame_from_angles", "workpiece"]

LEAN = 1e-4  # rad a tool axis may lean where the machine can't tilt it: rounding in the file
OFF_PLANE = 1e-6  # mm, the same across the plane of a machine that works in one


def workpiece(
    X: float = 0.0,
    Y: float = 0.0,
    Z: float = 0.0,
    A: float = 0.0,
    B: float = 0.0,
    C: float = 0.0,
) -> Floats:
    """Build the transform that places a workpiece, (3, 4): R = Rz(C)·Ry(B)·Rx(A) and the origin; mm, rad."""
    return frame_from_angles(X, Y, Z, A, B, C)


def frame_from_angles(x: float, y: float, z: float, a: float, b: float, c: float) -> Floats:
    """(3, 4): Rz(c)·Ry(b)·Rx(a) and the origin; mm, rad."""
    (sa, ca), (sb, cb), (sc, cc) = ((math.sin(t), math.cos(t)) for t in (a, b, c))
    return np.array(
        [
            [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa, x],
            [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa, y],
            [-sb, cb * sa, cb * ca, z],
        ]
    )


def compose_frames(outer: Floats | None, inner: Floats | None) -> Floats:
    """``outer`` after ``inner``, (3, 4); None stands for no change."""
    outer = frame_from_angles(0, 0, 0, 0, 0, 0) if outer is None else outer
    if inner is None:
        return outer
    rotation = outer[:, :3] @ inner[:, :3]
    return np.column_stack([rotation, outer[:, :3] @ inner[:, 3] + outer[:, 3]])


@dataclass(frozen=True, eq=False)
class PathLimit:
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


def compute_poses(
    machine: Machine, tip: Floats, axis: Floats, frame: Floats, turns: Floats | None = None
) -> tuple[Floats, tuple[PathLimit, ...]]:
    """Poses for tool tips and axes, (n, 3) each, and what the machine's axes can't follow; ``frame`` leads into M.

    ``turns`` (n, 3), rad, are A, B, C as a program gives them, with the axes that follow from them. A machine that
    turns three ways, or turns its tool about the tool's own axis, takes the whole orientation; one with B and C takes
    these as programmed where A is 0 and the frame turns about Z alone: see
    :func:`~.programmed_angles.find_programmed_angles`.

    Else a turn about the tool's axis is free: C is as at home where the machine turns three ways, and B and C tell the
    axis's direction where it turns two (B from 0 to 180°, but below 0 where a path has passed over B = 0, so that C
    does not jump by half a turn; at B = 0 C keeps the neighbour's value).

    Raises :class:`PoseError` for a motion of thousands of turns, where they have to be followed.
    """
    turning = find_tool_orientation(machine)
    rotation = frame[:, :3]
    poses = np.empty((len(tip), len(machine.axes)))
    off = {letter: np.empty(len(tip)) for letter in "XYZ" if letter not in machine.axes}
    into = [off[letter] if letter in off else poses[:, machine.axes.index(letter)] for letter in "XYZ"]
    across = np.ascontiguousarray(rotation.T)
    for start in range(0, len(tip), BLOCK):
        part = slice(start, start + BLOCK)
        for place, values in zip(into, (tip[part] @ across + frame[:, 3]).T, strict=True):
            place[part] = values
    angles = None if turns is None else find_programmed_angles(turning, turns, frame)
    if angles is None or turning.lean:
        pointed, lean = turning.along(axis, rotation)
        if angles is None and turns is not None and turning.letters:
            thick, at = add_turn_steps(turns, range(3))
            if len(thick) > len(turns):
                pointed = turning.along(compute_rotations(thick)[:, :, 2], rotation)[0][at]
        angles = pointed if angles is None else angles
    for column, letter in enumerate(turning.letters):
        poses[:, machine.axes.index(letter)] = angles[:, column]
    own = [PathLimit(letter, "mm", values, OFF_PLANE, _off_plane(letter)) for letter, values in off.items()]
    if turning.lean:
        text = f"tool axis would lean {{}}, the machine {turning.lean}".format
        own.insert(0, PathLimit("tilt", "rad", lean, LEAN, text))
    return poses, tuple(own)


def _off_plane(letter: str) -> Callable[[str], str]:
    return f"{letter} would be {{}}, the machine works in {letter} = 0".format
