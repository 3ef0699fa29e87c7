"""How much of its speed a joint needs where the tool goes straight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import EXACT
from ...toolpath.path import Floats
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory

_BLOCK = 1 << 17  # motions looked at together
_NEAR = 1e-9  # mm: a row of the trajectory no farther from another look tells nothing more


def strain(trajectory: Trajectory, piece: NDArray[np.int64], start: Floats, end: Floats) -> Floats:
    """The greatest share of its speed that a joint needs per mm/s of path speed, in both halves of k motions, (k, 2).

    piece, start, end : (k,) the curve's piece that a motion is on, and mm of it where it begins and ends

    The joints are looked at at the ends, in the middle and at the trajectory's rows between, for these are dense where
    joints run fast; between two looks their speeds are taken to go on changing as they did before and will behind.
    """
    out = np.empty((len(piece), 2))
    for begin in range(0, len(piece), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        out[part] = _of_block(trajectory, piece[part], start[part], end[part])
    return out


def _of_block(trajectory: Trajectory, piece: NDArray[np.int64], start: Floats, end: Floats) -> Floats:
    segment, offset, half = _looks(trajectory, piece, start, end)
    curve, machine = trajectory.curve, trajectory.posted.machine
    poses = curve.corner[segment] + curve.slope[segment] * offset[:, None]
    joints = machine.follow(poses, trajectory.posted.mode, EXACT)
    slope = np.diff(joints, axis=0) / _gaps(trajectory, segment, offset)[:, None] / DriveLimits.of(machine).speed
    turn = np.abs(np.diff(slope, axis=0)) * (segment[1:-1] == segment[:-2])[:, None]
    nothing = np.zeros((1, slope.shape[1]))
    before, behind = np.concatenate([nothing, turn]), np.concatenate([turn, nothing])
    share = (np.abs(slope) + 0.5 * np.maximum(before, behind)).max(1)
    return np.maximum.reduceat(share, np.flatnonzero(half[:-1])).reshape(-1, 2)


def _looks(
    trajectory: Trajectory, piece: NDArray[np.int64], start: Floats, end: Floats
) -> tuple[NDArray[np.int64], Floats, NDArray[np.bool_]]:
    """Pieces and mm on them, ascending; and whether a half of a motion begins there, or the last one ends."""
    joint_path, first, last = trajectory.joint_path, int(piece[0]), int(piece[-1])
    rows = slice(*np.searchsorted(joint_path.segment, [first, last + 1]))
    own, at = joint_path.segment[rows], joint_path.offset[rows]
    inside = ((own > first) | (at > start[0])) & ((own < last) | (at < end[-1]))
    own, at = own[inside], at[inside]
    segment = np.concatenate([piece, piece, piece[-1:], own])
    offset = np.concatenate([start, 0.5 * (start + end), end[-1:], at])
    half = np.arange(len(segment)) < len(segment) - len(own)
    order = np.lexsort((offset, segment))
    segment, offset, half = segment[order], offset[order], half[order]
    apart = _gaps(trajectory, segment, offset) > _NEAR
    kept = half | (np.append(True, apart) & np.append(apart, True))
    return segment[kept], offset[kept], half[kept]


def _gaps(trajectory: Trajectory, segment: NDArray[np.int64], offset: Floats) -> Floats:
    """mm of path from each look to the next."""
    gaps: Floats = np.diff(offset) + np.where(segment[1:] == segment[:-1], 0.0, trajectory.curve.length[segment[:-1]])
    return gaps
