"""Passes of the tool axis through or beside a pole: where they are, and how they are led through it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...kinematics.wrist import PRINTED, VICINITY
from ..path import Floats
from ..posting.posted import Posted
from .interpolation import Flags, Indices, Programmed
from .poles import Pole

WITHIN = 0.98  # of the angle tolerance: what an axis may be moved
_STEP = 0.02  # rad: motions that turn the axis farther are looked at in steps
_MOST_STEPS = 2000


@dataclass(frozen=True, eq=False)
class Steps:
    """Short steps of the programmed path near a pole, in order.

    record, begin, end : (m,) the motion by the record it leads to, and shares of it
    x0, x1 : (m, 2) the tool axis at both ends, as :meth:`Pole.beside` has it
    joined : (m,) whether a step begins where the one before ends
    nearest, share : (m,) rad from the pole where a step is nearest to it, and the share there
    """

    record: Indices
    begin: Floats
    end: Floats
    x0: Floats
    x1: Floats
    joined: Flags
    nearest: Floats
    share: Floats


@dataclass(frozen=True, eq=False)
class Pass:
    """A pass that can be led through the pole within the tolerance.

    steps : first and last of :class:`Steps` that it takes
    miss : rad by which the programmed axis passes beside the pole
    record, axis : (k,) records whose tool axes are moved, and where to, (k, 3) in M
    crossing : the step on which the pole is passed, -1 if none
    share : where on its motion
    ends : shares of that motion at which the way to the pole begins and ends, where that is within it
    """

    steps: tuple[int, int]
    miss: float
    record: Indices
    axis: Floats
    crossing: int
    share: float
    ends: tuple[float, ...]


def steps_near(pole: Pole, programmed: Programmed, posted: Posted, motion: Indices) -> Steps:
    """Steps of those of some motions that may come near to a pole."""
    machine = posted.machine
    if pole.joint is None or machine.wrist is None:
        freedom = 1.0 - programmed.axis[:, 2] ** 2
    else:
        freedom = machine.wrist.measure_freedom(posted.poses)
    off = np.arcsin(np.sqrt(np.clip(freedom, 0.0, 1.0)))
    length, turn = programmed.extent(motion)
    if pole.moves:
        turn = 1.2 * turn + 2.0 * length / min(machine.leg_sizes)
    close = 0.5 * (off[motion] + off[motion - 1] - turn) < VICINITY
    motion, parts = motion[close], np.ceil(np.clip(turn[close] / _STEP, 1.0, _MOST_STEPS)).astype(np.int64)
    record = np.repeat(motion, parts)
    number = np.arange(len(record)) - np.repeat(np.cumsum(parts) - parts, parts)
    begin, end = number / parts.repeat(parts), (number + 1) / parts.repeat(parts)
    x0, x1 = (pole.beside(*programmed.at(record, share)) for share in (begin, end))
    way = x1 - x0
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(-(x0 * way).sum(1) / (way * way).sum(1), 0.0, 1.0)
    at = np.where(np.isfinite(at), at, 0.0)
    nearest = np.hypot(*(x0 + at[:, None] * way).T)
    nearest = np.where(np.isfinite(nearest) & (np.hypot(*way.T) < 1.0), nearest, np.inf)
    joined = np.concatenate([[False], np.where(record[1:] == record[:-1], True, record[1:] == record[:-1] + 1)])
    return Steps(record, begin, end, x0, x1, joined[: len(record)], nearest, begin + at * (end - begin))


def passes(pole: Pole, programmed: Programmed, steps: Steps, angle: float) -> list[Pass]:
    """The passes that can be led through the pole with no axis moved by ``angle`` or more."""
    close = steps.nearest <= WITHIN * angle
    follows = steps.joined & np.concatenate([[False], close[:-1]])[: len(close)]
    starts = np.flatnonzero(close & ~follows)
    stops = np.flatnonzero(close & ~np.concatenate([close[1:] & steps.joined[1:], [False]])[: len(close)])
    reaches = np.sqrt(angle) * 0.5 ** np.arange(max(1.0, np.ceil(-np.log2(2.0 * np.sqrt(angle)))))
    windows = [_windows(steps, starts, stops, reach) for reach in reaches.tolist()]
    found: list[Pass] = []
    for number in range(len(starts)):
        if found and starts[number] <= found[-1].steps[1]:
            continue
        for (first, last), reach in zip(windows, reaches.tolist(), strict=True):
            led = _led(pole, programmed, steps, (int(first[number]), int(last[number])), reach, angle)
            if led is not None:
                found.append(led)
                break
    return found


def _windows(steps: Steps, starts: Indices, stops: Indices, reach: float) -> tuple[Indices, Indices]:
    """First and last of the steps about each run that are no farther than ``reach`` from the pole."""
    count = len(steps.record)
    if not count:
        return starts, stops
    begins = np.flatnonzero((np.hypot(*steps.x0.T) >= reach) | ~steps.joined)
    ends = np.flatnonzero((np.hypot(*steps.x1.T) >= reach) | ~np.append(steps.joined[1:], False))
    return begins[np.searchsorted(begins, starts, "right") - 1], ends[np.searchsorted(ends, stops)]


def _led(
    pole: Pole, programmed: Programmed, steps: Steps, window: tuple[int, int], reach: float, angle: float
) -> Pass | None:
    """The steps of a window, up to ``reach`` from the pole, led over it; None if that takes too much.

    In the plane beside the pole the path is squeezed towards a line through it: an offset b from the line, after a on
    it, becomes b·(a/reach)². So the free angle turns evenly, by no more than it must, and without a swing.
    """
    first, last = window
    some = slice(first, last + 1)
    x = np.concatenate([steps.x0[first : first + 1], steps.x1[some]])
    line = _line(x[0], x[-1], reach)
    normal = np.array([-line[1], line[0]])
    a, b = x @ line, x @ normal
    inside = np.hypot(a, b) < reach
    weight = np.where(inside, 1.0 - (a / reach) ** 2, 0.0)
    met = [end for end in (_met(x[0], x[1], reach), _met(x[-1], x[-2], reach)) if end is not None]
    edge = [abs(float(end @ normal)) ** 3 / reach**2 for end in met]  # what is left to move there
    crossing = np.flatnonzero(a[:-1] * a[1:] < 0.0)
    part = a[crossing] / (a[crossing] - a[crossing + 1])
    beside = np.abs(b[crossing] + part * (b[crossing + 1] - b[crossing]))
    if not max(0.0, np.abs(weight * b).max(), *beside, *edge) <= WITHIN * angle:
        return None
    records = np.concatenate([[steps.record[first] - (steps.begin[first] == 0.0)], steps.record[some]])
    whole = np.concatenate([[steps.begin[first] == 0.0], steps.end[some] == 1.0])
    share, step = 0.0, -1
    inner: tuple[float, ...] = ()
    moved = whole & (np.abs(weight * b) > PRINTED)
    if len(crossing):
        step = first + int(crossing[0])
        share = float(steps.begin[step] + part[0] * (steps.end[step] - steps.begin[step]))
        inner = _inner_ends(steps, window, step, reach)
    place = np.outer(a, line) + np.outer((1.0 - weight) * b, normal)
    chosen = records[moved]
    tip, axis = programmed.tip[chosen], programmed.axis[chosen]
    miss = float(steps.nearest[some].min())
    return Pass((first, last), miss, chosen, pole.pointing(tip, axis, place[moved]), step, share, inner)


def _line(begin: Floats, end: Floats, reach: float) -> Floats:
    """The direction (2,) in which the pole is passed, from where the path comes and goes."""
    directions = [v / np.hypot(*v) for v in (-begin, end) if np.hypot(*v) >= reach]
    if len(directions) == 2 and directions[0] @ directions[1] < 0.0:
        directions[1] = -directions[1]  # it turns back
    total: Floats = np.sum(directions, axis=0) if directions else end - begin
    size = np.hypot(*total)
    return np.array(total / size if size > 0.0 else [1.0, 0.0], dtype=np.float64)


def _met(outside: Floats, inside: Floats, reach: float) -> Floats | None:
    """Where the way from outside to inside comes within ``reach``."""
    if np.hypot(*outside) < reach or np.hypot(*inside) >= reach:
        return None
    way = inside - outside
    p, q, r = float(way @ way), float(outside @ way), float(outside @ outside) - reach * reach
    return outside + way * ((-q - math.sqrt(max(q * q - p * r, 0.0))) / p)


def _inner_ends(steps: Steps, window: tuple[int, int], crossing: int, reach: float) -> tuple[float, ...]:
    """Shares of the motion that crosses the pole at which it comes within ``reach`` and leaves again."""
    found = []
    first, last = window
    for step, outside, inside in ((first, steps.x0, steps.x1), (last, steps.x1, steps.x0)):
        met = _met(outside[step], inside[step], reach)
        if met is None or steps.record[step] != steps.record[crossing]:
            continue
        part = np.hypot(*(met - steps.x0[step])) / np.hypot(*(steps.x1[step] - steps.x0[step]))
        share = float(steps.begin[step] + part * (steps.end[step] - steps.begin[step]))
        if 0.0 < share < 1.0:
            found.append(share)
    return tuple(found)
