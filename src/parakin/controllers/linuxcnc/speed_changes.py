"""Where a trajectory's motions are divided because the speed changes along them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Indices
from ...toolpath.timing.trajectory import Trajectory

_STEP = 0.05  # of a motion's greatest speed: the trajectory's speed changes by as much within a stretch of it
_SHORTEST = 0.008  # s: no stretch takes less
_SAMPLING = 0.001  # s, between the samples of the trajectory's speed
_MOST_SAMPLES = 100_000  # of a piece at that distance; a step of a longer one has a hundredth of them at most


def find_speed_changes(trajectory: Trajectory, accelerations: Array) -> tuple[Indices, Array, Array]:
    """Find where to divide the pieces of a trajectory's curve so that each stretch needs one speed only.

    accelerations : (axes,) mm, rad and s; no stretch is so short that the controller could not stand still at both ends

    Returns for c divisions (c,) each: the piece, mm from its start, and the time, s.
    """
    joint_path, profile, pieces = trajectory.joint_path, trajectory.profile, len(trajectory.curve.length)
    first = np.searchsorted(joint_path.segment, np.arange(pieces))
    times = np.append(profile.row_times[first], profile.row_times[-1])
    slow, fast = _measure_speeds(trajectory, first)
    rise = 2.0 * (np.abs(trajectory.curve.slope) / accelerations).max(1)
    varied = (np.diff(times) >= 2.0 * np.maximum(_SHORTEST, rise * fast)) & (slow < (1.0 - _STEP) * fast)
    divisions = list[tuple[int, float, float]]()
    for piece in np.flatnonzero(varied).tolist():
        begin, end = times[piece], times[piece + 1]
        samples = _sample_times(begin, end, profile.time)
        step = np.clip(np.searchsorted(profile.time, samples, "right") - 1, 0, len(profile.row) - 1)
        t = samples - profile.time[step]
        speed = profile.speed[step] + t * (profile.acceleration[step] + 0.5 * t * profile.jerk[step])
        shift = t * (profile.speed[step] + t * (0.5 * profile.acceleration[step] + t * profile.jerk[step] / 6.0))
        offset = joint_path.offset[profile.row[step]] + shift
        chosen = _choose_divisions(samples - begin, speed, end - begin, _STEP * fast[piece], rise[piece])
        divisions += [(piece, offset[i], samples[i]) for i in chosen]
    table = np.array(divisions).reshape(-1, 3)
    return table[:, 0].astype(np.int64), table[:, 1], table[:, 2]


def _sample_times(begin: float, end: float, knots: Array) -> Array:
    """Sample a piece evenly, or a long one by each of its steps, which stand between the knots, (samples,) s."""
    count = int((end - begin) / _SAMPLING)
    if count <= _MOST_SAMPLES:
        return np.linspace(begin, end, count + 2)[1:-1]
    first, last = np.searchsorted(knots, [begin, end])
    ends = np.unique(np.concatenate([[begin], knots[first:last], [end]]))
    spans = np.diff(ends)
    counts = np.clip(spans / _SAMPLING, 1, _MOST_SAMPLES // 100).astype(np.int64)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    times: Array = (np.repeat(ends[:-1], counts) + np.repeat(spans / counts, counts) * within)[1:]
    return times


def _measure_speeds(trajectory: Trajectory, first: Indices) -> tuple[Array, Array]:
    """Measure the least and the greatest speed on each piece by the steps of its rows."""
    step, spans = trajectory.joint_path.step, np.diff(trajectory.profile.row_times)
    speed = np.divide(step, spans, out=np.zeros(len(step)), where=spans > 0.0)
    moving = step > 0.0
    least = np.minimum.reduceat(np.where(moving, speed, np.inf), first)
    return least, np.maximum.reduceat(np.where(moving, speed, 0.0), first)


def _choose_divisions(times: Array, speeds: Array, end: float, step: float, rise: float) -> list[int]:
    """Choose the samples at which a motion is divided: where its speed has changed by a step since the last one."""
    chosen, last, before = list[int](), 0.0, float(speeds[0])
    for i, (time, speed) in enumerate(zip(times.tolist(), speeds.tolist(), strict=True)):
        shortest = max(_SHORTEST, rise * max(speed, before))
        if abs(speed - before) >= step and time - last >= shortest and end - time >= shortest:
            chosen.append(i)
            last, before = time, speed
    return chosen
