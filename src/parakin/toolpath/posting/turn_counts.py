"""Whole turns of joints: the counts that bring them into range, each for a stretch of a path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arrays import Array, Flags
from ...kinematics.wrist import TURN
from ...machine import Machine
from ...model.parts import Drive
from .margin_blocks import split_margins

_MOST_AT_START, _MOST_OFF = 41, 9  # counts of turns that are tried: in a path's first stretch, and where none fits
_NEARER = 1e-6  # rad: a smaller gain is rounding

Cost = tuple[int, float, float]  # records off limits, rad turned between the stretches, rad from home


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
        for part, margins in split_margins(machine, poses, joints, mode):
            is_sound[part] = (margins[:, others] >= 0.0).all(axis=1) & np.isfinite(joints[part]).all(axis=1)
            for name, values in own.items():
                if name in machine.limits:
                    values[part] = margins[:, machine.limits.index(name)]
        return cls(drive, column, joints[:, column].copy(), low, high, is_sound, home)

    def count_off(self, start: int, stop: int, turns: int) -> int:
        """Count the records from start to stop that break only this joint's range, so many turns on."""
        part, shift = slice(start, stop), turns * TURN
        kept = (self.low[part] + shift >= 0.0) & (self.high[part] - shift >= 0.0)
        return int(np.count_nonzero(self.is_sound[part] & ~kept))

    def split(self, cuts: Sequence[int]) -> list[_Stretch]:
        """Split the path into stretches at the records ``cuts``."""
        stretches = []
        for start, stop in pairwise([0, *cuts, len(self.angles)]):
            angles = self.angles[start:stop]
            stretches.append(_Stretch(start, stop, float(np.fmin.reduce(angles)), float(np.fmax.reduce(angles))))
        return stretches


@dataclass(frozen=True)
class _Stretch:
    """Records over which the turns stay: from ``start`` to ``stop``, the joint between ``low`` and ``high``."""

    start: int
    stop: int
    low: float
    high: float

    def list_counts(self, joint: TurningJoint, before: Sequence[int]) -> list[int]:
        """List the counts of turns worth trying, where ``before`` are those of the stretch before."""
        if math.isnan(self.low):
            return sorted(before) or [0]
        ends = _find_fitting_counts(joint.drive, self.low, self.high)
        if ends[0] > ends[1]:
            middle = (joint.drive.low + joint.drive.high - self.low - self.high) / (2.0 * TURN)
            return _list_nearest(ends[1], ends[0], middle, _MOST_OFF)
        near = (joint.home - 0.5 * (self.low + self.high)) / TURN
        if not before:
            return _list_nearest(*ends, near, _MOST_AT_START)
        return sorted({*ends, _clip_turns(round(near), ends), *(_clip_turns(turns, ends) for turns in before)})

    def measure_cost(self, joint: TurningJoint, turns: int) -> tuple[int, float]:
        """Measure records off limits and rad from home with a count of turns."""
        from_home = 0.0 if math.isnan(self.low) else _measure_distance(turns, self.low, self.high, joint.home)
        return joint.count_off(self.start, self.stop, turns), from_home


def _list_nearest(low: int, high: int, middle: float, most: int) -> list[int]:
    """List up to ``most`` whole numbers from low to high, those nearest to a middle."""
    if high - low >= most:
        low = min(max(low, round(middle) - most // 2), high - most + 1)
        high = low + most - 1
    return list(range(low, high + 1))


def choose_turns(joint: TurningJoint, cuts: Sequence[int] = ()) -> list[int]:
    """Choose the count of turns in every stretch between the cuts, by dynamic programming over the stretches.

    The best counts break the joint's range in the fewest records, then turn the joint least, then keep nearest to home.
    """
    costs: dict[int, Cost] = {}  # of the best choice that ends with a count in the stretch before
    origins: list[dict[int, int]] = []  # by stretch: the count before, by the count there
    for stretch in joint.split(cuts):
        new_costs: dict[int, Cost] = {}
        origin: dict[int, int] = {}
        step = 0.0 if not stretch.start else float(joint.angles[stretch.start] - joint.angles[stretch.start - 1])
        step = 0.0 if math.isnan(step) else step
        for turns in stretch.list_counts(joint, list(costs)):
            off, from_home = stretch.measure_cost(joint, turns)
            best: Cost = (off, 0.0, from_home)
            for last, (off_before, turned, from_home_before) in costs.items():
                turned = round(turned + abs(step + TURN * (turns - last)), 6)
                cost = (off + off_before, turned, from_home + from_home_before)
                if turns not in origin or cost < best:
                    best, origin[turns] = cost, last
            new_costs[turns] = best
        costs = new_costs
        origins.append(origin)
    turns = min(costs, key=lambda count: (costs[count], abs(count)))
    counts = [turns]
    for origin in reversed(origins[1:]):
        turns = origin[turns]
        counts.append(turns)
    return counts[::-1]
