"""How far turning joints turn while a pose goes evenly to another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import PoseError
from ...kinematics.wrist import PRINTED, TURN, wrap_angle
from ...machine import Machine
from ..path import Floats

TURN_STEP = math.pi / 36.0  # rad: turns that go evenly are looked at in steps no longer
MOST_STEPS = 1 << 16  # in a motion
_WIDE = math.pi / 3.0  # rad a joint may turn from step to step
_HALVINGS = 6


@dataclass(frozen=True, eq=False)
class Passage:
    """Poses (m, axes) that go evenly from one to another, and joints (m, joints) that go on from given ones.

    ``smooth`` tells that every joint exists and turns in small steps.
    """

    poses: Floats
    joints: Floats
    smooth: bool


def count_steps(turned: Floats, first: int = 1) -> Floats:
    """In how many steps (n,) to look at motions that turn by (n,) rad, to the records from ``first`` on.

    Raises :class:`PoseError` for thousands of turns in one motion.
    """
    steps = np.maximum(1.0, np.ceil(turned / TURN_STEP))
    if steps.max(initial=0.0) > MOST_STEPS:
        turns = turned.max() / TURN
        raise PoseError(
            f"the motion to record {first + int(steps.argmax())} makes {turns:,.0f} turns: too many to follow"
        )
    return steps


def add_turn_steps(rows: Floats, columns: Sequence[int]) -> tuple[Floats, Any]:
    """Rows (m, ...) that go evenly, angles in ``columns`` in small steps, and where the given rows (n, ...) stand."""
    turned = np.abs(np.diff(rows[:, columns], axis=0)).max(axis=1, initial=0.0)
    if not (turned > TURN_STEP).any():
        return rows, slice(None)
    parts = count_steps(turned).astype(np.int64)
    at = np.concatenate([[0], np.cumsum(parts)])
    of = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(of)) - at[of]) / parts[of]
    between = rows[of] + share[:, None] * (rows[of + 1] - rows[of])
    return np.vstack([between, rows[-1:]]), at


def trace_passage(machine: Machine, mode: str, begin: Floats, end: Floats, joints: Floats, record: int) -> Passage:
    """From pose to pose, (axes,) each, joints going on from ``joints``; ``record`` is the one that is led to."""
    turned = [abs(float(end[i] - begin[i])) for i, letter in enumerate(machine.axes) if letter in "ABC"]
    parts = int(count_steps(np.array([max(turned, default=0.0)]), record)[0])
    for _ in range(_HALVINGS):
        share = np.linspace(0.0, 1.0, parts + 1)[:, None]
        poses = begin + share * (end - begin)
        poses[-1] = end
        followed = _going_on(machine, mode, poses, joints)
        turning = np.array(machine.joint_units) == "rad"
        widest = np.abs(np.diff(followed[:, turning], axis=0)).max(initial=0.0)  # NaN goes through
        if not widest > _WIDE or parts > MOST_STEPS:
            break
        parts *= 2
    return Passage(poses, followed, bool(widest <= _WIDE))


def _going_on(machine: Machine, mode: str, poses: Floats, joints: Floats) -> Floats:
    """Joints along poses from given ones on, in the working mode of head and table that these are in."""
    turning = np.array(machine.joint_units) == "rad"
    best, least = np.empty(0), math.inf
    for tried in machine.head_modes(mode):
        followed = machine.follow(poses, tried, PRINTED)
        off = followed[0] - joints
        off[turning] = wrap_angle(off[turning])
        size = float(np.abs(off).max())
        if not len(best) or size < least:
            best, least = followed, size
    best[:, turning] += TURN * np.round((joints - best[0])[turning] / TURN)
    return best
