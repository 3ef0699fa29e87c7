"""Whole turns of joints: the counts that bring them into range along a path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags
from ...kinematics.turns import TURN
from ...machine import Machine
from ...model.elements import Drive
from .margin_blocks import split_margins

_MOST_OFF = 9  # counts of turns that are tried where none fits
_NEARER = 1e-6  # rad: a smaller gain is rounding


def find_turns_in_range(drive: Drive, angles: Array, home: float) -> int | None:
    """Find the turns that bring all angles (n,) into a drive's range, nearest to home; None if no turns do."""
    low, high = float(np.fmin.reduce(angles)), float(np.fmax.reduce(angles))
    if math.isnan(low) or not (math.isfinite(drive.low) or math.isfinite(drive.high)):
        return 0
    fitting = _find_fitting_counts(drive, low, high)
    if fitting[0] > fitting[1]:
        return None
    least, near = _clip_turns(0, fitting), _clip_turns(round((home - 0.5 * (low + high)) / TURN), fitting)
    gain = _measure_distance(least, low, high, home) - _NEARER
    return near if _measure_distance(near, low, high, home) < gain else least


def _find_fitting_counts(drive: Drive, low: float, high: float) -> tuple[int, int]:
    """Find the least and the greatest count of turns that put low..high into the range; if they cross, none does."""
    unbounded = 1 << 40
    least = math.ceil((drive.low - low) / TURN) if math.isfinite(drive.low) else -unbounded
    most = math.floor((drive.high - high) / TURN) if math.isfinite(drive.high) else unbounded
    return least, most


def _clip_turns(turns: int, ends: tuple[int, int]) -> int:
    return min(max(turns, ends[0]), ends[1])


def _measure_distance(turns: int, low: float, high: float, home: float) -> float:
    """Measure how far low..high, so many turns on, reaches from home, rad."""
    return max(abs(low + turns * TURN - home), abs(high + turns * TURN - home))


@dataclass(frozen=True, eq=False)
class TurningJoint:
    """A turning joint along a path of n records.

    drive, column : of the joint
    angles : (n,) rad
    low, high : (n,) the margins to the ends of its range
    is_sound : (n,) all other limits hold
    home : its angle at home, rad
    """

    drive: Drive
    column: int
    angles: Array
    low: Array
    high: Array
    is_sound: Flags
    home: float

    @classmethod
    def of(cls, machine: Machine, poses: Array, joints: Array, mode: str, column: int, home: float) -> TurningJoint:
        """Measure a joint's margins along a path's poses (n, axes) and joints (n, joints)."""
        drive, count = machine.drives[column], len(joints)
        low, high, is_sound = np.full(count, np.inf), np.full(count, np.inf), np.empty(count, bool)
        own = {f"{drive.name}.min": low, f"{drive.name}.max": high}
        others = np.array([name not in own for name in machine.limits])
        for block, margins in split_margins(machine, poses, joints, mode):
            is_sound[block] = (margins[:, others] >= 0.0).all(axis=1) & np.isfinite(joints[block]).all(axis=1)
            for name, values in own.items():
                if name in machine.limits:
                    values[block] = margins[:, machine.limits.index(name)]
        return cls(drive, column, joints[:, column].copy(), low, high, is_sound, home)

    def count_off(self, turns: int) -> int:
        """Count the records that break only this joint's range, so many turns on."""
        shift = turns * TURN
        kept = (self.low + shift >= 0.0) & (self.high - shift >= 0.0)
        return int(np.count_nonzero(self.is_sound & ~kept))


def _list_nearest(low: int, high: int, middle: float, most: int) -> list[int]:
    """List up to ``most`` whole numbers from low to high, those nearest to a middle."""
    if high - low >= most:
        low = min(max(low, round(middle) - most // 2), high - most + 1)
        high = low + most - 1
    return list(range(low, high + 1))


def choose_turns(joint: TurningJoint) -> int:
    """Choose the turns with which a joint breaks its range in the fewest records, then keeps nearest to home."""
    low, high = float(np.fmin.reduce(joint.angles)), float(np.fmax.reduce(joint.angles))
    if math.isnan(low):
        return 0
    ends = _find_fitting_counts(joint.drive, low, high)
    if ends[0] > ends[1]:
        middle = (joint.drive.low + joint.drive.high - low - high) / (2.0 * TURN)
        counts = _list_nearest(ends[1], ends[0], middle, _MOST_OFF)
    else:
        counts = _list_nearest(*ends, (joint.home - 0.5 * (low + high)) / TURN, _MOST_OFF)

    def cost(turns: int) -> tuple[int, float, int]:
        return joint.count_off(turns), _measure_distance(turns, low, high, joint.home), abs(turns)

    return min(counts, key=cost)
