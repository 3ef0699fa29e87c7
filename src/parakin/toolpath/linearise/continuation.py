"""Poses and joints at single points of a path, which go on from those at earlier points as posting has them go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.rotations import collect_turns, compute_rotations, find_nearest_rotation_turns
from ...kinematics.turns import find_nearest_turn
from ...kinematics.wrist.pose_angles import continue_direction
from ...machine import Machine
from ..posting.frames import build_frame_from_angles, compute_poses

MACHINE_FRAME = build_frame_from_angles(0, 0, 0, 0, 0, 0)
_MATCHING = 1e-9  # of a rotation: what is rounding


@dataclass(frozen=True, eq=False)
class PosedPoints:
    """Poses (m, axes) and joints (m, joints) of m points of a path."""

    poses: Array
    joints: Array

    def __getitem__(self, index: slice | Indices | Flags) -> PosedPoints:
        return PosedPoints(self.poses[index], self.joints[index])

    def assign(self, index: Indices, points: PosedPoints) -> None:
        """Replace some of the points, in place."""
        self.poses[index], self.joints[index] = points.poses, points.joints

    def copy(self) -> PosedPoints:
        """Return points that can be replaced without changing these."""
        return PosedPoints(self.poses.copy(), self.joints.copy())


def continue_points(machine: Machine, mode: str, tip: Array, axis: Array, before: PosedPoints) -> PosedPoints:
    """Pose tips and axes (m, 3) in M and solve for their joints, each going on from its point of ``before``."""
    poses = _point_tool(machine, tip, axis, before)
    return PosedPoints(poses, _solve_joints(machine, mode, poses, before))


def continue_turned_points(
    machine: Machine, mode: str, tip: Array, rotation: Array, even: Array, before: PosedPoints
) -> PosedPoints:
    """Pose tips (m, 3) and rotations (m, 3, 3) of the tool in M as :func:`continue_points` does tips and axes.

    even : (m, axes) the poses whose angles to take where they are not NaN; the tip of a longer tool goes another way
    """
    poses = _point_tool(machine, tip, np.ascontiguousarray(rotation[:, :, 2]), before)
    columns = machine.turning_columns
    if len(columns) == 3:
        poses[:, columns] = find_nearest_rotation_turns(rotation, before.poses[:, columns])
    poses[:, columns] = np.where(np.isfinite(even[:, columns]), even[:, columns], poses[:, columns])
    return PosedPoints(poses, _solve_joints(machine, mode, poses, before))


def find_matching_poses(machine: Machine, poses: Array, rotation: Array) -> Flags:
    """Find poses (m, axes) that turn the tool as rotations (m, 3, 3) in M do, as far as the machine can."""
    off = rotation - compute_rotations(collect_turns(machine.axes, poses))
    matching: Flags = np.abs(off if len(machine.turning_columns) == 3 else off[:, :, 2:]).max(axis=(1, 2)) < _MATCHING
    return matching


def _point_tool(machine: Machine, tip: Array, axis: Array, before: PosedPoints) -> Array:
    """Compute poses whose turning axes go on from the poses before, over the pole of B and C too."""
    poses = compute_poses(machine, tip, axis, MACHINE_FRAME)[0]
    if machine.direction is not None:
        continue_direction(poses[:, machine.direction.pair], before.poses[:, machine.direction.pair])
    else:
        turning = machine.turning_columns
        poses[:, turning] = find_nearest_turn(poses[:, turning], before.poses[:, turning])
    return poses


def _solve_joints(machine: Machine, mode: str, poses: Array, before: PosedPoints) -> Array:
    """Solve for joints that go on from the joints before, over the wrist's pole too, turns counted."""
    if machine.wrist is None:
        joints = machine.inverse(poses, mode)
    else:
        joints = machine.wrist.continue_joints(poses, mode, (before.poses, before.joints))
    turning = machine.turning_joints
    joints[:, turning] = find_nearest_turn(joints[:, turning], before.joints[:, turning])
    return joints
