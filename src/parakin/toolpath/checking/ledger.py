"""What the bisection of a path's motions has proved and found: tallies of broken limits, a jump, open proofs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices


class WorstMargin(NamedTuple):
    """The least margin of a limit, with its motion (-1 where there is none) and share."""

    margin: float
    motion: int
    share: float


NO_WORST = WorstMargin(np.inf, -1, 1.0)


@dataclass
class Tally:
    """What is known of one limit that motions break between their records.

    count : motions that break it though their ends keep it
    motion, share : the first of these motions, and a share of it at which the limit is broken
    worst : the least margin computed so far
    """

    count: int = 0
    motion: int = -1
    share: float = 1.0
    worst: WorstMargin = NO_WORST

    def add_margins(self, motion: Indices, share: Array, margin: Array) -> None:
        """Keep the least of margins (n,) at shares (n,) of motions (n,)."""
        if len(margin):
            i = int(np.argmin(margin))
            if margin[i] < self.worst.margin:
                self.worst = WorstMargin(float(margin[i]), int(motion[i]), float(share[i]))


@dataclass(frozen=True)
class Jump:
    """A turning joint that can't go on from record to record.

    motion, share : where
    change : rad that the joint would have to jump there
    counted : rad that it goes from record to record by the records' own values
    off_axis : rad that the tool passes beside the joint's axis, where the wrist changes its working mode; None where
        turns are counted wrong
    """

    motion: int
    share: float
    joint: int
    change: float
    counted: float
    off_axis: float | None


@dataclass(frozen=True)
class Doubt:
    """What a motion could not be proved for when its bisection was given up.

    motion, share : where
    joint, turn : the turning joint that goes farthest on one of its sections, and by how many rad; None if all stand
    column, margin : the unproved limit of which least is left at the ends of its sections, and how much; None if all
        are proved
    """

    motion: int
    share: float
    joint: int | None
    turn: float
    column: int | None
    margin: float


@dataclass(frozen=True, eq=False)
class Ledger:
    """The state of the proofs of n motions, one column for each limit.

    unproved : (n, columns) what is still to be proved
    broken, share : (n, columns) what is broken, and a share of the motion at which it is
    cuts : (n,) how often the motion was cut
    """

    unproved: Flags
    broken: Flags
    share: Array
    cuts: Indices

    @classmethod
    def open_for(cls, unproved: Flags) -> Ledger:
        """Make the ledger of motions of which nothing is decided yet."""
        shape = unproved.shape
        return cls(unproved, np.zeros(shape, bool), np.ones(shape), np.zeros(len(unproved), np.int64))

    def mark_broken(self, number: Indices, column: int, share: Array) -> None:
        """Note that motions ``number`` break a column's limit at shares; the share noted first stays."""
        fresh = ~self.broken[number, column]
        self.share[number[fresh], column] = share[fresh]
        self.broken[number, column] = True
        self.unproved[number, column] = False
