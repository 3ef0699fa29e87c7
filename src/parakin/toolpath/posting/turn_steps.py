"""How far turning joints turn while a pose changes evenly to another one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Indices, count_repeats
from ...errors import PoseError
from ...kinematics.turns import TURN

TURN_STEP = math.pi / 36.0  # rad: turns that change evenly are followed in steps no longer than this
_MOST_STEPS = 1 << 16  # in a motion
WIDE = math.pi / 3.0  # rad a joint may turn from step to step


def count_steps(turned: Array) -> Indices:
    """Count the steps (n,) in which to follow motions that turn by (n,) rad, to the records from the second on.

    Raises :class:`PoseError` for thousands of turns in one motion.
    """
    steps = np.maximum(1.0, np.ceil(turned / TURN_STEP))
    if steps.max(initial=0.0) > _MOST_STEPS:
        turns = turned.max() / TURN
        raise PoseError(f"the motion to record {1 + int(steps.argmax())} makes {turns:,.0f} turns: too many to follow")
    return steps.astype(np.int64)


def add_turn_steps(rows: Array, columns: Sequence[int]) -> tuple[Array, Indices | slice]:
    """Add rows so that the angles in ``columns`` change in small steps: (m, ...), and where the given (n, ...) are."""
    turned = np.abs(np.diff(rows[:, columns], axis=0)).max(axis=1, initial=0.0)
    if not (turned > TURN_STEP).any():
        return rows, slice(None)
    steps = count_steps(turned)
    at_given = np.concatenate([[0], np.cumsum(steps)])
    motion = np.repeat(np.arange(len(steps)), steps)
    fraction = count_repeats(steps) / steps[motion]
    between = rows[motion] + fraction[:, None] * (rows[motion + 1] - rows[motion])
    return np.vstack([between, rows[-1:]]), at_given
