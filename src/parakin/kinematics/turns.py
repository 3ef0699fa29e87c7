"""Turns: angles that tell the same direction, brought near to others or counted along a path; angles are rad."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Flags

TURN = 2.0 * np.pi


def wrap_angle(angle: Array) -> Array:
    """Bring angles within half a turn of zero."""
    wrapped: Array = angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    return wrapped


def find_nearest_turn(angle: Array, near: Array) -> Array:
    """Bring angles within half a turn of others by adding the way from these, which is exact where it is short."""
    nearest: Array = near + wrap_angle(angle - near)
    return nearest


def measure_whole_turns(angle: Array, near: Array) -> Array:
    """Measure the whole turns, rad, that bring angles within half a turn of others when they are added."""
    turns: Array = TURN * np.round((near - angle) / TURN)
    return turns


def count_nearest_turns(joints: Array, near: Array, columns: Sequence[int]) -> None:
    """Count the turns of joints (n, joints) in ``columns`` so that they are within half a turn of others; in place.

    A joint that needs no turn is left bit for bit, and so is one whose neighbour is NaN.
    """
    for column in columns:
        angle = joints[:, column]
        counted = angle + measure_whole_turns(angle, near[:, column])
        joints[:, column] = np.where(np.isfinite(counted), counted, angle)


def unwind_angles(angles: Array) -> Array:
    """Count the turns of angles along a path (n,), without jumps over ±180°; NaN stays and does not spread."""
    with np.errstate(invalid="ignore"):
        if not (np.abs(np.diff(angles)) > np.pi).any() and not np.isnan(angles).any():
            return angles
    unwound = angles.copy()
    finite = np.flatnonzero(np.isfinite(angles))
    turned = np.diff(angles[finite])
    jumps = np.flatnonzero(np.abs(turned) > np.pi)
    turns = np.zeros(len(finite))
    turns[jumps + 1] = TURN * np.round(turned[jumps] / TURN)
    unwound[finite] -= np.cumsum(turns)
    return unwound


def fill_free(angles: Array, free: Flags) -> Array:
    """Replace free angles of a path (n,) by the last that is not free, at the start by the first to come."""
    index = np.where(free | ~np.isfinite(angles), -1, np.arange(len(angles)))
    last = np.maximum.accumulate(index)
    fixed = np.flatnonzero(index >= 0)
    return angles[np.where(last < 0, fixed[0], last)] if len(fixed) else angles


def turn_ahead(angles: Array, free: Flags) -> Array:
    """Replace free angles of a path (n,) as :func:`fill_free` does, but turn on the last of several free rows.

    So an angle that nothing depends on has turned before it counts again, and not while it begins to.
    """
    filled = fill_free(angles, free)
    last = np.flatnonzero(free[1:-1] & free[:-2] & ~free[2:]) + 1
    filled[last] = filled[last + 1]
    return filled
