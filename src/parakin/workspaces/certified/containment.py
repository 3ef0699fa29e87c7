"""Whether whole boxes of places lie in a region, proved on intervals; else a place where a limit is broken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from ...errors import PoseError
from .best_orientation import best_turns
from .constraints import Constraint
from .plane_cuts import CLEARED, EXCLUDED
from .region import Region
from .subdivision import Indices, Items, Lines, bounds

MOST = 4096  # parts of a box to be looked at before it is left undecided
_ROUNDS = 60  # halved more often, a part's numbers have no digits left
_ULP = 2.3e-16


@dataclass(frozen=True)
class Verdict:
    """What is proved of one box: it is inside, or ``limit`` is broken at ``pose``, or neither.

    Of an inclusive region no turn is allowed at the pose's place; the pose has one that comes near.
    ``boxes`` counts the parts looked at.
    """

    proved: bool
    pose: tuple[float, ...] | None
    limit: str | None
    boxes: int

    def __bool__(self) -> bool:
        return self.proved

    @property
    def undecided(self) -> bool:
        return not self.proved and self.limit is None


@dataclass(frozen=True, eq=False)
class Verdicts:
    """What is proved of N boxes.

    proved : (N,) every place of the box is in the region
    limit : (N,) index in ``names`` of a limit that is broken in the box, -1 where none was found
    places, turns : (N, d), (N, s) where that is, else NaN; of an inclusive region no turn tried is allowed there,
        which is not proved of all turns
    boxes : (N,) parts looked at
    """

    proved: NDArray[np.bool_]
    limit: Indices
    places: Array
    turns: Array
    boxes: Indices
    names: tuple[str, ...]


def holds(
    region: Region, low: ArrayLike, high: ArrayLike, more: Sequence[Constraint] = (), most: int = MOST
) -> Verdict:
    """Whether all places of the box [low, high], mm, are in a region, and keep the constraints ``more`` besides.

    It is undecided after ``most`` parts. Raises :class:`PoseError` for corners that are none.
    """
    bottom, top = np.atleast_2d(np.asarray(low, float), np.asarray(high, float))
    found = verdicts(region, bottom, top, more, most)
    seen = int(found.boxes.sum())
    if found.proved.all() or found.limit[0] < 0:
        return Verdict(bool(found.proved.all()), None, None, seen)
    if not region.every_orientation and not _nowhere(region, found.places[0], 1e-6 * float((top - bottom).max()), more):
        return Verdict(False, None, None, seen)
    pose = region.poses(found.places, found.turns)[0]
    return Verdict(False, tuple(pose.tolist()), found.names[int(found.limit[0])], seen)


def verdicts(
    region: Region, low: ArrayLike, high: ArrayLike, more: Sequence[Constraint] = (), most: int = MOST
) -> Verdicts:
    """The same of many boxes [low, high] at once, (N, d) mm: they cost little more than one."""
    bottom, top = np.asarray(low, float), np.asarray(high, float)
    if bottom.ndim != 2 or bottom.shape != top.shape or bottom.shape[1] != len(region.free_axes):
        raise PoseError(f"two corners of {' '.join(region.free_axes)} expected of a box")
    if not (np.isfinite(bottom).all() and np.isfinite(top).all() and (bottom <= top).all()):
        raise PoseError("two finite corners expected of a box, the lower one first")
    work = _Work(region, bottom, top, more, most)
    if region.every_orientation or not work.constraints:
        for number, constraint in enumerate(work.constraints):
            work.clear(number, constraint)
        work.proved[:] = work.open
    else:
        work.serve()
    names = tuple(constraint.name for constraint in work.constraints)
    return Verdicts(work.proved, work.limit, work.places, work.turns, work.boxes, names)


def _nowhere(region: Region, place: Array, half: float, more: Sequence[Constraint]) -> bool:
    """Proved that no turn is allowed about a place."""
    half = max(half, 1e-9 * float(np.abs(place).max()), 1e-9)
    work = region.subdivide(place - half, place + half, more)
    for _ in range(4):
        if not len(work.open.low) or any(len(part.low) for part in work.done):
            break
        work.refine(np.arange(len(work.open.low)))
    return not len(work.cells("cell").low)


class _Work:
    """N boxes in parts; ``open`` are those of which all still can be proved."""

    def __init__(self, region: Region, low: Array, high: Array, more: Sequence[Constraint], most: int):
        self.region, self.low, self.high, self.more, self.most = region, low, high, more, most
        self.constraints = [*(c for c in region.constraints if not c.implied), *more]
        n, self.d = low.shape
        self.first, self.last = (np.array([span[i] for span in region.swept_axes.values()], float) for i in (0, 1))
        self.proved, self.limit = np.zeros(n, np.bool_), np.full(n, -1, np.int64)
        self.places, self.turns = np.full(low.shape, np.nan), np.full((n, len(self.first)), np.nan)
        self.boxes, self.open = np.zeros(n, np.int64), np.ones(n, np.bool_)

    def _counted(self, box: Indices) -> NDArray[np.bool_]:
        """Parts of boxes still open, of which not too many were looked at."""
        self.boxes += np.bincount(box, minlength=len(self.boxes))
        self.open &= self.boxes <= self.most
        return np.asarray(self.open[box])

    def clear(self, number: int, constraint: Constraint) -> None:
        """One constraint over all turns: parts are boxes of places and turns, halved where they leave most open."""
        d = self.d
        box = np.flatnonzero(self.open)
        low = np.concatenate([self.low[box], np.tile(self.first, (len(box), 1))], 1)
        high = np.concatenate([self.high[box], np.tile(self.last, (len(box), 1))], 1)
        for _ in range(_ROUNDS):
            which = self._counted(box)
            box, low, high = box[which], low[which], high[which]
            if not len(box):
                return
            found = _bounds(constraint, low[:, :d], high[:, :d], low[:, d:], high[:, d:])
            which = found.state != CLEARED
            box, low, high, found = box[which], low[which], high[which], found.take(which)
            if not len(box):
                return
            place = _least(low, high, found)
            wrong = constraint.at(place, place)[1][:, 0] < 0.0
            if wrong.any():
                self.limit[box[wrong]], self.open[box[wrong]] = number, False
                self.places[box[wrong]], self.turns[box[wrong]] = place[wrong, :d], place[wrong, d:]
                which = self.open[box]
                box, low, high, found = box[which], low[which], high[which], found.take(which)
            low[:, d:] = np.where(found.turn > 0, high[:, d:], low[:, d:])
            high[:, d:] = np.where(found.turn < 0, low[:, d:], high[:, d:])
            box, low, high = _halved(box, low, high, _left_open(constraint, low, high, d))
        self.open[box] = False

    def serve(self) -> None:
        """A part is proved by one turn that serves all of its places: its whole's, or the best one at its middle."""
        box, low, high = np.arange(len(self.low)), self.low, self.high
        turns: Array | None = None
        for _ in range(_ROUNDS):
            which = self._counted(box)
            if turns is not None:
                which[which] = ~self._served(low[which], high[which], turns[which])
                turns = turns[which]
            box, low, high = box[which], low[which], high[which]
            if not len(box):
                break
            middle = 0.5 * (low + high)
            turns, margins = best_turns(self.region, middle, self.more)
            wrong = ~(margins >= 0.0).all(1)
            if wrong.any():
                first = (~(margins[wrong] >= 0.0)).argmax(1)
                self.limit[box[wrong]], self.open[box[wrong]] = first, False
                self.places[box[wrong]], self.turns[box[wrong]] = middle[wrong], turns[wrong]
            left = self.open[box]
            left[left] = ~self._served(low[left], high[left], turns[left])
            number, low, high = _halved(np.flatnonzero(left), low[left], high[left], (high - low)[left])
            box, turns = box[number], turns[number]
        self.open[box] = False
        self.proved[:] = self.open

    def _served(self, low: Array, high: Array, turns: Array) -> NDArray[np.bool_]:
        """Whether all limits are kept all over these boxes, each at one turn."""
        served = np.ones(len(low), np.bool_)
        for constraint in self.constraints:
            which = np.flatnonzero(served)
            found = _bounds(constraint, low[which], high[which], turns[which], turns[which])
            served[which] = found.state == CLEARED
        return served


def _bounds(constraint: Constraint, low: Array, high: Array, first: Array, last: Array) -> Lines:
    """Straight bounds over boxes of places [low, high] and turns [first, last], and no ulp less."""
    size = np.where(high > low, high - low + _ULP * np.maximum(np.abs(low), np.abs(high)), 0.0)
    items = Items(np.arange(len(low)), first, last, np.zeros((len(low), 0), np.bool_))
    return bounds(constraint, low, size, items, every=True)


def _least(low: Array, high: Array, found: Lines) -> Array:
    """The corner, of place and turn, in which a margin is likely least; of what is broken all over the middle."""
    ahead = np.concatenate([-np.sign(found.slopes), found.turn], 1)
    ahead[found.state == EXCLUDED] = 0.0
    return np.clip(0.5 * (low + high) + 0.5 * ahead * (high - low), low, high)


def _left_open(constraint: Constraint, low: Array, high: Array, d: int) -> Array:
    """What each axis of place and turn leaves open of a margin's bounds, (N, d + s)."""
    half = 0.5 * (high - low)
    down, up = constraint.over(low, high)
    size = np.maximum(np.abs(down), np.abs(up))
    s = low.shape[1] - d
    left = np.empty_like(half)
    left[:, d:] = size[:, 2 : 2 + s] * half[:, d:]
    if not constraint.smooth:
        left[:, :d] = 0.5 * (up - down)[:, 2 + s :] * half[:, :d]
    else:
        left[:, :d] = 0.0
        for column, (k, n) in enumerate(zip(*np.triu_indices(d), strict=True), 2 + s):
            if k == n:
                left[:, k] += 0.5 * np.maximum(-down[:, column], 0.0) * half[:, k] ** 2
            else:
                left[:, [k, n]] += 0.5 * (size[:, column] * half[:, k] * half[:, n])[:, None]
    vague = ~np.isfinite(left).all(1)
    left[vague] = half[vague] / np.where(half[vague].max(0, initial=0.0) > 0.0, half[vague].max(0, initial=0.0), 1.0)
    return left


def _halved(box: Indices, low: Array, high: Array, left: Array) -> tuple[Indices, Array, Array]:
    """Parts halved along every axis that leaves nearly as much open as the worst one."""
    cut = (left >= 0.5 * left.max(1, keepdims=True)) & (high > low)
    for axis in range(low.shape[1]):
        own = np.flatnonzero(cut[:, axis])
        middle = 0.5 * (low[own, axis] + high[own, axis])
        box, cut = np.concatenate([box, box[own]]), np.concatenate([cut, cut[own]])
        low, high = np.concatenate([low, low[own]]), np.concatenate([high, high[own]])
        high[own, axis] = middle
        low[len(low) - len(own) :, axis] = middle
    return box, low, high
