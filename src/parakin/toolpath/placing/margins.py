"""What a placement of the workpiece leaves of every limit: at some records of a path, or over the whole of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import PRINTED, TURN
from ...machine import Machine
from ..path import Floats, ToolPath
from ..posting.frames import PathLimit, compose_frames, compute_poses, frame_from_angles
from ..posting.range_use import list_ranges
from ..posting.working_mode import choose_branch
from .maximin import score_rows

Indices = NDArray[np.int64]
AXES = "XYZABC"
_BLOCK = 1 << 15  # records whose margins are held at once
_OFF = {"mm": 100.0, "rad": 1.0}  # what a limit of the path's own is relative to


class PlacementScore(NamedTuple):
    """A placement over the whole path: what it is worth, its tightest limit and record, and every limit's record."""

    worth: float
    margin: float
    limit: str
    record: int
    worst: Indices
    shares: Floats


@dataclass(frozen=True, eq=False)
class PlacementMargins:
    """Placements are points (d,) of the unit box, between the bounds of ``axes``; what isn't named is held.

    Rows are margins over half their limit's range. Hard ones must not be below 0 and count no further: the legs'
    reach, over the rod's length squared, and what the machine's axes can't follow.
    """

    machine: Machine
    path: ToolPath
    mode: str
    axes: tuple[str, ...]
    low: Floats
    high: Floats
    held: dict[str, float]

    def values(self, point: Floats) -> dict[str, float]:
        """mm and rad, by axis."""
        free = self.low + point * (self.high - self.low)
        return self.held | dict(zip(self.axes, free.tolist(), strict=True))

    def workpiece(self, point: Floats) -> Floats:
        """(3, 4)"""
        values = self.values(point)
        return frame_from_angles(*(values.get(letter, 0.0) for letter in AXES))

    def rows(self, points: Floats, records: Indices, track: Indices | None) -> tuple[Floats, Floats]:
        """Hard and soft rows (m, ...) of points (m, d) at some records, ascending.

        Joints go on from record to record of the ``track``, which holds these ``records``; without one from each of
        these to the next, turned to the middle of their ranges.
        """
        path = _some(self.path, records if track is None else track)
        at = slice(None) if track is None else np.searchsorted(track, records)
        poses, joints, own = [], [], []
        for point in points:
            x, limits = self._posed(point, path)
            if track is None:
                q = self.machine.follow(x, self.mode, PRINTED)
            else:
                taken = choose_branch(self.machine, path, x, self.mode)
                x, q = taken.poses[at], taken.joints[at]
            poses.append(x)
            joints.append(q)
            own.append(_own_rows(limits, at))
        margins = self.machine.margins(np.concatenate(poses), np.concatenate(joints), self.mode)
        if track is None:
            self._turn_freely(margins)
        hard, spans = self.relative
        margins = (margins / spans).reshape(len(points), len(records), -1)
        outer = np.concatenate([margins[:, :, hard].reshape(len(points), -1), np.array(own)], axis=1)
        return outer, margins[:, :, ~hard].reshape(len(points), -1)

    def found(self, point: Floats) -> PlacementScore:
        """The whole path's."""
        x, own = self._posed(point, self.path)
        taken = choose_branch(self.machine, self.path, x, self.mode)
        x, q = taken.poses, taken.joints
        hard, spans = self.relative
        count = len(self.machine.limits)
        least, worst = np.full(count, np.inf), np.zeros(count, np.int64)
        for start in range(0, len(q), _BLOCK):
            part = slice(start, start + _BLOCK)
            share = self.machine.margins(x[part], q[part], self.mode) / spans
            share = np.where(np.isnan(share), np.where(hard, -1.0, np.inf), share)
            at = share.argmin(axis=0)
            here = share[at, np.arange(count)]
            worst = np.where(here < least, start + at, worst)
            least = np.minimum(here, least)
        names = list(self.machine.limits)
        for limit in own:
            size = np.abs(limit.values)
            names.append(limit.name)
            least = np.append(least, (limit.tolerance - size.max()) / _OFF[limit.unit])
            worst, hard = np.append(worst, int(size.argmax())), np.append(hard, True)
        worth = float(score_rows(least[None, hard], least[None, ~hard])[0])
        counted = np.where(hard & (least >= 0.0), np.inf, least)
        if (counted[hard] < 0.0).any():
            counted[~hard] = np.inf
        index = int(counted.argmin()) if len(counted) else -1
        if index < 0 or counted[index] == np.inf:
            return PlacementScore(worth, 1.0, "", 0, worst, least)
        return PlacementScore(worth, float(counted[index]), names[index], int(worst[index]), worst, least)

    @cached_property
    def relative(self) -> tuple[NDArray[np.bool_], Floats]:
        """Which limits are a mere reach, and what each limit's margin is relative to, (limits,)."""
        uses, of = list_ranges(self.machine)
        spans = [
            uses[i].span if i >= 0 else max(limit.bound, 1.0) ** (2 if limit.unit == "mm²" else 1)
            for i, limit in zip(of.tolist(), self.machine.limit_parts, strict=True)
        ]
        return of < 0, np.array(spans)

    def _posed(self, point: Floats, path: ToolPath) -> tuple[Floats, tuple[PathLimit, ...]]:
        frame = compose_frames(self.workpiece(point), path.frame)
        return compute_poses(self.machine, path.tip, path.axis, frame, path.turns)

    def _turn_freely(self, margins: Floats) -> None:
        """Turn every turning joint by the whole turns that bring it nearest to the middle of its range, in place."""
        names = self.machine.limits
        for drive in self.machine.drives:
            ends = f"{drive.name}.min", f"{drive.name}.max"
            if drive.unit == "rad" and ends[0] in names and ends[1] in names:
                low, high = (names.index(end) for end in ends)
                by = TURN * np.round((margins[:, high] - margins[:, low]) / (2.0 * TURN))
                margins[:, low] += by
                margins[:, high] -= by


def _some(path: ToolPath, records: Indices) -> ToolPath:
    parts = {name: getattr(path, name)[records] for name in ("tip", "axis", "line", "rapid", "feed", "spindle")}
    turns = None if path.turns is None else path.turns[records]
    return replace(path, **parts, turns=turns, seconds=None, events=(), notes=())


def _own_rows(limits: tuple[PathLimit, ...], at: Indices | slice) -> Floats:
    """Signed values from both sides, so that rows have no corner at 0."""
    signed = [(limit, sign * limit.values[at]) for limit in limits for sign in (1.0, -1.0)]
    rows = [(limit.tolerance + values) / _OFF[limit.unit] for limit, values in signed]
    return np.concatenate(rows) if rows else np.empty(0)
