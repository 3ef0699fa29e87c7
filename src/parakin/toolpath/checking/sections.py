"""Parts of motions, and what is proved of every place on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import ASIDE, LEEWAY, PROVED
from ...performance.certified.margin_rates import Variation
from ..path import Floats
from .motions import EITHER, ONE, OTHER, Indices, Motions, Places, machine_size

Flags = NDArray[np.bool_]

RELATIVE = 1e-9  # of a limit's size: a margin no farther below 0 counts as kept
_FINEST = 2.0**-30  # of a motion: no part is shorter
_SHORT, _NARROW = 1e-7, 1e-9  # mm and rad: a part shorter than both is not cut
_FREE = np.sin(PROVED) ** 2
_HALF, _TURN = np.pi, 2.0 * np.pi
_CLOSE = 1e-6  # rad, of joints and what is known of them
_AT_ONCE = 4096  # boxes


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of motions, n of them, from share a to share b.

    number : (n,) of the motion in some list of them, for what is kept of each
    start, end : the places at a and b
    """

    number: Indices
    motion: Indices
    a: Floats
    b: Floats
    start: Places
    end: Places

    def __len__(self) -> int:
        return len(self.motion)

    def take(self, which: Flags | Indices) -> Parts:
        start, end = self.start.take(which), self.end.take(which)
        return Parts(self.number[which], self.motion[which], self.a[which], self.b[which], start, end)

    def cut(self, share: Floats, there: Places) -> tuple[Parts, Parts]:
        """Every part in two at places within."""
        return replace(self, b=share, end=there), replace(self, a=share, start=there)

    def pieces(self, share: Floats, there: Places) -> Parts:
        """A single part in many, at places within, in order."""
        count = len(share)
        alike = np.zeros(count + 1, np.int64)
        start, end = self.start.joined(there), there.joined(self.end)
        a, b = np.concatenate([self.a, share]), np.concatenate([share, self.b])
        return Parts(self.number[alike], self.motion[alike], a, b, start, end)

    def halved(self, share: Floats, there: Places) -> Parts:
        """As :meth:`cut`, all parts together."""
        left, right = self.cut(share, there)
        number, motion = np.tile(self.number, 2), np.tile(self.motion, 2)
        a, b = np.concatenate([self.a, share]), np.concatenate([share, self.b])
        return Parts(number, motion, a, b, left.start.joined(right.start), left.end.joined(right.end))


@dataclass(frozen=True, eq=False)
class Bounds:
    """What holds all over some parts, or runs of motions.

    least : (n, limits) no margin is less anywhere
    counted : (n,) every turning joint goes from its value at the start to that at the end without a jump
    """

    least: Floats
    counted: Flags


class Prover:
    """Bounds of the limits' margins over parts of motions and over runs of them, by intervals."""

    def __init__(self, motions: Motions):
        self.motions = motions
        machine = motions.machine
        self.variations = [Variation(machine, mode) for mode in motions.modes]
        names = list(machine.limits)
        drives = machine.drives
        self._ends = {  # of each turning joint: the columns of its limits
            i: [
                names.index(f"{drives[i].name}.{side}")
                for side in ("min", "max")
                if f"{drives[i].name}.{side}" in names
            ]
            for i in motions.turning
        }
        self._by_value = np.ones(len(names), bool)  # but for what counts turns
        for columns in self._ends.values():
            self._by_value[columns] = False
        size = machine_size(machine)
        sizes = {"mm": size, "rad": 1.0, "1": 1.0, "mm²": size * size}
        self._size = size
        self._aside = 2.0 * ASIDE * np.array([sizes[limit.unit] for limit in machine.limit_parts])
        self.tolerance = RELATIVE * np.array([sizes[limit.unit] for limit in machine.limit_parts])
        self.boxes = 0  # bounded, so that the work can be told

    def _split(self, sign: NDArray[np.int8]) -> list[tuple[Variation, Indices]]:
        """The rows to bound with each working mode; those that change it are in none."""
        groups = [(self.variations[0], np.flatnonzero(sign == ONE))]
        if len(self.variations) > 1:
            groups.append((self.variations[1], np.flatnonzero(sign == OTHER)))
        return [(v, rows[i : i + _AT_ONCE]) for v, rows in groups for i in range(0, len(rows), _AT_ONCE)]

    def over(self, parts: Parts) -> Bounds:
        """Bounds over parts, from both ends."""
        p0, p1, m0, m1 = parts.start.poses, parts.end.poses, parts.start.margins, parts.end.margins
        low, high, step = np.minimum(p0, p1), np.maximum(p0, p1), p1 - p0
        change = (parts.end.joints - parts.start.joints)[:, self.motions.turning]
        least, count = np.full(m0.shape, -np.inf), m0.shape[1]
        counted = np.zeros(len(parts), bool)
        low, high, sign, aside = self._beside(parts, low, high)
        self.boxes += len(parts)
        for variation, rows in self._split(sign):
            down, up = variation.rates(low[rows], high[rows])
            d = step[rows][:, None, :]
            down, up = np.minimum(down * d, up * d).sum(2), np.maximum(down * d, up * d).sum(2)
            least[rows] = from_ends(m0[rows], m1[rows], down[:, :count], up[:, :count])
            counted[rows] = within(change[rows], change[rows], down[:, count:], up[:, count:], _TURN)
        least[aside] -= self._aside * (np.linalg.norm(step[aside], axis=1) / self._size)[:, None]
        free = self._by_values(low, high, sign, least, aside)
        between = np.minimum(m0, m1)
        self._where_free(free, between, np.abs(change), least, counted)
        return Bounds(least, counted)

    def over_runs(
        self, at: Places, sign: NDArray[np.int8], low: Floats, high: Floats, q: tuple[Floats, Floats]
    ) -> Bounds:
        """Bounds over runs of motions in boxes [low, high] of poses, of which ``at`` is one; ``q`` are the least and
        the greatest of all joints at their records."""
        turning, count = self.motions.turning, at.margins.shape[1]
        below, above = (low - at.poses)[:, None, :], (high - at.poses)[:, None, :]
        q_low, q_high = (end[:, turning] - at.joints[:, turning] for end in q)
        least, counted = np.full(at.margins.shape, -np.inf), np.zeros(len(low), bool)
        still = (at.sign == EITHER) & self._still(q[1] - q[0])
        low, high, sign, aside = self._beside_the_pole(at, still, low, high, sign)
        self.boxes += len(low)
        for variation, rows in self._split(sign):
            down, up = variation.rates(low[rows], high[rows])
            b, a = below[rows], above[rows]
            down, up = np.minimum(down * a, up * b).sum(2), np.maximum(up * a, down * b).sum(2)
            least[rows] = at.margins[rows] + down[:, :count]
            counted[rows] = within(q_low[rows], q_high[rows], down[:, count:], up[:, count:], _HALF)
        least[aside] -= self._aside
        free = self._by_values(low, high, sign, least, aside)
        drives, between = self.motions.machine.drives, np.full(least.shape, -np.inf)
        for i, columns in self._ends.items():
            for column in columns:
                is_min = self.motions.machine.limits[column].endswith(".min")
                between[:, column] = q[0][:, i] - drives[i].low if is_min else drives[i].high - q[1][:, i]
        self._where_free(free, between, q_high - q_low, least, counted)
        return Bounds(least, counted)

    def _still(self, change: Floats) -> Flags:
        """(n,) where head and table don't turn."""
        return np.asarray((np.abs(change[:, self.motions.serial]) <= _CLOSE).all(1))

    def _beside(self, parts: Parts, low: Floats, high: Floats) -> tuple[Floats, Floats, NDArray[np.int8], Indices]:
        start, end = parts.start, parts.end
        still = (start.sign == EITHER) & (end.sign == EITHER) & self._still(end.joints - start.joints)
        return self._beside_the_pole(start, still, low, high, together(start.sign, end.sign))

    def _beside_the_pole(
        self, at: Places, still: Flags, low: Floats, high: Floats, sign: NDArray[np.int8]
    ) -> tuple[Floats, Floats, NDArray[np.int8], Indices]:
        """Boxes and working modes with those taken a little off the pole, whose rows come with them, in which head and
        table stand ``still`` on it: there the pose does not tell the first turn, which all else hangs on with a table.
        """
        turns = [i for i, unit in enumerate(self.motions.machine.axis_units) if unit == "rad"]
        rows = np.flatnonzero(still & (low[:, turns] == high[:, turns]).all(1))
        if self.motions.wrist is None or not len(rows):
            return low, high, sign, rows[:0]
        joints = at.joints[rows].copy()
        joints[:, self.motions.wrist.second] += ASIDE
        found = self.motions.machine.forward(joints, near=at.poses[rows])
        good = np.flatnonzero(found.converged)
        rows, poses = rows[good], found.poses[good]
        low, high, sign = low.copy(), high.copy(), sign.copy()
        low[np.ix_(rows, np.array(turns))] = high[np.ix_(rows, np.array(turns))] = poses[:, turns]
        sign[rows] = self.motions.signs(poses, joints[good])
        return low, high, sign, rows

    def _by_values(self, low: Floats, high: Floats, sign: NDArray[np.int8], least: Floats, aside: Indices) -> Flags:
        """Raise ``least`` by the margins' own bounds; returns where the first turn of head and table is free."""
        worst, freedom = np.full(least.shape, np.inf), np.zeros(len(low))
        for number, variation in enumerate(self.variations):
            rows = np.flatnonzero((sign == number) | (sign == EITHER))
            down, up = variation.least(low[rows], high[rows])
            worst[rows], freedom[rows] = np.minimum(worst[rows], down), np.maximum(freedom[rows], up)
        worst[aside] -= self._aside
        np.maximum(least, worst, out=least, where=self._by_value & ~np.isnan(worst))
        return freedom <= _FREE if self.motions.wrist is not None else np.zeros(len(low), bool)

    def _where_free(self, free: Flags, between: Floats, change: Floats, least: Floats, counted: Flags) -> None:
        """Where the tool stands along the first turn, both turns go straight from value to value."""
        rows = np.flatnonzero(free)
        for i in self.motions.serial:
            for column in self._ends[i]:
                least[rows, column] = np.fmax(least[rows, column], between[rows, column] - LEEWAY)
        counted[rows] |= (change[rows] < 1.5 * _HALF).all(1)

    def regular(self, parts: Parts) -> Flags:
        """(n,) where no parallel singularity can be on a part."""
        p0, p1 = parts.start.poses, parts.end.poses
        low, high, sign, _ = self._beside(parts, np.minimum(p0, p1), np.maximum(p0, p1))
        return self.regular_in(low, high, sign)

    def regular_in(self, low: Floats, high: Floats, sign: NDArray[np.int8]) -> Flags:
        regular = np.ones(len(low), bool)
        for number, variation in enumerate(self.variations):
            rows = np.flatnonzero((sign == number) | (sign == EITHER))
            for i in range(0, len(rows), _AT_ONCE):
                some = rows[i : i + _AT_ONCE]
                regular[some] &= variation.regular(low[some], high[some])
        return regular

    def finest(self, parts: Parts) -> Flags:
        """(n,) where parts are too short to be cut."""
        step = np.abs(parts.end.poses - parts.start.poses)
        short = [_SHORT if unit == "mm" else _NARROW for unit in self.motions.machine.axis_units]
        return np.asarray((step < short).all(1) | (parts.b - parts.a <= _FINEST))


def together(one: NDArray[np.int8], two: NDArray[np.int8]) -> NDArray[np.int8]:
    """The working mode that holds from place to place; EITHER where it changes on the way."""
    same = np.where(one == EITHER, two, one)
    same = np.where((two != EITHER) & (two != same), EITHER, same)
    return np.where((one == EITHER) & (two == EITHER), ONE, same).astype(np.int8)


def from_ends(m0: Floats, m1: Floats, down: Floats, up: Floats) -> Floats:
    """What a value is at least on the way from m0 to m1, if its rate by the share of the way is in [down, up]: at
    t ≥ m0 + down·t and ≥ m1 - up·(1 - t)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.clip((m0 - m1 + up) / (up - down), 0.0, 1.0)
        return np.where(down >= 0.0, m0, np.where(up <= 0.0, m1, m0 + down * t))


def within(low: Floats, high: Floats, down: Floats, up: Floats, turn: float) -> Flags:
    """(n,) where changes from ``low`` to ``high`` lie in [down, up], and this is narrow enough to tell turns by."""
    inside = (low >= down - _CLOSE) & (high <= up + _CLOSE) & (up - down < turn)
    return np.asarray(inside.all(1))
