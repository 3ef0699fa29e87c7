"""A trajectory that keeps jerks, on a joint path with the rows that it needs."""

from __future__ import annotations

import numpy as np

from ..path import Floats
from .corners import Indices
from .joint_path import DriveLimits, JointPath, refined
from .kernels.jerk_limiting import smoothed
from .speed_profile import SpeedProfile

_FIRST, _LEAST = 1.0 / 32.0, 1e-4  # of the way in which s̈ is built up, and mm: the first row behind a stop
_LAST = 0.6  # of a step: no new row beyond
_TRIES = 2  # of the trajectory, to find the steps in which s⃛ would have to change
_ROUGH, _SHORT = 0.6, 2e-3  # the part left of s⃛ that tells one, and mm: one that is not cut


def limit_jerk(
    joint_path: JointPath, drives: DriveLimits, x: Floats, ceiling: Floats
) -> tuple[JointPath, SpeedProfile, Indices]:
    """Limit the jerk of the quickest profile ṡ² ``x`` (rows,): the joint path, its profile, and what binds at each row.

    ceiling : (steps,) of ṡ²
    """
    where, parts = _behind_stops(joint_path, drives)
    joint_path, x, ceiling = _cut(joint_path, where, parts, x, ceiling)
    for _ in range(_TRIES):
        rough = _planned(joint_path, drives, x, ceiling, 1)[2] < _ROUGH
        rough[1:-1] |= rough[2:] | rough[:-2]
        where = np.flatnonzero(rough & (joint_path.step > _SHORT))
        joint_path, x, ceiling = _cut(joint_path, where, np.full(len(where), 0.5), x, ceiling)
    return joint_path, *_planned(joint_path, drives, x, ceiling)[:2]


def _behind_stops(joint_path: JointPath, drives: DriveLimits) -> tuple[Indices, Floats]:
    """Steps at stops, ascending, and the parts of them after which rows are missing: each twice as far as the last."""
    gaps = np.flatnonzero(joint_path.step == 0.0)
    found: list[tuple[Indices, Floats]] = []
    for cell, row, back in (
        (np.append(0, gaps + 1), np.append(0, gaps + 1), False),
        (np.append(gaps - 1, len(joint_path.step) - 1), np.append(gaps, len(joint_path.step)), True),
    ):
        step, other = joint_path.step[cell][:, None], row + (-1 if back else 1)
        slope = np.abs(joint_path.joints[row] - joint_path.joints[other]) / step
        with np.errstate(divide="ignore"):
            jerk, rise = np.min(drives.jerk / slope, axis=1), np.min(drives.acceleration / slope, axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            way = np.fmin(rise**3 / (6.0 * jerk**2), step[:, 0])
        part = np.maximum(_FIRST * way, _LEAST) / step[:, 0]
        while (part < _LAST).any():
            near = part < _LAST
            found.append((cell[near], 1.0 - part[near] if back else part[near]))
            part = 2.0 * part
    where, parts = (np.concatenate(column) for column in zip(*found, strict=True)) if found else (gaps[:0], np.empty(0))
    order = np.lexsort((parts, where))
    return where[order], parts[order]


def _cut(
    joint_path: JointPath, where: Indices, parts: Floats, x: Floats, ceiling: Floats
) -> tuple[JointPath, Floats, Floats]:
    """A joint_path with rows added as by :func:`~.joint_path.refined`, and ṡ² and its ceiling there."""
    if not len(where):
        return joint_path, x, ceiling
    between = x[where] + parts * (x[where + 1] - x[where])
    return (
        refined(joint_path, where, parts),
        np.insert(x, where + 1, between),
        np.insert(ceiling, where, ceiling[where]),
    )


def _planned(
    joint_path: JointPath, drives: DriveLimits, x: Floats, ceiling: Floats, rounds: int = 0
) -> tuple[SpeedProfile, Indices, Floats]:
    """A trajectory, what binds it at each row, and the part of s⃛ that is left on each step."""
    rows = len(joint_path.segment)
    time, passed, binding = np.empty(2 * rows + 1), np.zeros(rows), np.zeros(rows, np.int64)
    cell = np.empty(2 * rows, np.int64)
    shift, speed, rise, jerk = (np.empty(2 * rows) for _ in range(4))
    arrays, rough = [np.empty(rows) for _ in range(14)], np.ones(rows - 1)
    arrays[4][:] = x
    flags = tuple(np.empty(rows, bool) for _ in range(3))
    room = (tuple(arrays[:10]), tuple(arrays[10:]), np.empty((2 * rows, 4)), np.empty(rows, np.int64), flags)
    count = smoothed(
        joint_path.step, joint_path.joints, joint_path.bend, joint_path.feed, ceiling,
        (drives.speed, drives.acceleration, drives.jerk), (time, cell, shift, speed, rise, jerk), passed, binding,
        rough, room, rounds,
    )  # fmt: skip
    kept = slice(count)
    profile = SpeedProfile(time[: count + 1], cell[kept], shift[kept], speed[kept], rise[kept], jerk[kept], passed)
    return profile, binding, rough
