"""Where to put the part: the workpiece's placement that leaves the greatest least margin over a whole tool path."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import PoseError
from ...machine import Machine
from ...performance.search import pick_best_apart
from ..path import Floats, ToolPath
from ..posting.working_mode import list_candidate_modes
from .margins import AXES, Indices, PlacementMargins, PlacementScore
from .maximin import Rows, Top, maximise_least, score_rows

Progress = Callable[[float], None]
Bounds = Mapping[str, tuple[float, float]]

_LOOKED_AT, _STARTS = 384, 10  # placements spread over the bounds, and those of them to climb from
_APART = 0.1  # of the bounds
_STEPS = 20  # of a climb
_ROUNDS = 80  # of looking at the whole path
_AGREED = 1e-6  # of half a range: the whole path against the records looked at
_EVEN, _FEW = 24, 60  # records to begin with; a path of no more is looked at as a whole
_TRACK = 2000  # records along which joints are followed
_LEVER = 200.0  # mm along the tool's axis: as far as orientations are told by
_BESIDE = 0.02  # of half a range: limits as near to the tightest get their worst records looked at, too


@dataclass(frozen=True, eq=False)
class Placement:
    """The best placement found.

    workpiece : (3, 4), the transform to post with: M ← workpiece ← path.frame ← W
    values : mm and rad, by axis, of those that the bounds name
    mode : the working mode it was found in, to post with
    margin : the least of all margins over the path, over half its limit's range (a broken reach: over the rod's length
        squared); below 0 no placement was found that is allowed
    limit, record : the limit it is of, or one of the path's own: ``tilt``, ``X``, ``Y``, ``Z``; and where (0-based)
    tried : how many placements were looked at
    """

    workpiece: Floats
    values: dict[str, float]
    mode: str
    margin: float
    limit: str
    record: int
    tried: int

    @property
    def allowed(self) -> bool:
        return self.margin >= 0.0


def find_placement(
    machine: Machine, path: ToolPath, bounds: Bounds, *, mode: str | None = None, progress: Progress | None = None
) -> Placement:
    """The placement within bounds with the greatest least margin over all records of a path; see :class:`Placement`.

    Parameters
    ----------
    machine, path : as :func:`~..posting.post.post_path` takes them
    bounds : by axis (X Y Z mm, A B C rad) the least and the greatest value
    mode : working mode; None: the default one, and head and table's other sign where that allows no placement
    progress : called now and then with the fraction done, 0 to 1

    The same arguments give the same placement. Placements spread over the bounds are looked at, and the best of them
    climbed from, at a few records; those of the whole path that turn out worse are then looked at, too, until the least
    over these is that over all. The greatest is found so, not proved.

    Raises :class:`PoseError` for bounds that are none, an unknown mode and a path without records.
    """
    for axis, (low, high) in bounds.items():
        if axis not in AXES or not -math.inf < low <= high < math.inf:
            raise PoseError(f"bounds: {axis} from {low} to {high}; an axis of X Y Z A B C and low <= high expected")
    if not len(path):
        raise PoseError("path: no records to place")
    say = progress or (lambda fraction: None)
    axes = tuple(axis for axis in AXES if axis in bounds and bounds[axis][0] < bounds[axis][1])
    held = {axis: ends[0] for axis, ends in bounds.items() if axis not in axes}
    ends = np.array([bounds[axis] for axis in axes]).reshape(-1, 2)
    results, tried = [], 0
    for each in list_candidate_modes(machine, mode):
        search = _PlacementSearch(PlacementMargins(machine, path, each, axes, ends[:, 0], ends[:, 1], held), say)
        results.append((*search.run(), search.placing))
        tried += search.tried
        if results[-1][1].margin >= 0.0:
            break
    point, found, placing = max(results, key=lambda result: result[1].worth)
    say(1.0)
    values = placing.values(point)
    values = {axis: values[axis] for axis in AXES if axis in values}
    return Placement(placing.workpiece(point), values, placing.mode, found.margin, found.limit, found.record, tried)


class _PlacementSearch:
    """One search, in one working mode.

    records : those looked at, ascending
    track : those along which their joints go on, None at first: see :meth:`Placing.rows`
    """

    def __init__(self, placing: PlacementMargins, say: Progress):
        self.placing, self.say = placing, say
        self.records = _telling(placing.path)
        self.track: Indices | None = None
        self.tried = 0

    @property
    def rows(self) -> Rows:
        def rows(points: Floats) -> tuple[Floats, Floats]:
            self.tried += len(points)
            return self.placing.rows(points, self.records, self.track)

        return rows

    def run(self) -> tuple[Floats, PlacementScore]:
        """The best point, and what it is over the whole path."""
        return self._settled(self._climbed(0.0, 0.5))

    def _climbed(self, begin: float, end: float) -> list[Top]:
        """Local maxima over the records looked at; ``begin`` and ``end`` are of the progress."""
        d = len(self.placing.axes)
        points = _spread_out(_LOOKED_AT, d) if d else np.empty((1, 0))
        parts = np.array_split(points, range(32, len(points), 32))
        worths = np.concatenate([score_rows(*self.rows(part)) for part in parts])
        starts = pick_best_apart(points, worths, _STARTS, np.full(d, _APART)) if d else np.zeros(1, np.int64)
        tops = []
        for number, start in enumerate(starts.tolist(), 1):
            tops.append(maximise_least(self.rows, points[start], _STEPS))
            self.say(begin + (end - begin) * (0.3 + 0.7 * number / len(starts)))
        return tops

    def _settled(self, tops: list[Top]) -> tuple[Floats, PlacementScore]:
        """The best of some local maxima, over the whole path: the most promising one is looked at until it holds."""
        best: tuple[Floats, PlacementScore] | None = None
        for attempt in range(_ROUNDS):
            tops.sort(key=lambda top: (-round(top.worth, 9), -top.rest))
            point, worth, rest = tops[0]
            found = self.placing.found(point)
            self.tried += 1
            if best is None or found.worth > best[1].worth + _AGREED:
                best = point, found
            self.say((0.5 if self.track is None else 0.8) + 0.2 * (1.0 - 0.9**attempt))
            if best[1].worth >= worth - _AGREED:
                break
            more = np.setdiff1d(found.worst[found.shares < max(worth, 0.0) + _BESIDE], self.records)
            if len(more):
                self.records = np.union1d(self.records, more)
                if self.track is not None:
                    self.track = np.union1d(self.track, more)
            elif self.track is None:
                self.track = np.union1d(_evenly(len(self.placing.path), _TRACK), self.records)
                tops = [maximise_least(self.rows, point, _STEPS), *self._climbed(0.5, 0.8)]
                continue
            else:
                tops[0] = Top(point, found.worth, rest)  # no more is to be learnt of it
                continue
            tops = [maximise_least(self.rows, top.point, 0) for top in tops]
            index = max(range(len(tops)), key=lambda i: tops[i].worth)
            tops[index] = maximise_least(self.rows, tops[index].point, 40, 0.05)
        assert best is not None
        return best


def _spread_out(count: int, d: int) -> Floats:
    """Points (count, d) evenly spread over the unit box, the first in its middle: an additive recurrence, whose steps
    are powers of the number g > 1 with g**(d + 1) = g + 1 (Roberts, The unreasonable effectiveness of quasirandom
    sequences, 2018)."""
    g = 2.0
    for _ in range(60):
        g = (1.0 + g) ** (1.0 / (d + 1))
    steps = g ** -np.arange(1.0, d + 1.0)
    points: Floats = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return points


def _telling(path: ToolPath) -> Indices:
    """Records to begin with: those farthest out in many directions, by tip and by holder, and some in between."""
    count = len(path)
    if count <= _FEW:
        return np.arange(count)
    ways = np.array([w for w in np.ndindex(3, 3, 3) if w != (1, 1, 1)]) - 1.0
    parts = [_evenly(count, _EVEN)]
    for points in (path.tip, path.tip + _LEVER * path.axis):
        parts.append((points @ ways.T).argmax(axis=0))
    if path.turns is not None:
        parts += [path.turns.argmin(axis=0), path.turns.argmax(axis=0)]
    return np.unique(np.concatenate(parts))


def _evenly(count: int, wanted: int) -> Indices:
    return np.unique(np.linspace(0, count - 1, wanted).astype(np.int64))
