"""Choose the points of a trajectory between which the planner's splines run."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ...arrays import Array, Flags, Indices
from ...toolpath.timing.drive_limits import DriveLimits
from ...toolpath.timing.trajectory import Trajectory
from .model_header import CYCLE

LONGEST = 0.128  # s between knots at first; halved where the spline is too far off
SHORTEST = 1e-3  # s: a cycle
WINDOW = 30.0  # s of a trajectory that are looked at together
_NEAR = 1e-3  # mm, angles on an arm of 100 mm: how far the spline may be from the trajectory
_ARM = 100.0  # mm
_LATE = 1e-4  # s: how far a joint may be off, as time at its full speed
_LIMIT = 1.005  # of a joint's acceleration that the spline may need
_STANDING = 1e-9  # mm/s of path speed: rounding
_FEWEST = 4  # intervals between two stands
_LONGER = 1.5  # of an interval: intervals are halved, so that one is longer by a factor of 2 or more
_APART = 2e-6  # mm, angles on an arm of 100 mm: nearer knots could be one in a program
_SLOWEST = 0.11 / 60.0  # mm/s of the tip: just what LinuxCNC obeys
_MADE_UP = 0.25  # of _SLOWEST: how much faster a tip is that makes up for what it was held back
_SLOW = 1.0  # mm/s: a slower tool is looked at less often than in every cycle, once in 1 µm,
_MOST_SLOW = 1e4  # or so many cycles
_SHORT = 1e-4  # s, for the speed of a pose by differences


class Knots(NamedTuple):
    """k points of a trajectory, the first at its start.

    times : (k,) s
    poses : (k, axes) mm and rad
    stands : (k,) whether the tool stands still there
    """

    times: Array
    poses: Array
    stands: Flags


class _Cycles(NamedTuple):
    """Poses (k, axes) and joints (k, joints) in k cycles, and between them the accelerations (k - 2, joints)."""

    poses: Array
    joints: Array
    rises: Array


def choose_knots(trajectory: Trajectory) -> Knots:
    """Choose knots so that a cubic spline through them is the trajectory, and needs no more of the joints than it.

    Between two stands the knots are first even; intervals in which the spline is off are halved, down to a cycle.
    """
    stands = find_stands(trajectory)
    windows = [_split_evenly(trajectory, span) for span in pairwise(stands.tolist())]
    bounds = np.concatenate([stands[:1], *windows])
    rates = np.array([_measure_rate(trajectory, time) for time in bounds.tolist()])
    rates[np.isin(bounds, stands)] = 0.0
    times = [np.zeros(1)]
    for window, ends in zip(pairwise(bounds.tolist()), pairwise(rates), strict=True):
        times.append(_divide_window(trajectory, window, ends)[1:])
    all_times = np.concatenate(times)
    poses, standing = trajectory.at(all_times).poses, np.isin(all_times, stands)
    return _drop_creeping(trajectory, Knots(all_times, poses, standing))


def _split_evenly(trajectory: Trajectory, span: tuple[float, float]) -> Array:
    """Split a time into windows; return their ends."""
    window = WINDOW * _SLOW / _find_fastest(trajectory, span)
    return np.linspace(*span, max(int(np.ceil((span[1] - span[0]) / window)), 1) + 1)[1:]


def _weigh_axes(trajectory: Trajectory) -> Array:
    """Weigh the axes (axes,): an angle counts on an arm of 100 mm."""
    return np.where(np.array(trajectory.posted.machine.axis_units) == "rad", _ARM, 1.0)


def _drop_creeping(trajectory: Trajectory, knots: Knots) -> Knots:
    """Drop knots that are not apart from the one before, but for those of stands, and hold tips that creep.

    LinuxCNC obeys no feed below a tenth of a mm a minute, by which it measures a motion whose tip moves, however the
    tool turns: a tip that moves by less stays where it was. It makes up for it in later motions, at first at just that
    feed and then by a little more than its own: beside a pole, a sudden step would shake the first joint.
    """
    poses, weights = knots.poses.copy(), _weigh_axes(trajectory)
    linear = np.array([unit == "mm" for unit in trajectory.posted.machine.axis_units])
    seconds = np.diff(knots.times)
    steps = np.linalg.norm(np.diff(poses[:, linear], axis=0), axis=1)
    if (steps >= _SLOWEST * seconds).all():
        return knots
    kept = [0]
    for i in range(1, len(poses)):
        last = kept[-1]
        way = poses[i, linear] - poses[last, linear]
        tip, least = np.linalg.norm(way), _SLOWEST * (knots.times[i] - knots.times[last])
        most = max(least, steps[last:i].sum() + _MADE_UP * least)
        if tip < min(least, _NEAR):
            poses[i, linear] = poses[last, linear]
        elif tip > most:
            poses[i, linear] = poses[last, linear] + most / tip * way
        apart = (np.abs(poses[i] - poses[last]) * weights).max() >= _APART
        if apart or (knots.stands[last] and knots.stands[i]):
            kept.append(i)
        elif knots.stands[i]:
            kept[-1] = i
    return Knots(knots.times[kept], poses[kept], knots.stands[kept])


def find_stands(trajectory: Trajectory) -> Array:
    """Find the times (k,) at which the tool stands still: the start, the end, and the halts between; s."""
    profile = trajectory.profile
    still = profile.time[:-1][profile.speed <= _STANDING]
    times: Array = np.unique(np.concatenate([[0.0], still, [trajectory.seconds]]))
    stands: Array = times[np.append(True, np.diff(times) > 1e-9)]
    return stands


def _measure_rate(trajectory: Trajectory, time: float) -> Array:
    """Measure the change of the pose (axes,) a second, by differences."""
    before, after = trajectory.at([time - _SHORT, time + _SHORT]).poses
    rate: Array = (after - before) / (2.0 * _SHORT)
    return rate


def _divide_window(trajectory: Trajectory, window: tuple[float, float], rates: tuple[Array, Array]) -> Array:
    """Divide a time in which the tool does not stand still; return the knots' times with both ends.

    rates : of the pose at both ends, (axes,) each
    """
    start, end = window
    slow = _SLOW / _find_fastest(trajectory, window)
    count = max(_FEWEST, int(np.ceil((end - start) / (LONGEST * slow))))
    knots = np.linspace(start, end, count + 1)
    cycles = np.linspace(start, end, max(int(np.ceil((end - start) / (CYCLE * slow))), 2 * count) + 1)
    planned = _follow_cycles(trajectory, cycles, trajectory.at(cycles).poses)
    while True:
        spline = CubicSpline(knots, trajectory.at(knots).poses, bc_type=((1, rates[0]), (1, rates[1])))
        off = _find_deviations(trajectory, planned, _follow_cycles(trajectory, cycles, spline(cycles)))
        bad = _find_faulty_intervals(knots, cycles[off])
        if not len(bad):
            return knots
        knots = np.sort(np.concatenate([knots, 0.5 * (knots[bad] + knots[bad + 1])]))


def _find_faulty_intervals(knots: Array, times: Array) -> Indices:
    """Find the intervals between knots to halve for a spline that is off at times (k,): theirs and their neighbours.

    Beside a knot either side may be at fault: the interval behind, and a longer one ahead, whose bend the spline takes
    back into short ones. None is halved that is shorter than two cycles.
    """
    lengths = np.diff(knots)
    own = np.minimum(np.searchsorted(knots, times, "right") - 1, len(lengths) - 1)
    ahead = np.minimum(own + 1, len(lengths) - 1)
    ahead = ahead[lengths[ahead] > _LONGER * lengths[own]]
    candidates = np.unique(np.concatenate([own, np.maximum(own - 1, 0), ahead]))
    faulty: Indices = candidates[lengths[candidates] >= 2.0 * SHORTEST]
    return faulty


def _find_fastest(trajectory: Trajectory, window: tuple[float, float]) -> float:
    """Find the greatest speed of the path in a time, no less than what a tool makes _SLOW of: mm/s."""
    profile = trajectory.profile
    first, last = np.searchsorted(profile.time, window)
    return float(np.clip(profile.speed[max(first - 1, 0) : last + 1].max(initial=0.0), _SLOW / _MOST_SLOW, _SLOW))


def _follow_cycles(trajectory: Trajectory, cycles: Array, poses: Array) -> _Cycles:
    """Follow poses at evenly timed cycles with the joints."""
    joints = trajectory.posted.machine.follow(poses, trajectory.posted.mode)
    return _Cycles(poses, joints, np.abs(np.diff(joints, 2, axis=0)) / (cycles[1] - cycles[0]) ** 2)


def _find_deviations(trajectory: Trajectory, planned: _Cycles, splined: _Cycles) -> Flags:
    """Find the cycles (k,) in which the spline's pose, a joint, or a joint's acceleration is off."""
    limits = DriveLimits.of(trajectory.posted.machine)
    off: Flags = (np.abs(splined.poses - planned.poses) * _weigh_axes(trajectory)).max(axis=1) > _NEAR
    off |= (np.abs(splined.joints - planned.joints) > _LATE * limits.speed).any(axis=1)
    off[1:-1] |= (splined.rises > _LIMIT * np.maximum(limits.acceleration, planned.rises)).any(axis=1)
    return off
