"""Rotations by turns A, B and C (ISO 841): R = Rz(C)·Ry(B)·Rx(A), and the turns of a rotation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Array, split_rows
from .turns import fill_free, find_nearest_turn, unwind_angles, wrap_angle
from .wrist.pole_crossing import find_crossings, has_swing
from .wrist.pole_thresholds import EXACT
from .wrist.pose_angles import flip_rotation

TURNS = "ABC"  # about X, Y and Z
LEVEL = 1e-12  # rounding error of a rotation's entries
_BLOCK = 1 << 13  # rotations whose many intermediate arrays stay in the cache


def list_rotation_rows(a: Sequence[Any], b: Sequence[Any], c: Sequence[Any]) -> list[list[Any]]:
    """List the entries of Rz(C)·Ry(B)·Rx(A) row by row, each turn given by its sine and cosine."""
    (sa, ca), (sb, cb), (sc, cc) = a, b, c
    return [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]


def compute_rotations(turns: Array) -> Array:
    """Compute the rotations (n, 3, 3) of turns A, B, C (n, 3)."""
    a, b, c = zip(np.sin(turns.T), np.cos(turns.T), strict=True)
    return np.moveaxis(np.array(list_rotation_rows(a, b, c)), 2, 0)


def collect_turns(axes: Sequence[str], poses: Array) -> Array:
    """Collect the turns A, B, C (n, 3) of poses (n, axes); one that is no axis is zero."""
    turns = np.zeros((len(poses), 3))
    for column, axis in enumerate(axes):
        if axis in TURNS:
            turns[:, TURNS.index(axis)] = poses[:, column]
    return turns


def get_turning_axis(letter: str) -> Array:
    """Return the axis, a unit vector (3,), about which a turn A, B or C goes."""
    axis: Array = np.eye(3)[TURNS.index(letter)]
    return axis


def find_turn_about(rotation: Array, letter: str) -> float | None:
    """Find the angle by which a rotation (3, 3) turns about one axis alone; None if it does not."""
    i, j, k = _list_cyclic(letter)
    off = max(abs(rotation[i, j]), abs(rotation[i, k]), abs(rotation[j, i]), abs(rotation[k, i]))
    alone = off < LEVEL and rotation[i, i] > 0.0
    return math.atan2(rotation[k, j], rotation[j, j]) if alone else None


def find_twist(rotation: Array, letter: str) -> Any:
    """Find the part of rotations (..., 3, 3) that is a turn about an axis: its angles (...)."""
    _, j, k = _list_cyclic(letter)
    return np.arctan2(
        rotation[..., k, j] - rotation[..., j, k],
        rotation[..., j, j] + rotation[..., k, k],
    )


def _list_cyclic(letter: str) -> tuple[int, int, int]:
    i = TURNS.index(letter)
    return i, (i + 1) % 3, (i + 2) % 3


def decompose_rotations(rotation: Array) -> tuple[Array, Array]:
    """Decompose rotations (n, 3, 3): A, B, C (n, 3) with B within ±90°, and cos B (n,), zero on their pole."""
    cosine = np.hypot(rotation[:, 2, 1], rotation[:, 2, 2])
    a = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    b = np.arctan2(-rotation[:, 2, 0], cosine)
    c = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    return np.column_stack([a, b, c]), cosine


def find_nearest_rotation_turns(rotation: Array, near: Array) -> Array:
    """Find A, B, C (n, 3) of rotations (n, 3, 3), of both modes those nearest to others (n, 3)."""
    here, _ = decompose_rotations(rotation)
    modes = find_nearest_turn(np.stack([here, flip_rotation(here)]), near)
    nearer = ((modes - near) ** 2).sum(2).argmin(0)
    nearest: Array = modes[nearer, np.arange(len(near))]
    return nearest


def follow_rotations(turns: Array, rotation: Array, near: Array) -> Array:
    """Follow the rotations ``rotation``·R(turns) along a path of turns (n, 3): A, B, C (n, 3), continuous.

    Of the two modes the path begins in the one nearer to ``near`` (3,). At the pole B = ±90° A keeps the last value.
    """
    count = len(turns)
    here, cosine = np.empty((count, 3)), np.empty(count)
    entries = np.empty((count, 7))  # the columns y and z of each rotation, and x's last entry
    for block in split_rows(count, _BLOCK):
        rotations = rotation @ compute_rotations(turns[block])
        here[block], cosine[block] = decompose_rotations(rotations)
        entries[block] = rotations.reshape(-1, 9)[:, [1, 4, 7, 2, 5, 8, 6]]
    there = flip_rotation(here)
    free = cosine < EXACT
    regular = np.flatnonzero(~free)
    across = np.zeros(count, bool)
    if has_swing(here[regular, 0]):
        across[regular] = find_crossings(here[regular], there[regular])
    if len(regular):
        first = regular[0]
        if (wrap_angle(there[first] - near) ** 2).sum() < (wrap_angle(here[first] - near) ** 2).sum():
            across[regular] ^= True
    a = np.where(across, there[:, 0], here[:, 0])
    a = unwind_angles(fill_free(a, free) if len(regular) else np.full(count, near[0]))
    # With A given, B and C are well determined everywhere, where B is 90° too: R·Rx(-A) = Rz(C)·Ry(B).
    sine, cosine = np.sin(a), np.cos(a)
    y, z, x_last = entries[:, :3], entries[:, 3:6], entries[:, 6]
    b = np.arctan2(-x_last, y[:, 2] * sine + z[:, 2] * cosine)
    c = np.arctan2(z[:, 0] * sine - y[:, 0] * cosine, y[:, 1] * cosine - z[:, 1] * sine)
    return np.column_stack([a, unwind_angles(b), unwind_angles(c)])


def follow_twists(turns: Array, rotation: Array, tool: Array, letter: str) -> Array:
    """Follow the turn about an axis of ``rotation``·R(turns)·``tool``ᵀ along a path (n, 3): angles (n,), continuous."""
    angles = [
        find_twist(rotation @ compute_rotations(turns[block]) @ tool.T, letter)
        for block in split_rows(len(turns), _BLOCK)
    ]
    return unwind_angles(np.concatenate(angles))
