"""How a program brings the tool from wherever it is to its first record."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kinematics.wrist import EXACT, TILTED, TURN, Wrist
from ...machine import Machine
from ...toolpath.timing.drive_limits import DriveLimits

_SPEED_SHARE = 0.25  # fraction of the joints' speeds
_FROM_ANYWHERE = 4.0  # s, at least: for the motion whose start is not known
_LEAST = 0.5  # s, of a motion
_SAMPLES = 500  # samples of a motion
_TURNS = (0, 1, -1, 2, -2)


def plan_approach(machine: Machine, first: Array, joints: Array, mode: str) -> tuple[Array, Array]:
    """Plan the poses (k, axes) that lead to a first record's, and the s that each motion takes.

    Parameters
    ----------
    first, joints : (axes,) and (joints,) of the first record
    mode : the working mode that it is in

    At home the tool may lie along the first axis of a wrist, which then is free: it would have to jump as soon as the
    tool tilts in another direction than that axis stands for. So the tool is put upright above home first, turned,
    which moves no joint there, tilted in the direction the axis stands for, and brought to the record on the turn that
    it is planned on.
    """
    way = [first]
    wrist = machine.wrist
    if wrist is not None and wrist.find_free(machine.home[None], EXACT)[0]:
        way = _leave_pole(machine, wrist, first, joints, mode) or way
    if len(way) == 1 and mode != machine.mode:
        raise PoseError(f"mode {mode!r}: no way from home, which is in {machine.mode!r}, to the first record")
    poses = np.array(way)
    starts = np.concatenate([machine.home[None], poses[:-1]])
    seconds = [_choose_seconds(machine, start, end, mode) for start, end in zip(starts, poses, strict=True)]
    seconds[0] = max(seconds[0], _FROM_ANYWHERE)
    return poses, np.array(seconds)


def _leave_pole(machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str) -> list[Array] | None:
    """Go upright at home, tilted there, and to the first record; None where there is no such way."""
    tilted = machine.forward(wrist.tilt(machine.inverse(machine.home), mode, TILTED), near=machine.home)
    if not np.all(tilted.converged):
        return None
    for turns in _TURNS:
        via = np.array(machine.home)
        via[wrist.direction.pair] = np.asarray(tilted.poses).reshape(-1)[wrist.direction.pair]
        via[wrist.direction.c] += TURN * turns
        line = _sample_line(via, first)
        rows = machine.follow(line, mode, EXACT)
        arrival = rows[-1] - rows[0] + machine.inverse(via, mode)
        if abs(float((arrival - joints)[wrist.first])) < 1e-6 and not machine.check(line, mode=mode).any():
            upright = np.array(machine.home)
            upright[wrist.direction.c] = via[wrist.direction.c]
            return [upright, via, first]
    return None


def _sample_line(start: Array, end: Array) -> Array:
    return start + np.linspace(0.0, 1.0, _SAMPLES)[:, None] * (end - start)


def _choose_seconds(machine: Machine, start: Array, end: Array, mode: str) -> float:
    """Choose the s in which the joints run at a share of their speeds."""
    joints = machine.follow(_sample_line(start, end), mode, EXACT)
    rates = np.abs(np.diff(joints, axis=0)) * (_SAMPLES - 1) / DriveLimits.of(machine).speed
    return max(_LEAST, float(np.nanmax(rates, initial=0.0)) / _SPEED_SHARE)
