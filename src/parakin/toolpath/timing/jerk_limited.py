"""The quickest speed profile with limited jerk: an interior point method on graded rows of a joint path."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Indices
from ...kernels.batch import run_in_threads
from .drive_limits import DriveLimits
from .joint_path import JointPath, divide_joint_path
from .kernels.grading import bound_sizes, cut_steps
from .kernels.interior_point import (
    StepLimits,
    allocate_newton,
    join_rows,
    locate_times,
    lower_speeds,
    shorten_windows,
    stretch_pieces,
    write_pieces,
)
from .kernels.utilisation import Utilisation, measure_utilisation
from .speed_profile import SpeedProfile
from .time_optimal import RAMP, compute_ceilings, compute_spans

_FIRST, _LEAST = 1.0 / 16.0, 1e-6  # of the way in which s̈ is built up, and mm: the first step behind a stop
_PLACES = 4  # places on each piece where utilisation is measured
_SURE = 1.0001  # a profile is slowed by this × the worst utilisation, which is measured at some places only
_WINDOWS = 256, 32  # rows of windows, about: in short ones a place where little is gained holds few others up
_ROUGH, _FINE = (0.1, 0.01), (0.01, 1e-3, 1e-4)  # weights of the barriers, before and after rows are added
_MOST, _BUDGET = 6, 300_000  # rounds of sweeps for each, but no more rows in all rounds, and fewer if ...
_WORTH = 1e-3  # ... one saves no more than this fraction of the time
_STEPS = 12  # of Newton's, for each weight
_ACTIVE = 0.5  # fraction of a jerk limit from which a step is cut into as many parts as ...
_REFINEMENTS, _OVER, _MORE_PARTS = 2, 1.0005, 4  # times that steps are cut whose pieces take more of a limit, and parts
_FAR_OVER = 1.01  # of a limit, where ṡ is lowered too
_FASTER = 50.0  # × the path's mean speed at the joints' speeds: nothing is faster, also where all joints turn back
_SMOOTH, _PARTS = 6.0, 8  # ... make so many while s̈ is built up, but no more than _PARTS


def limit_jerk(joint_path: JointPath, limits: DriveLimits, x: Array) -> tuple[JointPath, SpeedProfile, Indices]:
    """Limit the jerk of the quickest profile; return the joint path, its profile, and the limit that binds at each row.

    x : (rows,) ṡ² of the quickest profile
    """
    joint_path, x = _grade_steps(joint_path, limits, x)
    least = compute_spans(joint_path, x)
    cap = np.full(len(x) - 1, np.inf)
    problem, edges = _pose_problem(joint_path, limits, cap), joint_path.find_stretches()
    x, a = _start_level(joint_path.step, edges, x)
    lower_speeds(edges, problem, x, a)
    _shorten(problem, edges, x, a, least, _ROUGH)
    parts = _count_parts(limits, problem, x, a)
    for again in range(_REFINEMENTS + 1):
        if (parts > 1).any():
            joint_path, x, a, least = _add_rows(joint_path, problem, parts, x, a, least)
            cap = np.repeat(cap, parts)
            problem, edges = _pose_problem(joint_path, limits, cap), joint_path.find_stretches()
            lower_speeds(edges, problem, x, a)
        if again == 0 or (parts > 1).any():
            _shorten(problem, edges, x, a, least, _FINE if again == 0 else _FINE[1:])
            profile, use = _write_profile(joint_path, limits, problem, edges, x, a)
        over = use.kept[:, 3] > _OVER
        parts = np.ones(len(problem.step), np.int64)
        parts[profile.row[over]] = _MORE_PARTS
        for p in np.flatnonzero(use.kept[:, 3] > _FAR_OVER):
            cap[profile.row[p]] = min(cap[profile.row[p]], profile.speed[p] ** 2 / use.kept[p, 3] ** 3)
        if not over.any():
            break
    pieces = 2 * (edges[:, 1] - edges[:, 0])
    worst = np.maximum.reduceat(use.kept[:, 3], np.cumsum(pieces) - pieces)
    stretch_pieces(edges, profile, np.where(worst > 1.0, _SURE * worst, 1.0))
    return joint_path, profile, use.binding


def _grade_steps(joint_path: JointPath, limits: DriveLimits, x: Array) -> tuple[JointPath, Array]:
    """Grade the steps, short ones at stops; ṡ² goes straight between the rows."""
    size = np.full(len(x), np.inf)
    ceiling = np.minimum(*compute_ceilings(joint_path, limits))
    for row, other in (joint_path.find_stretches().T, joint_path.find_stretches().T[::-1]):
        side = np.where(other > row, 1, -1)
        step = np.where(side > 0, row, row - 1)
        size[row] = _find_first_step(joint_path, limits, row, row + side, step, ceiling[step])
    bound_sizes(joint_path.step, size)
    count = cut_steps(joint_path.step, size, np.empty(0, np.int64), np.empty(0))
    if not count:
        return joint_path, x
    steps, parts = np.empty(count, np.int64), np.empty(count)
    cut_steps(joint_path.step, size, steps, parts)
    x = np.insert(x, steps + 1, x[steps] + parts * (x[steps + 1] - x[steps]))
    return divide_joint_path(joint_path, steps, parts), x


def _find_first_step(
    joint_path: JointPath, limits: DriveLimits, row: Indices, other: Indices, step: Indices, ceiling: Array
) -> Array:
    """Find the length of the first step behind stops: a part of the way in which s̈, or the speed, is built up."""
    slope = np.abs(joint_path.joints[row] - joint_path.joints[other]) / joint_path.step[step][:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        jerk = np.min(limits.jerk / slope, axis=1)
        acceleration = np.min(limits.acceleration / slope, axis=1)
        way = np.fmin(acceleration**3 / (6.0 * jerk**2), (2.0 * np.sqrt(ceiling)) ** 1.5 / (6.0 * np.sqrt(jerk)))
    way = np.where((way > 0.0) & np.isfinite(way), way, np.inf)
    size: Array = np.maximum(_FIRST * way, _LEAST)
    return size


def _start_level(step: Array, edges: Indices, x: Array) -> tuple[Array, Array]:
    """Start with a profile that is level between stops and leaves them at constant s⃛: ṡ² and s̈ at the rows."""
    starts, stops = edges.T
    s = np.append(0.0, np.cumsum(step))
    of = np.repeat(np.arange(len(edges)), stops - starts + 1)
    level = np.maximum.reduceat(x, starts)[of]
    slope = np.zeros(len(x))  # of log x
    for row, first in ((starts, step[starts]), (stops, step[stops - 1])):
        way, far = np.abs(s - s[row][of]), (first / _FIRST)[of]
        far = np.minimum(far, 0.25 * (s[stops] - s[starts])[of])
        level = level * (way / (way + far)) ** (4.0 / 3.0)
        sign = 1.0 if row is starts else -1.0
        with np.errstate(divide="ignore"):
            slope += sign * np.where(way > 0.0, 4.0 / 3.0 * far / (way * (way + far)), 0.0)
    return level, 0.5 * level * slope


def _pose_problem(joint_path: JointPath, limits: DriveLimits, cap: Array) -> StepLimits:
    """Pose the problem for the interior point method; ``cap`` (steps,) bounds ṡ² too."""
    rows, h = joint_path.rows, joint_path.step[:, None]
    bend, ceilings = rows.curvature, compute_ceilings(joint_path, limits)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.diff(rows.joints, axis=0) / h - h * (2.0 * bend[:-1] + bend[1:]) / 6.0
        pace = np.max(
            np.abs(slope) / np.minimum(limits.speed, RAMP * np.minimum(limits.acceleration, RAMP * limits.jerk)), axis=1
        )
    way = rows.step > 0.0
    mean = float((pace * rows.step)[way].sum() / rows.step.sum())
    top: Array | float = (_FASTER / mean) ** 2 if mean > 0.0 else np.inf
    top = np.minimum(cap, top)
    start, end = np.minimum(ceilings.start, top), np.minimum(ceilings.end, top)
    return StepLimits(rows.step, slope, bend, start, end, 1.0 / limits.acceleration, 1.0 / limits.jerk)


def _cut_windows(edges: Indices, rows: int, odd: int) -> Indices:
    """Cut stretches into windows (k, 2) of rows; with ``odd`` = 1 the cuts lie amid those with 0."""
    length = edges[:, 1] - edges[:, 0]
    count = np.maximum(1, length // rows)
    if odd:
        count = np.where(count > 1, count + 1, 1)
    of = np.repeat(np.arange(len(edges)), count)
    k = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    shift = 0.5 * odd
    span = length[of] / np.maximum(count[of] - odd, 1)
    first = np.where(k == 0, 0, np.round((k - shift) * span).astype(np.int64))
    last = np.where(k == count[of] - 1, length[of], np.round((k + 1 - shift) * span).astype(np.int64))
    windows = edges[of, 0][:, None] + np.column_stack([first, last])
    several: Indices = windows[windows[:, 1] - windows[:, 0] > 1]
    return several


def _shorten(
    problem: StepLimits, edges: Indices, x: Array, a: Array, least: Array, barriers: tuple[float, ...]
) -> None:
    """Shorten the time of a profile that keeps all limits, in sweeps of windows, for each weight of the barriers."""
    count = len(problem.step)
    time, use = np.empty(count), np.empty(count)
    cuts = [_cut_windows(edges, rows, odd) for rows in _WINDOWS for odd in (0, 1)]
    widest = max(int((windows[:, 1] - windows[:, 0]).max(initial=1)) for windows in cuts)
    rounds = min(max(_BUDGET // max(count, 1), 1), _MOST)
    if rounds == 1:
        cuts = cuts[:2]
    for weight in barriers:
        before = np.inf
        for sweep in range(rounds * len(cuts)):
            windows, args = cuts[sweep % len(cuts)], (problem, x, a, least, np.array([weight]), _STEPS)
            run_in_threads(
                len(windows),
                lambda begin, end: shorten_windows(windows[begin:end], *args, allocate_newton(widest + 1)),  # noqa: B023
            )
            run_in_threads(count, lambda start, stop: join_rows(problem, x, a, time, use, start, stop))
            if sweep % len(cuts) == len(cuts) - 1:
                total = float(time.sum())
                if abs(before - total) <= _WORTH * total:
                    break
                before = total


def _count_parts(limits: DriveLimits, problem: StepLimits, x: Array, a: Array) -> Indices:
    """Count the parts, even in time, into which to cut steps over which s̈ changes much."""
    count = len(problem.step)
    time, use = np.empty(count), np.empty(count)
    run_in_threads(count, lambda start, stop: join_rows(problem, x, a, time, use, start, stop))
    rise = min(RAMP, float(np.min(limits.acceleration / limits.jerk, initial=np.inf, where=np.isfinite(limits.jerk))))
    parts: Indices = np.where(use > _ACTIVE, np.clip(np.ceil(time * (_SMOOTH / rise)), 1, _PARTS), 1).astype(np.int64)
    return parts


def _add_rows(
    joint_path: JointPath, problem: StepLimits, parts: Indices, x: Array, a: Array, least: Array
) -> tuple[JointPath, Array, Array, Array]:
    """Cut each step into so many parts, even in time; the motion stays as it is."""
    count = len(problem.step)
    time, use = np.empty(count), np.empty(count)
    run_in_threads(count, lambda start, stop: join_rows(problem, x, a, time, use, start, stop))
    steps = np.repeat(np.arange(count), parts - 1)
    k = 1 + np.arange(len(steps)) - np.repeat(np.cumsum(parts - 1) - (parts - 1), parts - 1)
    states = np.empty((len(steps), 3))
    locate_times(problem, x, a, steps, k / parts[steps] * time[steps], states)
    share = states[:, 0] / problem.step[steps]
    refined = divide_joint_path(joint_path, steps, share)
    x, a = np.insert(x, steps + 1, states[:, 1]), np.insert(a, steps + 1, states[:, 2])
    per_mm = np.divide(least, problem.step, out=np.zeros(count), where=problem.step > 0.0)
    return refined, x, a, np.repeat(per_mm, parts) * refined.step


def _write_profile(
    joint_path: JointPath, limits: DriveLimits, problem: StepLimits, edges: Indices, x: Array, a: Array
) -> tuple[SpeedProfile, Utilisation]:
    """Write a profile in two pieces a step, each stretch from time 0 on, and measure it."""
    rows = len(x)
    count = 2 * int((edges[:, 1] - edges[:, 0]).sum())
    profile, use = (
        SpeedProfile.allocate(count, rows),
        Utilisation(np.empty((count, 4)), np.zeros(rows, np.int64), np.ones(rows - 1, bool)),
    )
    write_pieces(edges, problem, x, a, profile)
    measure_utilisation(joint_path.rows, limits, profile, use, _PLACES, 0, count)
    return profile, use
