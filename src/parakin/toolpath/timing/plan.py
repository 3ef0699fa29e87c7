"""From a posted path to its trajectory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import PoseError
from ...kernels.batch import split
from ..path import Floats
from ..posting.posted import Posted
from .corners import Corners, Flags, Indices, check_tolerance, round_corners
from .jerk_limited import limit_jerk
from .joint_path import DriveLimits, JointPath, build_joint_path, refined
from .kernels.reachability import backward, ceilings, forward, slack
from .kernels.utilisation import judged
from .speed_profile import SpeedProfile
from .trajectory import Trajectory, name_limits

UNBOUND = 1e12  # mm²/s², of ṡ²: nothing is as fast
WORTH = 5e-4  # of the cycle time: what more rows must save
_ROUNDS = 4
_RAMP = 0.1  # s in which a drive is thought to reach its acceleration where only a jerk is given
_ROUNDING = 1e-8
_PLACES = 5  # of each step at which limits are looked at


def plan_trajectory(
    posted: Posted,
    *,
    corners: Corners = "round",
    tolerance: float = 0.01,
    axis_tolerance: float = 1e-3,
    stops: Sequence[int] = (),
) -> Trajectory:
    """The quickest trajectory along a posted path that keeps its feeds and its drives' speeds, accelerations and jerks.

    Parameters
    ----------
    posted : a path with joints at every record
    corners : ``round`` rounds them; ``stop`` stands still at each that turns by more than a degree (angles counted as
        in :class:`~.smooth.Curve`), and rounds the others
    tolerance, axis_tolerance : mm of the tool's tip and rad of its axis that rounding may take it off
    stops : records at which the tool stands still, besides the first and the last

    Between records the tip moves straight and the pose's angles evenly. The feed is that of the record that the motion
    leads to; in rapid, and where none is programmed, drives are the only limit. Where no drive has an acceleration or a
    jerk, corners are neither rounded nor stopped at, and speeds change at once. With jerks the
    trajectory is not the quickest.

    Raises
    ------
    PoseError : a record or a motion between two where the legs can't close, or a motion that nothing limits
    """
    if corners not in ("round", "stop"):
        raise PoseError(f"corners: 'round' or 'stop' expected, not {corners!r}")
    check_tolerance(tolerance, "tolerance")
    check_tolerance(axis_tolerance, "axis_tolerance")
    halts, drives, names = _halts(posted, stops), DriveLimits.of(posted.machine), name_limits(posted.machine.joints)
    curve = round_corners(posted, corners, tolerance, axis_tolerance, halts, drives.bounds_acceleration)
    joint_path = build_joint_path(posted, curve, drives, tolerance, axis_tolerance)
    if not len(joint_path.step):
        return Trajectory(posted, curve, joint_path, _still(), np.full(1, len(names) - 1), names)
    if not drives.bounds_acceleration:
        return Trajectory(posted, curve, joint_path, *_at_once(joint_path, drives), names)
    joint_path, x, u = _quickest(joint_path, drives)
    if np.isfinite(drives.jerk).any():
        joint_path, profile, binding = limit_jerk(joint_path, drives, x, np.minimum(*_ceilings(joint_path, drives)))
    else:
        profile, binding = _steady(joint_path, drives, x, u)
    binding[_ends(joint_path)] = len(names) - 1
    return Trajectory(posted, curve, joint_path, profile, binding, names)


def _halts(posted: Posted, stops: Sequence[int]) -> Flags:
    """(n,) records to stop at."""
    count = len(posted.path)
    if not count:
        raise PoseError("the path has no records")
    lost = ~np.isfinite(posted.joints.sum(axis=1))
    if lost.any():
        raise PoseError(f"{_place(posted, lost)}: the machine can't take this pose")
    idle = ~posted.path.rapid & (posted.path.feed <= 0.0)
    if idle.any():
        raise PoseError(f"{_place(posted, idle)}: more than 0 expected for the feed")
    flags = np.zeros(count, bool)
    for stop in stops:
        if not 0 <= stop < count:
            raise PoseError(f"stops: records from 0 to {count - 1} expected, not {stop}")
        flags[stop] = True
    return flags


def _place(posted: Posted, flags: Flags) -> str:
    record = int(flags.argmax())
    return f"record {record} (line {int(posted.path.line[record])})"


def _still() -> SpeedProfile:
    nothing = np.empty(0)
    return SpeedProfile(np.zeros(1), np.empty(0, np.int64), nothing, nothing, nothing, nothing, np.zeros(1))


def _ends(joint_path: JointPath) -> Indices:
    """Rows at which the path is parted."""
    gaps = np.flatnonzero(joint_path.step == 0.0)
    return np.concatenate([[0, len(joint_path.step)], gaps, gaps + 1])


def _ceilings(joint_path: JointPath, drives: DriveLimits) -> tuple[Floats, Floats]:
    """(steps,) of ṡ² at both ends of each step: what feed and the joints' speeds allow."""
    left, right = np.empty(len(joint_path.step)), np.empty(len(joint_path.step))
    args = (joint_path.step, joint_path.joints, joint_path.bend, drives.speed, joint_path.feed, UNBOUND, left, right)
    split(len(left), lambda start, stop: ceilings(*args, start, stop))
    return left, right


def _quickest(joint_path: JointPath, drives: DriveLimits) -> tuple[JointPath, Floats, Floats]:
    """ṡ² (rows,) and s̈ (steps,) of the quickest trajectory without jerks, with rows where it switches."""
    limit = np.minimum(drives.acceleration, _RAMP * drives.jerk)
    for attempt in range(_ROUNDS):
        step, count, cap = joint_path.step, len(joint_path.step), np.full(len(joint_path.step), np.inf)
        left, right = _ceilings(joint_path, drives)
        top = np.minimum(np.append(left, 0.0), np.append(0.0, right))
        top[_ends(joint_path)] = 0.0
        x, u, reachable = np.empty(count + 1), np.empty(count), np.empty(count + 1)
        backward(step, joint_path.joints, joint_path.bend, limit, cap, top, reachable, 0, count)
        forward(step, joint_path.joints, joint_path.bend, limit, cap, reachable, x, u, 0, count)
        first, second, lost = np.empty(count), np.empty(count), list[float]()
        args = (step, joint_path.joints, joint_path.bend, limit, cap, left, right, x, u, first, second)
        split(count, lambda start, stop: lost.append(slack(*args, start, stop)))  # noqa: B023
        _refuse_unbound(joint_path, np.maximum(x[:-1], x[1:]))
        rows = np.concatenate([np.flatnonzero(first), np.flatnonzero(second)])
        if attempt == _ROUNDS - 1 or sum(lost) <= WORTH * _spans(joint_path, x).sum() or not len(rows):
            break
        parts = np.concatenate([first[first > 0.0], second[second > 0.0]])
        order = np.lexsort((parts, rows))
        joint_path = refined(joint_path, rows[order], parts[order])
    return joint_path, x, u


def _refuse_unbound(joint_path: JointPath, x: Floats) -> None:
    """Raise for a step (of ṡ² ``x``) on which joints move and nothing limits them."""
    for cell in np.flatnonzero((x >= 0.5 * UNBOUND) & (joint_path.step > 0.0)):
        moving = np.abs(joint_path.joints[cell + 1] - joint_path.joints[cell]) > 1e-12
        if moving.any():
            names = [name for name, moves in zip(joint_path.posted.machine.joints, moving, strict=True) if moves]
            text = f"no feed, and no speed or acceleration of {', '.join(names)}"
            raise PoseError(f"{joint_path.between(int(cell))} nothing limits the motion: {text}")


def _spans(joint_path: JointPath, x: Floats) -> Floats:
    """(steps,) s."""
    speed, moving = np.sqrt(x), joint_path.step > 0.0
    spans: Floats = np.divide(2.0 * joint_path.step, speed[:-1] + speed[1:], out=np.zeros(len(moving)), where=moving)
    return spans


def _steady(joint_path: JointPath, drives: DriveLimits, x: Floats, u: Floats) -> tuple[SpeedProfile, Indices]:
    """A trajectory of constant s̈ over each step, and what binds it at each row."""
    return _by_steps(joint_path, drives, np.sqrt(x)[:-1], u, _spans(joint_path, x))


def _at_once(joint_path: JointPath, drives: DriveLimits) -> tuple[SpeedProfile, Indices]:
    """A trajectory of constant speed over each step, and what binds it at each row."""
    ceiling = np.minimum(*_ceilings(joint_path, drives))
    _refuse_unbound(joint_path, ceiling)
    speed = np.sqrt(ceiling)
    return _by_steps(joint_path, drives, speed, np.zeros(len(speed)), joint_path.step / speed)


def _by_steps(
    joint_path: JointPath, drives: DriveLimits, speed: Floats, rise: Floats, spans: Floats
) -> tuple[SpeedProfile, Indices]:
    passed = np.append(0.0, np.cumsum(spans))
    cell = np.flatnonzero(joint_path.step > 0.0)
    nothing = np.zeros(len(cell))
    time, speed, rise = np.append(passed[cell], passed[-1]), speed[cell], rise[cell]
    binding, parts = np.zeros(len(joint_path.segment), np.int64), np.empty((len(cell), 4))
    pieces = (time, cell, nothing, speed, rise, nothing)
    limits = (drives.speed, drives.acceleration, np.full_like(drives.jerk, np.inf))
    args = (joint_path.step, joint_path.joints, joint_path.bend, joint_path.feed, limits, pieces)
    found, fresh = list[float](), np.ones(len(joint_path.step), bool)
    split(len(cell), lambda a, b: found.append(judged(*args, a, b, parts, binding, fresh, _PLACES)))
    worst = max(found)
    wider = worst if worst > 1.0 + _ROUNDING else 1.0  # which the planning leaves nothing to do for, but rounding
    profile = SpeedProfile(wider * time, cell, nothing, speed / wider, rise / wider**2, nothing, wider * passed)
    return profile, binding
