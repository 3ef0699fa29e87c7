"""The box in which a machine may be jogged: proved to be inside all limits, with speeds that its joints can follow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...arrays import Array, Flags
from ...machine import Machine
from ...performance.certified.margin_rates import MarginRates
from ...performance.singularities import compute_singularity_margins
from .axis_ranges import estimate_axis_ranges
from .axis_rates import choose_drive_rates, find_slowest_drive
from .home_pose import find_home_pose
from .model_header import find_least_margins

_TURN = np.radians(30.0)  # the widest range of a turning axis to either side of home
_NARROWER = 0.85  # the next try of a box that is not proved
_SMALLEST = 0.005  # of the first try
_FIRST_TURNS = (0.2, 0.1, 0.03, 0.01)  # of the widest turns, for the first box
_GROWTH = 0.1  # of a face's distance to the estimated range, by which it is moved outward
_GROWTH_AGAIN = 0.3  # of a step that could not be proved, for the next one
_LEAST_GROWTH = 0.02
_AT_THE_END = 0.01  # of the way from home to the estimated range: a face that is nearer to it stays
_CELLS = 2000  # cells of one proof
_BOUND_CELLS = 20000  # that are bisected for the speeds
_SAMPLES = 2000
_STEP = 1e-4  # mm and rad, of second differences
_FOR_CURVES = 0.5  # of the joints' accelerations, for the bend of axes in joints at full speed
_MOST_BOUND = 2.0  # of the most use, for its bound over a cell: intervals give some twice of what there is
_MOST_USE = 2.0  # of home's: how much faster joints may have to be in the box, for the same speeds of the axes
_ROUNDS = 24  # bisections of the cells whose bound is far above what is seen
_NEAR_ENOUGH = 1.15  # of what is seen: a bound that is no greater is not made better


@dataclass(frozen=True, eq=False)
class HandBox:
    """A box about LinuxCNC's home, (axes,) each: ends, and speeds and accelerations of all axes at once; mm, rad, s."""

    low: Array
    high: Array
    speed: Array
    acceleration: Array


@lru_cache(maxsize=32)
def find_hand_box(machine: Machine) -> HandBox:
    """Find a box about home by growth: shrunk until it is proved, then its faces moved outward one by one.

    Over all of it no limit is broken and no parallel singularity met, both proved by bounds of the margins' rates. The
    speeds are such that all axes together, each at its own, keep all joints within theirs.
    """
    home = find_home_pose(machine)
    proof = _BoxProof(machine, home)
    low, high = _choose_widest(machine, home)
    box = _grow_faces(proof, _find_first_box(proof, home, low, high), low, high)
    return HandBox(*box, *_choose_rates(proof, *box))


def _find_first_box(proof: _BoxProof, home: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Shrink the widest box about home until it is proved; turns are fewer and narrow, so that the tip has room."""
    turning = np.array(proof.machine.axis_units) == "rad"
    for turn in _FIRST_TURNS if turning.any() else (1.0,):
        scale = 1.0
        while scale > _SMALLEST:
            by = np.where(turning, turn, scale)
            box = home + by * (low - home), home + by * (high - home)
            if proof.holds(*box):
                return box
            scale *= _NARROWER
    return box


def _choose_widest(machine: Machine, home: Array) -> tuple[Array, Array]:
    """Choose the widest box that is tried: the axes' estimated ranges, turns near home, wrists off their pole."""
    low, high = estimate_axis_ranges(machine)
    turning = np.array(machine.axis_units) == "rad"
    low, high = np.minimum(low, home), np.maximum(high, home)
    low[turning] = np.maximum(low, home - _TURN)[turning]
    high[turning] = np.minimum(high, home + _TURN)[turning]
    return low, high


def _grow_faces(proof: _BoxProof, box: tuple[Array, Array], low: Array, high: Array) -> tuple[Array, Array]:
    """Move the faces outward in turn, each as long as the box is proved, in smaller steps where it is not."""
    ends, most = [end.copy() for end in box], (low, high)
    near = [_AT_THE_END * np.abs(end - proof.home) for end in most]
    steps = {(side, axis): _GROWTH for axis in range(len(low)) for side in (0, 1)}
    while steps:
        for (side, axis), step in tuple(steps.items()):
            tried = [end.copy() for end in ends]
            tried[side][axis] += step * (most[side][axis] - tried[side][axis])
            if proof.holds(*tried):
                ends = tried
            else:
                steps[side, axis] *= _GROWTH_AGAIN
        left = [np.abs(most[side] - ends[side]) for side in (0, 1)]
        steps = {
            (side, axis): step
            for (side, axis), step in steps.items()
            if step > _LEAST_GROWTH and left[side][axis] > near[side][axis]
        }
    return ends[0], ends[1]


class _BoxProof:
    """Proofs over boxes of poses [low, high], by bisection of what is undecided."""

    def __init__(self, machine: Machine, home: Array):
        self.machine, self.home, self.rates = machine, home, MarginRates(machine, machine.mode)
        self.least = find_least_margins(machine)
        self.slowest = np.array([find_slowest_drive(machine, unit) for unit in machine.axis_units])
        self.drives = np.array([choose_drive_rates(drive) for drive in machine.drives])
        at_home, wrist = home[None], machine.wrist
        self.off_pole = 0.0 if wrist is None else float(np.arcsin(np.sqrt(wrist.measure_freedom(at_home)[0])))
        self.most_use = _MOST_USE * float(self._measure_use(at_home, at_home, self.slowest[:, 0], self.drives[:, 0])[0])

    def holds(self, low: Array, high: Array) -> bool:
        """Tell whether no limit is broken, no singularity met, and the wrist off its pole; False if undecided."""
        if not self._may_hold(low, high):
            return False
        cells, left, self.whole = (low[None], high[None]), _CELLS, high - low
        while len(cells[0]):
            left -= len(cells[0])
            middles = 0.5 * (cells[0] + cells[1])
            if left < 0 or not self._are_good(middles).all():
                return False
            decided, widest = self._decide(*cells)
            cells = _bisect(cells[0][~decided], cells[1][~decided], widest[~decided])
        return True

    def _may_hold(self, low: Array, high: Array) -> bool:
        rng = np.random.default_rng(0)
        ends = rng.integers(0, 2, (64, len(low)))
        poses = np.vstack([low + ends * (high - low), rng.uniform(low, high, (256, len(low)))])
        return bool(self._are_good(poses).all())

    def _are_good(self, poses: Array) -> Flags:
        """Find poses that are allowed, and keep the stated distance to singularities and the pole."""
        margins = compute_singularity_margins(self.machine, poses)[:, : len(self.least)]
        good: Flags = (self.machine.check(poses) == 0) & (margins >= self.least).all(1)
        use = self._measure_use(poses, poses, self.slowest[:, 0], self.drives[:, 0])
        if self.machine.wrist is not None:
            good &= ~self.machine.wrist.find_free(poses, 0.5 * self.off_pole)
        return good & (use <= self.most_use)

    def _decide(self, low: Array, high: Array) -> tuple[Flags, Array]:
        """Decide cells by the margins in the middle and their rates; also tell the axis that widens the bound most."""
        half = 0.5 * (high - low)
        down, up = self.rates.bound_rates(low, high)
        count = len(self.machine.limits)
        change = np.maximum(np.abs(down), np.abs(up))[:, :count] * half[:, None, :]
        slack = self.machine.margins(0.5 * (low + high)) - change.sum(2)
        slack = np.fmax(slack, self.rates.bound_margins(low, high)[0])
        use = self._use_rates(down, up, self.slowest[:, 0], self.drives[:, 0])
        decided = (slack >= 0.0).all(1) & (use <= _MOST_BOUND * self.most_use) & self.rates.prove_regular(low, high)
        worst = np.take_along_axis(change, slack.argmin(1)[:, None, None], 1)[:, 0]
        return decided, np.where((slack < 0.0).any(1), worst.argmax(1), (half / self.whole).argmax(1))

    def bound_use(self, low: Array, high: Array, speed: Array, most: Array) -> float:
        """Bound the greatest Σ |dq/dx|·speed / most of a box's poses, for rates of axes (axes,) and joints (joints,).

        Cells whose bound is far above the greatest use that is seen are bisected, one axis after the other.
        """
        cells, seen, use = (low[None], high[None]), 0.0, np.empty(0)
        for number in range(_ROUNDS):
            middles = 0.5 * (cells[0] + cells[1])
            seen = max(seen, float(self._measure_use(middles, middles, speed, most).max()))
            use = self._measure_use(*cells, speed, most)
            wide = use > _NEAR_ENOUGH * seen
            if not wide.any() or wide.sum() > _BOUND_CELLS:
                break
            cells = _bisect(cells[0][wide], cells[1][wide], np.full(wide.sum(), number % len(low)))
        return max(_NEAR_ENOUGH * seen, float(use.max()))

    def _measure_use(self, low: Array, high: Array, speed: Array, most: Array) -> Array:
        return self._use_rates(*self.rates.bound_rates(low, high), speed, most)

    def _use_rates(self, down: Array, up: Array, speed: Array, most: Array) -> Array:
        size = np.maximum(np.abs(down), np.abs(up))[:, [self._row_of(i) for i in range(len(most))]]
        use: Array = (size @ speed / most).max(1)
        return use

    def _row_of(self, joint: int) -> int:
        """Find the row of the bounded rates that are those of a joint: an end of its range, or the joint itself."""
        machine = self.machine
        if joint in machine.turning_joints:
            return len(machine.limits) + machine.turning_joints.index(joint)
        ends = {f"{machine.joints[joint]}.{end}" for end in ("min", "max")}
        return next(row for row, name in enumerate(machine.limits) if name in ends)


def _bisect(low: Array, high: Array, axis: Array) -> tuple[Array, Array]:
    """Cut cells (n, axes) in two along an axis (n,)."""
    rows = np.arange(len(low))
    middle = 0.5 * (low + high)[rows, axis]
    first, last = high.copy(), low.copy()
    first[rows, axis] = last[rows, axis] = middle
    return np.vstack([low, last]), np.vstack([first, high])


def _choose_rates(proof: _BoxProof, low: Array, high: Array) -> tuple[Array, Array]:
    """Choose speeds and accelerations (axes,) of all axes, in proportion to the slowest drives' of their unit."""
    (speed, acceleration), (most, greatest) = proof.slowest.T, proof.drives.T
    speed = speed / max(1.0, proof.bound_use(low, high, speed, most))
    bend = _sample_bend(proof.machine, low, high, speed)
    speed = speed * min(1.0, float(np.sqrt(_FOR_CURVES * greatest / np.maximum(bend, 1e-300)).min()))
    left = greatest - np.minimum(bend, _FOR_CURVES * greatest)
    return speed, acceleration / max(1.0, proof.bound_use(low, high, acceleration, left))


def _sample_bend(machine: Machine, low: Array, high: Array, speed: Array) -> Array:
    """Sample the joints' accelerations (joints,) in even motion at full speed, in all directions at once."""
    rng = np.random.default_rng(0)
    shares = rng.random((_SAMPLES, len(low)))
    shares[::2] = np.round(shares[::2])  # corners, where joints bend most
    poses = low + shares * (high - low)
    signs = rng.choice([-1.0, 1.0], poses.shape)
    step = _STEP * signs * speed / speed.max()
    joints = [machine.inverse(poses + k * step) for k in (-1.0, 0.0, 1.0)]
    bend: Array = np.nanmax(np.abs(joints[0] - 2.0 * joints[1] + joints[2]), axis=0) * (speed.max() / _STEP) ** 2
    return bend
