"""The search for the best placement: maxima at few records of a path, to which the worst of all records are added."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Indices, Progress
from ...performance.search import pick_best_apart
from ..path import ToolPath
from .margins import PlacementMargins, PlacementScore
from .maximin import LocalMaximum, find_local_maximum, score_rows

_SPREAD, _STARTS = 384, 10  # placements spread over the bounds, and those of them to climb from
_APART = 0.1  # of the bounds
_STEPS = 20  # of a climb
_STEPS_AGAIN, _TRUST_AGAIN = 40, 0.05  # the same from a maximum after records are added
_ROUNDS = 80  # of computing the whole path
_AGREED = 1e-6  # of half a range: the whole path against the records looked at
_EVEN, _FEW = 24, 60  # records to begin with; a path of no more is looked at as a whole
_TRACK = 2000  # records along which joints are followed
_LEVER = 200.0  # mm along the tool's axis: orientations count as the way of a point so far up
_BESIDE = 0.02  # of half a range: limits as near to the tightest have their worst records added, too


class PlacementSearch:
    """A search in one working mode.

    Placements spread over the bounds are computed, and the best of them climbed from, at a few records. Those of the
    whole path that turn out worse are then added, until the least margin over these is that over all.

    records : those looked at, ascending
    track : those along which their joints go on, None at first: see :meth:`~.margins.PlacementMargins.compute_rows`
    tried : how many placements were computed
    """

    def __init__(self, margins: PlacementMargins, report: Progress):
        self.margins, self.report = margins, report
        self.records = _choose_records(margins.path)
        self.track: Indices | None = None
        self.tried = 0

    def run(self) -> list[tuple[Array, PlacementScore]]:
        """Find the best point, and its score over the whole path; then the other local maxima, the best first."""
        best, others = self._settle(self._find_local_maxima(0.0, 0.5))
        apart = [point for point in others if len(point) and np.abs(point - best[0]).max() > _APART]
        scored = [(point, self.margins.score_placement(point)) for point in apart]
        self.tried += len(scored)
        return [best, *sorted(scored, key=lambda pair: -pair[1].worth)]

    def _compute_rows(self, points: Array) -> tuple[Array, Array]:
        self.tried += len(points)
        return self.margins.compute_rows(points, self.records, self.track)

    def _find_local_maxima(self, begin: float, end: float) -> list[LocalMaximum]:
        """Find local maxima over the records looked at; ``begin`` and ``end`` are of the progress."""
        d = len(self.margins.axes)
        points = _spread_points(_SPREAD, d) if d else np.empty((1, 0))
        batches = np.array_split(points, range(32, len(points), 32))
        worths = np.concatenate([score_rows(*self._compute_rows(batch)) for batch in batches])
        starts = pick_best_apart(points, worths, _STARTS, np.full(d, _APART)) if d else np.zeros(1, np.int64)
        maxima = []
        for number, start in enumerate(starts.tolist(), 1):
            maxima.append(find_local_maximum(self._compute_rows, points[start], _STEPS))
            self.report(begin + (end - begin) * (0.3 + 0.7 * number / len(starts)))
        return maxima

    def _settle(self, maxima: list[LocalMaximum]) -> tuple[tuple[Array, PlacementScore], list[Array]]:
        """Find the best local maximum over the whole path, and all; add records until the most promising one holds."""
        best: tuple[Array, PlacementScore] | None = None
        for attempt in range(_ROUNDS):
            maxima.sort(key=lambda maximum: (-round(maximum.worth, 9), -maximum.rest))
            point, worth, rest = maxima[0]
            score = self.margins.score_placement(point)
            self.tried += 1
            if best is None or score.worth > best[1].worth + _AGREED:
                best = point, score
            self.report((0.5 if self.track is None else 0.8) + 0.2 * (1.0 - 0.9**attempt))
            if best[1].worth >= worth - _AGREED:
                break
            worse = np.setdiff1d(score.records[score.margins < max(worth, 0.0) + _BESIDE], self.records)
            if len(worse):
                self.records = np.union1d(self.records, worse)
                if self.track is not None:
                    self.track = np.union1d(self.track, worse)
            elif self.track is None:
                self.track = np.union1d(_space_evenly(len(self.margins.path), _TRACK), self.records)
                maxima = [find_local_maximum(self._compute_rows, point, _STEPS), *self._find_local_maxima(0.5, 0.8)]
                continue
            else:
                maxima[0] = LocalMaximum(point, score.worth, rest)  # more records would add nothing to it
                continue
            maxima = [find_local_maximum(self._compute_rows, maximum.point, 0) for maximum in maxima]
            index = max(range(len(maxima)), key=lambda i: maxima[i].worth)
            maxima[index] = find_local_maximum(self._compute_rows, maxima[index].point, _STEPS_AGAIN, _TRUST_AGAIN)
        assert best is not None
        return best, [maximum.point for maximum in maxima]


def _spread_points(count: int, d: int) -> Array:
    """Spread points (count, d) evenly over the unit box, the first in its middle, by an additive recurrence.

    Its steps are powers of the number g > 1 with g**(d + 1) = g + 1 (Roberts, The unreasonable effectiveness of
    quasirandom sequences, 2018).
    """
    g = 2.0
    for _ in range(60):
        g = (1.0 + g) ** (1.0 / (d + 1))
    steps = g ** -np.arange(1.0, d + 1.0)
    points: Array = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return points


def _choose_records(path: ToolPath) -> Indices:
    """Choose records to begin with: those farthest out in many directions, by tip and holder, and some in between."""
    count = len(path)
    if count <= _FEW:
        return np.arange(count)
    directions = np.array([direction for direction in np.ndindex(3, 3, 3) if direction != (1, 1, 1)]) - 1.0
    records = [_space_evenly(count, _EVEN)]
    for points in (path.tip, path.tip + _LEVER * path.axis):
        records.append((points @ directions.T).argmax(axis=0))
    if path.turns is not None:
        records += [path.turns.argmin(axis=0), path.turns.argmax(axis=0)]
    return np.unique(np.concatenate(records))


def _space_evenly(count: int, wanted: int) -> Indices:
    return np.unique(np.linspace(0, count - 1, wanted).astype(np.int64))
