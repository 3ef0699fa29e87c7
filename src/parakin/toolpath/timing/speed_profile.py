"""A speed profile: the speed along a joint path as a function of time, in pieces of constant jerk."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Indices


class SpeedProfile(NamedTuple):
    """The motion s(t) along a joint path, in p pieces of constant s⃛; no piece reaches over a row.

    time : (p + 1,) s, when each piece begins, and when the last one ends
    row, shift : (p,) the last row before a piece's start, and mm of s from it
    speed, acceleration, jerk : (p,) ṡ, s̈ and s⃛ at a piece's start
    row_times : (rows,) s, when each row is passed
    """

    time: Array
    row: Indices
    shift: Array
    speed: Array
    acceleration: Array
    jerk: Array
    row_times: Array

    @staticmethod
    def allocate(pieces: int, rows: int) -> SpeedProfile:
        """Allocate a profile of so many ``pieces`` over so many ``rows``; its times are zero."""
        shift, speed, acceleration, jerk = (np.empty(pieces) for _ in range(4))
        return SpeedProfile(
            np.zeros(pieces + 1), np.empty(pieces, np.int64), shift, speed, acceleration, jerk, np.zeros(rows)
        )

    def cut(self, pieces: int) -> SpeedProfile:
        """Keep the first so many ``pieces`` only."""
        motion = (self.shift, self.speed, self.acceleration, self.jerk)
        shift, speed, acceleration, jerk = (column[:pieces] for column in motion)
        time, row = self.time[: pieces + 1], self.row[:pieces]
        return SpeedProfile(time, row, shift, speed, acceleration, jerk, self.row_times)

    def stretch(self, factor: float) -> SpeedProfile:
        """Stretch the profile in time by a ``factor`` that divides speeds, its square accelerations; for s⃛ = 0."""
        if factor == 1.0:
            return self
        speed, acceleration = self.speed / factor, self.acceleration / factor**2
        return self._replace(
            time=factor * self.time, speed=speed, acceleration=acceleration, row_times=factor * self.row_times
        )

    def stretch_pieces(self, factor: Array) -> SpeedProfile:
        """Stretch pieces in time by a ``factor`` each (p,), which may differ only where the motion stands still."""
        time = np.append(self.time[0], self.time[0] + np.cumsum(factor * np.diff(self.time)))
        speed, acceleration, jerk = self.speed / factor, self.acceleration / factor**2, self.jerk / factor**3
        row_times = np.interp(self.row_times, self.time, time)
        return self._replace(time=time, speed=speed, acceleration=acceleration, jerk=jerk, row_times=row_times)

    def at(self, times: Array) -> tuple[Indices, Array, Array, Array]:
        """Evaluate row, mm of s after the row, ṡ and s̈ at ``times`` (k,) s; outside the profile's time, at its ends."""
        piece = np.clip(np.searchsorted(self.time, times, "right") - 1, 0, len(self.row) - 1)
        t = np.clip(times, 0.0, self.time[-1]) - self.time[piece]
        v, a, e = self.speed[piece], self.acceleration[piece], self.jerk[piece]
        shift = self.shift[piece] + t * (v + t * (0.5 * a + t * e / 6.0))
        return self.row[piece], shift, v + t * (a + 0.5 * t * e), a + t * e

    def __repr__(self) -> str:
        return f"<parakin speed profile: {len(self.row)} pieces>"
