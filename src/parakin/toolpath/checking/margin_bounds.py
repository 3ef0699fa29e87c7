"""Bounds of the limits' margins over sections and runs of motions, by interval arithmetic.

The mean value theorem bounds a margin from its values at the ends of a section and from the range of its derivatives
over the box of poses that holds the section. Bounds of the margin itself over the box count where they are better.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist.pole_crossing import EITHER, OTHER, OWN, WristModes
from ...kinematics.wrist.pole_thresholds import ASIDE, LEEWAY, PROVED, convert_to_freedom
from ...performance.certified.margin_rates import MarginRates
from .motion_sections import Sections
from .motions import (
    MotionPoints,
    PathMotions,
    measure_machine_size,
    merge_wrist_modes,
)

KEPT = 1e-9  # of a limit's size: a margin no farther below zero counts as kept, for it is rounding
_SHORTEST_SHARE = 2.0**-30  # of a motion: no section is shorter
_SHORTEST = {"mm": 1e-7, "rad": 1e-9}  # a section that is shorter on every axis is not cut
_HALF, _TURN = np.pi, 2.0 * np.pi
_ROUNDING = 1e-6  # rad, of joints and of their bounds
_BOXES_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class MarginBounds:
    """What is proved of every point of n sections, or runs of motions.

    least : (n, limits) a bound that no margin is below
    counted : (n,) every turning joint goes from its value at the start to that at the end without a jump
    """

    least: Array
    counted: Flags


class _Boxes(NamedTuple):
    """Boxes [low, high] of poses (n, axes), the wrist's modes in them (n,), and the rows that were moved aside."""

    low: Array
    high: Array
    wrist_modes: WristModes
    aside: Indices


class MotionProver:
    """Prove the limits kept over sections of motions and over runs of motions, with bounds of their margins.

    tolerance : (limits,) how far below zero a margin still counts as kept
    boxes : how many were bounded, a measure of the work
    """

    def __init__(self, motions: PathMotions):
        self.motions = motions
        machine = motions.machine
        self.margin_rates = [MarginRates(machine, mode) for mode in motions.modes]
        columns = {name: column for column, name in enumerate(machine.limits)}
        self._range_columns = {  # of each turning joint: its limits
            joint: [
                columns[name] for side in ("min", "max") if (name := f"{machine.drives[joint].name}.{side}") in columns
            ]
            for joint in motions.turning_joints
        }
        self._bounded_by_value = np.ones(len(columns), bool)  # all but the limits that count turns
        for own_columns in self._range_columns.values():
            self._bounded_by_value[own_columns] = False
        size = measure_machine_size(machine)
        sizes = {"mm": size, "rad": 1.0, "1": 1.0, "mm²": size * size}
        self._size = size
        self._aside = 2.0 * ASIDE * np.array([sizes[limit.unit] for limit in machine.limit_definitions])
        self.tolerance = KEPT * np.array([sizes[limit.unit] for limit in machine.limit_definitions])
        self.boxes = 0

    @np.errstate(over="ignore", invalid="ignore")  # thousands of km away rates overflow, and bound nothing
    def bound_sections(self, sections: Sections) -> MarginBounds:
        """Bound the margins over sections by the mean value theorem from both ends."""
        p0, p1, m0, m1 = sections.first.poses, sections.last.poses, sections.first.margins, sections.last.margins
        step = p1 - p0
        change = (sections.last.joints - sections.first.joints)[:, self.motions.turning_joints]
        least, count = np.full(m0.shape, -np.inf), m0.shape[1]
        counted = np.zeros(len(sections), bool)
        boxes = self._box_sections(sections)
        self.boxes += len(sections)
        for rates, rows in self._group_by_mode(boxes.wrist_modes):
            down, up = rates.bound_rates(boxes.low[rows], boxes.high[rows])
            way = step[rows][:, None, :]
            down, up = np.minimum(down * way, up * way).sum(2), np.maximum(down * way, up * way).sum(2)
            least[rows] = _bound_from_ends(m0[rows], m1[rows], down[:, :count], up[:, :count])
            counted[rows] = _find_contained(change[rows], change[rows], down[:, count:], up[:, count:], _TURN)
        aside = boxes.aside
        least[aside] -= self._aside * (np.linalg.norm(step[aside], axis=1) / self._size)[:, None]
        free = self._raise_by_values(boxes, least)
        self._allow_free_wrist(free, np.minimum(m0, m1), np.abs(change), least, counted)
        return MarginBounds(least, counted)

    @np.errstate(over="ignore", invalid="ignore")
    def bound_runs(
        self, at: MotionPoints, wrist_modes: WristModes, box: tuple[Array, Array], joint_range: tuple[Array, Array]
    ) -> MarginBounds:
        """Bound the margins over runs of motions by the mean value theorem from one point of each.

        at : the points, one on each of n runs
        box : least and greatest poses (n, axes) of each run
        joint_range : least and greatest joints (n, joints) at the records of each run
        """
        turning, count = self.motions.turning_joints, at.margins.shape[1]
        (low, high), (q_low, q_high) = box, joint_range
        below, above = (low - at.poses)[:, None, :], (high - at.poses)[:, None, :]
        back, ahead = (end[:, turning] - at.joints[:, turning] for end in joint_range)
        least, counted = np.full(at.margins.shape, -np.inf), np.zeros(len(low), bool)
        still = (at.wrist_modes == EITHER) & self._find_still(q_high - q_low)
        boxes = self._move_aside(at, still, low, high, wrist_modes)
        self.boxes += len(low)
        for rates, rows in self._group_by_mode(boxes.wrist_modes):
            down, up = rates.bound_rates(boxes.low[rows], boxes.high[rows])
            b, a = below[rows], above[rows]
            down, up = np.minimum(down * a, up * b).sum(2), np.maximum(up * a, down * b).sum(2)
            least[rows] = at.margins[rows] + down[:, :count]
            counted[rows] = _find_contained(back[rows], ahead[rows], down[:, count:], up[:, count:], _HALF)
        least[boxes.aside] -= self._aside
        free = self._raise_by_values(boxes, least)
        self._allow_free_wrist(free, self._measure_ranges(least.shape, q_low, q_high), ahead - back, least, counted)
        return MarginBounds(least, counted)

    def _measure_ranges(self, shape: tuple[int, ...], q_low: Array, q_high: Array) -> Array:
        """Compute the margins of turning joints' ranges for least and greatest joints; -inf in the other columns."""
        machine, margins = self.motions.machine, np.full(shape, -np.inf)
        for joint, columns in self._range_columns.items():
            drive = machine.drives[joint]
            for column in columns:
                is_min = machine.limits[column].endswith(".min")
                margins[:, column] = q_low[:, joint] - drive.low if is_min else drive.high - q_high[:, joint]
        return margins

    def _group_by_mode(self, wrist_modes: WristModes) -> list[tuple[MarginRates, Indices]]:
        """List the rows to bound in each working mode, in blocks; rows that change their mode are in none."""
        groups = [(self.margin_rates[0], np.flatnonzero(wrist_modes == OWN))]
        if len(self.margin_rates) > 1:
            groups.append((self.margin_rates[1], np.flatnonzero(wrist_modes == OTHER)))
        return [
            (rates, rows[start : start + _BOXES_AT_ONCE])
            for rates, rows in groups
            for start in range(0, len(rows), _BOXES_AT_ONCE)
        ]

    def _find_still(self, change: Array) -> Flags:
        """Find rows of joints' changes (n, joints) in which the wrist does not turn."""
        return np.asarray((np.abs(change[:, self.motions.wrist_joints]) <= _ROUNDING).all(1))

    def _box_sections(self, sections: Sections) -> _Boxes:
        """Box the poses of sections, those on which the wrist stands on its pole a little off it."""
        first, last = sections.first, sections.last
        low, high = np.minimum(first.poses, last.poses), np.maximum(first.poses, last.poses)
        on_pole = (first.wrist_modes == EITHER) & (last.wrist_modes == EITHER)
        still = on_pole & self._find_still(last.joints - first.joints)
        merged = merge_wrist_modes(first.wrist_modes, last.wrist_modes)
        wrist_modes = np.where(on_pole, OWN, merged).astype(np.int8)
        return self._move_aside(first, still, low, high, wrist_modes)

    def _move_aside(self, at: MotionPoints, still: Flags, low: Array, high: Array, wrist_modes: WristModes) -> _Boxes:
        """Move boxes in which the wrist stands ``still`` on its pole a little off the pole.

        On the pole the pose does not tell the first joint, on which everything else depends with a table.
        """
        machine, wrist = self.motions.machine, self.motions.wrist
        turns = machine.turning_columns
        rows = np.flatnonzero(still & (low[:, turns] == high[:, turns]).all(1))
        if wrist is None or not len(rows):
            return _Boxes(low, high, wrist_modes, rows[:0])
        joints = at.joints[rows].copy()
        joints[:, wrist.second] += ASIDE
        solution = machine.forward(joints, near=at.poses[rows])
        good = np.flatnonzero(solution.converged)
        rows, poses = rows[good], solution.poses[good]
        low, high, wrist_modes = low.copy(), high.copy(), wrist_modes.copy()
        low[np.ix_(rows, np.array(turns))] = high[np.ix_(rows, np.array(turns))] = poses[:, turns]
        wrist_modes[rows] = self.motions.find_wrist_modes(poses, joints[good])
        return _Boxes(low, high, wrist_modes, rows)

    def _raise_by_values(self, boxes: _Boxes, least: Array) -> Flags:
        """Raise ``least`` to the bounds of the margins themselves, in place; find boxes where the first joint is free.

        Both joints of the wrist go straight from value to value there.
        """
        worst, freedom = np.full(least.shape, np.inf), np.zeros(len(least))
        for number, rates in enumerate(self.margin_rates):
            rows = np.flatnonzero((boxes.wrist_modes == number) | (boxes.wrist_modes == EITHER))
            down, up = rates.bound_margins(boxes.low[rows], boxes.high[rows])
            worst[rows], freedom[rows] = np.minimum(worst[rows], down), np.maximum(freedom[rows], up)
        worst[boxes.aside] -= self._aside
        np.maximum(least, worst, out=least, where=self._bounded_by_value & ~np.isnan(worst))
        return freedom <= convert_to_freedom(PROVED) if self.motions.wrist is not None else np.zeros(len(least), bool)

    def _allow_free_wrist(self, free: Flags, margins: Array, change: Array, least: Array, counted: Flags) -> None:
        """Bound the wrist's ranges by the margins at the ends where its first joint is free; in place."""
        rows = np.flatnonzero(free)
        for joint in self.motions.wrist_joints:
            for column in self._range_columns[joint]:
                least[rows, column] = np.fmax(least[rows, column], margins[rows, column] - LEEWAY)
        counted[rows] |= (change[rows] < 1.5 * _HALF).all(1)

    def prove_regular(self, sections: Sections) -> Flags:
        """Prove sections free of parallel singularities, (n,)."""
        boxes = self._box_sections(sections)
        return self.prove_regular_boxes(boxes.low, boxes.high, boxes.wrist_modes)

    def prove_regular_boxes(self, low: Array, high: Array, wrist_modes: WristModes) -> Flags:
        """Prove boxes [low, high] of poses (n, axes) free of parallel singularities in their modes, (n,)."""
        regular = np.ones(len(low), bool)
        for number, rates in enumerate(self.margin_rates):
            rows = np.flatnonzero((wrist_modes == number) | (wrist_modes == EITHER))
            for start in range(0, len(rows), _BOXES_AT_ONCE):
                block = rows[start : start + _BOXES_AT_ONCE]
                regular[block] &= rates.prove_regular(low[block], high[block])
        return regular

    def find_finest(self, sections: Sections) -> Flags:
        """Find sections that are too short to be cut."""
        step = np.abs(sections.last.poses - sections.first.poses)
        shortest = [_SHORTEST[unit] for unit in self.motions.machine.axis_units]
        return np.asarray((step < shortest).all(1) | (sections.end - sections.begin <= _SHORTEST_SHARE))


def _bound_from_ends(m0: Array, m1: Array, down: Array, up: Array) -> Array:
    """Bound a value on the way from m0 to m1 from below, with its rate by the share t of the way in [down, up].

    The value at t is ≥ m0 + down·t and ≥ m1 - up·(1 - t).
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.clip((m0 - m1 + up) / (up - down), 0.0, 1.0)
        return np.where(down >= 0.0, m0, np.where(up <= 0.0, m1, m0 + down * t))


def _find_contained(low: Array, high: Array, down: Array, up: Array, turn: float) -> Flags:
    """Find rows whose changes from ``low`` to ``high`` lie in [down, up], if that is narrower than ``turn``.

    Narrower, the bounds hold no two changes that are a turn apart.
    """
    contained = (low >= down - _ROUNDING) & (high <= up + _ROUNDING) & (up - down < turn)
    return np.asarray(contained.all(1))
