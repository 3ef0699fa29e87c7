"""Poses and joints at a single point of a path, as they go on from those at an earlier one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.wrist import continue_direction, find_nearest_turn, flip_rotation
from ...machine import Machine
from ..path import Floats
from ..posting.frames import compute_poses, frame_from_angles
from ..posting.programmed_angles import compute_rotations
from .interpolation import Flags, Indices

_HERE = frame_from_angles(0, 0, 0, 0, 0, 0)
_EVEN = 1e-9  # of a rotation


@dataclass(frozen=True, eq=False)
class Rows:
    """Poses (m, axes) and joints (m, joints) of m points."""

    poses: Floats
    joints: Floats

    def __getitem__(self, index: slice | Indices | Flags) -> Rows:
        return Rows(self.poses[index], self.joints[index])

    def put(self, index: Indices, rows: Rows) -> None:
        self.poses[index], self.joints[index] = rows.poses, rows.joints


def continued(machine: Machine, mode: str, tip: Floats, axis: Floats, before: Rows) -> Rows:
    """Rows for tips and axes (m, 3) in M, each going on from its row of ``before`` as posting has them go on."""
    poses = _pointing(machine, tip, axis, before)
    return Rows(poses, _joints(machine, mode, poses, before))


def turned(machine: Machine, mode: str, tip: Floats, rotation: Floats, even: Floats, before: Rows) -> Rows:
    """As :func:`continued` where a program turns the tool: rotations (m, 3, 3) in M.

    ``even`` are the poses to take where they are given, and not NaN.
    """
    poses = _pointing(machine, tip, np.ascontiguousarray(rotation[:, :, 2]), before)
    columns = _turning_columns(machine)
    if len(columns) == 3:
        poses[:, columns] = _decomposed(rotation, before.poses[:, columns])
    poses = np.where(np.isfinite(even), even, poses)
    return Rows(poses, _joints(machine, mode, poses, before))


def has_turns(machine: Machine, poses: Floats, rotation: Floats) -> Flags:
    """Whether poses (m, axes) turn the tool as rotations (m, 3, 3) in M do, as far as the machine can."""
    columns = _turning_columns(machine)
    turns = np.zeros((len(poses), 3))
    turns[:, ["ABC".index(machine.axes[column]) for column in columns]] = poses[:, columns]
    off = rotation - compute_rotations(turns)
    has: Flags = np.abs(off if len(columns) == 3 else off[:, :, 2:]).max(axis=(1, 2)) < _EVEN
    return has


def _turning_columns(machine: Machine) -> list[int]:
    return [column for column, letter in enumerate(machine.axes) if letter in "ABC"]


def _pointing(machine: Machine, tip: Floats, axis: Floats, before: Rows) -> Floats:
    poses = compute_poses(machine, tip, axis, _HERE)[0]
    if machine.has_direction:
        continue_direction(poses[:, 3:], before.poses[:, 3:])
    else:
        for column, letter in enumerate(machine.axes):
            if letter in "ABC":
                poses[:, column] = find_nearest_turn(poses[:, column], before.poses[:, column])
    return poses


def _decomposed(rotation: Floats, before: Floats) -> Floats:
    """A, B, C (m, 3) of rotations (m, 3, 3), of both ways to have them the nearer to ``before`` (m, 3)."""
    r = np.moveaxis(rotation, 0, 2)
    level = np.hypot(r[2, 1], r[2, 2])
    a, b, c = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(-r[2, 0], level), np.arctan2(r[1, 0], r[0, 0])
    here = np.column_stack([a, b, c])
    ways = find_nearest_turn(np.stack([here, flip_rotation(here)]), before)
    nearer = ((ways - before) ** 2).sum(2).argmin(0)
    angles: Floats = ways[nearer, np.arange(len(before))]
    return angles


def _joints(machine: Machine, mode: str, poses: Floats, before: Rows) -> Floats:
    if machine.wrist is None:
        joints = machine.inverse(poses, mode)
    else:
        joints = machine.wrist.continue_joints(poses, mode, (before.poses, before.joints))
    for column, unit in enumerate(machine.joint_units):
        if unit == "rad":
            joints[:, column] = find_nearest_turn(joints[:, column], before.joints[:, column])
    return joints
