"""Where a machine may stand when it is switched on: poses spread over the workspace in which home lies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np

from ....arrays import Array, Flags
from ....machine import Machine
from ....model.limits import Limit
from ....performance.singularities import compute_singularity_margins
from ..axis_ranges import estimate_axis_ranges
from ..model_header import LEAST_REGULARITY, NEAR_LIMIT, find_least_margins

STARTS = 1000
_ROUNDS, _SAMPLES = 30, 40_000
_POINTS = 25  # looked at on the way from home
_OFF_SINGULAR = 2.0  # of the least regularity that the kinematics accepts


@dataclass(frozen=True, eq=False)
class HomingStarts:
    """Poses (n, axes) and joints (n, joints) from which a machine is homed."""

    poses: Array
    joints: Array


@lru_cache(maxsize=32)
def sample_starts(machine: Machine) -> HomingStarts:
    """Sample poses evenly from the axes' estimated ranges; the same ones in every run, fewer of a narrow workspace.

    They are where the guard lets jogs end, or farther inside, and are reached straight from home within all limits and
    without a singularity: no other part of the workspace can be come to without taking the machine apart.
    """
    rng = np.random.default_rng(0)
    low, high = (end.copy() for end in estimate_axis_ranges(machine))
    turning = np.array(machine.axis_units) == "rad"
    low[turning], high[turning] = np.maximum(low, -pi)[turning], np.minimum(high, pi)[turning]
    starts = np.empty((0, len(low)))
    for _ in range(_ROUNDS):
        poses = rng.uniform(low, high, (_SAMPLES, len(low)))
        poses = poses[_is_a_start(machine, poses)]
        starts = np.concatenate([starts, poses[_is_reached_straight(machine, poses)]])
        if len(starts) >= STARTS:
            break
    starts = starts[:STARTS]
    return HomingStarts(starts, machine.inverse(starts))


def _is_a_start(machine: Machine, poses: Array) -> Flags:
    """Tell where poses are inside the drives' ranges, off all other limits, and off singularities, (n,)."""
    allowed: Flags = machine.check(poses) == 0
    kept = poses[allowed]
    near = np.array([NEAR_LIMIT[limit.unit] for limit in list_other_limits(machine)])
    margins = compute_other_margins(machine, kept, machine.inverse(kept))
    regular = compute_regularity(machine, kept) >= _OFF_SINGULAR * LEAST_REGULARITY
    allowed[allowed] = regular & (margins >= near).all(1)
    return allowed


def _is_reached_straight(machine: Machine, poses: Array) -> Flags:
    """Tell where nothing is broken on the straight way from home in the axes, (n,)."""
    share = np.linspace(0.0, 1.0, _POINTS)[:, None, None]
    way = (machine.home + share * (poses - machine.home)).reshape(-1, poses.shape[1])
    kept = (machine.check(way) == 0) & (compute_regularity(machine, way) >= LEAST_REGULARITY)
    unharmed: Flags = kept.reshape(_POINTS, -1).all(0)
    return unharmed


def list_other_limits(machine: Machine) -> list[Limit]:
    """List the limits but for the drives' own ranges: homing goes to the ends of these, and past."""
    drives = {f"{name}.{side}" for name in machine.joints for side in ("min", "max")}
    return [limit for limit in machine.limit_definitions if limit.name not in drives]


def compute_other_margins(machine: Machine, poses: Array, joints: Array) -> Array:
    """Compute the margins (n, limits) of :func:`list_other_limits`; NaN where a leg can't close."""
    names = {limit.name for limit in list_other_limits(machine)}
    columns = [i for i, name in enumerate(machine.limits) if name in names]
    return machine.margins(poses, joints)[:, columns]


def compute_regularity(machine: Machine, poses: Array) -> Array:
    """Compute the least singularity margin (n,) as a fraction of home's (of 1 for a leg's drive), wrists apart."""
    least = find_least_margins(machine)
    counted = least > 0.0
    margins = compute_singularity_margins(machine, poses)[:, counted]
    regularity: Array = (margins * (LEAST_REGULARITY / least[counted])).min(1)
    return regularity
