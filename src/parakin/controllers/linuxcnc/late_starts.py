"""How late LinuxCNC begins a motion, when one blends into another."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags

_BLEND = 0.002  # mm by which motions that turn the tool may cut corners, unless asked for otherwise


def measure_late_starts(steps: Array, seconds: Array, rise: Array, linear: Flags) -> Array:
    """Measure how late motions begin after the ones before them begin to fall, s (k,), the last one's zero.

    LinuxCNC blends below a speed only: that from which a motion falls within its tolerance of the corner, or in the
    time of the shorter one. It goes by the tip, and takes a turn of a tip that stands as one along X, in degrees.
    """
    tip = np.sqrt((steps[:, linear] ** 2).sum(1))
    moves = tip > 0.0
    turn = np.degrees(np.sqrt((steps[:, ~linear] ** 2).sum(1)))
    along_x = np.eye(1, int(linear.sum()))
    direction = np.where(moves[:, None], steps[:, linear] / np.where(moves, tip, 1.0)[:, None], along_x)
    bend = np.sqrt((np.diff(direction, axis=0) ** 2).sum(1))
    speed = np.where(moves, tip, turn)[:-1] / seconds[:-1]
    falling = np.maximum(rise[:-1], 1e-12)
    time = np.minimum(np.minimum(seconds[:-1], seconds[1:]), np.maximum(falling, rise[1:]))
    near = 2.0 * np.sqrt(2.0 * _BLEND * speed / falling / np.maximum(bend, 1e-12))
    share = np.minimum(np.minimum(time / falling, near / np.maximum(speed, 1e-12)), 1.0)
    late: Array = falling * (1.0 - share) * ((turn[:-1] > 0.0) | (turn[1:] > 0.0))
    return np.append(late, 0.0)
