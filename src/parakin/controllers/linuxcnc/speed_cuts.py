"""Where a law's motions are cut because the speed changes along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...toolpath.path import Floats
from ...toolpath.timing.trajectory import Law

_STEP = 0.05  # of a motion's greatest speed: by so much the law's speed changes within a part of it
_SHORTEST = 0.008  # s: no part takes less
_LOOK = 0.001  # s, between the places where the law's speed is looked at


def cuts(law: Law, accelerations: Floats) -> tuple[NDArray[np.int64], Floats, Floats]:
    """The pieces of a law's curve that are cut, (c,), and where: mm from the piece's start, and s, (c,) each.

    accelerations : (axes,) mm, rad and s; no part is so short that the controller could not stand still at both ends
    """
    course, pace, pieces = law.course, law.pace, len(law.curve.length)
    first = np.searchsorted(course.segment, np.arange(pieces))
    times = np.append(pace.passed[first], pace.passed[-1])
    slow, fast = _speeds(law, first)
    rise = 2.0 * (np.abs(law.curve.slope) / accelerations).max(1)
    varied = (np.diff(times) >= 2.0 * np.maximum(_SHORTEST, rise * fast)) & (slow < (1.0 - _STEP) * fast)
    found = list[tuple[int, float, float]]()
    for piece in np.flatnonzero(varied).tolist():
        begin, end = times[piece], times[piece + 1]
        looks = np.linspace(begin, end, int((end - begin) / _LOOK) + 2)[1:-1]
        where = np.clip(np.searchsorted(pace.time, looks, "right") - 1, 0, len(pace.cell) - 1)
        t = looks - pace.time[where]
        speed = pace.speed[where] + t * (pace.rise[where] + 0.5 * t * pace.jerk[where])
        shift = t * (pace.speed[where] + t * (0.5 * pace.rise[where] + t * pace.jerk[where] / 6.0))
        offset = course.offset[pace.cell[where]] + shift
        parts = _parts(looks - begin, speed, end - begin, _STEP * fast[piece], rise[piece])
        found += [(piece, offset[i], looks[i]) for i in parts]
    table = np.array(found).reshape(-1, 3)
    return table[:, 0].astype(np.int64), table[:, 1], table[:, 2]


def _speeds(law: Law, first: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """The least and the greatest speed on each piece, told by its steps."""
    step, spans = law.course.step, np.diff(law.pace.passed)
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
