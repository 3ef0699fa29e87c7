"""The turns a machine takes to point its tool along an axis; a turn about that axis is free."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...kinematics.wrist import PRINTED, cross_direction_pole, fill_free, unwind_angles
from ...machine import Machine
from ..path import Floats

BLOCK = 1 << 13  # records of which the many intermediate arrays stay in the cache


@dataclass(frozen=True)
class ToolOrientation:
    """How a machine points its tool.

    letters : of its turns
    angles : from axes k (n, 3) in M: an angle for each of its turns, where the one that is wound is free, and how far
        the tool then still leans off k
    wound : the letter that is made continuous
    lean : what the machine does where k asks for another tilt; empty where it can have every one
    has_direction : the turns are B and C of the tool's axis
    spins : it turns the tool about the tool's own axis, and no other way
    tool : the tool's rotation in M where the machine's turns are 0
    """

    letters: str
    angles: Callable[[Floats], tuple[Sequence[Floats], Any, Any]]
    wound: str | None
    lean: str = ""
    has_direction: bool = False
    spins: bool = False
    tool: Floats | None = None

    def along(self, axis: Floats, rotation: Floats) -> tuple[Floats, Floats]:
        """Angles (n, turns) for tool axes (n, 3) that ``rotation`` leads into M, without jumps, and the lean (n,)."""
        count = len(axis)
        turns, lean = np.empty((count, len(self.letters))), np.zeros(count)
        free: Any = np.zeros(count, bool)
        across = np.ascontiguousarray(rotation.T)
        for start in range(0, count, BLOCK):
            part = slice(start, start + BLOCK)
            angles, free[part], leaning = self.angles(axis[part] @ across)
            for column, values in enumerate(angles):
                turns[part, column] = values
            if self.lean:
                lean[part] = leaning
        if self.has_direction:
            cross_direction_pole(turns, np.flatnonzero(~free))
        if self.wound is not None:
            column = self.letters.index(self.wound)
            turns[:, column] = _continuous(turns[:, column], free)
        return turns, lean


def find_tool_orientation(machine: Machine) -> ToolOrientation:
    """How a machine points its tool."""
    turns = "".join(letter for letter in machine.axes if letter in "ABC")
    if len(turns) == 3:
        held = float(machine.home[-1])  # what C is free to be, for which the machine is made
        return ToolOrientation(turns, lambda k: _three_turns(k, held), "B")
    if machine.has_direction:
        return ToolOrientation(turns, _two_turns, "C", has_direction=True)
    tool = np.array(machine.structure.tool_rotation, dtype=np.float64)
    fixed = np.array(machine.structure.tool_axis, dtype=np.float64)
    upright = abs(fixed[2] - 1.0) < 1e-12
    about = np.eye(3)["ABC".index(turns[0])] if turns else fixed
    share = float(about @ fixed)
    if 1.0 - share * share < 1e-18:  # no turn, or one about the tool's own axis: it changes nothing
        lean = "keeps it upright" if upright else "keeps its direction"

        def none(k: Floats) -> tuple[Sequence[Floats], Any, Any]:
            return [np.zeros(len(k))] * len(turns), False, _angle(k, fixed)

        return ToolOrientation(turns, none, None, lean, spins=bool(turns), tool=tool)
    return ToolOrientation(turns, lambda k: _one_turn(k, about, fixed, share), turns, "can't follow", tool=tool)


def _two_turns(k: Floats) -> tuple[Sequence[Floats], Any, Any]:
    kx, ky, kz = k.T
    square = kx * kx + ky * ky
    return [np.arctan2(np.sqrt(square), kz), np.arctan2(ky, kx)], square < PRINTED * PRINTED, None


def _three_turns(k: Floats, c: float) -> tuple[Sequence[Floats], Any, Any]:
    """Turned back by C, k is Ry(B)·Rx(A)·z = (sin B cos A, -sin A, cos B cos A)."""
    cos, sin = math.cos(c), math.sin(c)
    kx, ky, kz = cos * k[:, 0] + sin * k[:, 1], cos * k[:, 1] - sin * k[:, 0], k[:, 2]
    square = kx * kx + kz * kz
    return [np.arctan2(-ky, np.sqrt(square)), np.arctan2(kx, kz), np.full(len(k), c)], square < PRINTED * PRINTED, None


def _one_turn(k: Floats, about: Floats, fixed: Floats, share: float) -> tuple[Sequence[Floats], Any, Any]:
    """The angle about ``about`` that brings ``fixed`` nearest to k; ``share`` is the fixed axis's part along it."""
    along = k @ about
    across = np.sqrt(np.maximum(0.0, 1.0 - along * along))
    angle = np.arctan2(k @ np.cross(about, fixed), k @ fixed - share * along)
    return [angle], across * across < PRINTED * PRINTED, np.abs(np.arctan2(along, across) - math.asin(share))


def _angle(k: Floats, fixed: Floats) -> Floats:
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(k, fixed), axis=1), k @ fixed)
    return angle


def _continuous(angle: Floats, free: Any) -> Floats:
    """The angle without jumps; where it is free, it keeps the neighbour's value."""
    if free.any():
        angle = np.zeros_like(angle) if free.all() else fill_free(angle, free)
    jumps = bool(np.any(np.abs(np.diff(angle)) > math.pi))
    return unwind_angles(angle) if jumps else angle
