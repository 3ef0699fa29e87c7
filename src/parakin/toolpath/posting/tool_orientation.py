"""The turns by which a machine points its tool along an axis; a turn about that axis is free."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ...arrays import Array, Flags, split_rows
from ...kinematics.rotations import LEVEL, get_turning_axis
from ...kinematics.turns import turn_ahead, unwind_angles
from ...kinematics.wrist.pole_thresholds import EXACT, PRINTED, is_on_pole
from ...kinematics.wrist.pose_angles import cross_direction_pole, solve_direction
from ...machine import Machine

BLOCK = 1 << 13  # records whose many intermediate arrays stay in the cache

# An angle for each turn, each (n,); where the continuous one is free, (n,) or one for all; the lean left, (n,) or None.
TurnSolution: TypeAlias = tuple[Sequence[Array], Any, Any]


@dataclass(frozen=True)
class ToolOrientation:
    """How a machine points its tool.

    letters : the axes that turn it
    solve : for tool axes k (n, 3) in M, of which some (n,) are exact, an angle for each of the letters, where the
        continuous one of them is free, and how far the tool then still leans off k
    continuous : the letter whose angle is made continuous along a path
    restriction : what the machine does where k asks for another tilt; empty where it can have every tilt
    has_direction : the turns are B and C of the tool's axis
    spins : the machine turns the tool about the tool's own axis, and in no other way
    tool : the tool's rotation in M where the machine's turns are zero
    """

    letters: str
    solve: Callable[[Array, Flags | None], TurnSolution]
    continuous: str | None
    restriction: str = ""
    has_direction: bool = False
    spins: bool = False
    tool: Array | None = None

    def point_along(self, axis: Array, rotation: Array, exact: Flags | None = None) -> tuple[Array, Array]:
        """Find angles (n, letters) without jumps for tool axes (n, 3), and the lean (n,); ``rotation`` leads into M."""
        count = len(axis)
        turns, lean = np.empty((count, len(self.letters)), order="F"), np.zeros(count)  # worked on by columns
        free: Any = np.zeros(count, bool)
        to_machine = np.ascontiguousarray(rotation.T)
        for block in split_rows(count, BLOCK):
            is_exact = None if exact is None else exact[block]
            angles, free[block], leaning = self.solve(axis[block] @ to_machine, is_exact)
            for column, values in enumerate(angles):
                turns[block, column] = values
            if self.restriction:
                lean[block] = leaning
        if self.has_direction:
            cross_direction_pole(turns, np.flatnonzero(~free))
        if self.continuous is not None:
            column = self.letters.index(self.continuous)
            turns[:, column] = _make_continuous(turns[:, column], free)
        return turns, lean


def find_tool_orientation(machine: Machine) -> ToolOrientation:
    """Find how a machine points its tool: by A, B, C, by a direction's B and C, by one turn, or not at all."""
    letters = "".join(machine.axes[column] for column in machine.turning_columns)
    if len(letters) == 3:
        home_c = float(machine.home[machine.turning_columns[-1]])  # C is free, and the machine is made for its home
        return ToolOrientation(letters, lambda k, exact: solve_three_turns(k, home_c), "B")
    if machine.has_direction:
        return ToolOrientation(letters, _solve_direction, "C", has_direction=True)
    tool = np.array(machine.structure.tool_rotation, dtype=np.float64)
    at_home = np.array(machine.structure.tool_axis, dtype=np.float64)
    turning = get_turning_axis(letters[0]) if letters else at_home
    cosine = float(turning @ at_home)
    if is_on_pole(1.0 - cosine * cosine, EXACT):  # no turn, or one about the tool's own axis, which changes nothing
        restriction = "keeps it upright" if abs(at_home[2] - 1.0) < LEVEL else "keeps its direction"

        def solve_no_turn(k: Array, exact: Flags | None) -> TurnSolution:
            return [np.zeros(len(k))] * len(letters), False, _measure_angle(k, at_home)

        return ToolOrientation(letters, solve_no_turn, None, restriction, spins=bool(letters), tool=tool)
    return ToolOrientation(
        letters, lambda k, exact: _solve_one_turn(k, turning, at_home, cosine), letters, "can't follow", tool=tool
    )


def _solve_direction(k: Array, exact: Flags | None) -> TurnSolution:
    """Solve k = Rz(C)·Ry(B)·z for B from 0 to 180° and C."""
    b, c, free = solve_direction(k, exact)
    return [b, c], free, None


def solve_three_turns(k: Array, c: Any) -> TurnSolution:
    """Solve for A and B with C given, one for all or (n,).

    Turned back by C, k is Ry(B)·Rx(A)·z = (sin B cos A, -sin A, cos B cos A).
    """
    cos, sin = np.cos(c), np.sin(c)
    kx, ky, kz = cos * k[:, 0] + sin * k[:, 1], cos * k[:, 1] - sin * k[:, 0], k[:, 2]
    square = kx * kx + kz * kz
    return [np.arctan2(-ky, np.sqrt(square)), np.arctan2(kx, kz), np.full(len(k), c)], is_on_pole(square, PRINTED), None


def _solve_one_turn(k: Array, turning: Array, at_home: Array, cosine: float) -> TurnSolution:
    """Find the angle about the axis ``turning`` that brings the tool's axis from ``at_home`` nearest to k.

    cosine : of the angle between the two axes
    """
    along = k @ turning
    across = np.sqrt(np.maximum(0.0, 1.0 - along * along))
    angle = np.arctan2(k @ np.cross(turning, at_home), k @ at_home - cosine * along)
    return [angle], is_on_pole(across * across, PRINTED), np.abs(np.arctan2(along, across) - math.asin(cosine))


def _measure_angle(k: Array, fixed: Array) -> Array:
    angle: Array = np.arctan2(np.linalg.norm(np.cross(k, fixed), axis=1), k @ fixed)
    return angle


def _make_continuous(angle: Array, free: Any) -> Array:
    """Unwind an angle along a path; where it is free, it keeps the last value, or turns ahead to the next one."""
    if free.any():
        angle = np.zeros_like(angle) if free.all() else turn_ahead(angle, free)
    has_jumps = bool(np.any(np.abs(np.diff(angle)) > math.pi))
    return unwind_angles(angle) if has_jumps else angle
