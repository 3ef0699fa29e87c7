"""What bracketing a path's motions has told so far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..path import Floats
from .motions import Indices
from .sections import Flags


@dataclass
class Tally:
    """What is known of one limit broken between records.

    count : motions whose ends keep it
    motion, share : the first of them, and a place on it where it is broken
    margin, worst, at : the least margin seen, the motion and the share where
    """

    count: int = 0
    motion: int = -1
    share: float = 1.0
    margin: float = np.inf
    worst: int = -1
    at: float = 1.0

    def see(self, motion: Indices, share: Floats, margin: Floats) -> None:
        """Margins at places on motions."""
        if len(margin):
            i = int(np.argmin(margin))
            if margin[i] < self.margin:
                self.margin, self.worst, self.at = float(margin[i]), int(motion[i]), float(share[i])


@dataclass(frozen=True)
class Jump:
    """A turning joint that can't go on from record to record.

    motion, share : where
    by, told : rad, how far it would have to jump there, and how far it goes from record to record
    beside : rad that the tool passes beside the joint's axis, where it changes head and table's working mode; None
        where turns are counted wrong
    """

    motion: int
    share: float
    joint: int
    by: float
    told: float
    beside: float | None


@dataclass(frozen=True, eq=False)
class Ledger:
    """Of some motions, (n, columns): what is still to be shown of them, what is broken, and a share where it is; and
    (n,) how often they were cut."""

    need: Flags
    broken: Flags
    share: Floats
    cuts: Indices

    @staticmethod
    def of(need: Flags) -> Ledger:
        return Ledger(need, np.zeros(need.shape, bool), np.ones(need.shape), np.zeros(len(need), np.int64))

    def found(self, number: Indices, column: int, share: Floats) -> None:
        """A column is broken on motions."""
        new = ~self.broken[number, column]
        self.share[number[new], column] = share[new]
        self.broken[number, column] = True
        self.need[number, column] = False
