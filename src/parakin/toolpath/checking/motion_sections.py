"""Sections of motions, which bisection halves until each is proved to keep its limits or found to break one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags, Indices
from .motions import MotionPoints


@dataclass(frozen=True, eq=False)
class Sections:
    """n sections of motions, from one share of a motion to another.

    number : (n,) of the motion in the list of motions under proof
    motion : (n,) by the record that it leads to
    begin, end : (n,) shares of the motion
    first, last : the points there
    """

    number: Indices
    motion: Indices
    begin: Array
    end: Array
    first: MotionPoints
    last: MotionPoints

    def __len__(self) -> int:
        return len(self.motion)

    @property
    def middle(self) -> Array:
        """Shares half way, (n,)."""
        return 0.5 * (self.begin + self.end)

    def select(self, which: Flags | Indices) -> Sections:
        """Return some of the sections."""
        first, last = self.first.select(which), self.last.select(which)
        return Sections(self.number[which], self.motion[which], self.begin[which], self.end[which], first, last)

    def halve(self, share: Array, points: MotionPoints) -> Sections:
        """Cut every section in two at a share within it, where its point is given: the front halves, then the rear."""
        number, motion = np.tile(self.number, 2), np.tile(self.motion, 2)
        begin, end = np.concatenate([self.begin, share]), np.concatenate([share, self.end])
        return Sections(number, motion, begin, end, self.first.append(points), points.append(self.last))

    def divide(self, share: Array, points: MotionPoints) -> Sections:
        """Cut a single section at ascending shares (k,) within it into k + 1 in order."""
        alike = np.zeros(len(share) + 1, np.int64)
        begin, end = np.concatenate([self.begin, share]), np.concatenate([share, self.end])
        first, last = self.first.append(points), points.append(self.last)
        return Sections(self.number[alike], self.motion[alike], begin, end, first, last)
