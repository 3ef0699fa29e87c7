"""From the workpiece frame W to a machine's poses in its frame M: where W lies, and where the tool points."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arguments import check_arguments, parse_coordinate
from ...arrays import Array, Flags, split_rows
from ...errors import PoseError
from ...kinematics.rotations import compute_rotations, list_rotation_rows
from ...machine import Machine
from ...units import AXIS_UNITS
from .programmed_angles import find_programmed_angles
from .tool_orientation import BLOCK, find_tool_orientation
from .turn_steps import add_turn_steps

LEAN = 1e-4  # rad a tool axis may lean where the machine can't tilt it: rounding in the file
OFF_PLANE = 1e-6  # mm, the same across the plane of a machine that works in one


@check_arguments
def workpiece(
    X: float | str = 0.0,
    Y: float | str = 0.0,
    Z: float | str = 0.0,
    A: float | str = 0.0,
    B: float | str = 0.0,
    C: float | str = 0.0,
) -> Array:
    """Build the transform that places a workpiece, (3, 4): R = Rz(C)·Ry(B)·Rx(A) and the origin.

    X, Y, Z : where its frame's origin lies in the machine's frame, mm or texts with their unit
    A, B, C : its angles there, rad or texts with their unit, ``B="30 deg"``

    Raises :class:`PoseError` for what is no finite length or angle.
    """
    values = {"X": X, "Y": Y, "Z": Z, "A": A, "B": B, "C": C}
    numbers = [parse_coordinate(axis, value, AXIS_UNITS[axis]) for axis, value in values.items()]
    if not all(map(math.isfinite, numbers)):
        raise PoseError(f"workpiece: finite numbers expected, not {' '.join(f'{number:g}' for number in numbers)}")
    return build_frame_from_angles(*numbers)


def build_frame_from_angles(x: float, y: float, z: float, a: float, b: float, c: float) -> Array:
    """Build a transform (3, 4): R = Rz(c)·Ry(b)·Rx(a) and the origin; mm, rad."""
    rotation = list_rotation_rows(*((math.sin(angle), math.cos(angle)) for angle in (a, b, c)))
    return np.column_stack([rotation, [x, y, z]])


def find_frame_angles(frame: Array) -> tuple[float, float, float]:
    """Find A, B and C of a transform (3, 4), rad: R = Rz(C)·Ry(B)·Rx(A)."""
    r = frame[:, :3]
    b = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    return math.atan2(r[2, 1], r[2, 2]), b, math.atan2(r[1, 0], r[0, 0])


def compose_frames(outer: Array | None, inner: Array | None) -> Array:
    """Compose two transforms (3, 4), ``outer`` after ``inner``; None stands for no change."""
    outer = build_frame_from_angles(0, 0, 0, 0, 0, 0) if outer is None else outer
    if inner is None:
        return outer
    rotation = outer[:, :3] @ inner[:, :3]
    return np.column_stack([rotation, outer[:, :3] @ inner[:, 3] + outer[:, 3]])


def invert_frame(frame: Array) -> Array:
    """Invert a transform (3, 4)."""
    turned_back = frame[:, :3].T
    return np.column_stack([turned_back, -turned_back @ frame[:, 3]])


@dataclass(frozen=True, eq=False)
class PathLimit:
    """What a path asks for and a machine with fewer axes can't do: a limit of the path, not of the machine.

    name : ``tilt``, ``X``, ``Y`` or ``Z``
    unit : ``mm`` or ``rad``
    values : (n,) what the machine would have to do and can't
    tolerance : of ``values``
    describe : makes the text of an offence from a value's text
    """

    name: str
    unit: str
    values: Array
    tolerance: float
    describe: Callable[[str], str]

    @property
    def broken(self) -> Flags:
        """Which records break it, (n,)."""
        return ~(np.abs(self.values) <= self.tolerance)


def compute_poses(
    machine: Machine,
    tip: Array,
    axis: Array,
    frame: Array,
    turns: Array | None = None,
    exact: Flags | None = None,
) -> tuple[Array, tuple[PathLimit, ...]]:
    """Compute poses (n, axes) for tool tips and axes, (n, 3) each, and what the machine's axes can't follow.

    frame : (3, 4), leads into M
    turns : (n, 3) rad, A, B, C as a program gives them, from which the axes follow
    exact : (n,) which axes were computed, as :class:`~..path.ToolPath` has it

    A machine that turns three ways, or turns its tool about the tool's own axis, takes the whole orientation of the
    turns; one with B and C takes them as programmed where A is zero and the frame turns about Z alone: see
    :func:`~.programmed_angles.find_programmed_angles`.

    Else a turn about the tool's axis is free: C is as at home where the machine turns three ways, and B and C determine
    the axis's direction where it turns two ways (B from 0 to 180°, but below 0 where a path has passed over B = 0, so
    that C does not jump by half a turn; at B = 0 C keeps the neighbour's value, and turns ahead to the next one).

    Raises :class:`PoseError` for a motion of thousands of turns, where they have to be followed.
    """
    orientation = find_tool_orientation(machine)
    rotation = frame[:, :3]
    poses = np.empty((len(tip), len(machine.axes)))
    off_plane = {letter: np.empty(len(tip)) for letter in "XYZ" if letter not in machine.axes}
    columns = [off_plane[c] if c in off_plane else poses[:, machine.axes.index(c)] for c in "XYZ"]
    to_machine = np.ascontiguousarray(rotation.T)
    for block in split_rows(len(tip), BLOCK):
        for column, values, shift in zip(columns, (tip[block] @ to_machine).T, frame[:, 3], strict=True):
            np.add(values, shift, out=column[block])
    angles = None if turns is None else find_programmed_angles(orientation, turns, frame)
    if angles is None or orientation.restriction:
        pointed, lean = orientation.point_along(axis, rotation, exact)
        if angles is None and turns is not None and orientation.letters:
            steps, at_records = add_turn_steps(turns, range(3))
            if len(steps) > len(turns):
                pointed = orientation.point_along(compute_rotations(steps)[:, :, 2], rotation)[0][at_records]
        angles = pointed if angles is None else angles
    poses[:, [machine.axes.index(letter) for letter in orientation.letters]] = angles
    limits = [PathLimit(c, "mm", values, OFF_PLANE, _describe_off_plane(c)) for c, values in off_plane.items()]
    if orientation.restriction:
        text = f"tool axis would lean {{}}, the machine {orientation.restriction}".format
        limits.insert(0, PathLimit("tilt", "rad", lean, LEAN, text))
    return poses, tuple(limits)


def _describe_off_plane(letter: str) -> Callable[[str], str]:
    return f"{letter} would be {{}}, the machine works in {letter} = 0".format
