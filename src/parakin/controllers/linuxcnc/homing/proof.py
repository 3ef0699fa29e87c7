"""Prove by interval bisection that homing the legs together can't pull a machine through a singularity."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from ....arrays import Array, Flags
from ....machine import Machine
from ....performance.certified.bisection import AT_ONCE, bisect_inputs
from ....performance.certified.margin_rates import MarginRates
from ..axis_ranges import estimate_axis_ranges

_SLACK = 10.0  # mm that a joint may be off its even motion: ramps, and the way back off a switch
_BEYOND = 0.3  # of the axes' estimated ranges, by which the searched box is wider
_CELLS_OF_STARTS = 40_000
_MOST_CELLS = 50_000
_UNBOUNDED = 1e200


def prove_homing(machine: Machine, ends: dict[int, float], speeds: Array) -> bool:
    """Prove that legs homed together to their ``ends`` meet no singularity, from wherever the machine is switched on.

    A joint moves at its own speed until it is at its switch, so the seconds that two joints have yet to go never differ
    by more than at the start; on the way home all shrink in proportion. Where the machine may start, within all its
    limits, these seconds and their differences are bounded from above. Of the poses that keep these bounds none is
    singular, and none lies on the boundary of the searched box: so the pose, which goes on where it is regular, stays
    among them. Limits other than the ranges of the drives are not part of the claim.

    Only for machines that translate, without constraints, whose switches lie at the ends of the joints' ranges or
    beyond; of others, and where cells are left undecided, False.

    ends : joint's index to its switch, mm; speeds (joints,)
    """
    translates = all(unit == "mm" for unit in (*machine.axis_units, *machine.joint_units))
    if not translates or machine.constraints or len(ends) < len(machine.joints):
        return False
    return _TogetherProof(machine, ends, speeds).holds()


class _TogetherProof:
    """A machine that translates, its legs on their way to their switches, over cells [low, high] of poses."""

    def __init__(self, machine: Machine, ends: dict[int, float], speeds: Array):
        self.machine, self.rates, self.speeds = machine, MarginRates(machine, machine.mode), speeds
        joints = range(len(machine.joints))
        self.rows = [machine.limits.index(f"{machine.joints[i]}.min") for i in joints]
        self.reaches = [i for i, limit in enumerate(machine.limit_definitions) if limit.side == "reach"]
        self.drives = np.array([machine.drives[i].low for i in joints])
        self.switches = np.array([ends[i] for i in joints])
        middles = np.array([0.5 * (machine.drives[i].low + machine.drives[i].high) for i in joints])
        self.signs = np.where(self.switches < middles, -1.0, 1.0)
        ends_of_ranges = np.array([[getattr(drive, end) for drive in machine.drives] for end in ("low", "high")])
        self.before = ((self.switches - ends_of_ranges) * self.signs).min(0)
        self.pairs = list(permutations(joints, 2))
        low, high = (np.array(end) for end in estimate_axis_ranges(machine))
        self.low, self.high = low - _BEYOND * (high - low), high + _BEYOND * (high - low)

    def holds(self) -> bool:
        """Tell whether it is proved."""
        if (self.before < -_SLACK).any():
            return False  # a joint may stand beyond its switch
        longest, apart = self._bound_starts()
        low, high, left = self.low[None], self.high[None], _MOST_CELLS
        while len(low):
            left -= len(low)
            if left < 0:
                return False
            decided = [
                self._decide(low[i : i + AT_ONCE], high[i : i + AT_ONCE], longest, apart)
                for i in range(0, len(low), AT_ONCE)
            ]
            rest = ~np.concatenate(decided)
            low, high = _halve(low[rest], high[rest])
        return True

    def _bound_starts(self) -> tuple[Array, Array]:
        """Bound the seconds to go over all allowed poses, (joints,), and their differences, (pairs,), from above."""
        low, high = self.low[None], self.high[None]
        while 0 < len(low) < _CELLS_OF_STARTS:
            allowed = (self._bound_margins(low, high)[1] >= 0.0).all(1)
            low, high = _halve(low[allowed], high[allowed])
        first, last = self._bound_seconds(*self._bound_margins(low, high)[:2])
        return last.max(0), np.array([(last[:, i] - first[:, j]).max() for i, j in self.pairs])

    def _decide(self, low: Array, high: Array, longest: Array, apart: Array) -> Flags:
        """Decide which cells are not come to, or regular and inside of the box, (n,)."""
        least, most, bounded = self._bound_margins(low, high)
        first, last = self._bound_seconds(least, most)
        slack = _SLACK / self.speeds
        away = (last < -slack).any(1) | (first > longest + slack).any(1) | (most[:, self.reaches] < 0.0).any(1)
        for (i, j), seconds in zip(self.pairs, apart, strict=True):
            away |= first[:, i] - last[:, j] > seconds + slack[i] + slack[j]
        good: Flags = bounded & (low > self.low).all(1) & (high < self.high).all(1) & ~away
        good[good] = self.rates.prove_regular(low[good], high[good])
        return np.asarray(away | good)

    def _bound_margins(self, low: Array, high: Array) -> tuple[Array, Array, Flags]:
        """Bound all margins from both sides, (n, limits), and tell where the joints' rates are bounded, (n,).

        Where they are, the legs close all over the cell, and none of them is singular.
        """
        count = len(self.machine.limits)
        down, up = self.rates.bound_rates(low, high)
        change = (np.maximum(np.abs(down), np.abs(up))[:, :count] * 0.5 * (high - low)[:, None]).sum(2)
        middle = self.machine.margins(0.5 * (low + high))
        least, most = self.rates.enclose_margins(low, high)
        return (
            np.fmax(np.where(np.isnan(least), -np.inf, least), middle - change),
            np.fmin(np.where(np.isnan(most), np.inf, most), middle + change),
            (change[:, self.rows] < _UNBOUNDED).all(1),
        )

    def _bound_seconds(self, least: Array, most: Array) -> tuple[Array, Array]:
        """Bound the seconds that joints have yet to go, (n, joints), by the margins' bounds."""
        way = [(self.switches - self.drives - end[:, self.rows]) * self.signs / self.speeds for end in (least, most)]
        return np.minimum(*way), np.maximum(*way)


def _halve(low: Array, high: Array) -> tuple[Array, Array]:
    """Bisect cells across their widest axes."""
    return bisect_inputs(low, high, (high - low).argmax(1))
