"""The deviation of the tool from the programmed path where a controller moves pose or joints evenly."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.rotations import collect_turns
from ...kinematics.wrist.pole_thresholds import LEAST_LEAN, WAVER
from ...machine import Machine
from ..posting.frames import compute_poses
from ..programmed_path import ProgrammedPath, compute_norms, compute_tool_axes, interpolate_great_circle
from .continuation import MACHINE_FRAME, PosedPoints

Interpolation: TypeAlias = Literal["pose", "joints"]  # what a controller moves evenly from record to record
SHARES: Array = (np.arange(32, dtype=np.float64) + 0.58) / 32.0  # of a span, at which its deviation is measured closely
ALLOWED = 0.997  # of the tolerance: what may be measured at SHARES, for the worst point may lie between them
_POINTS_AT_ONCE = 1 << 14


@dataclass(frozen=True, eq=False)
class MotionSpans:
    """m spans of programmed motions, from one record of a posted path to the next.

    record, begin, end : (m,) the programmed motion by the record it leads to, and the shares of it where a span begins
        and ends
    first, last : the points there
    """

    record: Indices
    begin: Array
    end: Array
    first: PosedPoints
    last: PosedPoints


@dataclass(frozen=True, eq=False)
class Deviation:
    """The measure of a controller's deviation from a programmed path, in tolerances.

    programmed : the path, in the machine frame M (with a table: the table's)
    interpolation : ``pose``, where the pose's coordinates go evenly from record to record, or ``joints``, where the
        joints do
    chord, angle : the tolerances, mm of the tip and rad of the axis

    The tool is compared with the point of its motion that is nearest to its tip; where the axis goes farther than the
    tip, in tolerances, with the point at the same share.
    """

    machine: Machine
    programmed: ProgrammedPath
    interpolation: Interpolation
    chord: float
    angle: float

    def measure_spans(self, spans: MotionSpans, shares: Array) -> Array:
        """Measure the greatest deviation at shares (k,) of each span, (m,), in tolerances; infinite without a pose."""
        worst = np.empty(len(spans.record))
        step = max(1, _POINTS_AT_ONCE // len(shares))
        for start in range(0, len(worst), step):
            block = slice(start, start + step)
            record = np.repeat(spans.record[block], len(shares))
            begin, length = spans.begin[block, None], (spans.end - spans.begin)[block, None]
            share = (begin + shares * length).ravel()
            poses = self._interpolate_poses(spans.first[block], spans.last[block], shares)
            ratio = self.measure_poses(record, share, poses)[2]
            ratio = np.maximum(ratio, self._measure_wavering(spans.first[block], spans.last[block], shares, poses))
            ratio = np.where(np.isnan(ratio), np.inf, ratio)
            worst[block] = ratio.reshape(-1, len(shares)).max(1)
        return worst

    def measure_poses(self, record: Indices, share: Array, poses: Array) -> tuple[Array, Array, Array]:
        """Measure the deviation of poses (m, axes) that the controller reaches at shares of the motions to ``record``.

        Returns mm of the tip, rad of the axis, and the greater of both in tolerances; (m,) each.
        """
        point, k = self.programmed.interpolate(record, share)
        tip = point.copy()
        for column, letter in enumerate(self.machine.axes):
            if letter in "XYZ":
                tip[:, "XYZ".index(letter)] = poses[:, column]
        if self.interpolation == "joints":
            length, turn = self.programmed.measure_motions(record)
            by_tip = np.flatnonzero(length * self.angle > turn * self.chord)
            if len(by_tip):
                motion = record[by_tip]
                way = (self.programmed.tip[motion] - self.programmed.tip[motion - 1]) / length[by_tip, None] ** 2
                ahead = np.einsum("ij,ij->i", tip[by_tip] - point[by_tip], way)
                nearest = np.clip(share[by_tip] + np.where(np.isfinite(ahead), ahead, 0.0), 0.0, 1.0)
                point[by_tip], k[by_tip] = self.programmed.interpolate(motion, nearest)
        if len(self.machine.turning_columns) < 2:  # the machine points the tool as it can
            k = self._compute_axes(compute_poses(self.machine, point, k, MACHINE_FRAME)[0])
        reached = self._compute_axes(poses)
        extension = self.programmed.interpolate_extension(record, share)
        off = compute_norms(tip - point - extension[:, None] * (reached - k) if extension.any() else tip - point)
        lean = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * compute_norms(reached - k)))
        return off, lean, np.maximum(off / self.chord, lean / self.angle)

    def find_wavering(self, spans: MotionSpans, shares: Array) -> Flags:
        """Find the spans (m,) on which the wrist's first joint is led aside too far, at shares (k,)."""
        poses = self._interpolate_poses(spans.first, spans.last, shares)
        wavering = self._measure_wavering(spans.first, spans.last, shares, poses)
        wavers: Flags = wavering.reshape(-1, len(shares)).max(1) > 1.0
        return wavers

    def _measure_wavering(self, first: PosedPoints, last: PosedPoints, shares: Array, poses: Array) -> Array:
        """Measure how far poses between two points lead the wrist's first joint aside, (m,), in fractions of WAVER.

        The axis leaves the great circle between both points, and the nearer the pole, the more that turns the joint. A
        wrist that the platform does not turn goes evenly with the pose, and a program's own turns are as they are.
        """
        wavering, wrist = np.zeros(len(poses)), self.machine.wrist
        is_even = self.interpolation == "joints" or self.programmed.path.turns is not None
        if wrist is None or is_even or not self.machine.structure.carries_pole:
            return wavering
        begin, end = (np.repeat(self._compute_axes(point.poses), len(shares), axis=0) for point in (first, last))
        even = interpolate_great_circle(begin, end, np.tile(shares, len(first.poses)))
        lean = compute_norms(self._compute_axes(poses) - even)
        near = np.flatnonzero(lean > LEAST_LEAN)
        off_pole = np.sqrt(wrist.measure_freedom(poses[near]))
        wavering[near] = lean[near] / np.maximum(WAVER * off_pole, LEAST_LEAN)
        return wavering

    def _interpolate_poses(self, first: PosedPoints, last: PosedPoints, shares: Array) -> Array:
        """Interpolate the controller's poses at shares of spans, share by share of the first span, then of the next."""
        s = shares[None, :, None]
        poses = _interpolate_rows(first.poses, last.poses, s)
        if self.interpolation == "joints":
            joints = _interpolate_rows(first.joints, last.joints, s)
            poses = self.machine.forward(joints, near=poses).poses
        return poses

    @cached_property
    def _upright(self) -> Array:
        """The tool's axis at A, B, C = 0."""
        return np.array(self.machine.structure.tool_axis, dtype=np.float64)

    def _compute_axes(self, poses: Array) -> Array:
        """Compute the tool axes (m, 3) of poses."""
        turns = collect_turns(self.machine.axes, poses)
        if len(self.machine.turning_columns) >= 2:
            return compute_tool_axes(turns)
        x, y, z = self._upright
        (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
        y, z = ca * y - sa * z, sa * y + ca * z
        x, z = cb * x + sb * z, cb * z - sb * x
        return np.column_stack([cc * x - sc * y, sc * x + cc * y, z])


def _interpolate_rows(first: Array, last: Array, s: Array) -> Array:
    rows: Array = np.ascontiguousarray((first[:, None] + s * (last - first)[:, None]).reshape(-1, first.shape[1]))
    return rows
