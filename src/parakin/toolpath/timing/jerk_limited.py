"""The quickest speed profile with limited jerk: slowed down to keep all limits, then by an interior point method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Indices, count_repeats
from ...kernels.batch import run_in_threads
from .drive_limits import DriveLimits
from .joint_path import JointPath, divide_joint_path
from .kernels.grading import bound_sizes, cut_steps
from .kernels.interior_point import Sweep, allocate_newton, shorten_windows
from .kernels.slowing import allocate_scratch, measure_needs, slow_down, smooth_speeds
from .kernels.speed_ceilings import StepCeilings
from .kernels.step_limits import (
    StepLimits,
    compute_slopes,
    locate_times,
    measure_steps,
    stretch_pieces,
    tighten_steps,
    write_pieces,
    write_times,
)
from .kernels.utilisation import Places, Utilisation, measure_utilisation
from .speed_profile import SpeedProfile
from .time_optimal import RAMP, compute_ceilings, find_reachable

_FIRST, _LEAST = 1.0 / 16.0, 1e-6  # of the way in which s̈ is built up, and mm: the first step behind a stop
_OF_WAY = 0.5  # of the way from rest to a row's speed: where it is low, no step is cut shorter
_START = 1.0 / 64.0  # of a stretch: no first step is longer
_ACROSS = 0.5  # fraction of a jerk limit that q'''·ṡ³ may take at first
_FASTER = 50.0  # × the path's mean speed at the joints' speeds: nothing is faster, also where all joints turn back
_PIECES, _PER_RAMP, _ACTIVE = (
    8,
    6.0,
    0.5,
)  # a step is cut into as many pieces, so many a ramp, where jerk is taken so far
_WINDOWS = 256, 32  # rows of windows, about: in short ones a place where little is gained holds few others up
_BARRIERS, _ROUGH = (0.01, 1e-3, 1e-4), 1  # weights, and how many of them come before rows are added
_STEPS, _SWEEPS = 12, 6  # of Newton's in each window and sweep, and sweeps of each cut into windows, at most
_WORK = 4_000_000  # steps of the path that Newton's method expands in all, at most: some 3 s on two cores
_ENOUGH = 6  # of Newton's steps for each of the path's are left to a weight, if the next one has to go without
_WORTH = 1e-3  # a window is left as it is where the last sweep saved less than this fraction of the time
_PLACES = Places(18, True)  # on each piece where utilisation is measured
_OVER = 1.0005  # a step whose pieces take more of a limit is cut into _MORE_PIECES, or tightened
_MEASUREMENTS, _REFINEMENTS, _MORE_PIECES = 6, 2, 4  # how often pieces are measured at most, and steps cut for it
_SURE = 1.0001  # a profile is slowed by this × the worst utilisation, which is measured at some places only


class _Plan(NamedTuple):
    """A profile that is being planned, by rows.

    joint_path, edges : the joints, and first and last row of each stretch (k, 2)
    problem : its limits
    x, a : (rows,) ṡ² and s̈, changed in place
    where : (steps,) infinite where the profile may still be shortened, else 0
    """

    joint_path: JointPath
    edges: Indices
    problem: StepLimits
    x: Array
    a: Array
    where: Array


def limit_jerk(joint_path: JointPath, limits: DriveLimits, x: Array) -> tuple[JointPath, SpeedProfile, Indices]:
    """Limit the jerk of the quickest profile; return the joint path, its profile, and the limit that binds at each row.

    x : (rows,) ṡ² of the quickest profile
    """
    ramp = _find_ramp(limits)
    joint_path, x = _grade_steps(joint_path, limits, ramp, x)
    count = len(joint_path.step)
    problem = _pose_problem(joint_path, limits)
    x, a = _find_start(joint_path, limits, problem, ramp)
    plan = _Plan(joint_path, joint_path.find_stretches(), problem, x, a, np.full(count, np.inf))
    rough = max(_WORK * _ROUGH // len(_BARRIERS), min(_ENOUGH * count, _WORK))
    work = _WORK - rough + _shorten(plan, _BARRIERS[:_ROUGH], rough)
    if work >= count:
        plan = _cut_steps(plan, limits, ramp, _count_parts(plan, ramp))
    work = _shorten(plan, _BARRIERS[_ROUGH:], work)
    profile, use = _write_profile(plan, limits, None)
    for again in range(_MEASUREMENTS):
        over = use.excess > _OVER
        if not over.any():
            break
        known: tuple[Utilisation, Array, Array] | None
        pieces = np.ones(len(plan.x) - 1, np.int64)
        plan = plan._replace(where=np.zeros(len(pieces)))
        if again < _REFINEMENTS and work >= len(pieces):
            pieces[profile.row[over]] = _MORE_PIECES
            plan, known = _cut_steps(plan, limits, ramp, pieces), None
        else:
            known = use, plan.x.copy(), plan.a.copy()
            plan = _tighten_steps(plan, ramp, profile.row[over], _SURE * use.excess[over])
        if again < _MEASUREMENTS - 1:
            work = _shorten(plan, _BARRIERS[_ROUGH:], work)
        profile, use = _write_profile(plan, limits, known)
    pieces = 2 * (plan.edges[:, 1] - plan.edges[:, 0])
    worst = np.maximum.reduceat(use.excess, np.cumsum(pieces) - pieces)
    stretch_pieces(plan.edges, profile, np.where(worst > 1.0, _SURE * worst, 1.0))
    return plan.joint_path, profile, use.binding


def _find_ramp(limits: DriveLimits) -> float:
    """Find the least time in which a drive builds its acceleration up, s."""
    finite = np.isfinite(limits.jerk)
    return min(RAMP, float(np.min(limits.acceleration[finite] / limits.jerk[finite])))


def _grade_steps(joint_path: JointPath, limits: DriveLimits, ramp: float, x: Array) -> tuple[JointPath, Array]:
    """Grade the steps, short ones at stops and at corners passed slowly; ṡ² goes straight between the rows."""
    edges, size = joint_path.find_stretches(), np.full(len(x), np.inf)
    starts, stops = edges.T
    length = np.append(0.0, np.cumsum(joint_path.step))
    greatest = _START * (length[stops] - length[starts])
    ceiling = np.minimum(*compute_ceilings(joint_path, limits))
    for row, step, other in ((starts, starts, starts + 1), (stops, stops - 1, stops - 1)):
        slope = np.abs(joint_path.joints[row] - joint_path.joints[other]) / joint_path.step[step][:, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            jerk, acceleration = (np.min(each / slope, axis=1) for each in (limits.jerk, limits.acceleration))
            way = np.fmin(acceleration**3 / (6.0 * jerk**2), (4.0 * ceiling[step]) ** 0.75 / (6.0 * np.sqrt(jerk)))
        way = np.where((way > 0.0) & np.isfinite(way), _FIRST * way, np.inf)
        size[row] = np.minimum(np.maximum(way, _LEAST), greatest)
    bound_sizes(joint_path.step, size)
    way = np.minimum(np.sqrt(x) * (ramp / _PER_RAMP), _OF_WAY * _bound_ways_from_rest(joint_path, limits, x))
    size = np.maximum(size, way)
    count = cut_steps(joint_path.step, size, np.empty(0, np.int64), np.empty(0))
    if not count:
        return joint_path, x
    steps, fractions = np.empty(count, np.int64), np.empty(count)
    cut_steps(joint_path.step, size, steps, fractions)
    x = np.insert(x, steps + 1, x[steps] + fractions * (x[steps + 1] - x[steps]))
    return divide_joint_path(joint_path, steps, fractions), x


def _bound_ways_from_rest(joint_path: JointPath, limits: DriveLimits, x: Array) -> Array:
    """Bound the ways (rows,) that jerks need from rest to the speeds of ``x``, by those of the rows about.

    Jerk j alone makes (9/2 j d²)^(1/3) of speed on the way d.
    """
    step = joint_path.step
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slope = np.abs(np.diff(joint_path.joints, axis=0)) / step[:, None]
        jerk = np.min(limits.jerk / slope, axis=1)
        way = np.sqrt(x**1.5 / (4.5 * np.fmin(np.append(jerk, np.inf), np.append(np.inf, jerk))))
    way[np.isnan(way)] = np.inf
    at = np.append(0.0, np.cumsum(step))
    way = np.minimum.accumulate(way - at) + at
    bounded: Array = np.minimum.accumulate((way + at)[::-1])[::-1] - at
    return bounded


def _pose_problem(joint_path: JointPath, limits: DriveLimits) -> StepLimits:
    """Pose the problem for the interior point method."""
    rows, ceilings = joint_path.rows, compute_ceilings(joint_path, limits)
    speed = np.minimum(limits.speed, RAMP * np.minimum(limits.acceleration, RAMP * limits.jerk))
    slope, slowness = np.empty((len(rows.step), len(speed))), np.empty(len(rows.step))
    run_in_threads(len(slope), lambda first, last: compute_slopes(rows, speed, slope, slowness, first, last))
    mean = float((slowness * rows.step).sum() / rows.step.sum())
    top = (_FASTER / mean) ** 2 if mean > 0.0 else np.inf
    start, end = (np.minimum(ceiling, top) for ceiling in ceilings)
    even = np.ones(len(start))
    rates = 1.0 / limits.acceleration, 1.0 / limits.jerk
    return StepLimits(rows.step, slope, rows.curvature, start, end, *rates, rows.forces.along, rows.forces.across, even)


def _find_start(joint_path: JointPath, limits: DriveLimits, problem: StepLimits, ramp: float) -> tuple[Array, Array]:
    """Find ṡ² and s̈ of a profile that keeps all limits: reachable with q'''·ṡ³ bounded, smoothed, and slowed down."""
    rows, count = joint_path.rows, len(joint_path.step)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        third = np.abs(np.diff(rows.curvature, axis=0)) / rows.step[:, None]
        ceiling = np.min(_ACROSS * limits.jerk / third, axis=1) ** (2.0 / 3.0)
    ceiling = np.fmin(ceiling, np.minimum(problem.ceiling_start, problem.ceiling_end))
    x, a = find_reachable(joint_path, limits, StepCeilings(ceiling, ceiling))[0], np.zeros(count + 1)
    edges, scratch = joint_path.find_stretches(), allocate_scratch(count + 1)
    for first, last in edges:
        smooth_speeds(first, last, rows.step, ramp, x, a, scratch)
    _slow_stretches(problem, edges, ramp, x, a)
    return x, a


def _slow_stretches(problem: StepLimits, edges: Indices, ramp: float, x: Array, a: Array) -> None:
    """Slow each stretch down where it breaks a limit."""
    scratch, needs = allocate_scratch(len(x)), np.empty((len(problem.step), 2))
    run_in_threads(len(needs), lambda start, stop: measure_needs(problem, x, a, needs, start, stop))
    for first, last in edges:
        slow_down(first, last, problem, ramp, x, a, needs, scratch)


def _cut_windows(edges: Indices, rows: int, odd: int) -> Indices:
    """Cut stretches into windows (k, 2) of rows; with ``odd`` = 1 the cuts lie amid those with 0."""
    length = edges[:, 1] - edges[:, 0]
    count = np.maximum(1, length // rows)
    if odd:
        count = np.where(count > 1, count + 1, 1)
    of = np.repeat(np.arange(len(edges)), count)
    k = count_repeats(count)
    shift = 0.5 * odd
    span = length[of] / np.maximum(count[of] - odd, 1)
    first = np.where(k == 0, 0, np.round((k - shift) * span).astype(np.int64))
    last = np.where(k == count[of] - 1, length[of], np.round((k + 1 - shift) * span).astype(np.int64))
    windows = edges[of, 0][:, None] + np.column_stack([first, last])
    several: Indices = windows[windows[:, 1] - windows[:, 0] > 1]
    return several


def _shorten(plan: _Plan, barriers: tuple[float, ...], work: int) -> int:
    """Shorten a profile that keeps all limits, in sweeps of windows for each weight; return the rest of the work."""
    count = len(plan.where)
    cuts = [_cut_windows(plan.edges, rows, odd) for rows in _WINDOWS for odd in (0, 1)]
    widest = max(int((windows[:, 1] - windows[:, 0]).max(initial=1)) for windows in cuts)
    for k, weight in enumerate(barriers):
        share, gains = min(work, max(work // (len(barriers) - k), _ENOUGH * count)), plan.where.copy()
        for sweep in range(_SWEEPS * len(cuts)):
            steps = min(share // count, _STEPS)
            if not steps:
                break
            args = Sweep(plan.problem, plan.x, plan.a, gains, weight, steps, _WORTH)
            done = _sweep_windows(cuts[sweep % len(cuts)], args, count, widest)
            share, work = share - done, work - done
            if not done:
                break
    return work


def _sweep_windows(windows: Indices, sweep: Sweep, count: int, widest: int) -> int:
    """Shorten all windows, in threads; return the number of steps that were expanded."""
    work = list[int]()

    def shorten(start: int, stop: int) -> None:
        stretch = slice(*np.searchsorted(windows[:, 0], (start, stop)))
        work.append(shorten_windows(windows[stretch], sweep, allocate_newton(widest + 1)))

    run_in_threads(count, shorten)
    return sum(work)


def _measure_steps(problem: StepLimits, x: Array, a: Array) -> tuple[Array, Array]:
    """Measure the time of each step, and how much of the most used jerk limit it takes."""
    time, use = np.empty(len(problem.step)), np.empty(len(problem.step))
    run_in_threads(len(time), lambda start, stop: measure_steps(problem, x, a, time, use, start, stop))
    return time, use


def _count_parts(plan: _Plan, ramp: float) -> Indices:
    """Count the pieces, even in time, into which to cut steps over which s̈ changes much."""
    time, use = _measure_steps(plan.problem, plan.x, plan.a)
    pieces: Indices = np.where(use > _ACTIVE, np.clip(np.ceil(time * (_PER_RAMP / ramp)), 1, _PIECES), 1).astype(
        np.int64
    )
    return pieces


def _cut_steps(plan: _Plan, limits: DriveLimits, ramp: float, pieces: Indices) -> _Plan:
    """Cut each step into so many pieces, even in time; the motion stays as it is, but where it breaks a limit now."""
    if not (pieces > 1).any():
        return plan
    time, whole = _measure_steps(plan.problem, plan.x, plan.a)[0], plan.problem.step
    steps = np.repeat(np.arange(len(pieces)), pieces - 1)
    k = 1 + np.arange(len(steps)) - np.repeat(np.cumsum(pieces - 1) - (pieces - 1), pieces - 1)
    states = np.empty((len(steps), 3))
    locate_times(plan.problem, plan.x, plan.a, steps, k / pieces[steps] * time[steps], states)
    joint_path = divide_joint_path(plan.joint_path, steps, states[:, 0] / whole[steps])
    x, a = np.insert(plan.x, steps + 1, states[:, 1]), np.insert(plan.a, steps + 1, states[:, 2])
    where = np.repeat(np.where(pieces > 1, np.inf, plan.where), pieces)
    problem = _pose_problem(joint_path, limits)
    cut = _Plan(joint_path, joint_path.find_stretches(), problem, x, a, where)
    _slow_plan(cut, ramp)
    return cut


def _tighten_steps(plan: _Plan, ramp: float, steps: Indices, factors: Array) -> _Plan:
    """Tighten the limits of steps that take ``factors`` of them, and slow the profile down there."""
    problem, tighter = plan.problem, np.ones(len(plan.where))
    tighten_steps(steps, factors, problem, plan.x, plan.a, tighter)
    ceilings = problem.ceiling_start / tighter**2, problem.ceiling_end / tighter**2
    tightening = problem.tightening * tighter
    problem = problem._replace(ceiling_start=ceilings[0], ceiling_end=ceilings[1], tightening=tightening)
    plan = plan._replace(problem=problem)
    _slow_plan(plan, ramp)
    return plan


def _slow_plan(plan: _Plan, ramp: float) -> None:
    """Slow a profile down where it breaks a limit, and mark where that changed it."""
    before = plan.x.copy()
    _slow_stretches(plan.problem, plan.edges, ramp, plan.x, plan.a)
    plan.where[(plan.x != before)[:-1]] = np.inf


def _write_profile(
    plan: _Plan, limits: DriveLimits, known: tuple[Utilisation, Array, Array] | None
) -> tuple[SpeedProfile, Utilisation]:
    """Write a profile in two pieces a step, each stretch from time 0 on, and measure its utilisation.

    known : the utilisation of the same rows with other ṡ² and s̈ (rows,); it is measured anew where they changed
    """
    rows, pieces = len(plan.x), 2 * int((plan.edges[:, 1] - plan.edges[:, 0]).sum())
    profile = SpeedProfile.allocate(pieces, rows)
    if known is None:
        use = Utilisation(np.empty(pieces), np.zeros(rows, np.int64), np.ones(rows - 1, bool))
    else:
        rows_changed = (known[1] != plan.x) | (known[2] != plan.a)
        use = known[0]._replace(changed=rows_changed[:-1] | rows_changed[1:])
    steps = np.flatnonzero(plan.problem.step)
    span, motion = np.empty(len(steps)), (plan.problem, plan.x, plan.a)
    run_in_threads(len(steps), lambda first, last: write_pieces(steps, *motion, profile, span, first, last))
    write_times(plan.edges, span, profile)
    args = (plan.joint_path.rows, limits, profile, use, _PLACES)
    run_in_threads(pieces // 2, lambda first, last: measure_utilisation(*args, 2 * first, 2 * last))
    return profile, use
