"""How a program brings the tool from wherever it is to its first record."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kinematics.turns import TURN, find_nearest_turn
from ...kinematics.wrist.pole_thresholds import EXACT, NEAR_START, PRINTED, SAME_MODE, STANDING, TILTED, is_upright
from ...kinematics.wrist.turning_joints import Wrist
from ...machine import Machine
from ...toolpath.posting.wrist_poses import find_pose_with_wrist
from ...toolpath.timing.drive_limits import DriveLimits
from .home_pose import find_home_pose

_SPEED_FRACTION = 0.25  # fraction of the joints' speeds
_FROM_ANYWHERE = 4.0  # s, at least: for the motion whose start is not known
_LEAST = 0.5  # s, of a motion
_SAMPLES = 500  # samples of a motion
_TURNS = (0, 1, -1, 2, -2)
_LEADS = (1.0, 0.1, 0.01)  # poses that lead to a record beside the pole: fractions of the way home, and of TILTED
_MOST_LEADS = 40
_NEARER = 0.25  # a pose between the nearest of them and the record: its fraction, of the nearest one's
_NEAREST = 0.1 * STANDING / TILTED
_SWUNG = np.radians(0.5)  # by which the first joint may turn on a line of them


def plan_approach(machine: Machine, first: Array, joints: Array, mode: str) -> tuple[Array, Array]:
    """Plan the poses (k, axes) that lead to a first record's, and the s that each motion takes.

    Parameters
    ----------
    first, joints : (axes,) and (joints,) of the first record
    mode : the working mode that it is in

    At home the tool may lie along the first axis of a wrist, which then is free: it would have to jump as soon as the
    tool tilts in another direction than that axis stands for. So the tool is put upright above home first, turned,
    which moves no joint there, tilted in the direction the axis stands for, and brought to the record on the turn that
    it is planned on. From another home it goes straight to the record if it arrives as planned, else over the pole. A
    record beside the pole is come to straight from aside, or the axis would swing on the way.

    Raises :class:`PoseError` where no such way is found.
    """
    wrist = machine.wrist
    if wrist is None and mode != machine.mode:
        raise PoseError(f"mode {mode!r}: no way from home, which is in {machine.mode!r}, to the first record")
    way = [first] if wrist is None else _approach_with_wrist(machine, wrist, first, joints, mode)
    home = find_home_pose(machine)
    if wrist is not None and (home != machine.home).any():  # straight to the pole above it, where the way begins
        way = [_put_upright(machine, wrist, home), *way]
    poses = np.array(way)
    starts = np.concatenate([home[None], poses[:-1]])
    seconds = [_choose_seconds(machine, start, end, mode) for start, end in zip(starts, poses, strict=True)]
    seconds[0] = max(seconds[0], _FROM_ANYWHERE)
    return poses, np.array(seconds)


def _put_upright(machine: Machine, wrist: Wrist, home: Array) -> Array:
    """Put the tool at LinuxCNC's home on the pole, without a turn of C where it is free there."""
    pole = np.array(machine.home)
    if is_upright(pole[wrist.direction.b]):
        pole[wrist.direction.c] = home[wrist.direction.c]
    return pole


def _approach_with_wrist(machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str) -> list[Array]:
    """Approach a record in a mode, with the wrist's first joint as it is there; return the poses."""
    way = _approach_from_aside(machine, wrist, first, joints, mode)
    goal = float((joints if len(way) == 1 else _follow_back(machine, way, joints, mode))[wrist.first])
    home, at_home = np.array(machine.home), machine.inverse(machine.home)
    to_pole = [] if wrist.find_free(home[None], EXACT)[0] else _go_to_pole(machine, wrist, at_home)
    if to_pole != [] and mode == machine.mode and _turns_to(machine, home, way[0], mode, (at_home[wrist.first], goal)):
        return way
    if to_pole is not None:
        pole = to_pole[-1] if to_pole else home
        aside = at_home.copy()
        aside[wrist.pair] = goal, _find_second_on_pole(machine, wrist)
        turned = find_pose_with_wrist(machine, pole, wrist.tilt(aside, mode, TILTED), mode)
        left = _leave_pole(machine, wrist, pole, way[0], goal, mode)
        if left is not None:
            return [*to_pole, *left, *way]
        if turned is not None:
            turned[wrist.direction.c] = find_nearest_turn(turned[wrist.direction.c], way[0][wrist.direction.c])
            left = _leave_pole(machine, wrist, pole, turned, goal, mode)
            if left is not None and _turns_to(machine, turned, way[0], mode, (goal, goal)):
                return [*to_pole, *left, turned, *way]
    name, angle = machine.joints[wrist.first], np.degrees(joints[wrist.first])
    raise PoseError(f"no way from home to the first record, where {name} is at {angle:.1f}° in mode {mode!r}")


def _find_second_on_pole(machine: Machine, wrist: Wrist) -> float:
    """Find the second joint of a wrist on its pole: amid those of both modes."""
    here, there = (machine.inverse(machine.home, mode)[wrist.second] for mode in machine.head_modes(machine.mode))
    return float(0.5 * (here + find_nearest_turn(there, here)))


def _go_to_pole(machine: Machine, wrist: Wrist, at_home: Array) -> list[Array] | None:
    """Go from home to the pole above it, with the first joint as at home; None where there is no such way."""
    on_pole, poses, near = _find_second_on_pole(machine, wrist), list[Array](), np.array(machine.home)
    for fraction in (0.1, 0.01, 0.0):
        joints = at_home.copy()
        joints[wrist.second] = on_pole + fraction * (at_home[wrist.second] - on_pole)
        pose = find_pose_with_wrist(machine, near, joints, machine.mode)
        if pose is None:
            return None
        poses.append(pose)
        near = pose
    return poses if wrist.find_free(poses[-1][None], PRINTED)[0] else None


def _turns_to(machine: Machine, begin: Array, end: Array, mode: str, angles: tuple[float, float]) -> bool:
    """Tell whether the first joint turns from one angle to another on a line of poses, and no limit is broken on it."""
    first, last = angles
    turn, keeps_limits = _follow_line(machine, begin, end, mode, first)
    return abs(turn - (last - first)) < SAME_MODE and keeps_limits


def _follow_line(machine: Machine, begin: Array, end: Array, mode: str, first: float) -> tuple[float, bool]:
    """Follow a line of poses; return by how much the first joint turns, from ``first`` on, and if limits are kept.

    A path that is off limits at its first record is come to all the same.
    """
    assert machine.wrist is not None
    line, column = _sample_line(begin, end), machine.wrist.first
    joints = machine.follow(line, mode, EXACT)
    turn = float(joints[-1, column] - joints[0, column])
    joints[:, column] += first - joints[0, column]
    broken = machine.check(line, joints, mode)
    return turn, bool(broken[-1]) or not broken.any()


def _approach_from_aside(machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str) -> list[Array]:
    """Approach a record beside the pole straight from home, with the first joint as it is there; return the poses.

    The pole of a central leg moves with the tip, and C turns far beside B = 0: where the joint would leave its range
    between the poses, or swing to and fro, there are more of them.
    """
    off_pole = float(np.sqrt(wrist.measure_freedom(first[None])[0]))
    if off_pole > NEAR_START:
        return [first]
    own = mode if off_pole < PRINTED else wrist.find_mode(first, joints, mode)
    fractions = list(_LEADS)
    while True:
        way = _lead_back(machine, wrist, first, joints, own, fractions)
        straight = [_is_straight(machine, *line, mode, float(joints[wrist.first])) for line in pairwise(way)]
        behind = [*fractions[1:], max(_NEARER * fractions[-1], _NEAREST)]
        between = [
            float(np.sqrt(f * nearer)) if k + 1 < len(fractions) else nearer
            for k, (f, nearer) in enumerate(zip(fractions, behind, strict=True))
            if k < len(straight) and not straight[k]
        ]
        more = sorted({*fractions, *between}, reverse=True)
        if len(more) == len(fractions) or len(more) > _MOST_LEADS:
            return way
        fractions = more


def _is_straight(machine: Machine, begin: Array, end: Array, mode: str, first: float) -> bool:
    """Tell whether the first joint hardly turns on a line of poses, and no limit is broken on it."""
    assert machine.wrist is not None
    turns = np.diff(machine.follow(_sample_line(begin, end), mode, STANDING)[:, machine.wrist.first])
    return bool(np.abs(turns).sum() < _SWUNG) and _follow_line(machine, begin, end, mode, first)[1]


def _lead_back(
    machine: Machine, wrist: Wrist, first: Array, joints: Array, mode: str, fractions: Sequence[float]
) -> list[Array]:
    """Lead from a record back home by fractions of the way, the tool tilted; return the way, or the record alone."""
    c, way = wrist.direction.c, list[Array]()
    for fraction in fractions:
        near = first + fraction * (machine.home - first)
        pose = find_pose_with_wrist(machine, near, wrist.tilt(joints, mode, fraction * TILTED), mode)
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


def _leave_pole(machine: Machine, wrist: Wrist, pole: Array, end: Array, goal: float, mode: str) -> list[Array] | None:
    """Leave a pole above home to where a line leads to a pose with the first joint at ``goal``; None if none does."""
    on_pole = machine.inverse(machine.home)
    on_pole[wrist.second] = _find_second_on_pole(machine, wrist)
    tilted = find_pose_with_wrist(machine, pole, wrist.tilt(on_pole, mode, TILTED), mode)
    if tilted is None:
        return None
    columns, c = wrist.direction.pair, wrist.direction.c
    can_turn = bool(is_upright(pole[wrist.direction.b]))
    for turns in _TURNS if can_turn else (0,):
        via = pole.copy()
        via[columns] = tilted[columns]
        via[c] += TURN * turns
        if _turns_to(machine, via, end, mode, (on_pole[wrist.first], goal)):
            upright = pole.copy()
            upright[c] = via[c] if can_turn else pole[c]
            return [upright, via]
    return None


def _sample_line(start: Array, end: Array) -> Array:
    return start + np.linspace(0.0, 1.0, _SAMPLES)[:, None] * (end - start)


def _choose_seconds(machine: Machine, start: Array, end: Array, mode: str) -> float:
    """Choose the s in which the joints run at a fraction of their speeds."""
    joints = machine.follow(_sample_line(start, end), mode, STANDING)
    rates = np.abs(np.diff(joints, axis=0)) * (_SAMPLES - 1) / DriveLimits.of(machine).speed
    return max(_LEAST, float(np.nanmax(rates, initial=0.0)) / _SPEED_FRACTION)
