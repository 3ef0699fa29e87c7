"""A speed profile: the speed along a joint path as a function of time, in pieces of constant jerk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Indices


@dataclass(frozen=True, eq=False)
class SpeedProfile:
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

    def at(self, times: Array) -> tuple[Indices, Array, Array, Array]:
        """Evaluate row, mm of s after the row, ṡ and s̈ at times (k,); outside the profile's time, at its ends."""
        piece = np.clip(np.searchsorted(self.time, times, "right") - 1, 0, len(self.row) - 1)
        t = np.clip(times, 0.0, self.time[-1]) - self.time[piece]
        v, a, e = self.speed[piece], self.acceleration[piece], self.jerk[piece]
        shift = self.shift[piece] + t * (v + t * (0.5 * a + t * e / 6.0))
        return self.row[piece], shift, v + t * (a + 0.5 * t * e), a + t * e
