"""A trajectory as straight motions of the tool at one speed each: what a G-code program can say of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...toolpath.path import Floats
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from .joint_speed_use import strain
from .speed_cuts import cuts

CYCLE = 1e-3  # s: of the controller. Motions that take whole cycles it blends evenly, others with a bump of speed
_KEPT = 0.997  # of the joints' speeds; the rest is for what lies between the looks and for the controller's rounding
_EVEN = 0.1  # mm/mm: corners sharper than this turn the joints elsewhere
_ROUNDING = 1e-6  # of a cycle


@dataclass(frozen=True, eq=False)
class Motions:
    """k straight motions of the tool, each at one speed. Lengths are mm, angles rad.

    ends : (k, axes) the pose that each leads to
    seconds : (k,) what each takes, whole cycles
    halt : (k,) whether the tool stands still at its end
    piece : (k,) the piece of the trajectory's curve that it is on, or a part of
    """

    ends: Floats
    seconds: Floats
    halt: NDArray[np.bool_]
    piece: NDArray[np.int64]


def motions(trajectory: Trajectory, speeds: Floats, accelerations: Floats) -> Motions:
    """The motions of a trajectory, divided where its speed changes, and slow enough that no joint passes its speed.

    speeds, accelerations : (axes,) what the controller gives each axis; mm, rad and s
    """
    curve, pieces = trajectory.curve, len(trajectory.curve.length)
    if not pieces:
        nothing = np.empty(0)
        return Motions(np.empty((0, curve.corner.shape[1])), nothing, nothing > 0.0, nothing.astype(np.int64))
    after, offset, passed = cuts(trajectory, accelerations)
    first = np.searchsorted(trajectory.joint_path.segment, np.arange(1, pieces))
    piece = np.concatenate([np.arange(pieces), after])
    end = np.concatenate([curve.length, offset])
    passed = np.concatenate([trajectory.profile.row_times[first], trajectory.profile.row_times[-1:], passed])
    order = np.lexsort((end, piece))
    piece, end, passed = piece[order], end[order], passed[order]
    last = np.append(piece[1:] != piece[:-1], True)
    start = np.where(np.append(True, last[:-1]), 0.0, np.append(0.0, end[:-1]))
    halt = np.zeros(len(piece), bool)
    if DriveLimits.of(trajectory.posted.machine).bounds_acceleration:
        halt[last] = curve.parted[1:]
    slope, length = np.abs(curve.slope[piece]), end - start
    cycles = np.maximum(np.diff(np.rint(passed / CYCLE), prepend=0.0), 1.0)
    cycles = np.maximum(cycles, np.ceil((slope / speeds).max(1) * length / CYCLE - _ROUNDING))
    share = strain(trajectory, piece, start, end) / (_KEPT * CYCLE)
    even = ~last[:-1] | (curve.sharpness[piece[1:]] < _EVEN) & ~halt[:-1]
    meet = np.where(even, np.maximum(share[:-1, 1], share[1:, 0]), 0.0)
    share[:-1, 1], share[1:, 0] = np.maximum(share[:-1, 1], meet), np.maximum(share[1:, 0], meet)
    ramp = 2.0 * (slope / accelerations).max(1) * length / CYCLE**2
    ends = np.where(last[:, None], curve.corner[piece + 1], curve.corner[piece] + curve.slope[piece] * end[:, None])
    return Motions(ends, CYCLE * _calm(cycles, share * length[:, None], ramp, ~halt[:-1]), halt, piece)


def _calm(cycles: Floats, need: Floats, ramp: Floats, blended: NDArray[np.bool_]) -> Floats:
    """Cycles (k,) of motions, raised until no joint passes its speed, even where one motion blends into the next.

    need : (k, 2) cycles at which a joint has all of its speed, in a motion's halves
    ramp : (k,) a motion of n cycles rises and falls in ramp/n cycles
    blended : (k - 1,) whether the next one begins to rise when a motion begins to fall; and it does not fall itself
        before that one is over. Each at its own rate, so that they may be faster together than each of them alone.
    """
    cycles = np.maximum(cycles, np.ceil(np.maximum(need.max(1), np.sqrt(ramp)) - _ROUNDING))
    while True:  # ends, for speeds only fall, and slow motions have room
        ramps = ramp / cycles
        both = need[:-1, 1] / cycles[:-1] * np.maximum(1.0 - ramps[1:] / ramps[:-1], 0.0) + need[1:, 0] / cycles[1:]
        over = np.maximum(both * blended, 1.0)
        least = cycles * np.maximum(np.append(over, 1.0), np.append(1.0, over))
        least = np.maximum(least, np.append(0.0, ramps[:-1] * blended))
        slower = np.ceil(least - _ROUNDING)
        if not (slower > cycles).any():
            return cycles
        cycles = np.maximum(cycles, slower)
