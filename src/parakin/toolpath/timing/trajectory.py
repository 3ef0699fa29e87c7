"""A time law along a tool path: as fast as feed and drives allow, and never faster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..path import Floats
from ..posting.posted import Posted
from .corners import Curve, Indices, checked
from .joint_path import Course

if TYPE_CHECKING:
    from .setpoints import Setpoints


@dataclass(frozen=True, eq=False)
class Pace:
    """ṡ and what is with it along a course, in p pieces of constant s⃛; none reaches over a row.

    time : (p + 1,) s, at which pieces begin and the last one ends
    cell, shift : (p,) the row before a piece's start, and mm from it
    speed, rise, jerk : (p,) ṡ, s̈ and s⃛ at a piece's start
    passed : (rows,) s, when each row is passed
    """

    time: Floats
    cell: Indices
    shift: Floats
    speed: Floats
    rise: Floats
    jerk: Floats
    passed: Floats


@dataclass(frozen=True, eq=False)
class Law:
    """When a machine is where on a tool path of n records. Lengths are mm, angles rad, times s.

    posted : what was planned
    curve : the tool's path with its corners, rounded or not
    course : the joints along it, by rows
    pace : the speed along it
    binding : (rows,) what limits the speed at each row, an index into ``names``
    names : ``feed``, then for each joint ``d1.speed``, ``d1.acceleration``, ``d1.jerk``, and ``start/stop``
    """

    posted: Posted
    curve: Curve
    course: Course
    pace: Pace
    binding: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """The cycle time."""
        return float(self.pace.time[-1])

    @cached_property
    def times(self) -> Floats:
        """(n,) when each record is passed; at a rounded corner where the tool is nearest to it."""
        first = np.searchsorted(self.course.segment, np.arange(len(self.curve.length)))
        return np.append(self.pace.passed[first], self.pace.passed[-1])[self.curve.place]

    @cached_property
    def shares(self) -> dict[str, float]:
        """The share of the cycle time in which each limit binds, the greatest first; without those that never do."""
        spans = np.diff(self.pace.passed)
        near = 0.5 * (np.append(spans, 0.0) + np.append(0.0, spans))
        sums = np.bincount(self.binding, near, len(self.names)) / (self.seconds or 1.0)
        return {self.names[i]: float(sums[i]) for i in np.argsort(-sums, kind="stable") if sums[i] > 0.0}

    def at(self, times: ArrayLike) -> Setpoints:
        """Setpoints at times (k,); before the start and after the end the machine stands still."""
        from .setpoints import setpoints

        return setpoints(self, np.atleast_1d(np.asarray(times, np.float64)))

    def sampled(self, rate: float) -> Setpoints:
        """Setpoints at ``rate`` Hz, from the start to the first one at which the motion is over."""
        count = int(np.ceil(self.seconds * checked(rate, "rate") - 1e-9)) + 1
        return self.at(np.arange(count) / rate)


def names_of(joints: Sequence[str]) -> tuple[str, ...]:
    """The names of all that can bind."""
    kinds = ("speed", "acceleration", "jerk")
    return ("feed", *(f"{joint}.{kind}" for kind in kinds for joint in joints), "start/stop")
