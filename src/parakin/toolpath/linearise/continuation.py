"""Poses and joints at a single point of a path, as they go on from those at an earlier one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.batch import run
from ...kinematics.follow import wrapped
from ...machine import Machine
from ..path import Floats
from ..posting.frames import tool_poses, transform
from ..posting.programmed_angles import rotations
from ..posting.tool_axis import ROUNDED
from .interpolation import Flags, Indices

_QUARTER = 0.5 * np.pi
_HERE = transform(0, 0, 0, 0, 0, 0)
_SAME = 1e-6  # rad
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
    off = rotation - rotations(turns)
    has: Flags = np.abs(off if len(columns) == 3 else off[:, :, 2:]).max(axis=(1, 2)) < _EVEN
    return has


def _turning_columns(machine: Machine) -> list[int]:
    return [column for column, letter in enumerate(machine.axes) if letter in "ABC"]


def _pointing(machine: Machine, tip: Floats, axis: Floats, before: Rows) -> Floats:
    poses = tool_poses(machine, tip, axis, _HERE)[0]
    if machine.axes[3:] == ("B", "C"):
        _settle_direction(poses, before.poses)
    else:
        for column, letter in enumerate(machine.axes):
            if letter in "ABC":
                poses[:, column] = _unwound(poses[:, column], before.poses[:, column])
    return poses


def _decomposed(rotation: Floats, before: Floats) -> Floats:
    """A, B, C (m, 3) of rotations (m, 3, 3), of both ways to have them the nearer to ``before`` (m, 3)."""
    r = np.moveaxis(rotation, 0, 2)
    level = np.hypot(r[2, 1], r[2, 2])
    a, b, c = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(-r[2, 0], level), np.arctan2(r[1, 0], r[0, 0])
    ways = np.stack([np.column_stack([a, b, c]), np.column_stack([a + np.pi, np.pi - b, c + np.pi])])
    ways = _unwound(ways, before)
    nearer = ((ways - before) ** 2).sum(2).argmin(0)
    angles: Floats = ways[nearer, np.arange(len(before))]
    return angles


def _settle_direction(poses: Floats, before: Floats) -> None:
    b, c = np.abs(poses[:, 3]), np.where(poses[:, 3] < 0.0, poses[:, 4] + np.pi, poses[:, 4])
    over, was_free = before[:, 3] < 0.0, np.abs(np.sin(before[:, 3])) < ROUNDED
    b0, c0 = np.abs(before[:, 3]), np.where(over, before[:, 4] + np.pi, before[:, 4])
    over = over ^ _spared(np.column_stack([c0, b0]), np.column_stack([c, b]), np.column_stack([c + np.pi, -b]))
    over = np.where(was_free, np.abs(wrapped(c - before[:, 4])) > _QUARTER, over)
    free = np.sin(b) < ROUNDED
    poses[:, 3] = np.where(over & ~free, -b, b)
    poses[:, 4] = _unwound(np.where(free, before[:, 4], np.where(over, c + np.pi, c)), before[:, 4])


def _joints(machine: Machine, mode: str, poses: Floats, before: Rows) -> Floats:
    model = machine.model
    joints = machine.inverse(poses, mode)
    first, last = model.first_serial, joints.shape[1] - model.serial
    if first is not None:
        columns = [first, last + 1 if first == last else last]
        other = mode[:-1] + ("-" if mode[-1] == "+" else "+")
        begin, there = machine.inverse(before.poses, mode), machine.inverse(poses, other)
        was_free = _free(machine, before.poses)
        over = (np.abs(wrapped(before.joints - begin))[:, columns] > _SAME).any(1)
        drive = model.drives[columns[1]]
        able = np.isfinite(there).all(1) & (there[:, columns[1]] >= drive.low) & (there[:, columns[1]] <= drive.high)
        over = over ^ _spared(begin[:, columns], joints[:, columns], there[:, columns])
        over = np.where(was_free, np.abs(wrapped(joints[:, first] - before.joints[:, first])) > _QUARTER, over) & able
        joints[over] = there[over]
        free = _free(machine, poses)
        if free.any():
            held = np.ascontiguousarray(before.joints[free][:, [first]])
            into = np.empty((len(held), joints.shape[1]))
            joints[free] = run(model.held_tape(mode), np.ascontiguousarray(poses[free]), into, held)
    for column, unit in enumerate(machine.joint_units):
        if unit == "rad":
            joints[:, column] = _unwound(joints[:, column], before.joints[:, column])
    return joints


def _free(machine: Machine, poses: Floats) -> Flags:
    found = run(machine.model.freedom_tape(), np.ascontiguousarray(poses), np.empty((len(poses), 1)))[:, 0]
    free: Flags = found < np.sin(ROUNDED) ** 2
    return free


def _spared(before: Floats, here: Floats, there: Floats) -> Flags:
    """Where going on from ``before`` in the other pair of angles (m, 2) spares a swing, as ``over_the_pole`` has it."""
    stay, cross = wrapped(here - before), wrapped(there - before)
    with np.errstate(invalid="ignore"):
        spared: Flags = (np.abs(stay[:, 0]) > _QUARTER) & ((cross**2).sum(1) < 0.25 * (stay**2).sum(1))
    return spared


def _unwound(angle: Floats, near: Floats) -> Floats:
    return near + wrapped(angle - near)
