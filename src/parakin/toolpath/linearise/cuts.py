"""Where motions have to be cut so that each part keeps to its tolerances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..path import Floats
from ..posting.posted import Posted
from ..posting.programmed_angles import compute_rotations
from .continuation import Rows, continued, has_turns, turned
from .deviation import Parts, Tube
from .interpolation import Flags, Indices, Programmed

SHARES: Floats = (np.arange(5, dtype=np.float64) + 1.0) / 6.0  # at which the parts tried are looked at
_FULL = 0.992  # of the tolerance: what a part may take there
_NEAR = 0.998  # of the greatest length or deviation: good enough
_SHORTEST = 1e-9  # of a motion
_ROUNDS = 60
_ANYWHERE = 0.37  # on a motion: a share at which only poses that go evenly are even
_MOST = 20000  # parts of a motion


@dataclass(frozen=True, eq=False)
class Places:
    """Where the records of a posted path stand on the programmed one: the part that leads to each of n records.

    record, begin, end : (n,) the programmed motion, by the record it leads to, and the shares where the part begins and
        ends
    """

    record: Indices
    begin: Floats
    end: Floats

    @staticmethod
    def of(count: int) -> Places:
        """Those of the programmed records themselves."""
        return Places(np.arange(count), np.zeros(count), np.ones(count))

    def cut(self, motion: Indices, share: Floats) -> Places:
        """With records put into motions, in order, at shares of what they are here."""
        at = self.begin[motion] + share * (self.end[motion] - self.begin[motion])
        record = np.insert(self.record, motion, self.record[motion])
        end = np.insert(self.end, motion, at)
        begin = np.concatenate([[0.0], np.where(record[1:] == record[:-1], end[:-1], 0.0)])
        return Places(record, begin, end)


def parts_of(posted: Posted, places: Places, motion: Indices) -> Parts:
    """Whole motions of a posted path."""
    first, last = (Rows(posted.poses[at], posted.joints[at]) for at in (motion - 1, motion))
    return Parts(places.record[motion], places.begin[motion], places.end[motion], first, last)


@dataclass(frozen=True, eq=False)
class Cuts:
    """Shares at which motions are cut, in order, and the motions of which a part can't be kept however short."""

    motion: Indices
    share: Floats
    stuck: Indices


def cuts(tube: Tube, posted: Posted, places: Places, motion: Indices) -> Cuts:
    """The fewest cuts of some motions of a posted path, each part as long as it may be.

    Where the path leads out of reach the last cut is out of reach too, and the rest of the motion is left as it is.
    """
    search = _Search(tube, posted, places, motion)
    found, stuck = [(np.empty(0, np.int64), np.empty(0))], [np.empty(0, np.int64)]
    for _ in range(_MOST):
        search.drop(search.tried(np.ones(len(search.motion)))[1] <= _FULL)
        if not len(search.motion):
            break
        share, rows = search.longest()
        lost = ~np.isfinite(rows.joints).all(1)
        still = share - search.at < _SHORTEST
        stuck.append(search.motion[still & ~lost])
        found.append((search.motion[~still | lost], share[~still | lost]))
        search = search.after(share, rows, ~(still | lost))
    stuck.append(search.motion)
    motions, shares = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.lexsort((shares, motions))
    return Cuts(motions[order], shares[order], np.concatenate(stuck))


class _Search:
    """Motions (m,) with the shares up to which they are cut, and the rows there."""

    def __init__(self, tube: Tube, posted: Posted, places: Places, motion: Indices):
        self.tube, self.posted, self.places, self.motion = tube, posted, places, motion
        known = tube.programmed
        self.path = known if known.path is posted.path else Programmed(posted.path, posted.frame)
        self.at = np.zeros(len(motion))
        self.rows = Rows(posted.poses[motion - 1], posted.joints[motion - 1])

    def drop(self, done: Flags) -> None:
        self.motion, self.at, self.rows = self.motion[~done], self.at[~done], self.rows[~done]

    def after(self, share: Floats, rows: Rows, going: Flags) -> _Search:
        """The same, cut at ``share``."""
        self.at, self.rows = share, rows
        self.drop(~going)
        return self

    def tried(self, share: Floats, some: slice | Indices = slice(None)) -> tuple[Rows, Floats]:
        """Rows at shares of some motions, and the deviation of the parts that lead there, in tolerances."""
        motion, at, first = self.motion[some], self.at[some], self.rows[some]
        last = self._rows(motion, share, first)
        begin, span = self.places.begin[motion], (self.places.end - self.places.begin)[motion]
        parts = Parts(self.places.record[motion], begin + at * span, begin + share * span, first, last)
        return last, self.tube.worst(parts, SHARES)

    def _rows(self, motion: Indices, share: Floats, first: Rows) -> Rows:
        machine, mode, turns = self.posted.machine, self.posted.mode, self.path.turns(motion, share)
        tip, axis = self.path.at(motion, share)
        if turns is None:
            return continued(machine, mode, tip, axis, first)
        rotation = self.path.rotation @ compute_rotations(turns)
        even = np.where(self.even[motion][:, None], self._between(motion, share), np.nan)
        return turned(machine, mode, tip, rotation, even, first)

    @cached_property
    def even(self) -> Flags:
        """(n,) motions on which the pose's angles are those of a program, and go evenly with them."""
        motion = np.arange(1, len(self.posted.path))
        share = np.full(len(motion), _ANYWHERE)
        turns = self.path.turns(motion, share)
        if turns is None:
            return np.zeros(len(self.posted.path), np.bool_)
        poses, rotation = self._between(motion, share), self.path.rotation @ compute_rotations(turns)
        return np.append(False, has_turns(self.posted.machine, poses, rotation))

    def _between(self, motion: Indices, share: Floats) -> Floats:
        begin = self.posted.poses[motion - 1]
        return begin + share[:, None] * (self.posted.poses[motion] - begin)

    def longest(self) -> tuple[Floats, Rows]:
        """The shares where the longest good parts end, and the rows there; with no good part, where it was tried last.

        The deviation grows with a power of the length, which two trials on either side of the tolerance tell.
        """
        count = len(self.motion)
        low, high = self.at.copy(), np.ones(count)
        good, bad = np.zeros(count), np.full(count, np.inf)
        rows = replace(self.rows, poses=self.rows.poses.copy(), joints=self.rows.joints.copy())
        open_ = np.arange(count)
        for _ in range(_ROUNDS):
            share = self._guess(low[open_], high[open_], good[open_], bad[open_], self.at[open_])
            last, ratio = self.tried(share, open_)
            fits = ratio <= _FULL
            unmoved = low[open_] == self.at[open_]
            kept = fits | unmoved  # what was tried last stands for no good part, and tells whether it is out of reach
            rows.put(open_[kept], last[kept])
            low[open_[fits]], good[open_[fits]] = share[fits], ratio[fits]
            high[open_[~fits]], bad[open_[~fits]] = share[~fits], ratio[~fits]
            length, room = low - self.at, high - low
            done = (good >= _NEAR * _FULL) | (room <= (1.0 - _NEAR) * length) | (high - self.at < _SHORTEST)
            open_ = open_[~done[open_]]
            if not len(open_):
                break
        return np.where(low > self.at, low, high), rows

    @staticmethod
    def _guess(low: Floats, high: Floats, good: Floats, bad: Floats, at: Floats) -> Floats:
        goal = 0.5 * (1.0 + _NEAR) * _FULL
        short, long = low - at, high - at
        with np.errstate(divide="ignore", invalid="ignore"):
            power = np.log(bad / good) / np.log(long / short)
            inner = short * (goal / good) ** (1.0 / power)
            outer = long * np.sqrt(goal / bad)
        length = np.where(good > 0.0, inner, outer)
        length = np.where(np.isfinite(length) & (length > 0.0), length, 0.5 * (short + long))
        room = long - short
        edge = np.where(good > 0.0, 1e-4, 0.02)
        share: Floats = at + np.clip(length, short + edge * room, long - 0.02 * room)
        return share
