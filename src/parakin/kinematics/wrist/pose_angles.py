"""The turning axes of a pose: B and C that point the tool, and A, B and C of a whole rotation.

Of a direction, C is the first angle and B the second.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, AxisRange, Flags, Indices
from ...model.structures import compute_axis_angles, compute_tool_axis
from ..turns import find_nearest_turn, measure_whole_turns, wrap_angle
from .pole_crossing import compare_ways, find_crossings, has_swing, spares_swing
from .pole_thresholds import EXACT, PRINTED, SWING, is_on_pole

# Ranges of the turning axes that hold every rotation, every turn about one axis, and every direction, once.
EVERY_ROTATION: dict[str, AxisRange] = {"A": (-np.pi, np.pi), "B": (-np.pi / 2, np.pi / 2), "C": (-np.pi, np.pi)}
EVERY_TURN: AxisRange = (-np.pi, np.pi)
EVERY_DIRECTION: dict[str, AxisRange] = {"B": (0.0, np.pi), "C": (-np.pi, np.pi)}


def solve_direction(k: Array, exact: Flags | None = None) -> tuple[Array, Array, Flags]:
    """Solve k = Rz(C)·Ry(B)·z, (n, 3), for B from 0 to 180° and C; tell where C is free.

    exact : (n,) which k were computed; the others have the digits of a file, and lean no less than these tell
    """
    b, c = compute_axis_angles(list(k.T))
    within = PRINTED if exact is None else np.where(exact, EXACT, PRINTED)
    return b, c, is_on_pole(k[:, 0] * k[:, 0] + k[:, 1] * k[:, 1], within)


def point_direction(b: Array, c: Array) -> Array:
    """Compute the tool axes k = Rz(C)·Ry(B)·z, unit vectors (n, 3)."""
    return np.stack(compute_tool_axis(b, c)[0], axis=-1)


def flip_direction(c: Array, b: Array) -> Array:
    """Return the other C and B, (n, 2), that point the tool the same way."""
    return np.column_stack([c + np.pi, -b])


def cross_direction_pole(turns: Array, at: Indices) -> None:
    """Let B and C along a path (n, 2) go on over their pole at the regular rows ``at``; in place."""
    if has_swing(turns[at, 1]):
        here = turns[at][:, ::-1]
        there = flip_direction(here[:, 0], here[:, 1])
        across = find_crossings(here, there)
        turns[at[across]] = there[across][:, ::-1]


def flip_azimuth(azimuth: float, sense: float = 1.0) -> float:
    """Return the azimuth about a pole at which the first angle is the same in the other mode, half a turn on."""
    return azimuth + sense * np.pi


def continue_turns(turns: Array, row: int) -> None:
    """Let C of the turns A, B, C (n, 3) behind a row go on from that row's by whole turns; in place."""
    turns[row + 1 :, 2] += measure_whole_turns(turns[row + 1, 2], turns[row, 2])


def fold_direction(turns: Array) -> tuple[Array, Array]:
    """Return B ≥ 0 and C, (n,) each, that point the tool as B and C (n, 2) do."""
    b, c = np.abs(turns[:, 0]), turns[:, 1].copy()
    c[turns[:, 0] < 0.0] += np.pi
    return b, c


def continue_direction(turns: Array, before: Array) -> None:
    """Let B and C (n, 2) each go on from those of a row of ``before`` (n, 2), over the pole too; in place."""
    (b, c), (b0, c0) = fold_direction(turns), fold_direction(before)
    flipped, was_free = before[:, 0] < 0.0, np.abs(np.sin(before[:, 0])) < PRINTED
    flipped = flipped ^ spares_swing(np.column_stack([c0, b0]), np.column_stack([c, b]), flip_direction(c, b))
    flipped = np.where(was_free, np.abs(wrap_angle(c - before[:, 1])) > SWING, flipped)
    free = np.sin(b) < PRINTED
    turns[:, 0] = np.where(flipped & ~free, -b, b)
    turns[:, 1] = find_nearest_turn(np.where(free, before[:, 1], np.where(flipped, c + np.pi, c)), before[:, 1])


def find_nearest_direction(axis: Array, near: Array) -> Array:
    """Find A = 0, B and C (m, 3) that point a tool along ``axis`` (m, 3), of both modes those nearest to others."""
    b, c = compute_axis_angles(list(axis.T))
    c = np.where(np.sin(b) < EXACT, near[:, 2], c)
    other = flip_direction(c, b)
    modes = [
        find_nearest_turn(np.column_stack([0.0 * b, *pair]), near) for pair in ((b, c), (other[:, 1], other[:, 0]))
    ]
    stay, flip = (list((turns - near)[:, 1:].T) for turns in modes)
    flipped = compare_ways(stay, flip) < 0.0
    return np.where(flipped[:, None], modes[1], modes[0])


def flip_rotation(turns: Array) -> Array:
    """Return the other A, B, C (n, 3) of the same rotation Rz(C)·Ry(B)·Rx(A); their pole is B = ±90°."""
    return np.column_stack([turns[:, 0] + np.pi, np.pi - turns[:, 1], turns[:, 2] + np.pi])


def bring_within_poles(turns: Array) -> Array:
    """Return the A, B, C (n, 3) of the same rotations with B within ±90°."""
    a, b, c = turns[:, 0], wrap_angle(turns[:, 1]), turns[:, 2]
    over = np.abs(b) > 0.5 * np.pi
    across = np.copysign(np.pi, b) - b
    return np.column_stack([np.where(over, a + np.pi, a), np.where(over, across, b), np.where(over, c + np.pi, c)])
