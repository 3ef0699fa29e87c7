"""A path whose records have turns A, B, C: tool axes as programmed, turned about these as a curve along it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...arrays import Array, Indices
from ...kinematics.rotations import compute_rotations, find_turn_about, find_twist, follow_rotations
from ...kinematics.turns import unwind_angles
from ...machine import Machine
from ..linearise.path_records import divide_motions
from ..path import ToolPath
from ..posting.tool_orientation import solve_three_turns
from ..programmed_path import ProgrammedPath, compute_dots

_GLANCE = (0.31, 0.67)  # of a motion: neither a bulge nor an S hides from both
_ROUNDS = 12


class TurnCurve:
    """C of the machine along a path: a uniform cubic B-spline, twice continuous, among its control values' neighbours.

    values : (m,) rad, one a station
    """

    def __init__(self, values: Array):
        self.values = values

    def evaluate(self, at: Array) -> Array:
        """Evaluate the curve at places (k,), counted in stations."""
        last = len(self.values) - 1
        before = np.clip(np.floor(at), 0, max(last - 1, 0)).astype(np.int64)
        t = at - before
        weights = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
        near = self.values[np.clip(before[:, None] + [-1, 0, 1, 2], 0, last)]
        return compute_dots(np.stack(weights, axis=1), near) / 6.0


class _TurnedTool:
    """The tool's turns at places on a path, in W; places are motions by the record they lead to, and shares of them."""

    def __init__(self, path: ToolPath, frame: Array, find_c: Callable[[Indices, Array], Array]):
        self.programmed = ProgrammedPath(path, frame)
        self.rotation, self.find_c = np.ascontiguousarray(frame[:, :3].T), find_c

    def compute_machine_turns(self, motion: Indices, share: Array) -> Array:
        """Compute A, B, C (k, 3) of the machine."""
        c = self.find_c(motion, share)
        (a, b, _), _, _ = solve_three_turns(self.programmed.interpolate(motion, share)[1], c)
        return np.column_stack([a, unwind_angles(b), c])

    def compute_rotations(self, motion: Indices, share: Array) -> Array:
        """Compute the tool's rotations (k, 3, 3) in W."""
        rotations: Array = self.rotation @ compute_rotations(self.compute_machine_turns(motion, share))
        return rotations

    def follow_turns(self, motion: Indices, share: Array) -> Array:
        """Compute A, B, C (k, 3) in W at places in the order of the path, continuous."""
        turns = self.compute_machine_turns(motion, share)
        yaw = find_turn_about(self.rotation, "C")
        if yaw is not None:
            return turns + [0.0, 0.0, yaw]
        return follow_rotations(turns, self.rotation, turns[0] + [0.0, 0.0, find_twist(self.rotation, "C")])


def turn_path(
    machine: Machine, path: ToolPath, frame: Array, find_c: Callable[[Indices, Array], Array], lean: float
) -> ToolPath:
    """Give the records of a path turns A, B, C; C of the machine is that of ``find_c`` at motions and shares.

    Records are inserted where turns that go evenly from record to record would turn the tool off the great circle of
    its axis, or off that C, by more than ``lean`` rad.

    frame : (3, 4), leads into M
    """
    tool = _TurnedTool(path, frame, find_c)
    motion, share = np.maximum(np.arange(len(path)), 1), np.ones(len(path))
    share[0] = 0.0
    turns = tool.follow_turns(motion, share)
    doubtful = np.arange(1, len(path))
    for _ in range(_ROUNDS):
        begin = np.where(motion[doubtful - 1] == motion[doubtful], share[doubtful - 1], 0.0)
        span = share[doubtful] - begin
        off = np.zeros(len(doubtful))
        for glance in _GLANCE:
            even = turns[doubtful - 1] + glance * (turns[doubtful] - turns[doubtful - 1])
            there = tool.compute_rotations(motion[doubtful], begin + glance * span)
            chord = np.linalg.norm(compute_rotations(even) - there, axis=(1, 2)) / np.sqrt(2.0)
            off = np.maximum(off, chord)  # the angle between two rotations is 2·asin(‖R - R'‖ / √8)
        wide = off > lean
        cut = doubtful[wide]
        if not len(cut):
            break
        motion = np.insert(motion, cut, motion[cut])
        share = np.insert(share, cut, (begin + 0.5 * span)[wide])
        turns = tool.follow_turns(motion, share)
        added = cut + np.arange(len(cut))
        doubtful = np.sort(np.concatenate([added, added + 1]))
    inserted = share < 1.0
    inserted[0] = False
    return replace(divide_motions(path, motion[inserted], share[inserted]), turns=turns)
