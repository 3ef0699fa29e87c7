"""The joints along a curve: rows, dense enough that splines through them are the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import PoseError
from ...kernels.batch import split
from ...machine import Machine
from ..path import Floats
from ..posting.posted import Posted
from .corners import Curve, Flags, Indices
from .joint_following import close_to, followed
from .kernels.splines import along, astray, bends, blended, rows_of, swiftness

LONGEST = 2.0  # mm of the path's length: no step is longer
PARTS = 12.0  # into which half a corner is cut, for each rad (mm/mm) by which the path turns there
MOST_PARTS, ENOUGH = 8, 2_000_000  # no more than so many, and fewer where a path has so many parts in all
CLOSE = 3e-4  # of a joint's limit: what the splines may be off
_ROUNDS = 60
_ANEW = 5  # rounds after which the joints are followed from the start again
_FINEST = 1e-7  # mm: a step this short is not cut
_TELLS = 4  # rows beyond a new one over which splines still change
_BLOCK = 1 << 16  # rows
_NOISE = 1e-11  # of a joint's size: what its rounding may be


@dataclass(frozen=True)
class DriveLimits:
    """What each joint can do, (joints,) each, infinite where nothing is said; mm or rad, and s."""

    speed: Floats
    acceleration: Floats
    jerk: Floats

    @staticmethod
    def of(machine: Machine) -> DriveLimits:
        drives = machine.drives
        return DriveLimits(*(np.array([getattr(d, k) for d in drives]) for k in ("speed", "acceleration", "jerk")))

    @cached_property
    def bounds_acceleration(self) -> bool:
        """Some joint can't change its speed at once."""
        return bool(np.isfinite(self.acceleration).any() or np.isfinite(self.jerk).any())


@dataclass(frozen=True, eq=False)
class JointPath:
    """Joints over the length of a curve: cubic splines through n rows, with two continuous derivatives by s.

    posted, curve : whose joints they are
    segment, offset : (n,) the curve's piece that a row is on, and mm from its start
    step : (n - 1,) mm from row to row; 0 where the curve is parted: two rows stand there
    joints, bend : (n, joints) and their second derivatives by s
    feed : (n - 1,) the greatest ṡ² that the programmed feed allows over each step
    """

    posted: Posted
    curve: Curve
    segment: Indices
    offset: Floats
    step: Floats
    joints: Floats
    bend: Floats
    feed: Floats

    def between(self, row: int) -> str:
        """Where a row is, by the records before and behind it."""
        record = int(self.curve.record_of_piece[self.segment[row]])
        return f"between records {record - 1} and {record} (line {int(self.posted.path.line[record])})"

    def poses(self, cell: Indices, shift: Floats) -> Floats:
        """Poses ``shift`` mm after the rows ``cell``."""
        return poses_on(self.curve, self.segment[cell], self.offset[cell] + shift)

    def splines(self, cell: Indices, shift: Floats, speed: Floats, rise: Floats) -> tuple[Floats, Floats, Floats]:
        """Joints, speeds and accelerations ``shift`` mm after the rows ``cell``, where ṡ and s̈ are speed and rise."""
        out = tuple(np.empty((len(cell), self.joints.shape[1])) for _ in range(3))
        args = (cell, shift, speed, rise, self.step, self.joints, self.bend, *out)
        split(len(cell), lambda start, stop: along(*args, start, stop))
        return out[0], out[1], out[2]

    def joints_at(self, cell: Indices, shift: Floats) -> tuple[Floats, Floats, Floats]:
        """The machine's joints ``shift`` mm after the rows ``cell``, the nearest to the splines, and the splines.

        And how much less exact the first turning joint is; see :func:`~.following.close_to`.
        """
        nothing = np.zeros(len(cell))
        guess = self.splines(cell, shift, nothing, nothing)[0]
        joints, blur = close_to(self.posted.machine, self.posted.mode, self.poses(cell, shift), guess)
        return joints, guess, blur


def build_joint_path(
    posted: Posted, curve: Curve, drives: DriveLimits, tolerance: float, axis_tolerance: float
) -> JointPath:
    """The joints along a curve, in steps as short as they have to be.

    Raises :class:`PoseError` where a leg can't close between two records, or a joint would have to jump.
    """
    if not len(curve.length):
        nothing = np.empty(0)
        return JointPath(
            posted, curve, np.zeros(1, np.int64), np.zeros(1), nothing, posted.joints[:1], nothing, nothing
        )
    most = min(MOST_PARTS, ENOUGH // len(curve.length))
    steps = np.ceil(np.minimum(PARTS * curve.sharp, most)).astype(np.int64)
    args = (curve.length, curve.reach, curve.parted, steps, LONGEST)
    size = rows_of(*args, np.empty(0, np.int64), np.empty(0))
    segment, offset = np.empty(size, np.int64), np.empty(size)
    rows_of(*args, segment, offset)
    fine = 1e-3 * np.where(np.array(posted.machine.joint_units) == "mm", tolerance, axis_tolerance)
    joint_path = laid(posted, curve, segment, offset)
    doubtful = np.ones(size - 1, bool)
    for attempt in range(1, _ROUNDS):
        long = _too_long(joint_path, drives, fine, np.flatnonzero(doubtful & (joint_path.step > 0.0)))
        if not len(long):
            return joint_path
        if joint_path.step[long].min() < _FINEST:
            break
        where, parts = _cuts(long, joint_path.step)
        # The joints between are those nearest to the splines, but where a path passes beside a pole: there rows too
        # far apart may have led over it, which only all of them together tell.
        anew = attempt % _ANEW == 0
        joint_path = refined(joint_path, where, parts, anew)
        doubtful[:] = anew
        doubtful[where] = True
        doubtful = _widened(np.insert(doubtful, where + 1, True))
    raise PoseError(f"{joint_path.between(int(long[0]))} a joint would have to jump: the tool passes a singular pose")


def _cuts(long: Indices, step: Floats) -> tuple[Indices, Floats]:
    """Steps to cut, ascending, and after what parts of them: quarters of those too long, halves of their neighbours."""
    beside = np.setdiff1d(np.concatenate([long - 1, long + 1]), long)
    beside = beside[(beside >= 0) & (beside < len(step))]
    beside = beside[step[beside] > 0.0]
    where = np.concatenate([np.repeat(long, 3), beside])
    parts = np.concatenate([np.tile([0.25, 0.5, 0.75], len(long)), np.full(len(beside), 0.5)])
    order = np.lexsort((parts, where))
    return where[order], parts[order]


def _widened(flags: Flags) -> Flags:
    result = flags.copy()
    for by in range(1, _TELLS + 1):
        result[by:] |= flags[:-by]
        result[:-by] |= flags[by:]
    return result


def _too_long(joint_path: JointPath, drives: DriveLimits, fine: Floats, cells: Indices) -> Indices:
    """Those of some steps over which the splines are off by more than ``fine`` (joints,), or a limit would be."""
    found, wrist = [], joint_path.posted.machine.wrist
    for start in range(0, len(cells), _BLOCK):
        cell = cells[start : start + _BLOCK]
        middle, guess, blur = joint_path.joints_at(cell, 0.5 * joint_path.step[cell])
        off, grain = np.empty(len(cell), bool), np.full(middle.shape, _NOISE)
        if wrist is not None:
            grain[:, wrist.first] *= blur
        args = (
            joint_path.step,
            joint_path.bend,
            joint_path.feed,
            middle,
            guess,
            fine,
            drives.acceleration,
            CLOSE,
            grain,
            off,
        )
        split(len(cell), lambda start, stop: astray(cell, *args, start, stop))  # noqa: B023
        found.append(cell[off])
    return np.concatenate(found)


def refined(joint_path: JointPath, where: Indices, parts: Floats, anew: bool = False) -> JointPath:
    """A joint_path with rows added in steps ``where``, ascending, after ``parts`` of them.

    The joints at the new rows are those nearest to the old splines; with ``anew`` all are followed from the start.
    """
    shift = parts * joint_path.step[where]
    segment = np.insert(joint_path.segment, where + 1, joint_path.segment[where])
    offset = np.insert(joint_path.offset, where + 1, joint_path.offset[where] + shift)
    if anew:
        return laid(joint_path.posted, joint_path.curve, segment, offset)
    joints = np.insert(joint_path.joints, where + 1, joint_path.joints_at(where, shift)[0], axis=0)
    return _through(joint_path.posted, joint_path.curve, segment, offset, joints)


def laid(posted: Posted, curve: Curve, segment: Indices, offset: Floats) -> JointPath:
    """The joints at given rows, followed from the start."""
    way = np.append(0.0, np.cumsum(curve.length))[segment] + offset
    joints = followed(posted.machine, posted.mode, poses_on(curve, segment, offset), way)
    turns = np.round((posted.joints[0] - joints[0]) / (2.0 * np.pi))
    turns[np.array(posted.machine.joint_units) == "mm"] = 0.0
    if (turns != 0.0).any():
        joints += turns * (2.0 * np.pi)
    return _through(posted, curve, segment, offset, joints)


def _through(posted: Posted, curve: Curve, segment: Indices, offset: Floats, joints: Floats) -> JointPath:
    step = np.diff(offset)
    over = np.flatnonzero(segment[1:] != segment[:-1])
    ends = curve.length[segment[over]]
    step[over] = np.where(offset[over] < ends, ends - offset[over], 0.0)
    bend = np.empty_like(joints)
    bends(step, joints, bend, np.empty(len(segment)))
    joint_path = JointPath(
        posted, curve, segment, offset, step, joints, bend, _feeds(posted, curve, segment, offset, step)
    )
    if not np.isfinite(joints.sum()):
        lost = int((~np.isfinite(joints)).any(1).argmax())
        raise PoseError(f"{joint_path.between(lost)} the legs can't close")
    return joint_path


def poses_on(curve: Curve, segment: Indices, offset: Floats) -> Floats:
    """Poses on a curve, (rows, axes)."""
    out = np.empty((len(segment), curve.corner.shape[1]))
    args = (segment, offset, curve.corner, curve.length, curve.slope, curve.turn, curve.reach, out)
    split(len(segment), lambda start, stop: blended(*args, start, stop))
    return out


def _feeds(posted: Posted, curve: Curve, segment: Indices, offset: Floats, step: Floats) -> Floats:
    """(steps,) of ṡ², where the tip has the programmed feed or a piece takes the programmed time."""
    path, record = posted.path, curve.record_of_piece
    tip = np.array([i for i, axis in enumerate(posted.machine.axes) if axis in "XYZ"], np.int64)
    free = path.rapid[record]
    feed = np.where(free | np.isnan(path.feed[record]), np.inf, path.feed[record] / 60.0)
    most = np.full(len(record), np.inf)
    if path.seconds is not None:
        most = np.where(free | np.isnan(path.seconds[record]), np.inf, curve.length / path.seconds[record])
    out = np.empty(len(step))
    args = (segment, offset, step, tip, curve.length, curve.slope, curve.turn, curve.reach, feed, most, out)
    split(len(step), lambda start, stop: swiftness(*args, start, stop))
    return out
