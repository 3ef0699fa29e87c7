"""Turns in which the tool's tip all but stands: the tip is held, and moved by itself where it must."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags, Indices

_SLOWEST = 0.11 / 60.0  # mm/s: what is slower LinuxCNC runs at 0.1 mm/min in inverse time; it goes by the tip
_SLOW = 0.02  # mm/s: slower tips are held where that keeps them within _HELD
_HELD = 1e-5  # mm that a tip may stay behind: more would turn the first joint of a wrist on a moving leg
_NOTHING = 5e-7  # mm: less is not printed
_LEAST = 0.002  # s, of the tip's own motion


def delay_slow_tips(ends: Array, seconds: Array, halt: Flags, linear: Flags) -> tuple[Array, Indices, Array]:
    """Delay the tip in motions that turn the tool and all but leave its tip where it is.

    LinuxCNC blends turns of a tip that stands evenly, but slows down where such a turn meets one whose tip moves.

    Parameters
    ----------
    ends : (k + 1, axes) the start, and the end of every motion
    seconds, halt : (k,) of the motions; the tip of one that halts comes to its place
    linear : (axes,) those in mm

    Returns ends (n, axes), the motions (n,) that they are of, and the seconds (n,): a motion may become two, the turn
    and the tip's.
    """
    steps = np.abs(np.diff(ends, axis=0))
    ways = np.sqrt((steps[:, linear] ** 2).sum(1))
    slow = np.flatnonzero((ways < _SLOW * seconds) & steps[:, ~linear].any(1))
    rows, tips, apart, own_seconds = ends.copy(), ends[:, linear], list[int](), list[float]()
    for k in slow.tolist():
        behind = float(np.linalg.norm(tips[k + 1] - tips[k]))
        if behind <= (_NOTHING if halt[k] else _HELD):
            rows[k + 1, linear] = tips[k + 1] = tips[k]
        elif behind < _SLOWEST * seconds[k]:
            rows[k + 1, linear] = tips[k]
            apart.append(k)
            own_seconds.append(max(behind / _SLOWEST, _LEAST))
    motion = np.sort(np.concatenate([np.arange(len(seconds)), np.array(apart, np.int64)]))
    own = np.append(False, motion[1:] == motion[:-1])
    times = seconds[motion]
    times[own] = own_seconds
    return np.where(own[:, None], ends[motion + 1], rows[motion + 1]), motion, times
