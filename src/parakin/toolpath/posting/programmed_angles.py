"""Turns A, B, C as a program gives them, on a machine that takes them: it makes them turn for turn."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kinematics.rotations import LEVEL, TURNS, find_turn_about, find_twist, follow_rotations, follow_twists
from ...kinematics.turns import measure_whole_turns
from .tool_orientation import ToolOrientation
from .turn_steps import add_turn_steps


def find_programmed_angles(orientation: ToolOrientation, turns: Array, frame: Array) -> Array | None:
    """Find the machine's angles (n, letters) for turns (n, 3) in W; None where only the tool's axis determines them.

    Where the frame turns about one of the machine's own axes alone (C, where there are several), the angles are those
    programmed, and that axis's has the frame's added. Else they are those of the rotation in M: continuous, with turns
    counted as A, B and C go evenly from record to record, and nearest to those programmed at the start.
    """
    letters, last = orientation.letters, orientation.letters[-1:]
    if not letters or not len(turns):
        return None
    rotation = frame[:, :3]
    yaw = find_turn_about(rotation, last)
    own = [letter in letters for letter in TURNS]
    upright = orientation.tool is None or np.abs(orientation.tool - np.eye(3)).max() < LEVEL
    if yaw is not None and upright and not turns[:, [not letter for letter in own]].any():
        angles = turns[:, own]
        angles[:, -1] += yaw
        return angles
    if len(letters) < 3 and not orientation.spins:
        return None
    steps, at_records = add_turn_steps(turns, range(3))
    start = turns[0, own] + np.append(np.zeros(len(letters) - 1), yaw or find_twist(rotation, last))
    if orientation.spins:
        assert orientation.tool is not None
        angles = follow_twists(steps, rotation, orientation.tool, last)[:, None]
    else:
        angles = follow_rotations(steps, rotation, start)
    angles += measure_whole_turns(angles[0], start)
    at_given: Array = angles[at_records]
    return at_given
