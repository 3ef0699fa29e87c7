"""How far off the programmed path a controller's interpolation leads the tool."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from ...machine import Machine
from ..path import Floats
from ..posting.frames import compute_poses, frame_from_angles
from .continuation import Rows
from .interpolation import Indices, Programmed, axis_of_turns

Under: TypeAlias = Literal["pose", "joints"]
SHARES: Floats = (np.arange(32, dtype=np.float64) + 0.58) / 32.0  # where a part is looked at thoroughly
FOUND = 0.997  # of the tolerance: what may be found there, for the worst point may lie between
_BLOCK = 1 << 14  # points looked at together
_HERE = frame_from_angles(0, 0, 0, 0, 0, 0)


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of programmed motions, from one record of a posted path to the next.

    record, begin, end : (m,) the programmed motion by the record it leads to, and the shares of it where a part begins
        and ends
    first, last : the rows there
    """

    record: Indices
    begin: Floats
    end: Floats
    first: Rows
    last: Rows


@dataclass(frozen=True, eq=False)
class Tube:
    """The tolerances about a programmed path.

    programmed : the path, in the machine frame M (with a table: the table's)
    under : ``pose``, where the pose's coordinates go evenly from record to record, or ``joints``, where the joints do
    chord, angle : mm and rad

    The tool is compared with the point of its motion that is nearest to its tip; where in tolerances the axis goes
    farther than the tip, with the point at the same share.
    """

    machine: Machine
    programmed: Programmed
    under: Under
    chord: float
    angle: float

    def worst(self, parts: Parts, shares: Floats) -> Floats:
        """The greatest deviation at some shares of each part, (m,), in tolerances; infinite where there is no pose."""
        worst = np.empty(len(parts.record))
        step = max(1, _BLOCK // len(shares))
        for start in range(0, len(worst), step):
            some = slice(start, start + step)
            first, last = parts.first[some], parts.last[some]
            record = np.repeat(parts.record[some], len(shares))
            begin, span = parts.begin[some, None], (parts.end - parts.begin)[some, None]
            share = (begin + shares * span).ravel()
            ratio = self.deviations(record, share, self._poses(first, last, shares))[2]
            ratio = np.where(np.isnan(ratio), np.inf, ratio)
            worst[some] = ratio.reshape(-1, len(shares)).max(1)
        return worst

    def deviations(self, record: Indices, share: Floats, poses: Floats) -> tuple[Floats, Floats, Floats]:
        """Of poses (m, axes) reached at shares of the motions to ``record``: mm of the tip, rad of the axis, and the
        greater of both in tolerances; (m,) each."""
        point, k = self.programmed.at(record, share)
        tip = point.copy()
        for column, letter in enumerate(self.machine.axes):
            if letter in "XYZ":
                tip[:, "XYZ".index(letter)] = poses[:, column]
        if self.under == "joints":
            length, turn = self.programmed.extent(record)
            nearest = np.flatnonzero(length * self.angle > turn * self.chord)
            if len(nearest):
                to = record[nearest]
                way = (self.programmed.tip[to] - self.programmed.tip[to - 1]) / length[nearest, None] ** 2
                ahead = np.einsum("ij,ij->i", tip[nearest] - point[nearest], way)
                moved = np.clip(share[nearest] + np.where(np.isfinite(ahead), ahead, 0.0), 0.0, 1.0)
                point[nearest], k[nearest] = self.programmed.at(to, moved)
        if self._turns < 2:  # it points the tool as it can
            k = self._axes(compute_poses(self.machine, point, k, _HERE)[0])
        off, lean = _norm(tip - point), 2.0 * np.arcsin(np.minimum(1.0, 0.5 * _norm(self._axes(poses) - k)))
        return off, lean, np.maximum(off / self.chord, lean / self.angle)

    def _poses(self, first: Rows, last: Rows, shares: Floats) -> Floats:
        s = shares[None, :, None]
        poses = _between(first.poses, last.poses, s)
        if self.under == "joints":
            joints = _between(first.joints, last.joints, s)
            poses = self.machine.forward(joints, near=poses).poses
        return poses

    @property
    def _turns(self) -> int:
        return sum(letter in "ABC" for letter in self.machine.axes)

    @cached_property
    def _upright(self) -> Floats:
        """The tool's axis at A, B, C = 0."""
        return np.array(self.machine.structure.tool_axis, dtype=np.float64)

    def _axes(self, poses: Floats) -> Floats:
        """Tool axes (m, 3) of poses."""
        axes = self.machine.axes
        turns = np.zeros((len(poses), 3))
        for column, letter in enumerate(axes):
            if letter in "ABC":
                turns[:, "ABC".index(letter)] = poses[:, column]
        if self._turns >= 2:
            return axis_of_turns(turns)
        x, y, z = self._upright
        (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
        y, z = ca * y - sa * z, sa * y + ca * z
        x, z = cb * x + sb * z, cb * z - sb * x
        return np.column_stack([cc * x - sc * y, sc * x + cc * y, z])


def _between(first: Floats, last: Floats, s: Floats) -> Floats:
    rows: Floats = np.ascontiguousarray((first[:, None] + s * (last - first)[:, None]).reshape(-1, first.shape[1]))
    return rows


def _norm(rows: Floats) -> Floats:
    norms: Floats = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norms
