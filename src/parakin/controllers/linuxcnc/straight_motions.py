"""A trajectory as straight motions of the tool at one speed each, which is what a G-code program can say of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...machine import Machine
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from .joint_utilisation import measure_joint_utilisation
from .late_starts import measure_late_starts
from .slow_tips import delay_slow_tips
from .speed_changes import find_speed_changes

CYCLE = 1e-3  # s: of the controller. Motions that take whole cycles it blends evenly, others with a bump of speed
_USABLE = 0.997  # fraction of the joints' speeds; the rest is for the way between samples and for rounding
_EVEN = 0.1  # mm/mm: corners sharper than this turn the joints elsewhere
_SHARP = 1.0  # mm/mm: a tip whose way turns by more, some 60°, all but reverses
_TURNING = 1e-6  # rad/mm: what is rounding
_ROUNDING = 1e-6  # cycles


@dataclass(frozen=True, eq=False)
class StraightMotions:
    """k straight motions of the tool, each at one speed. Lengths are mm, angles rad.

    ends : (k, axes) the pose that each leads to
    seconds : (k,) what each takes, whole cycles
    halt : (k,) whether the tool stands still at its end
    piece : (k,) the piece of the trajectory's curve that it is on, or a stretch of
    held_up_by : (k,) what it takes longer for than the trajectory, an index into ``reasons``; 0 where it does not
    reasons : in words
    rise : (k,) s, what it takes to come to its speed, or from it to a stand
    late : (k,) s, by which the next motion begins later than the motion begins to fall
    """

    ends: Array
    seconds: Array
    halt: Flags
    piece: Indices
    held_up_by: Indices
    reasons: tuple[str, ...]
    rise: Array
    late: Array

    @property
    def total_seconds(self) -> float:
        """What all motions take, s: one begins while the other falls, but for the last one before a stand.

        That one does not blend, and so falls with all of the acceleration.
        """
        return float(self.seconds.sum() + self.late.sum() + 0.5 * self.rise[self.halt].sum())


class _Division(NamedTuple):
    """The curve's pieces and stretches of these, k in the path's order.

    piece : (k,)
    start, end : (k,) mm from the piece's start
    time : (k,) s, when the end is reached
    last : (k,) whether the piece ends there
    """

    piece: Indices
    start: Array
    end: Array
    time: Array
    last: Flags


def build_straight_motions(trajectory: Trajectory, speeds: Array, accelerations: Array) -> StraightMotions:
    """Divide a trajectory where its speed changes, and slow the stretches until no joint passes its speed.

    speeds, accelerations : (axes,) what the controller gives each axis; mm, rad and s
    """
    curve, pieces = trajectory.curve, len(trajectory.curve.length)
    if not pieces:
        nothing = np.empty(0)
        none = nothing.astype(np.int64)
        ends = np.empty((0, curve.corner.shape[1]))
        return StraightMotions(ends, nothing, nothing > 0.0, none, none, ("",), nothing, nothing)
    piece, start, end, time, last = _divide_pieces(trajectory, accelerations)
    halt = np.zeros(len(piece), bool)
    if DriveLimits.of(trajectory.posted.machine).bounds_acceleration:
        halt[last] = curve.parted[1:] | _find_reversals(trajectory)
    slope, length = np.abs(curve.slope[piece]), end - start
    planned = np.maximum(np.diff(np.rint(time / CYCLE), prepend=0.0), 1.0)
    by_axis = (slope / speeds) * length[:, None] / CYCLE
    cycles = np.maximum(planned, np.ceil(by_axis.max(1) - _ROUNDING))
    use = measure_joint_utilisation(trajectory, piece, start, end) / (_USABLE * CYCLE)
    even = ~last[:-1] | (curve.sharpness[piece[1:]] < _EVEN) & ~halt[:-1]
    meet = np.where(even, np.maximum(use[:-1, 1], use[1:, 0]), 0.0)
    use[:-1, 1], use[1:, 0] = np.maximum(use[:-1, 1], meet), np.maximum(use[1:, 0], meet)
    ramp = 2.0 * (slope / accelerations).max(1) * length / CYCLE**2
    ends = np.where(last[:, None], curve.corner[piece + 1], curve.corner[piece] + curve.slope[piece] * end[:, None])
    need = use * length[:, None]
    cycles = _raise_cycles(cycles, need, ramp, ~halt[:-1])
    bounds = np.column_stack([planned, by_axis, need.max(1), np.sqrt(ramp)])
    held_up_by = np.where(cycles > 1.2 * planned, bounds[:, 1:].argmax(1) + 1, 0)
    linear = np.array([unit == "mm" for unit in trajectory.posted.machine.axis_units])
    rows, motion, seconds = delay_slow_tips(np.concatenate([curve.corner[:1], ends]), CYCLE * cycles, halt, linear)
    halts = halt[motion] & np.append(motion[1:] != motion[:-1], True)
    steps = np.diff(rows, axis=0, prepend=curve.corner[:1])
    rise = 2.0 * (np.abs(steps) / accelerations).max(1) / seconds
    late = measure_late_starts(steps, seconds, rise, linear) * ~halts
    reasons = _name_reasons(trajectory.posted.machine)
    return StraightMotions(rows, seconds, halts, piece[motion], held_up_by[motion], reasons, rise, late)


def _find_reversals(trajectory: Trajectory) -> Flags:
    """Find the pieces (k,) at whose end the tip turns sharply while the tool turns.

    LinuxCNC begins the next motion within the cycle in which the speed falls below that of the blend; with the
    acceleration of its turning axes that one cycle may be more than the tolerance.
    """
    curve, units = trajectory.curve, trajectory.posted.machine.axis_units
    linear = np.array([unit == "mm" for unit in units])
    turns: Flags = np.abs(curve.slope[:, ~linear]).max(axis=1, initial=0.0) > _TURNING
    sharp = np.sqrt((curve.turn[1:, linear] ** 2).sum(axis=1)) > _SHARP
    reversals: Flags = sharp & (turns | np.append(turns[1:], False))
    return reversals


def _name_reasons(machine: Machine) -> tuple[str, ...]:
    """Name what holds motions up, in the order of the bounds of their cycles."""
    units = list(zip(machine.axes, machine.axis_units, strict=True))
    axes = [f"{axis} turns, and its axis is no faster" for axis, unit in units if unit == "rad"]
    linear = [f"{axis} is no faster" for axis, unit in units if unit == "mm"]
    return "", *linear, *axes, "a joint would pass its speed", "motions so short can't be blended faster"


def _divide_pieces(trajectory: Trajectory, accelerations: Array) -> _Division:
    """Divide the curve's pieces where the speed along them changes."""
    curve, profile, pieces = trajectory.curve, trajectory.profile, len(trajectory.curve.length)
    after, offset, reached = find_speed_changes(trajectory, accelerations)
    first = np.searchsorted(trajectory.joint_path.segment, np.arange(1, pieces))
    piece = np.concatenate([np.arange(pieces), after])
    end = np.concatenate([curve.length, offset])
    time = np.concatenate([profile.row_times[first], profile.row_times[-1:], reached])
    order = np.lexsort((end, piece))
    piece, end, time = piece[order], end[order], time[order]
    last = np.append(piece[1:] != piece[:-1], True)
    start = np.where(np.append(True, last[:-1]), 0.0, np.append(0.0, end[:-1]))
    return _Division(piece, start, end, time, last)


def _raise_cycles(cycles: Array, need: Array, ramp: Array, blended: Flags) -> Array:
    """Raise the cycles (k,) of motions until no joint passes its speed, even where one motion blends into the next.

    need : (k, 2) cycles at which a joint has all of its speed, in a motion's halves
    ramp : (k,) a motion of n cycles rises and falls in ramp/n cycles
    blended : (k - 1,) whether the next motion begins to rise when a motion begins to fall, and does not fall itself
        before that one is over. Each changes at its own rate, so together they may be faster than each of them alone,
        and for some cycles they are: see :func:`_measure_bumps`.
    """
    cycles = np.maximum(cycles, np.ceil(np.maximum(need.max(1), np.sqrt(ramp)) - _ROUNDING))
    while True:  # it ends, for speeds only fall, and slow motions have room
        ramps = ramp / cycles
        bumps = _measure_bumps(ramps)
        both = need[:-1, 1] / cycles[:-1] * np.maximum(1.0 - ramps[1:] / ramps[:-1], 0.0) + need[1:, 0] / cycles[1:]
        over = np.maximum(both * (1.0 + np.maximum(bumps[:-1], bumps[1:])) * blended, 1.0)
        least = cycles * np.maximum(np.append(over, 1.0), np.append(1.0, over))
        least = np.maximum(least, np.append(0.0, ramps[:-1] * blended))
        slower = np.ceil(least - _ROUNDING)
        if not (slower > cycles).any():
            return cycles
        cycles = np.maximum(cycles, slower)


def _measure_bumps(ramps: Array) -> Array:
    """Measure the bumps of speed, as fractions of it, where one motion falls and an equal one rises; (k,).

    ramps : (k,) cycles in which a motion rises, and falls

    LinuxCNC changes a speed by whole steps of a cycle, but for the last one of a rise. In n whole cycles and a
    part f that costs a little more than an even rise would, and so much of the way is left for the fall: its first
    step leads from n + f to sqrt((n - 1/2)^2 + 2nf) - 1/2, where n + f - 1 would go with the rise of the next motion.
    From then on both change by whole steps. In the first cycle the bump is half of what it is later.
    """
    whole = np.floor(ramps)
    excess = np.sqrt((whole - 0.5) ** 2 + 2.0 * whole * (ramps - whole)) + 0.5 - ramps
    bumps: Array = np.where(whole > 1.0, excess, 0.5 * excess) / np.maximum(ramps, 1.0)
    return np.where(whole > 0.0, bumps, 0.0)
