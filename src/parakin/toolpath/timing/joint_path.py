"""The joints along a curve: rows, refined until cubic splines through them are the machine's joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...arrays import Array, Flags, Indices
from ...errors import PoseError
from ...kernels.batch import run_in_threads
from ...kinematics.turns import measure_whole_turns
from ..path import ToolPath
from ..posting.posted import Posted
from .corners import Curve
from .drive_limits import DriveLimits
from .joint_following import find_nearest_joints, follow_curve
from .kernels.grading import bound_sizes, cut_steps
from .kernels.rounded_corners import place_rows
from .kernels.speed_ceilings import CurveRows, FeedLimits, compute_feed_ceilings
from .kernels.splines import (
    ForceRows,
    JointRows,
    JointState,
    Midpoints,
    PathState,
    SplineTolerances,
    evaluate_splines,
    fit_splines,
    make_unforced_rows,
    mark_coarse_steps,
)

LONGEST = 2.0  # mm of the path's length: no step is longer
STEPS_PER_RAD = 12.0  # into which half a corner is cut, for each rad (mm/mm) by which the path turns there
MOST_STEPS, ENOUGH = 8, 2_000_000  # of half a corner, no more than so many, and fewer on paths of so many steps in all
_EACH, _SPANS = (
    2,
    2,
)  # steps of each span between two knots, and spans of a piece; one step on paths of that many in all
CLOSE = 3e-4  # greatest error of the splines' acceleration, as a fraction of a joint's limit
FINE = 1e-3  # greatest error of the splines' joints, as a fraction of the tolerances
_MOST_ROWS = 20_000_000  # at first: a path of 40 km, for which some GB are needed
_ROUNDS = 60
_ANEW = 5  # rounds after which the joints are followed from the start again
_FINEST = 1e-7  # mm: a step this short is not cut
_DISTURBED = 4  # rows beyond a new one over which the splines still change
_BLOCK = 1 << 16  # steps measured at a time
_STILL = 1e-9  # mm: a tip that moves less stands still
_NOISE = 1e-11  # rounding error as a fraction of a joint's size


@dataclass(frozen=True, eq=False)
class JointPath:
    """The joints over the length of a curve, by n rows: cubic splines, with two continuous derivatives by s.

    posted, curve : whose joints they are
    segment, offset : (n,) the curve's piece that a row is on, and mm from its start
    rows : the steps from row to row, the joints, their second derivatives by s, and the ceiling of the feed
    """

    posted: Posted
    curve: Curve
    segment: Indices
    offset: Array
    rows: JointRows

    @property
    def step(self) -> Array:
        """(n - 1,) mm from row to row; 0 where the curve is parted: two rows stand there."""
        return self.rows.step

    @property
    def joints(self) -> Array:
        """(n, joints) mm and rad."""
        return self.rows.joints

    def describe_step(self, row: int) -> str:
        """Describe where the step after a ``row`` is, by the record that its motion leads to."""
        record = int(self.curve.record_of_piece[self.segment[row]])
        return f"{self.posted.path.locate(record)}: on the way to it"

    def find_stretches(self) -> Indices:
        """Find the first and the last row of each stretch, (k, 2)."""
        gaps = np.flatnonzero(self.step == 0.0)
        return np.column_stack([np.append(0, gaps + 1), np.append(gaps, len(self.step))])

    def find_ends(self) -> Indices:
        """Find the rows at which stretches begin and end."""
        return self.find_stretches().ravel()

    def poses(self, row: Indices, shift: Array) -> Array:
        """Compute the poses (k, axes) that lie ``shift`` (k,) mm of s after each ``row`` (k,)."""
        return self.curve.poses(self.segment[row], self.offset[row] + shift)

    def evaluate(self, state: PathState) -> JointState:
        """Evaluate the splines: joints, speeds and accelerations of k states along the path.

        state : rows, mm of s after them, ṡ and s̈, (k,) each
        """
        out = JointState(*(np.empty((len(state.row), self.joints.shape[1])) for _ in range(3)))
        run_in_threads(len(state.row), lambda start, stop: evaluate_splines(self.rows, state, out, start, stop))
        return out

    def joints_at(self, row: Indices, shift: Array) -> tuple[Array, Array, Array]:
        """Compute the machine's joints ``shift`` (k,) mm after each ``row`` (k,), nearest the splines, and the splines.

        The third (k, joints) is how far rounding takes the former off.
        """
        still = np.zeros(len(row))
        splined = self.evaluate(PathState(row, shift, still, still)).joints
        machine, poses = self.posted.machine, self.poses(row, shift)
        joints = find_nearest_joints(machine, self.posted.mode, poses, splined)
        if machine.wrist is None:
            return joints, splined, _NOISE * np.maximum(1.0, np.abs(joints))
        return joints, splined, _NOISE * machine.wrist.measure_blur(poses, self.posted.mode, joints)

    def __repr__(self) -> str:
        return f"<parakin joint path: {len(self.segment)} rows>"


def build_joint_path(
    posted: Posted, curve: Curve, limits: DriveLimits, tolerance: float, axis_tolerance: float
) -> JointPath:
    """Build the joints along a curve, with steps as short as the splines need them.

    Raises :class:`PoseError` where a leg can't close between two records, a joint would have to jump, or the path has
    tens of kilometres.
    """
    if not len(curve.length):
        return _build_single_row(posted, curve)
    most = min(MOST_STEPS, ENOUGH // len(curve.length))
    corner_steps = np.ceil(np.minimum(STEPS_PER_RAD * curve.sharpness, most)).astype(np.int64)
    each = _EACH if _EACH * _SPANS * len(curve.length) <= ENOUGH else 1
    length = float(curve.length.sum())
    too_long = not length < LONGEST * _MOST_ROWS  # rows are counted one by one
    size = 0 if too_long else place_rows(curve, corner_steps, each, LONGEST, np.empty(0, np.int64), np.empty(0))
    if too_long or size > _MOST_ROWS:
        raise PoseError(f"a path of {1e-6 * length:,.0f} km, too long to be timed")
    segment, offset = np.empty(size, np.int64), np.empty(size)
    place_rows(curve, corner_steps, each, LONGEST, segment, offset)
    fine = FINE * np.where(np.array(posted.machine.joint_units) == "mm", tolerance, axis_tolerance)
    tolerances = SplineTolerances(fine, limits.acceleration, CLOSE)
    joint_path = _follow_rows(posted, curve, segment, offset)
    doubtful = np.ones(size - 1, bool)
    for attempt in range(1, _ROUNDS):
        coarse = _find_coarse_steps(joint_path, tolerances, np.flatnonzero(doubtful & (joint_path.step > 0.0)))
        if not len(coarse):
            return joint_path
        if joint_path.step[coarse].min() < _FINEST:
            break
        steps, fractions = _divide_steps(coarse, joint_path.step)
        # The joints of new rows are those nearest to the splines. Beside a pole rows too far apart may have led over
        # it; only following all rows from the start shows that.
        anew = attempt % _ANEW == 0
        joint_path = refine_joint_path(joint_path, steps, fractions, anew)
        doubtful[:] = anew
        doubtful[steps] = True
        doubtful = _widen_flags(np.insert(doubtful, steps + 1, True))
    where = joint_path.describe_step(int(coarse[0]))
    raise PoseError(f"{where} a joint would have to jump: the tool passes a singular pose")


def grade_rows(curve: Curve, segment: Indices, offset: Array, longest: float) -> tuple[Indices, Array]:
    """Add rows until no step is longer than about twice its neighbour, or than ``longest`` mm."""
    step, size = _measure_steps(curve, segment, offset), np.full(len(segment), longest)
    bound_sizes(step, size)
    count = cut_steps(step, size, np.empty(0, np.int64), np.empty(0))
    steps, fractions = np.empty(count, np.int64), np.empty(count)
    cut_steps(step, size, steps, fractions)
    return np.insert(segment, steps + 1, segment[steps]), np.insert(
        offset, steps + 1, offset[steps] + fractions * step[steps]
    )


def _measure_steps(curve: Curve, segment: Indices, offset: Array) -> Array:
    """Measure the steps from row to row, (rows - 1,) mm; zero where the curve is parted."""
    step = np.diff(offset)
    over = np.flatnonzero(segment[1:] != segment[:-1])
    ends = curve.length[segment[over]]
    step[over] = np.where(offset[over] < ends, ends - offset[over], 0.0)
    return step


def _build_single_row(posted: Posted, curve: Curve) -> JointPath:
    """Build the joint path of a curve that is a single point."""
    joints, empty = posted.joints[:1], np.empty(0)
    rows = JointRows(empty, joints, np.zeros_like(joints), empty, make_unforced_rows(1))
    return JointPath(posted, curve, np.zeros(1, np.int64), np.zeros(1), rows)


def _divide_steps(coarse: Indices, step: Array) -> tuple[Indices, Array]:
    """List the steps to cut, ascending, and at which fractions: coarse ones are quartered, longer neighbours halved."""
    quarter, beside = 0.25 * np.tile(step[coarse], 2), np.concatenate([coarse - 1, coarse + 1])
    inside = (beside >= 0) & (beside < len(step))
    quarter, beside = quarter[inside], beside[inside]
    beside = np.setdiff1d(beside[step[beside] > quarter], coarse)
    steps = np.concatenate([np.repeat(coarse, 3), beside])
    fractions = np.concatenate([np.tile([0.25, 0.5, 0.75], len(coarse)), np.full(len(beside), 0.5)])
    order = np.lexsort((fractions, steps))
    return steps[order], fractions[order]


def _widen_flags(flags: Flags) -> Flags:
    """Flag also the neighbours of flagged steps whose splines a new row disturbs."""
    result = flags.copy()
    for by in range(1, _DISTURBED + 1):
        result[by:] |= flags[:-by]
        result[:-by] |= flags[by:]
    return result


def _find_coarse_steps(joint_path: JointPath, tolerances: SplineTolerances, candidates: Indices) -> Indices:
    """Find those of some steps over which the splines are off by more than the tolerances."""
    blocks = []
    for begin in range(0, len(candidates), _BLOCK):
        steps = candidates[begin : begin + _BLOCK]
        joints, splined, rounding = joint_path.joints_at(steps, 0.5 * joint_path.step[steps])
        coarse = np.empty(len(steps), bool)
        mark = partial(
            mark_coarse_steps, joint_path.rows, steps, Midpoints(joints, splined, rounding), tolerances, coarse
        )
        run_in_threads(len(steps), mark)
        blocks.append(steps[coarse])
    return np.concatenate(blocks)


def refine_joint_path(joint_path: JointPath, steps: Indices, fractions: Array, anew: bool = False) -> JointPath:
    """Add rows in steps, ascending, after ``fractions`` of them; none is bounded by forces.

    The joints at the new rows are those nearest to the old splines; with ``anew`` all are followed from the start.
    """
    shift = fractions * joint_path.step[steps]
    segment = np.insert(joint_path.segment, steps + 1, joint_path.segment[steps])
    offset = np.insert(joint_path.offset, steps + 1, joint_path.offset[steps] + shift)
    if anew:
        return _follow_rows(joint_path.posted, joint_path.curve, segment, offset)
    joints = np.insert(joint_path.joints, steps + 1, joint_path.joints_at(steps, shift)[0], axis=0)
    return fit_joint_path(joint_path.posted, joint_path.curve, segment, offset, joints)


def divide_joint_path(joint_path: JointPath, steps: Indices, fractions: Array) -> JointPath:
    """Add rows in steps, ascending, after ``fractions`` of them, on the splines: these stay as they are."""
    rows, shift = joint_path.rows, fractions * joint_path.step[steps]
    still = np.zeros(len(steps))
    joints = joint_path.evaluate(PathState(steps, shift, still, still)).joints
    bend = rows.curvature[steps]
    bend += fractions[:, None] * (rows.curvature[steps + 1] - bend)
    segment = np.insert(joint_path.segment, steps + 1, joint_path.segment[steps])
    offset = np.insert(joint_path.offset, steps + 1, joint_path.offset[steps] + shift)
    step = np.insert(rows.step, steps, 0.0)
    places = steps + np.arange(len(steps))  # of the new steps, each before what is left of the old one
    last = np.append(steps[1:] != steps[:-1], True)
    step[places] = shift - np.where(np.append(True, last[:-1]), 0.0, np.append(0.0, shift[:-1]))
    step[places[last] + 1] = (rows.step[steps] - shift)[last]
    return JointPath(
        joint_path.posted,
        joint_path.curve,
        segment,
        offset,
        JointRows(
            step,
            np.insert(rows.joints, steps + 1, joints, axis=0),
            np.insert(rows.curvature, steps + 1, bend, axis=0),
            np.insert(rows.feed_ceiling, steps, rows.feed_ceiling[steps]),
            _divide_forces(rows.forces, steps, fractions),
        ),
    )


def _divide_forces(forces: ForceRows, steps: Indices, fractions: Array) -> ForceRows:
    """Add rows in steps after ``fractions`` of them."""

    def divide(values: Array) -> Array:
        between = values[steps] + fractions[:, None] * (values[steps + 1] - values[steps])
        return np.insert(values, steps + 1, between, axis=0)

    return ForceRows(forces.drive, divide(forces.along), divide(forces.across))


def _follow_rows(posted: Posted, curve: Curve, segment: Indices, offset: Array) -> JointPath:
    """Follow the joints from the first row to the last, and fit splines through them."""
    length = np.append(0.0, np.cumsum(curve.length))[segment] + offset
    joints = follow_curve(posted.machine, posted.mode, curve.poses(segment, offset), length)
    turning = posted.machine.turning_joints
    turns = measure_whole_turns(joints[0, turning], posted.joints[0, turning])
    if turns.any():
        joints[:, turning] += turns
    return fit_joint_path(posted, curve, segment, offset, joints)


def fit_joint_path(posted: Posted, curve: Curve, segment: Indices, offset: Array, joints: Array) -> JointPath:
    """Fit splines through the joints of rows.

    Raises :class:`PoseError` where they are out of reach.
    """
    step = _measure_steps(curve, segment, offset)
    curvature = np.empty_like(joints)
    fit_splines(step, joints, curvature, np.empty(len(segment)))
    feed_ceiling = _compute_feed_ceiling(posted, curve, CurveRows(segment, offset, step))
    rows = JointRows(step, joints, curvature, feed_ceiling, make_unforced_rows(len(segment)))
    joint_path = JointPath(posted, curve, segment, offset, rows)
    if not np.isfinite(joints.sum()):
        lost = int((~np.isfinite(joints)).any(1).argmax())
        raise PoseError(f"{joint_path.describe_step(lost)} the legs can't close")
    return joint_path


def _compare_tips(path: ToolPath) -> Array:
    """Compare the way of the machine's own tip with that of the longer tool's tip, which keeps the feed: (n,)."""
    assert path.extension is not None
    ways = (path.tip, path.tip - path.extension[:, None] * path.axis)
    machine, tool = (np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1) for tip in ways)
    ratio: Array = np.divide(machine, tool, out=np.full(len(path), np.inf), where=tool > _STILL)
    ratio[(machine <= _STILL) & (tool <= _STILL)] = 1.0
    return ratio


def _compute_feed_ceiling(posted: Posted, curve: Curve, rows: CurveRows) -> Array:
    """Compute the ceiling of ṡ² over each step: the tip keeps the programmed feed, or a piece its programmed time."""
    path, record = posted.path, curve.record_of_piece
    tip_columns = np.array([i for i, axis in enumerate(posted.machine.axes) if axis in "XYZ"], np.int64)
    free = path.rapid[record]
    feed = path.feed if path.extension is None else path.feed * _compare_tips(path)
    tip_speed = np.where(free | np.isnan(feed[record]), np.inf, feed[record] / 60.0)
    path_speed = np.full(len(record), np.inf)
    if path.seconds is not None:
        path_speed = np.where(free | np.isnan(path.seconds[record]), np.inf, curve.length / path.seconds[record])
    ceiling, limits = np.empty(len(rows.step)), FeedLimits(tip_columns, tip_speed, path_speed)
    run_in_threads(len(ceiling), lambda start, stop: compute_feed_ceilings(rows, curve, limits, ceiling, start, stop))
    return ceiling
