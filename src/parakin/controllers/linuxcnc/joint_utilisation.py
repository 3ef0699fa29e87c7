"""How much of its speed a joint needs where the tool goes straight."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist import PRINTED
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory

_BLOCK = 1 << 17  # motions at a time
_NEAR = 1e-9  # mm: a row of the trajectory no farther from another sample adds nothing


def measure_joint_utilisation(trajectory: Trajectory, piece: Indices, start: Array, end: Array) -> Array:
    """Measure the greatest utilisation of a joint's speed per mm/s of path speed, in both halves of k motions.

    Parameters
    ----------
    piece, start, end : (k,) the curve's piece that a motion is on, and mm of it where it begins and ends

    Returns (k, 2), s/mm. The joints are sampled at the ends, in the middle and at the trajectory's rows between, for
    these are dense where joints run fast. Between two samples the speeds are taken to go on changing as they do before
    and behind.
    """
    utilisation = np.empty((len(piece), 2))
    for begin in range(0, len(piece), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        utilisation[block] = _measure_block(trajectory, piece[block], start[block], end[block])
    return utilisation


def _measure_block(trajectory: Trajectory, piece: Indices, start: Array, end: Array) -> Array:
    segment, offset, half = _place_samples(trajectory, piece, start, end)
    curve, machine = trajectory.curve, trajectory.posted.machine
    poses = curve.corner[segment] + curve.slope[segment] * offset[:, None]
    joints = machine.follow(poses, trajectory.posted.mode, PRINTED)
    gaps = _measure_gaps(trajectory, segment, offset)
    slope = np.diff(joints, axis=0) / gaps[:, None] / DriveLimits.of(machine).speed
    change = np.abs(np.diff(slope, axis=0)) * (segment[1:-1] == segment[:-2])[:, None]
    nothing = np.zeros((1, slope.shape[1]))
    before, behind = np.concatenate([nothing, change]), np.concatenate([change, nothing])
    greatest = (np.abs(slope) + 0.5 * np.maximum(before, behind)).max(1)
    return np.maximum.reduceat(greatest, np.flatnonzero(half[:-1])).reshape(-1, 2)


def _place_samples(trajectory: Trajectory, piece: Indices, start: Array, end: Array) -> tuple[Indices, Array, Flags]:
    """Place the samples, ascending: their pieces, mm on these, and whether a motion's half begins, or the last ends."""
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
    apart = _measure_gaps(trajectory, segment, offset) > _NEAR
    kept = half | (np.append(True, apart) & np.append(apart, True))
    return segment[kept], offset[kept], half[kept]


def _measure_gaps(trajectory: Trajectory, segment: Indices, offset: Array) -> Array:
    """Measure the path from each sample to the next, mm."""
    gaps: Array = np.diff(offset) + np.where(segment[1:] == segment[:-1], 0.0, trajectory.curve.length[segment[:-1]])
    return gaps
