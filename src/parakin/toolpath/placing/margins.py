"""What a placement of the workpiece leaves of every limit: at some records of a path, or over the whole of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.turns import TURN
from ...machine import Machine
from ..path import ToolPath, select_records
from ..posting.frames import PathLimit, build_frame_from_angles, compose_frames, compute_poses
from ..posting.margin_blocks import split_margins
from ..posting.path_samples import SampledPath, sample_path
from ..posting.range_use import list_ranges
from ..posting.working_mode import follow_working_mode
from .maximin import score_rows

AXES = "XYZABC"
_UNIT = {"mm": 100.0, "rad": 1.0}  # what a limit of the path's own is relative to


class PlacementScore(NamedTuple):
    """A placement over the whole path.

    worth : as of :func:`~.maximin.score_rows`
    margin, limit, record : the least margin over half its limit's range, with its limit and record
    records : (limits,) where each limit is the tightest
    margins : (limits,) the least margin of each, over half its range
    """

    worth: float
    margin: float
    limit: str
    record: int
    records: Indices
    margins: Array


class Steering(NamedTuple):
    """How a path is followed at a placement.

    mode : working mode
    pole_zone : rad off a wrist's pole: nearer, the tool is held, and the first joint stands still
    rewinds : the first joint's turns are taken back, and the ends of its range do not count
    """

    mode: str
    pole_zone: float
    rewinds: bool


@dataclass(frozen=True, eq=False)
class PlacementMargins:
    """The margins that placements leave; these are points (d,) of the unit box, between the bounds of ``axes``.

    low, high : (d,) the bounds, mm and rad
    fixed : values of the axes that do not vary; those that are not named are zero

    Rows are margins over half their limit's range. Hard ones must not be negative and count no further: the legs'
    reach, over the rod's length squared, and what the machine's axes can't follow. The others are soft.
    """

    machine: Machine
    path: ToolPath
    steering: Steering
    axes: tuple[str, ...]
    low: Array
    high: Array
    fixed: dict[str, float]

    def list_values(self, point: Array) -> dict[str, float]:
        """List the values of the axes at a point, mm and rad."""
        free = self.low + point * (self.high - self.low)
        return self.fixed | dict(zip(self.axes, free.tolist(), strict=True))

    def build_workpiece(self, point: Array) -> Array:
        """Build the transform (3, 4) of the placement at a point."""
        values = self.list_values(point)
        return build_frame_from_angles(*(values.get(letter, 0.0) for letter in AXES))

    def compute_rows(self, points: Array, records: Indices, track: Indices | None) -> tuple[Array, Array]:
        """Compute hard and soft rows (m, ...) of points (m, d) at some records, ascending.

        track : records along which the joints go on, these ``records`` among them; None: they go on from each of these
            records to the next, and turning joints are brought to the middle of their ranges
        """
        path = select_records(self.path, records if track is None else track)
        rows = slice(None) if track is None else np.searchsorted(track, records)
        all_poses, all_joints, path_rows, mode = [], [], [], self.steering.mode
        for point in points:
            poses, path_limits = self._compute_poses(point, path)
            if track is None:
                joints = self.machine.follow(poses, mode, self.steering.pole_zone)
            else:
                sampled = self._sample(point, path, poses)
                solution = follow_working_mode(self.machine, path, sampled, mode, self.steering.pole_zone)
                poses, joints = solution.poses[rows], solution.joints[rows]
            all_poses.append(poses)
            all_joints.append(joints)
            path_rows.append(_list_path_rows(path_limits, rows))
        margins = self.machine.margins(np.concatenate(all_poses), np.concatenate(all_joints), mode)
        if track is None:
            self._turn_to_middle(margins)
        is_reach, spans = self._spans
        margins[:, self._rewound] = spans[self._rewound]
        margins = (margins / spans).reshape(len(points), len(records), -1)
        hard = np.concatenate([margins[:, :, is_reach].reshape(len(points), -1), np.array(path_rows)], axis=1)
        return hard, margins[:, :, ~is_reach].reshape(len(points), -1)

    def score_placement(self, point: Array) -> PlacementScore:
        """Score the placement at a point over the whole path."""
        poses, path_limits = self._compute_poses(point, self.path)
        sampled, mode = self._sample(point, self.path, poses), self.steering.mode
        solution = follow_working_mode(self.machine, self.path, sampled, mode, self.steering.pole_zone)
        is_reach, spans = self._spans
        names, is_hard = list(self.machine.limits), is_reach
        least, records = np.full(len(names), np.inf), np.zeros(len(names), np.int64)
        for block, margins in split_margins(self.machine, solution.poses, solution.joints, mode):
            margins = margins / spans
            margins[:, self._rewound] = 1.0
            margins = np.where(np.isnan(margins), np.where(is_reach, -1.0, np.inf), margins)
            tightest = margins.argmin(axis=0)
            here = margins[tightest, np.arange(len(names))]
            records = np.where(here < least, block.start + tightest, records)
            least = np.minimum(here, least)
        for limit in path_limits:
            size = np.abs(limit.values)
            names.append(limit.name)
            least = np.append(least, (limit.tolerance - size.max()) / _UNIT[limit.unit])
            records, is_hard = np.append(records, int(size.argmax())), np.append(is_hard, True)
        worth = float(score_rows(least[None, is_hard], least[None, ~is_hard])[0])
        counted = np.where(is_hard & (least >= 0.0), np.inf, least)
        if (counted[is_hard] < 0.0).any():
            counted[~is_hard] = np.inf
        index = int(counted.argmin()) if len(counted) else -1
        if index < 0 or counted[index] == np.inf:
            return PlacementScore(worth, 1.0, "", 0, records, least)
        return PlacementScore(worth, float(counted[index]), names[index], int(records[index]), records, least)

    @cached_property
    def _rewound(self) -> Indices:
        """The limits that rewinds keep; their margins count as half the range."""
        machine, wrist = self.machine, self.machine.wrist
        if wrist is None or not self.steering.rewinds:
            return np.empty(0, np.int64)
        name = machine.joints[wrist.first]
        return np.array([i for i, limit in enumerate(machine.limits) if limit in (f"{name}.min", f"{name}.max")])

    @cached_property
    def _spans(self) -> tuple[Flags, Array]:
        """Which limits are a mere reach, and what each limit's margin is relative to, (limits,)."""
        uses, quantities = list_ranges(self.machine)
        spans = [
            uses[i].span if i >= 0 else max(limit.bound, 1.0) ** (2 if limit.unit == "mm²" else 1)
            for i, limit in zip(quantities.tolist(), self.machine.limit_definitions, strict=True)
        ]
        return quantities < 0, np.array(spans)

    def _compute_poses(self, point: Array, path: ToolPath) -> tuple[Array, tuple[PathLimit, ...]]:
        return compute_poses(self.machine, path.tip, path.axis, self._compose_frame(point, path), path.turns)

    def _sample(self, point: Array, path: ToolPath, poses: Array) -> SampledPath:
        return sample_path(self.machine, path, self._compose_frame(point, path), self.steering.mode, poses)

    def _compose_frame(self, point: Array, path: ToolPath) -> Array:
        return compose_frames(self.build_workpiece(point), path.frame)

    def _turn_to_middle(self, margins: Array) -> None:
        """Turn every turning joint by the whole turns that bring it nearest to the middle of its range, in place."""
        names = self.machine.limits
        for drive in self.machine.drives:
            ends = f"{drive.name}.min", f"{drive.name}.max"
            if drive.unit == "rad" and ends[0] in names and ends[1] in names:
                low, high = (names.index(end) for end in ends)
                turned = TURN * np.round((margins[:, high] - margins[:, low]) / (2.0 * TURN))
                margins[:, low] += turned
                margins[:, high] -= turned


def _list_path_rows(limits: tuple[PathLimit, ...], records: Indices | slice) -> Array:
    """List the margins of a path's own limits, signed from both sides so that rows have no corner at zero."""
    signed = [(limit, sign * limit.values[records]) for limit in limits for sign in (1.0, -1.0)]
    rows = [(limit.tolerance + values) / _UNIT[limit.unit] for limit, values in signed]
    return np.concatenate(rows) if rows else np.empty(0)
