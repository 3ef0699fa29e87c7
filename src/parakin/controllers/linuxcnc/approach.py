"""How a program brings the tool from wherever it is to its first record."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kinematics.wrist import EXACT, TILTED, TURN, Wrist
from ...machine import Machine
from ...toolpath.timing.drive_limits import DriveLimits

_CALM = 0.25  # of the joints' speeds
_UNKNOWN = 4.0  # s: for the motion whose start is not known
_LEAST = 0.5  # s
_LOOKS = 500  # on a motion
_TURNS = (0, 1, -1, 2, -2)


def approach(machine: Machine, first: Array, joints: Array, mode: str) -> tuple[Array, Array]:
    """Poses (k, axes) that lead to a first record's, and the s that each motion takes.

    first, joints, mode : (axes,) and (joints,) of the first record, and the working mode that it is in

    At home the tool may lie along the first axis of a wrist, which then is free: it would have to jump as soon as the
    tool tilts another way than that axis stands for. So the tool is put upright above home first, turned, which moves
    no joint there, tilted the way the axis stands for, and brought to the record on the turn that it is planned on.
    """
    way = [first]
    wrist = machine.wrist
    if wrist is not None and wrist.find_free(machine.home[None], EXACT)[0]:
        way = _over_the_pole(machine, wrist, first, joints, mode) or way
    if len(way) == 1 and mode != machine.mode:
        raise PoseError(f"mode {mode!r}: no way from home, which is in {machine.mode!r}, to the first record")
    poses = np.array(way)
    starts = np.concatenate([machine.home[None], poses[:-1]])
    seconds = [_seconds(machine, start, end, mode) for start, end in zip(starts, poses, strict=True)]
    seconds[0] = max(seconds[0], _UNKNOWN)
    return poses, np.array(seconds)


def _over_the_pole(machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str) -> list[Array] | None:
    """Upright at home, tilted there, and the first record; None where there is no such way."""
    found = machine.forward(wrist.tilt(machine.inverse(machine.home), mode, TILTED), near=machine.home)
    if not np.all(found.converged):
        return None
    for turns in _TURNS:
        via = np.array(machine.home)
        via[3:] = np.asarray(found.poses).reshape(-1)[3:]
        via[4] += TURN * turns
        line = _line(via, first)
        way = machine.follow(line, mode, EXACT)
        arrives = way[-1] - way[0] + machine.inverse(via, mode)
        if abs(float((arrives - joints)[wrist.first])) < 1e-6 and not machine.check(line, mode=mode).any():
            upright = np.array(machine.home)
            upright[4] = via[4]
            return [upright, via, first]
    return None


def _line(start: Array, end: Array) -> Array:
    return start + np.linspace(0.0, 1.0, _LOOKS)[:, None] * (end - start)


def _seconds(machine: Machine, start: Array, end: Array, mode: str) -> float:
    """s in which the joints have a part of their speeds."""
    joints = machine.follow(_line(start, end), mode, EXACT)
    rates = np.abs(np.diff(joints, axis=0)) * (_LOOKS - 1) / DriveLimits.of(machine).speed
    return max(_LEAST, float(np.nanmax(rates, initial=0.0)) / _CALM)
