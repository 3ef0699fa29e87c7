"""The time of a straight motion whose speed, acceleration and jerk are bounded, in closed form."""

from __future__ import annotations

import numpy as np


def s_curve_time(way, v, a, j):
    """The least time for a way, from stand to stand; s."""
    if v < a**2 / j and way >= 2.0 * v * np.sqrt(v / j):  # the acceleration's bound is not reached
        return way / v + 2.0 * np.sqrt(v / j)
    if way >= v * (v / a + a / j):
        return way / v + v / a + a / j
    if way >= 2.0 * a**3 / j**2:
        return a / j + np.sqrt((a / j) ** 2 + 4.0 * way / a)
    return 4.0 * np.cbrt(way / (2.0 * j))
