"""The fewest cuts of motions whose spans keep to the tolerances: a search makes each span as long as it may be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.rotations import compute_rotations
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath
from .continuation import PosedPoints, continue_points, continue_turned_points, find_matching_poses
from .deviation import Deviation, MotionSpans

_SHARES: Array = (np.arange(5, dtype=np.float64) + 1.0) / 6.0  # of a span, at which its deviation is measured here
_FULL = 0.992  # of the tolerance: what a span may take at _SHARES, for the worst point may lie between them
_NEARLY = 0.998  # of the greatest length or deviation: as much is not improved any further
_SHORTEST = 1e-9  # of a motion
_ROUNDS = 60
_UNEVEN = 0.37  # of a motion: a share at which only poses that go evenly are even
_MOST_CUTS = 20000  # of a motion


@dataclass(frozen=True, eq=False)
class PathPositions:
    """Where the records of a posted path stand on the programmed one: the span that leads to each of n records.

    record, begin, end : (n,) the programmed motion, by the record it leads to, and the shares where the span begins and
        ends
    """

    record: Indices
    begin: Array
    end: Array

    @classmethod
    def at_records(cls, count: int) -> PathPositions:
        """Return the positions of the programmed records themselves."""
        return cls(np.arange(count), np.zeros(count), np.ones(count))

    @property
    def passed(self) -> Array:
        """How many programmed motions lie behind each record, with their shares, (n,)."""
        return self.record - 1 + self.end

    def insert(self, motion: Indices, share: Array) -> PathPositions:
        """Insert records into motions, in order, at shares of what they are here."""
        at = self.begin[motion] + share * (self.end[motion] - self.begin[motion])
        record = np.insert(self.record, motion, self.record[motion])
        end = np.insert(self.end, motion, at)
        begin = np.concatenate([[0.0], np.where(record[1:] == record[:-1], end[:-1], 0.0)])
        return PathPositions(record, begin, end)

    def compose(self, inner: PathPositions) -> PathPositions:
        """Return where records stand whose ``inner`` positions are told on the path whose positions these are."""
        at = inner.record
        begin, width = self.begin[at], self.end[at] - self.begin[at]
        return PathPositions(self.record[at], begin + inner.begin * width, begin + inner.end * width)

    def find_passed(self, inner: float) -> float:
        """Find how many programmed motions lie behind a place on the path whose positions these are."""
        return float(np.interp(inner, np.arange(len(self.record)), self.passed))


def select_spans(posted: Posted, positions: PathPositions, motion: Indices) -> MotionSpans:
    """Return whole motions of a posted path as spans."""
    first, last = (PosedPoints(posted.poses[record], posted.joints[record]) for record in (motion - 1, motion))
    return MotionSpans(positions.record[motion], positions.begin[motion], positions.end[motion], first, last)


@dataclass(frozen=True, eq=False)
class PathCuts:
    """Shares at which motions are cut, in order, and the motions on which a span can't be kept however short."""

    motion: Indices
    share: Array
    stuck: Indices

    @classmethod
    def sort(cls, motion: Indices, share: Array, stuck: Indices) -> PathCuts:
        """Sort cuts by motion and share."""
        order = np.lexsort((share, motion))
        return cls(motion[order], share[order], stuck)


def find_cuts(deviation: Deviation, posted: Posted, positions: PathPositions, motion: Indices) -> PathCuts:
    """Find the fewest cuts of motions of a posted path: every span ends as far on as its deviation allows.

    Where the path leads out of reach the last cut is out of reach too, and the rest of the motion is left as it is.
    """
    search = _CutSearch(deviation, posted, positions, motion)
    motions, shares = [np.empty(0, np.int64)], [np.empty(0)]
    stuck = [np.empty(0, np.int64)]
    for _ in range(_MOST_CUTS):
        search.drop(search.try_spans(np.ones(len(search.motion)))[1] <= _FULL)
        if not len(search.motion):
            break
        share, points = search.find_longest_spans()
        unreachable = ~np.isfinite(points.joints).all(1)
        unmoved = share - search.share < _SHORTEST
        stuck.append(search.motion[unmoved & ~unreachable])
        motions.append(search.motion[~unmoved | unreachable])
        shares.append(share[~unmoved | unreachable])
        search.advance(share, points, ~(unmoved | unreachable))
    stuck.append(search.motion)
    cuts = PathCuts.sort(np.concatenate(motions), np.concatenate(shares), np.concatenate(stuck))
    wavering = motion[deviation.find_wavering(select_spans(posted, positions, motion), _SHARES)]
    for each in np.setdiff1d(wavering, cuts.stuck):
        own = np.flatnonzero(cuts.motion == each)
        cuts.share[own] = _spread_cuts(cuts.share[own])
    return cuts


def _spread_cuts(share: Array) -> Array:
    """Spread cuts of a motion (k,) evenly over its spans, the last of which is shorter than they need be.

    Records whose distances jump make joints tremble where a path is rounded over whole motions.
    """
    ends = np.concatenate([[0.0], share, [1.0]])
    last = min(1.0, (ends[-1] - ends[-2]) / (ends[-2] - ends[-3])) if len(share) else 1.0
    places = np.append(np.arange(len(share) + 1.0), len(share) + last)
    spread: Array = np.interp(places[-1] * np.arange(1, len(share) + 1) / (len(share) + 1), places, ends)
    return spread


class _CutSearch:
    """The search for cuts of motions (m,), with the shares (m,) up to which they are cut and the points there."""

    def __init__(self, deviation: Deviation, posted: Posted, positions: PathPositions, motion: Indices):
        self.deviation, self.posted, self.positions, self.motion = deviation, posted, positions, motion
        known = deviation.programmed
        self.path = known if known.path is posted.path else ProgrammedPath(posted.path, posted.frame)
        self.share = np.zeros(len(motion))
        self.points = PosedPoints(posted.poses[motion - 1], posted.joints[motion - 1])

    def drop(self, done: Flags) -> None:
        """Leave out motions that need no further cut."""
        self.motion, self.share, self.points = self.motion[~done], self.share[~done], self.points[~done]

    def advance(self, share: Array, points: PosedPoints, going: Flags) -> None:
        """Cut the motions at shares, and go on with some of them."""
        self.share, self.points = share, points
        self.drop(~going)

    def try_spans(self, share: Array, rows: slice | Indices = slice(None)) -> tuple[PosedPoints, Array]:
        """Compute the points at shares of some motions, and the deviations, in tolerances, of the spans up to them."""
        motion, cut, first = self.motion[rows], self.share[rows], self.points[rows]
        last = self._compute_points(motion, share, first)
        begin, length = self.positions.begin[motion], (self.positions.end - self.positions.begin)[motion]
        spans = MotionSpans(self.positions.record[motion], begin + cut * length, begin + share * length, first, last)
        return last, self.deviation.measure_spans(spans, _SHARES)

    def _compute_points(self, motion: Indices, share: Array, first: PosedPoints) -> PosedPoints:
        machine, mode = self.posted.machine, self.posted.mode
        turns = self.path.interpolate_turns(motion, share)
        tip, axis = self.path.interpolate(motion, share)
        if turns is None:
            return continue_points(machine, mode, tip, axis, first)
        rotation = self.path.rotation @ compute_rotations(turns)
        even = np.where(self._even_motions[motion][:, None], self._interpolate_poses(motion, share), np.nan)
        return continue_turned_points(machine, mode, tip, rotation, even, first)

    @cached_property
    def _even_motions(self) -> Flags:
        """(n,) motions on which the pose's angles are those of a program, and go evenly with them."""
        motion = np.arange(1, len(self.posted.path))
        share = np.full(len(motion), _UNEVEN)
        turns = self.path.interpolate_turns(motion, share)
        if turns is None:
            return np.zeros(len(self.posted.path), np.bool_)
        poses, rotation = self._interpolate_poses(motion, share), self.path.rotation @ compute_rotations(turns)
        return np.append(False, find_matching_poses(self.posted.machine, poses, rotation))

    def _interpolate_poses(self, motion: Indices, share: Array) -> Array:
        begin = self.posted.poses[motion - 1]
        return begin + share[:, None] * (self.posted.poses[motion] - begin)

    def find_longest_spans(self) -> tuple[Array, PosedPoints]:
        """Find the shares where the longest good spans end, and the points there, by bracketing.

        Where no span is good these are the last ones tried. The deviation grows with a power of the length, which two
        trials on either side of the tolerance tell.
        """
        count = len(self.motion)
        low, high = self.share.copy(), np.ones(count)
        good, bad = np.zeros(count), np.full(count, np.inf)
        points = self.points.copy()
        rows = np.arange(count)
        for _ in range(_ROUNDS):
            share = _guess_shares(low[rows], high[rows], good[rows], bad[rows], self.share[rows])
            last, ratio = self.try_spans(share, rows)
            fits = ratio <= _FULL
            unmoved = low[rows] == self.share[rows]
            kept = fits | unmoved  # the last trial stands for no good span, and tells whether it is out of reach
            points.assign(rows[kept], last[kept])
            low[rows[fits]], good[rows[fits]] = share[fits], ratio[fits]
            high[rows[~fits]], bad[rows[~fits]] = share[~fits], ratio[~fits]
            length, room = low - self.share, high - low
            done = (good >= _NEARLY * _FULL) | (room <= (1.0 - _NEARLY) * length) | (high - self.share < _SHORTEST)
            rows = rows[~done[rows]]
            if not len(rows):
                break
        return np.where(low > self.share, low, high), points


def _guess_shares(low: Array, high: Array, good: Array, bad: Array, begin: Array) -> Array:
    """Guess where spans that begin at ``begin`` reach the tolerance, within brackets low to high, (m,) each.

    good, bad : the deviations, in tolerances, of spans that end at ``low`` and ``high``; 0 and infinite if not known
    """
    goal = 0.5 * (1.0 + _NEARLY) * _FULL
    short, long = low - begin, high - begin
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(bad / good) / np.log(long / short)
        inner = short * (goal / good) ** (1.0 / power)
        outer = long * np.sqrt(goal / bad)
    length = np.where(good > 0.0, inner, outer)
    length = np.where(np.isfinite(length) & (length > 0.0), length, 0.5 * (short + long))
    room = long - short
    edge = np.where(good > 0.0, 1e-4, 0.02)  # of the bracket: a trial keeps off its ends, so that it always shrinks
    share: Array = begin + np.clip(length, short + edge * room, long - 0.02 * room)
    return share
