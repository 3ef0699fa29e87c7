"""A speed profile with limited jerk, on a joint path with the rows that it needs."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Indices
from .drive_limits import DriveLimits
from .joint_path import JointPath, refine_joint_path
from .kernels.jerk_limiting import JerkScratch, plan_jerk_limited
from .kernels.jerk_passes import Pools, StepBounds
from .kernels.utilisation import Utilisation
from .speed_profile import SpeedProfile

_FIRST, _LEAST = 1.0 / 32.0, 1e-4  # of the way in which s̈ is built up, and mm: the first row behind a stop
_LAST = 0.6  # no new row is put beyond this fraction of a step
_TRIES = 2  # rounds of planning, to find the steps over which s⃛ would have to change
_ROUGH, _SHORT = 0.6, 2e-3  # the kept fraction of s⃛ below which a step is cut, and mm: one that is not


def limit_jerk(
    joint_path: JointPath, limits: DriveLimits, x: Array, ceiling: Array
) -> tuple[JointPath, SpeedProfile, Indices]:
    """Limit the jerk of the quickest profile; return the joint path, its profile, and the limit that binds at each row.

    x : (rows,) ṡ² of the quickest profile; ceiling : (steps,) of ṡ²
    """
    steps, fractions = _grade_stops(joint_path, limits, ceiling)
    joint_path, x, ceiling = _add_rows(joint_path, steps, fractions, x, ceiling)
    for _ in range(_TRIES):
        rough = _plan_profile(joint_path, limits, x, ceiling, 1)[2] < _ROUGH
        rough[1:-1] |= rough[2:] | rough[:-2]
        steps = np.flatnonzero(rough & (joint_path.step > _SHORT))
        joint_path, x, ceiling = _add_rows(joint_path, steps, np.full(len(steps), 0.5), x, ceiling)
    return joint_path, *_plan_profile(joint_path, limits, x, ceiling)[:2]


def _grade_stops(joint_path: JointPath, limits: DriveLimits, ceiling: Array) -> tuple[Indices, Array]:
    """Find the steps at stops, ascending, and the parts after which rows are missing: each twice as far as the last."""
    gaps = np.flatnonzero(joint_path.step == 0.0)
    cuts: list[tuple[Indices, Array]] = []
    for steps, row, back in (
        (np.append(0, gaps + 1), np.append(0, gaps + 1), False),
        (np.append(gaps - 1, len(joint_path.step) - 1), np.append(gaps, len(joint_path.step)), True),
    ):
        length, other = joint_path.step[steps][:, None], row + (-1 if back else 1)
        slope = np.abs(joint_path.joints[row] - joint_path.joints[other]) / length
        with np.errstate(divide="ignore"):
            jerk = np.min(limits.jerk / slope, axis=1)
            acceleration = np.min(limits.acceleration / slope, axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            way = np.fmin(acceleration**3 / (6.0 * jerk**2), np.sqrt(ceiling[steps] ** 1.5 / jerk))
            way = np.fmin(way, length[:, 0])
        fraction = np.maximum(_FIRST * way, _LEAST) / length[:, 0]
        while (fraction < _LAST).any():
            near = fraction < _LAST
            cuts.append((steps[near], 1.0 - fraction[near] if back else fraction[near]))
            fraction = 2.0 * fraction
    if not cuts:
        return gaps[:0], np.empty(0)
    steps, fractions = (np.concatenate(column) for column in zip(*cuts, strict=True))
    order = np.lexsort((fractions, steps))
    return steps[order], fractions[order]


def _add_rows(
    joint_path: JointPath, steps: Indices, fractions: Array, x: Array, ceiling: Array
) -> tuple[JointPath, Array, Array]:
    """Add rows as :func:`~.joint_path.refine_joint_path` does, and interpolate ṡ² and its ceiling there."""
    if not len(steps):
        return joint_path, x, ceiling
    between = x[steps] + fractions * (x[steps + 1] - x[steps])
    x, ceiling = np.insert(x, steps + 1, between), np.insert(ceiling, steps, ceiling[steps])
    return refine_joint_path(joint_path, steps, fractions), x, ceiling


def _plan_profile(
    joint_path: JointPath, limits: DriveLimits, x: Array, ceiling: Array, rounds: int = 0
) -> tuple[SpeedProfile, Indices, Array]:
    """Plan a profile; return it, the limit that binds at each row, and the least kept fraction of s⃛ on each step."""
    rows = len(joint_path.segment)
    profile, scratch = SpeedProfile.allocate(2 * rows, rows), _allocate_scratch(rows)
    scratch.x[:] = x
    count = plan_jerk_limited(joint_path.rows, limits, ceiling, profile, scratch, rounds)
    return profile.cut(count), scratch.use.binding, scratch.least_kept


def _allocate_scratch(rows: int) -> JerkScratch:
    """Allocate the arrays for planning so many rows, in two pieces a step."""
    bounds = StepBounds(*(np.empty(rows) for _ in range(3)))
    pools = Pools(np.empty(rows), np.empty(rows), np.empty(rows), np.empty(rows, np.int64))
    use = Utilisation(np.empty((2 * rows, 4)), np.zeros(rows, np.int64), np.empty(rows, bool))
    return JerkScratch(
        bounds=bounds,
        x=np.empty(rows),
        u=np.empty(rows),
        controllable=np.empty(rows),
        rising_x=np.empty(rows),
        rising_u=np.empty(rows),
        braking_x=np.empty(rows),
        braking_u=np.empty(rows),
        acceleration=np.empty(rows),
        pools=pools,
        use=use,
        touched=np.empty(rows, bool),
        moved=np.empty(rows, bool),
        least_kept=np.ones(rows - 1),
    )
