"""The time of straight motions under a planner with trapezoids of speed, as grbl and its kin have."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...arrays import Array, Flags

_STRAIGHT = 0.999999  # cosine, for grbl a motion that goes straight on
JUNCTION_DEVIATION = 0.01  # mm, grbl's $11 and FluidNC's junction_deviation_mm as they are delivered


def stretch_for_buffer(seconds: Array, buffer: int, line_seconds: float) -> Array:
    """Stretch motions where they end faster than lines come: wherever a planner's buffer of them would run dry.

    seconds : (k,) of the motions
    buffer : how many the planner holds
    line_seconds : that a line takes on its way to it
    """
    if not (len(seconds) and line_seconds):
        return seconds
    window = min(buffer, len(seconds))
    sums = np.convolve(seconds, np.ones(window), "valid")
    factors = np.maximum(line_seconds * window / sums, 1.0)
    padded = np.concatenate([np.ones(window - 1), factors, np.ones(window - 1)])
    stretched: Array = seconds * np.lib.stride_tricks.sliding_window_view(padded, window).max(axis=1)
    return stretched


def predict_planned_seconds(steps: Array, seconds: Array, halt: Flags, accelerations: Array, buffer: int) -> Array:
    """Predict what motions (k,) take whose speed changes with bounded acceleration, each junction passed as grbl does.

    A planner that holds ``buffer`` motions has to be able to stop at the last of them. After grbl 1.1, ``planner.c``.

    steps : (k, joints) mm and degrees
    seconds : (k,) what each is told to take
    halt : (k,) whether the planner stops at its end
    accelerations : (joints,) in the same units
    """
    length = np.sqrt((steps**2).sum(axis=1))
    if not len(length) or not np.isfinite(accelerations).any():
        return seconds
    unit = steps / length[:, None]
    speed = length / seconds
    acceleration = _limit(accelerations, unit)
    rise = 2.0 * acceleration * length
    entry = np.minimum(np.append(np.inf, _bound_junctions(unit, accelerations)), speed**2)
    entry[1:] = np.minimum(entry[1:], speed[:-1] ** 2)
    entry[np.append(True, halt[:-1])] = 0.0
    entry = np.append(entry, 0.0)
    before = np.append(0.0, np.cumsum(rise))
    ahead = buffer - 1  # the first of the buffer is under way while the speed at its end is planned
    ends = np.minimum(np.arange(len(length)) + ahead, len(length))
    reach = before[ends] - before[:-1]  # from a stand at the end of the buffer
    for later in range(1, ahead):
        there = np.minimum(np.arange(len(length)) + later, len(length))
        reach = np.minimum(reach, entry[there] + before[there] - before[:-1])
    entry[:-1] = np.minimum(entry[:-1], reach)
    entry = np.minimum.accumulate(entry - before) + before
    entry = np.maximum(entry, 0.0)
    peak = np.minimum(speed**2, 0.5 * (entry[:-1] + entry[1:] + rise))
    first, last, top = np.sqrt(entry[:-1]), np.sqrt(entry[1:]), np.sqrt(peak)
    ramps = (2.0 * top - first - last) / acceleration
    even = length - (2.0 * peak - entry[:-1] - entry[1:]) / (2.0 * acceleration)
    planned: Array = ramps + np.maximum(even, 0.0) / top
    return planned


def _limit(limits: Array, unit: Array) -> Array:
    """Find how far along unit vectors (k, joints) no joint passes its limit."""
    with np.errstate(divide="ignore"):
        lengths: Array = (limits / np.abs(unit)).min(axis=1)
    return lengths


def _bound_junctions(unit: Array, accelerations: Array) -> Array:
    """Compute the squares of the speeds (k - 1,) at which grbl passes from one motion to the next."""
    cosine = (unit[:-1] * unit[1:]).sum(axis=1)
    turn = unit[1:] - unit[:-1]
    size = np.sqrt((turn**2).sum(axis=1))
    straight, back = cosine > _STRAIGHT, cosine < -_STRAIGHT
    bent = ~(straight | back)
    half = np.sqrt(0.5 * (1.0 + cosine[bent]))
    squares = np.where(straight, np.inf, 0.0)
    sideways = _limit(accelerations, turn[bent] / size[bent, None])
    squares[bent] = sideways * JUNCTION_DEVIATION * half / (1.0 - half)
    return squares


def find_halts(count: int, places: Iterable[int]) -> Flags:
    """Find the motions (count,) that a planner ends before it obeys the commands at places, motions before them."""
    halts = np.zeros(count, bool)
    halts[[place - 1 for place in places if 0 < place <= count]] = True
    return halts
