"""Poses all over a machine's workspace, inside all limits and clear of singularities."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...arguments import RowsLike
from ...arrays import Array
from ...errors import PoseError
from ...kernels.intervals import freeze_rows
from ...kinematics.tall_matrices import compute_determinants
from ...machine import Machine

SAMPLES = 400  # of the workspace, if nothing else is said
_MOST_SAMPLES = 20_000
_WIDER = 1.5  # than what is proved along the axes from home
_MOST_ROUNDS = 200
_A_ROUND = 4096
_REGULAR = 0.25  # of home's regularity
_MOST_TILT = 0.5  # rad either way, of an axis that turns farther


def choose_poses(machine: Machine, poses: RowsLike | None, samples: int) -> Array:
    """Choose the rows of given poses, (N, axes), or as many of the workspace as ``samples`` where none are given.

    Raises :class:`PoseError` for poses that are none, or for too few or too many samples.
    """
    if poses is not None:
        return machine.rows(poses, machine.axes, "poses")[0]
    check_sample_count(samples)
    return sample_allowed_poses(machine, samples)


def check_sample_count(samples: int) -> None:
    """Check how many poses of a workspace are wanted; raises :class:`PoseError`."""
    if not 1 <= samples <= _MOST_SAMPLES:
        raise PoseError(f"samples: a number from 1 to {_MOST_SAMPLES} expected, not {samples}")


@lru_cache(maxsize=16)
def sample_allowed_poses(machine: Machine, count: int, seed: int = 0) -> Array:
    """Sample poses (count, axes) evenly over a box about what travel from home along the axes spans.

    They are inside all limits, on home's side of the singularities, and no nearer to them than a quarter of home.

    Raises :class:`PoseError` where too few are found.
    """
    travels = [machine.travel(machine.home, axis) for axis in machine.axes]
    low, high = (np.array([getattr(t, end).distance for t in travels]) for end in ("back", "ahead"))
    turning = np.array(machine.axis_units) == "rad"
    low, high = (
        np.where(turning, np.minimum(low, _MOST_TILT), low),
        np.where(turning, np.minimum(high, _MOST_TILT), high),
    )
    at_home = _measure_regularity(machine, machine.home[None])
    rng = np.random.default_rng(seed)
    chosen: list[Array] = []
    size = 0
    for _ in range(_MOST_ROUNDS):
        ways = rng.uniform(-_WIDER * low, _WIDER * high, (_A_ROUND, len(low)))
        poses = machine.home + ways
        poses = poses[machine.check(poses) == 0]
        regularity = _measure_regularity(machine, poses)
        poses = poses[regularity >= _REGULAR * at_home]
        chosen.append(poses)
        size += len(poses)
        if size >= count:
            return freeze_rows(np.concatenate(chosen)[:count])
    raise PoseError(f"{machine.name}: only {size} of {count} poses inside its limits were found")


def _measure_regularity(machine: Machine, poses: Array) -> Array:
    """Measure how far poses are from parallel singularities, (n,): the least singular value of the legs' unit wrenches.

    A turn counts as the greatest leg's length. Negative on the other side of the singularities than home.
    """
    joints = np.vstack([machine.inverse(poses), machine.inverse(machine.home)])
    a, _, norms = machine.twist_rates(np.vstack([poses, machine.home]), joints)
    legs = norms.shape[1]
    a = a.copy()
    a[:, :legs] /= norms[:, :, None]
    turning = np.arange(a.shape[2]) >= sum(axis in "XYZ" for axis in machine.axes)
    a[:, :legs] /= np.where(turning, max(machine.leg_sizes), 1.0)
    values = np.linalg.svd(a, compute_uv=False)[:, -1]
    sides = np.sign(compute_determinants(a))
    return np.asarray((values * sides * sides[-1])[:-1])
