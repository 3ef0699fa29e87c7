"""How long designs take for a part: estimated in a search, where each has its own joints along the same curve."""

from __future__ import annotations

from functools import cached_property
from math import isfinite

import numpy as np

from ..arrays import Array, Indices
from ..errors import PoseError
from ..families.family import Family
from ..kinematics.turns import unwind_angles
from ..kinematics.wrist.pole_crossing import find_crossings
from ..machine import Machine
from ..toolpath.job import Job, Tolerances, prepare
from ..toolpath.path import ToolPath
from ..toolpath.posting.frames import compose_frames, workpiece
from ..toolpath.posting.post import post_path
from ..toolpath.timing.corners import Curve, round_corners
from ..toolpath.timing.drive_limits import DriveLimits
from ..toolpath.timing.joint_path import LONGEST, divide_joint_path, fit_joint_path, grade_rows
from ..toolpath.timing.plan import flag_stops
from ..toolpath.timing.stops import find_stops, sum_dwells
from ..toolpath.timing.time_optimal import find_quickest, sum_spans

_ROWS = 2400  # of the path that are timed, at most
_WINDOWS = 6  # stretches of so many rows in all, where the path has more
_ROUNDING = np.array([0.5, 1.0])  # of a rounding's reach, where it has rows
_CLOSE = 1e-6  # of a piece: rows nearer to each other are one
_CHECKED = 200  # poses of the path at which limits are looked at


class PartTimer:
    """Times a part on a family's machines by the quickest profile without jerks and forces along rows of its curve.

    The curve, its corners and its rows are the nominal machine's, for they hang on the tool alone. Of a path with more
    rows stretches evenly spread are timed. What jerks, forces, and what lies between the stretches add is taken to be
    the same fraction for all designs: that of the nominal machine's job.

    family : the machines
    path, frame : a part, and where it lies, as for :func:`parakin.prepare`
    shift : (axes,) how far the nominal machine's part is moved from there
    checked_poses : (P, axes), mm and rad, of the path, at which limits are looked at

    Raises :class:`PoseError` for a path that can't be timed, or drives without accelerations.
    """

    def __init__(self, family: Family, path: ToolPath, frame: Array | None, shift: Array):
        self.family, self.path, self.frame, self.shift = family, path, frame, shift
        machine = family.machine
        self._limits = DriveLimits.of(machine)
        if not self._limits.bounds_acceleration:
            raise PoseError("path: no drive has an acceleration or a jerk, so all designs take as long")
        stops = flag_stops(path, find_stops(path))
        self._posted = post_path(machine, path, workpiece=frame, mode=machine.mode)
        rounded = Tolerances().share_with_corners()
        self._curve = round_corners(self._posted, "round", rounded.tip, rounded.axis, stops, True)
        length = float(self._curve.length.sum())
        if not length:
            raise PoseError("path: its tool path has a single point")
        segment, offset = grade_rows(self._curve, *_place_rows(self._curve), max(LONGEST, 2.0 * length / _ROWS))
        self._windows = _choose_windows(segment)
        self._segment, self._offset = segment, offset
        self._timed = np.concatenate([self._curve.poses(segment[w], offset[w]) for w in self._windows])
        whole = np.unique(np.linspace(0, len(segment) - 1, _CHECKED).astype(int))
        self.checked_poses = self._curve.poses(segment[whole], offset[whole])
        at = np.append(0.0, np.cumsum(self._curve.length))[segment] + offset
        self._stands_for = length / sum(float(at[w.stop - 1] - at[w.start]) for w in self._windows)
        self._waits = sum_dwells(path)

    def __repr__(self) -> str:
        return f"<parakin part timer on {self.family.machine.name}: {len(self._timed)} rows>"

    def estimate_seconds(self, shifts: Array, sizes: Array) -> Array:
        """Estimate the cycle times of designs, (S,) s; NaN where the part is out of reach.

        shifts : (S, axes) by which the part is moved, mm and rad
        sizes : (S, k) of the family, mm and rad
        """
        return self.factor * self._time_stretches(shifts, sizes) + self._waits

    @cached_property
    def factor(self) -> float:
        """By which estimates are multiplied, as the time of a job has shown; 1 where the nominal machine has none."""
        seconds = self.prepare_job(self.family.machine, self.shift).seconds
        estimate = float(self._time_stretches(self.shift[None], self.family.nominal[None])[0])
        return 1.0 if seconds is None or not isfinite(estimate) else (seconds - self._waits) / estimate

    def _time_stretches(self, shifts: Array, sizes: Array) -> Array:
        joints = self._follow(self._timed + shifts[:, None], sizes[:, None])
        seconds = np.full(len(joints), np.nan)
        ends = np.cumsum([window.stop - window.start for window in self._windows])[:-1]
        for design in np.flatnonzero(np.isfinite(joints).all((1, 2))).tolist():
            windows = zip(self._windows, np.split(joints[design], ends), strict=True)
            seconds[design] = sum(self._time_rows(window, own) for window, own in windows)
        return self._stands_for * seconds

    def _follow(self, poses: Array, sizes: Array) -> Array:
        """Follow the joints along each design's rows, (S, R, axes) -> (S, R, joints); over poles in the other mode."""
        machine = self.family.machine
        joints = self.family.inverse(poses, sizes)
        wrist = machine.wrist
        if wrist is not None:
            other = self.family.inverse(poses, sizes, wrist.other_mode(machine.mode))
            for own, there in zip(joints, other, strict=True):
                over = find_crossings(own[:, wrist.pair], there[:, wrist.pair])
                own[over] = there[over]
        for own in joints:
            for column in machine.turning_joints:
                own[:, column] = unwind_angles(own[:, column])
        return joints

    def prepare_job(self, machine: Machine, shift: Array) -> Job:
        """Prepare the part's job on a design's machine.

        machine : the design's
        shift : (axes,) by which the part is moved, mm and rad
        """
        by = {axis: float(value) for axis, value in zip(machine.axes, shift, strict=True) if axis in "XYZ"}
        return prepare(machine, self.path, workpiece=compose_frames(workpiece(**by), self.frame))

    def _time_rows(self, window: slice, joints: Array) -> float:
        path = fit_joint_path(self._posted, self._curve, self._segment[window], self._offset[window], joints)
        path, x, _ = find_quickest(path, self._limits, None, divide_joint_path)
        return sum_spans(path, x)


def _place_rows(curve: Curve) -> tuple[Indices, Array]:
    """Place rows at the corners of a curve, in their roundings and in the middle of its pieces."""
    count, length = len(curve.length), curve.length[:, None]
    near, far = curve.fall[:-1, None] * _ROUNDING, length - curve.rise[1:, None] * _ROUNDING[::-1]
    offset = np.sort(np.concatenate([np.zeros((count, 1)), near, 0.5 * length, far, length], 1))
    kept = np.diff(offset, append=np.inf) > _CLOSE * length
    kept[:, -1] = curve.parted[1:]
    kept[:, 0] = True
    segment = np.broadcast_to(np.arange(count)[:, None], offset.shape)
    return segment[kept], offset[kept]


def _choose_windows(segment: Indices) -> list[slice]:
    """Choose the rows that are timed: all, or stretches of them from a piece's first row to another's."""
    count = len(segment)
    if count <= _ROWS:
        return [slice(0, count)]
    each = _ROWS // _WINDOWS
    starts = np.linspace(0, count - each, _WINDOWS).astype(int)
    first = np.searchsorted(segment, segment[starts])
    last = np.minimum(np.searchsorted(segment, segment[starts + each - 1], "right"), count - 1)
    return [slice(begin, end + 1) for begin, end in zip(first.tolist(), last.tolist(), strict=True)]
