"""The quickest speed profile along a joint path: time-optimal path parameterization by reachability, without jerks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ...arrays import Array, Indices
from ...errors import PoseError
from ...kernels.batch import run_in_threads
from .drive_limits import DriveLimits
from .force_limits import ForceLimits
from .joint_path import JointPath, refine_joint_path
from .kernels.acceleration_limits import AccelerationLimits
from .kernels.reachability import Switches, compute_controllable, compute_reachable, find_switches
from .kernels.speed_ceilings import StepCeilings, compute_speed_ceilings
from .kernels.utilisation import Places, Utilisation, measure_utilisation
from .speed_profile import SpeedProfile

UNBOUND = 1e12  # mm²/s², of ṡ²: nothing is as fast
WORTH = 5e-4  # least fraction of the cycle time that more rows must save
AddRows: TypeAlias = Callable[[JointPath, Indices, Array], JointPath]  # in steps, ascending, after fractions of them
_ROUNDS = 4
_TANGENTS = 40  # of the drives' powers, each where the profile of the one before goes, until the time is the same
_SAME = 1e-4
RAMP = 0.1  # s in which a drive is assumed to reach its acceleration where only a jerk is given
_ROUNDING = 1e-8
_PLACES = Places(5, False)  # on each step where utilisation is measured: the limits were kept between them, too


def compute_ceilings(joint_path: JointPath, limits: DriveLimits) -> StepCeilings:
    """Compute what feed and the joints' speeds allow for ṡ² at both ends of each step."""
    steps = len(joint_path.step)
    ceilings = StepCeilings(np.empty(steps), np.empty(steps))
    args = (joint_path.rows, limits.speed, UNBOUND, ceilings)
    run_in_threads(steps, lambda start, stop: compute_speed_ceilings(*args, start, stop))
    return ceilings


def find_reachable(joint_path: JointPath, limits: DriveLimits, ceilings: StepCeilings) -> tuple[Array, Array]:
    """Find the greatest ṡ² (rows,) below ceilings that is controllable and reachable, and its s̈ (steps,)."""
    count = len(joint_path.step)
    ceiling = np.minimum(np.append(ceilings.start, 0.0), np.append(0.0, ceilings.end))
    ceiling[joint_path.find_ends()] = 0.0
    bounds = AccelerationLimits(np.minimum(limits.acceleration, RAMP * limits.jerk), np.full(count, np.inf))
    x, u, controllable = np.empty(count + 1), np.empty(count), np.empty(count + 1)
    compute_controllable(joint_path.rows, bounds, ceiling, controllable, 0, count)
    compute_reachable(joint_path.rows, bounds, controllable, x, u, 0, count)
    return x, u


def find_quickest(
    joint_path: JointPath, limits: DriveLimits, forces: ForceLimits | None, add_rows: AddRows = refine_joint_path
) -> tuple[JointPath, Array, Array]:
    """Find ṡ² (rows,) and s̈ (steps,) of the quickest profile without jerks, with rows where it switches."""
    for attempt in range(_ROUNDS):
        joint_path = joint_path if forces is None else forces.bound(joint_path)
        rows, count = joint_path.rows, len(joint_path.step)
        ceilings = compute_ceilings(joint_path, limits)
        x, u = find_reachable(joint_path, limits, ceilings)
        seconds = np.inf
        for _ in range(_TANGENTS):
            if forces is None or not forces.bounds_power or abs(seconds - sum_spans(joint_path, x)) < _SAME * seconds:
                break
            seconds, joint_path = sum_spans(joint_path, x), forces.bound(joint_path, x)
            x, u = find_reachable(joint_path, limits, ceilings)
        rows = joint_path.rows
        bounds = AccelerationLimits(np.minimum(limits.acceleration, RAMP * limits.jerk), np.full(count, np.inf))
        switches, lost = Switches(np.empty(count), np.empty(count)), list[float]()
        args = (rows, bounds, ceilings, x, switches)
        run_in_threads(count, lambda start, stop: lost.append(find_switches(*args, start, stop)))  # noqa: B023
        refuse_unbound(joint_path, limits, np.maximum(x[:-1], x[1:]))
        steps = np.concatenate([np.flatnonzero(where) for where in switches])
        # A step between two stands takes forever until it has a row; what it loses is infinite, too.
        if attempt == _ROUNDS - 1 or sum(lost) < WORTH * sum_spans(joint_path, x) or not len(steps):
            break
        fractions = np.concatenate([where[where > 0.0] for where in switches])
        order = np.lexsort((fractions, steps))
        joint_path = add_rows(joint_path, steps[order], fractions[order])
    return joint_path, x, u


def refuse_unbound(joint_path: JointPath, limits: DriveLimits, x: Array) -> None:
    """Raise for a step (of ṡ² ``x``) on which joints move and nothing limits them.

    Joints with limits that hardly move while C turns by itself, the tool upright, are as fast as they may be.
    """
    fast = np.flatnonzero((x >= 0.5 * UNBOUND) & (joint_path.step > 0.0))
    moving = np.abs(joint_path.joints[fast + 1] - joint_path.joints[fast]) > 1e-12
    moving &= np.isinf(limits.speed) & np.isinf(limits.acceleration)
    unbound = np.flatnonzero(moving.any(1))
    if len(unbound):
        own = zip(joint_path.posted.machine.joints, moving[unbound[0]], strict=True)
        text = f"no feed, and no speed or acceleration of {', '.join(joint for joint, moves in own if moves)}"
        raise PoseError(f"{joint_path.describe_step(int(fast[unbound[0]]))} nothing limits the motion: {text}")


def compute_spans(joint_path: JointPath, x: Array) -> Array:
    """Compute the time of each step, s, from ṡ² at the rows; infinite between two stands."""
    speed, moving = np.sqrt(x), joint_path.step > 0.0
    time, total = np.zeros(len(moving)), speed[:-1] + speed[1:]
    with np.errstate(divide="ignore"):
        spans: Array = np.divide(2.0 * joint_path.step, total, out=time, where=moving)
    return spans


def sum_spans(joint_path: JointPath, x: Array) -> float:
    """Sum the time of all steps, s."""
    return float(compute_spans(joint_path, x).sum())


def build_accelerated_profile(
    joint_path: JointPath, limits: DriveLimits, x: Array, u: Array
) -> tuple[SpeedProfile, Indices]:
    """Build the profile of constant s̈ over each step, and what binds it at each row."""
    return _write_steps(joint_path, limits, np.sqrt(x)[:-1], u, compute_spans(joint_path, x))


def build_uniform_profile(joint_path: JointPath, limits: DriveLimits) -> tuple[SpeedProfile, Indices]:
    """Build the profile of the greatest constant speed over each step, and what binds it at each row."""
    ceiling = np.minimum(*compute_ceilings(joint_path, limits))
    refuse_unbound(joint_path, limits, ceiling)
    speed = np.sqrt(ceiling)
    return _write_steps(joint_path, limits, speed, np.zeros(len(speed)), joint_path.step / speed)


def _write_steps(
    joint_path: JointPath, limits: DriveLimits, speed: Array, acceleration: Array, spans: Array
) -> tuple[SpeedProfile, Indices]:
    """Write a profile of one piece for each step, stretched in time by the excess over a limit; note what binds it."""
    row_times = np.append(0.0, np.cumsum(spans))
    row = np.flatnonzero(joint_path.step > 0.0)
    time, still = np.append(row_times[row], row_times[-1]), np.zeros(len(row))
    profile = SpeedProfile(time, row, still, speed[row], acceleration[row], still, row_times)
    without_jerk = limits._replace(jerk=np.full_like(limits.jerk, np.inf))
    binding, changed = np.zeros(len(row_times), np.int64), np.ones(len(joint_path.step), bool)
    args = (joint_path.rows, without_jerk, profile, Utilisation(np.empty(len(row)), binding, changed), _PLACES)
    factors = list[float]()
    run_in_threads(len(row), lambda first, last: factors.append(measure_utilisation(*args, first, last)))
    worst = max(factors)
    return profile.stretch(worst if worst > 1.0 + _ROUNDING else 1.0), binding
