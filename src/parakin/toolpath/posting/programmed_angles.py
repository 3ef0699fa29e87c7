"""Turns A, B, C as a program gives them, on a machine that takes them: what is programmed is done, turn for turn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...kinematics.wrist import EXACT, fill_free, find_crossings, flip_rotation, has_swing, unwind_angles, wrap_angle
from ..path import Floats
from .tool_orientation import BLOCK, ToolOrientation
from .turn_steps import add_turn_steps

_LEVEL = 1e-12  # of a frame's rotation: what is rounding


def find_programmed_angles(turning: ToolOrientation, turns: Floats, frame: Floats) -> Floats | None:
    """Angles (n, turns) of the machine for turns (n, 3) in W; None where only the tool's axis tells them.

    Where the frame turns about one of the machine's own turns alone (C, where there are several), the angles are those
    programmed, and this one's has the frame's added. Else they are those of the rotation in M, continuous, their turns
    counted as A, B and C go evenly from record to record, and nearest to those programmed at the start.
    """
    letters, last = turning.letters, turning.letters[-1:]
    if not letters or not len(turns):
        return None
    yaw = _about(frame, last)
    own = [letter in letters for letter in "ABC"]
    upright = turning.tool is None or np.abs(turning.tool - np.eye(3)).max() < _LEVEL
    if yaw is not None and upright and not turns[:, [not letter for letter in own]].any():
        angles = turns[:, own]
        angles[:, -1] += yaw
        return angles
    if len(letters) < 3 and not turning.spins:
        return None
    thick, at = add_turn_steps(turns, range(3))
    near = turns[0, own] + np.append(np.zeros(len(letters) - 1), yaw or _twist(frame[:, :3], last))
    if turning.spins:
        assert turning.tool is not None
        found = _spun(thick, frame, turning.tool, last)
    else:
        found = _decomposed(thick, frame, near)
    taken: Floats = _started(found, near)[at]
    return taken


def compute_rotations(turns: Floats) -> Floats:
    """Rz(C)·Ry(B)·Rx(A) for turns A, B, C (n, 3): (n, 3, 3)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
    rows = [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _about(frame: Floats, letter: str) -> float | None:
    """The angle by which a frame turns about one axis alone, if it does."""
    i, j, k = _cyclic(letter)
    r = frame[:, :3]
    off = max(abs(r[i, j]), abs(r[i, k]), abs(r[j, i]), abs(r[k, i]))
    return math.atan2(r[k, j], r[j, j]) if off < _LEVEL and r[i, i] > 0.0 else None


def _cyclic(letter: str) -> tuple[int, int, int]:
    i = "ABC".index(letter)
    return i, (i + 1) % 3, (i + 2) % 3


def _twist(rotation: Floats, letter: str) -> Any:
    """The part of rotations (..., 3, 3) that is a turn about an axis."""
    _, j, k = _cyclic(letter)
    return np.arctan2(
        rotation[..., k, j] - rotation[..., j, k],
        rotation[..., j, j] + rotation[..., k, k],
    )


def _spun(turns: Floats, frame: Floats, tool: Floats, letter: str) -> Floats:
    """(n, 1) turns of a tool about its own axis."""
    parts = np.array_split(turns, range(BLOCK, len(turns), BLOCK))
    angles = [_twist(frame[:, :3] @ compute_rotations(part) @ tool.T, letter) for part in parts]
    return unwind_angles(np.concatenate(angles))[:, None]


def _decomposed(turns: Floats, frame: Floats, near: Floats) -> Floats:
    """A, B, C (n, 3) in M, continuous; of the two ways to have a rotation the one nearer to ``near`` at the start."""
    count = len(turns)
    here, size = np.empty((count, 3)), np.empty(count)
    columns = np.empty((count, 7))
    for start in range(0, count, BLOCK):
        part = slice(start, start + BLOCK)
        r = frame[:, :3] @ compute_rotations(turns[part])
        size[part] = np.hypot(r[:, 2, 1], r[:, 2, 2])
        here[part, 0] = np.arctan2(r[:, 2, 1], r[:, 2, 2])
        here[part, 1] = np.arctan2(-r[:, 2, 0], size[part])
        here[part, 2] = np.arctan2(r[:, 1, 0], r[:, 0, 0])
        columns[part] = r.reshape(-1, 9)[:, [1, 4, 7, 2, 5, 8, 6]]
    there = flip_rotation(here)
    free = size < EXACT
    regular = np.flatnonzero(~free)
    across = np.zeros(count, bool)
    if has_swing(here[regular]):
        across[regular] = find_crossings(here[regular], there[regular])
    if len(regular):
        first = regular[0]
        if (wrap_angle(there[first] - near) ** 2).sum() < (wrap_angle(here[first] - near) ** 2).sum():
            across[regular] ^= True
    a = np.where(across, there[:, 0], here[:, 0])
    a = unwind_angles(fill_free(a, free) if len(regular) else np.full(count, near[0]))
    # With A given the others are well told everywhere, where B is 90° too: R·Rx(-A) = Rz(C)·Ry(B).
    s, c = np.sin(a), np.cos(a)
    y, z, back = columns[:, :3], columns[:, 3:6], columns[:, 6]
    b = np.arctan2(-back, y[:, 2] * s + z[:, 2] * c)
    turn = np.arctan2(z[:, 0] * s - y[:, 0] * c, y[:, 1] * c - z[:, 1] * s)
    return np.column_stack([a, unwind_angles(b), unwind_angles(turn)])


def _started(angles: Floats, near: Floats) -> Floats:
    """Each angle (n, turns) as a whole by the turns that bring its start nearest to ``near``."""
    angles += 2.0 * math.pi * np.round((near - angles[0]) / (2.0 * math.pi))
    return angles
