"""Where a trajectory's motions are cut because the speed changes along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...toolpath.path import Floats
from ...toolpath.timing.trajectory import Trajectory

_STEP = 0.05  # of a motion's greatest speed: by so much the trajectory's speed changes within a part of it
_SHORTEST = 0.008  # s: no part takes less
_LOOK = 0.001  # s, between the places where the trajectory's speed is looked at


def cuts(trajectory: Trajectory, accelerations: Floats) -> tuple[NDArray[np.int64], Floats, Floats]:
    """The pieces of a trajectory's curve that are cut, (c,), and where: mm from the piece's start, and s, (c,) each.

    accelerations : (axes,) mm, rad and s; no part is so short that the controller could not stand still at both ends
    """
    joint_path, profile, pieces = trajectory.joint_path, trajectory.profile, len(trajectory.curve.length)
    first = np.searchsorted(joint_path.segment, np.arange(pieces))
    times = np.append(profile.row_times[first], profile.row_times[-1])
    slow, fast = _speeds(trajectory, first)
    rise = 2.0 * (np.abs(trajectory.curve.slope) / accelerations).max(1)
    varied = (np.diff(times) >= 2.0 * np.maximum(_SHORTEST, rise * fast)) & (slow < (1.0 - _STEP) * fast)
    found = list[tuple[int, float, float]]()
    for piece in np.flatnonzero(varied).tolist():
        begin, end = times[piece], times[piece + 1]
        looks = np.linspace(begin, end, int((end - begin) / _LOOK) + 2)[1:-1]
        where = np.clip(np.searchsorted(profile.time, looks, "right") - 1, 0, len(profile.row) - 1)
        t = looks - profile.time[where]
        speed = profile.speed[where] + t * (profile.acceleration[where] + 0.5 * t * profile.jerk[where])
        shift = t * (profile.speed[where] + t * (0.5 * profile.acceleration[where] + t * profile.jerk[where] / 6.0))
        offset = joint_path.offset[profile.row[where]] + shift
        parts = _parts(looks - begin, speed, end - begin, _STEP * fast[piece], rise[piece])
        found += [(piece, offset[i], looks[i]) for i in parts]
    table = np.array(found).reshape(-1, 3)
    return table[:, 0].astype(np.int64), table[:, 1], table[:, 2]


def _speeds(trajectory: Trajectory, first: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """The least and the greatest speed on each piece, told by its steps."""
    step, spans = trajectory.joint_path.step, np.diff(trajectory.profile.row_times)
    speed = np.divide(step, spans, out=np.zeros(len(step)), where=spans > 0.0)
    moving = step > 0.0
    least = np.minimum.reduceat(np.where(moving, speed, np.inf), first)
    return least, np.maximum.reduceat(np.where(moving, speed, 0.0), first)


def _parts(times: Floats, speeds: Floats, end: float, step: float, rise: float) -> list[int]:
    """The looks at which a motion is cut: where its speed has changed by a step since the last cut."""
    found, last, before = list[int](), 0.0, float(speeds[0])
    for i, (time, speed) in enumerate(zip(times.tolist(), speeds.tolist(), strict=True)):
        shortest = max(_SHORTEST, rise * max(speed, before))
        if abs(speed - before) >= step and time - last >= shortest and end - time >= shortest:
            found.append(i)
            last, before = time, speed
    return found
