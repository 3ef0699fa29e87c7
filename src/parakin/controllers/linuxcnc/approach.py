"""How a program brings the tool from wherever it is to its first record."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kinematics.wrist import EXACT, PRINTED, TILTED, TURN, Wrist, find_nearest_turn, is_upright
from ...machine import Machine
from ...toolpath.posting.wrist_poses import find_pose_with_wrist
from ...toolpath.timing.drive_limits import DriveLimits

_SPEED_SHARE = 0.25  # fraction of the joints' speeds
_FROM_ANYWHERE = 4.0  # s, at least: for the motion whose start is not known
_LEAST = 0.5  # s, of a motion
_SAMPLES = 500  # samples of a motion
_TURNS = (0, 1, -1, 2, -2)
_SHARES = (1.0, 0.1, 0.01)  # of the way back home and of TILTED, for the poses that lead to a record beside the pole


def plan_approach(machine: Machine, first: Array, joints: Array, mode: str) -> tuple[Array, Array]:
    """Plan the poses (k, axes) that lead to a first record's, and the s that each motion takes.

    Parameters
    ----------
    first, joints : (axes,) and (joints,) of the first record
    mode : the working mode that it is in

    At home the tool may lie along the first axis of a wrist, which then is free: it would have to jump as soon as the
    tool tilts in another direction than that axis stands for. So the tool is put upright above home first, turned,
    which moves no joint there, tilted in the direction the axis stands for, and brought to the record on the turn that
    it is planned on. A record beside the pole is come to straight from aside, lest the axis swing on the way.

    Raises :class:`PoseError` where no such way is found.
    """
    wrist = machine.wrist
    way = [first] if wrist is None else _approach_from_aside(machine, wrist, first, joints, mode)
    if wrist is not None and wrist.find_free(machine.home[None], EXACT)[0]:
        aside = joints if len(way) == 1 else _follow_back(machine, way, joints, mode)
        left = _leave_pole(machine, wrist, way[0], aside, mode)
        if left is None:
            name, angle = machine.joints[wrist.first], np.degrees(joints[wrist.first])
            raise PoseError(f"no way from home to the first record, where {name} is at {angle:.1f}° in mode {mode!r}")
        way = [*left, *way]
    elif mode != machine.mode:
        raise PoseError(f"mode {mode!r}: no way from home, which is in {machine.mode!r}, to the first record")
    poses = np.array(way)
    starts = np.concatenate([machine.home[None], poses[:-1]])
    seconds = [_choose_seconds(machine, start, end, mode) for start, end in zip(starts, poses, strict=True)]
    seconds[0] = max(seconds[0], _FROM_ANYWHERE)
    return poses, np.array(seconds)


def _approach_from_aside(machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str) -> list[Array]:
    """Approach a record beside the pole straight from home, with the first joint as it is there; return the poses."""
    off_pole = float(np.sqrt(wrist.measure_freedom(first[None])[0]))
    if off_pole > 0.5 * TILTED:
        return [first]
    own = mode if off_pole < PRINTED or wrist.has_mode(first[None], joints[None], mode)[0] else wrist.other_mode(mode)
    c, way = wrist.direction.c, list[Array]()
    for share in _SHARES:
        near = first + share * (machine.home - first)
        pose = find_pose_with_wrist(machine, near, wrist.tilt(joints, own, share * TILTED), own)
        if pose is None:
            return [first]
        pose[c] = find_nearest_turn(pose[c], way[-1][c] if way else first[c])
        way.append(pose)
    if is_upright(first[wrist.direction.b], PRINTED):  # C turns there by itself
        way.append(np.where(np.arange(len(first)) == c, way[-1], first))
    return [*way, first]


def _follow_back(machine: Machine, way: list[Array], joints: Array, mode: str) -> Array:
    """Find the joints (joints,) at the start of a way that comes to joints straight from aside."""
    assert machine.wrist is not None
    start = machine.inverse(way[0], mode)
    start[machine.wrist.first] = find_nearest_turn(start[machine.wrist.first], joints[machine.wrist.first])
    return np.asarray(start)


def _leave_pole(machine: Machine, wrist: Wrist, goal: Array, joints: Array, mode: str) -> list[Array] | None:
    """Leave the pole at home to where a line leads to a pose and its joints; None where no line does."""
    tilted = machine.forward(wrist.tilt(machine.inverse(machine.home), mode, TILTED), near=machine.home)
    if not np.all(tilted.converged):
        return None
    for turns in _TURNS:
        via = np.array(machine.home)
        via[wrist.direction.pair] = np.asarray(tilted.poses).reshape(-1)[wrist.direction.pair]
        via[wrist.direction.c] += TURN * turns
        line = _sample_line(via, goal)
        rows = machine.follow(line, mode, EXACT)
        arrival = rows[-1] - rows[0] + machine.inverse(via, mode)
        if abs(float((arrival - joints)[wrist.first])) < 1e-6 and not machine.check(line, mode=mode).any():
            upright = np.array(machine.home)
            upright[wrist.direction.c] = via[wrist.direction.c]
            return [upright, via]
    return None


def _sample_line(start: Array, end: Array) -> Array:
    return start + np.linspace(0.0, 1.0, _SAMPLES)[:, None] * (end - start)


def _choose_seconds(machine: Machine, start: Array, end: Array, mode: str) -> float:
    """Choose the s in which the joints run at a share of their speeds."""
    joints = machine.follow(_sample_line(start, end), mode, EXACT)
    rates = np.abs(np.diff(joints, axis=0)) * (_SAMPLES - 1) / DriveLimits.of(machine).speed
    return max(_LEAST, float(np.nanmax(rates, initial=0.0)) / _SPEED_SHARE)
