"""A law that keeps jerks, on a course with the rows that it needs."""

from __future__ import annotations

import numpy as np

from ..path import Floats
from .corners import Indices
from .joint_path import Course, Drives, refined
from .kernels.jerk_limiting import smoothed
from .trajectory import Pace

_FIRST, _LEAST = 1.0 / 32.0, 1e-4  # of the way in which s̈ is built up, and mm: the first row behind a stop
_LAST = 0.6  # of a step: no new row beyond
_TRIES = 2  # of the law, to find the steps in which s⃛ would have to change
_ROUGH, _SHORT = 0.6, 2e-3  # the part left of s⃛ that tells one, and mm: one that is not cut


def gentle(course: Course, drives: Drives, x: Floats, ceiling: Floats) -> tuple[Course, Pace, Indices]:
    """A law that keeps jerks, no quicker than that of ṡ² ``x`` (rows,), what binds it at each row, and its course.

    ceiling : (steps,) of ṡ²
    """
    where, parts = _behind_stops(course, drives)
    course, x, ceiling = _cut(course, where, parts, x, ceiling)
    for _ in range(_TRIES):
        rough = _planned(course, drives, x, ceiling, 1)[2] < _ROUGH
        rough[1:-1] |= rough[2:] | rough[:-2]
        where = np.flatnonzero(rough & (course.step > _SHORT))
        course, x, ceiling = _cut(course, where, np.full(len(where), 0.5), x, ceiling)
    return course, *_planned(course, drives, x, ceiling)[:2]


def _behind_stops(course: Course, drives: Drives) -> tuple[Indices, Floats]:
    """Steps at stops, ascending, and the parts of them after which rows are missing: each twice as far as the last."""
    gaps = np.flatnonzero(course.step == 0.0)
    found: list[tuple[Indices, Floats]] = []
    for cell, row, back in (
        (np.append(0, gaps + 1), np.append(0, gaps + 1), False),
        (np.append(gaps - 1, len(course.step) - 1), np.append(gaps, len(course.step)), True),
    ):
        step, other = course.step[cell][:, None], row + (-1 if back else 1)
        slope = np.abs(course.joints[row] - course.joints[other]) / step
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


def _cut(course: Course, where: Indices, parts: Floats, x: Floats, ceiling: Floats) -> tuple[Course, Floats, Floats]:
    """A course with rows added as by :func:`~.course.refined`, and ṡ² and its ceiling there."""
    if not len(where):
        return course, x, ceiling
    between = x[where] + parts * (x[where + 1] - x[where])
    return refined(course, where, parts), np.insert(x, where + 1, between), np.insert(ceiling, where, ceiling[where])


def _planned(
    course: Course, drives: Drives, x: Floats, ceiling: Floats, rounds: int = 0
) -> tuple[Pace, Indices, Floats]:
    """A law, what binds it at each row, and the part of s⃛ that is left on each step."""
    rows = len(course.segment)
    time, passed, binding = np.empty(2 * rows + 1), np.zeros(rows), np.zeros(rows, np.int64)
    cell = np.empty(2 * rows, np.int64)
    shift, speed, rise, jerk = (np.empty(2 * rows) for _ in range(4))
    arrays, rough = [np.empty(rows) for _ in range(14)], np.ones(rows - 1)
    arrays[4][:] = x
    flags = tuple(np.empty(rows, bool) for _ in range(3))
    room = (tuple(arrays[:10]), tuple(arrays[10:]), np.empty((2 * rows, 4)), np.empty(rows, np.int64), flags)
    count = smoothed(
        course.step, course.joints, course.bend, course.feed, ceiling,
        (drives.speed, drives.acceleration, drives.jerk), (time, cell, shift, speed, rise, jerk), passed, binding,
        rough, room, rounds,
    )  # fmt: skip
    kept = slice(count)
    pace = Pace(time[: count + 1], cell[kept], shift[kept], speed[kept], rise[kept], jerk[kept], passed)
    return pace, binding, rough
