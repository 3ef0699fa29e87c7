"""How far turning joints turn while a pose changes evenly to another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Indices
from ...errors import PoseError
from ...kinematics.wrist import PRINTED, TURN, wrap_angle
from ...machine import Machine

TURN_STEP = math.pi / 36.0  # rad: turns that change evenly are followed in steps no longer than this
_MOST_STEPS = 1 << 16  # in a motion
WIDE = math.pi / 3.0  # rad a joint may turn from step to step
_HALVINGS = 6


@dataclass(frozen=True, eq=False)
class Passage:
    """Poses (m, axes) that change evenly from one to another, and joints (m, joints) that go on from given ones.

    smooth : every joint exists and turns in small steps
    """

    poses: Array
    joints: Array
    smooth: bool


def find_turning_columns(machine: Machine) -> list[int]:
    """Find the columns of a pose that are angles."""
    return [column for column, letter in enumerate(machine.axes) if letter in "ABC"]


def find_turning_joints(machine: Machine) -> list[int]:
    """Find the columns of a joint vector that are angles."""
    return [column for column, unit in enumerate(machine.joint_units) if unit == "rad"]


def count_steps(turned: Array, first: int = 1) -> Indices:
    """Count the steps (n,) in which to follow motions that turn by (n,) rad, to the records from ``first`` on.

    Raises :class:`PoseError` for thousands of turns in one motion.
    """
    steps = np.maximum(1.0, np.ceil(turned / TURN_STEP))
    if steps.max(initial=0.0) > _MOST_STEPS:
        turns = turned.max() / TURN
        raise PoseError(
            f"the motion to record {first + int(steps.argmax())} makes {turns:,.0f} turns: too many to follow"
        )
    return steps.astype(np.int64)


def add_turn_steps(rows: Array, columns: Sequence[int]) -> tuple[Array, Indices | slice]:
    """Add rows so that the angles in ``columns`` change in small steps: (m, ...), and where the given (n, ...) are."""
    turned = np.abs(np.diff(rows[:, columns], axis=0)).max(axis=1, initial=0.0)
    if not (turned > TURN_STEP).any():
        return rows, slice(None)
    steps = count_steps(turned)
    at_given = np.concatenate([[0], np.cumsum(steps)])
    motion = np.repeat(np.arange(len(steps)), steps)
    fraction = (np.arange(len(motion)) - at_given[motion]) / steps[motion]
    between = rows[motion] + fraction[:, None] * (rows[motion + 1] - rows[motion])
    return np.vstack([between, rows[-1:]]), at_given


def trace_passage(machine: Machine, mode: str, begin: Array, end: Array, joints: Array, record: int) -> Passage:
    """Trace the way from pose to pose, (axes,) each, in steps that are halved until no joint turns far in one.

    Joints go on from ``joints``; ``record`` is the record that the motion leads to.
    """
    turned = max((abs(float(end[i] - begin[i])) for i in find_turning_columns(machine)), default=0.0)
    steps = int(count_steps(np.array([turned]), record)[0])
    turning = find_turning_joints(machine)
    for _ in range(_HALVINGS):
        poses = begin + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - begin)
        poses[-1] = end
        followed = _follow_from(machine, mode, poses, joints)
        widest = np.abs(np.diff(followed[:, turning], axis=0)).max(initial=0.0)  # NaN goes through
        if not widest > WIDE or steps > _MOST_STEPS:
            break
        steps *= 2
    return Passage(poses, followed, bool(widest <= WIDE))


def _follow_from(machine: Machine, mode: str, poses: Array, joints: Array) -> Array:
    """Follow poses with the joints going on from given ones, in the mode of head and table that these are in."""
    turning = find_turning_joints(machine)
    nearest, least = np.empty(0), math.inf
    for candidate in machine.head_modes(mode):
        followed = machine.follow(poses, candidate, PRINTED)
        off = followed[0] - joints
        off[turning] = wrap_angle(off[turning])
        distance = float(np.abs(off).max())
        if not len(nearest) or distance < least:
            nearest, least = followed, distance
    nearest[:, turning] += TURN * np.round((joints - nearest[0])[turning] / TURN)
    return nearest
