"""Samples of a tool path between its records, where an angle at a pole turns too far from one record to the next.

Beside a pole the angle of the turning axis swings, and two records tell neither which way round nor whether the tool
passes over the pole. Bisection adds samples until each step is short, or ends on the pole itself; so what follows from
them does not hang on how dense the records are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices, count_repeats
from ...kinematics.turns import wrap_angle
from ...kinematics.wrist.pole_thresholds import PRINTED, is_upright
from ...kinematics.wrist.pose_angles import fold_direction
from ...machine import Machine
from ..path import ToolPath
from ..programmed_path import ProgrammedPath
from .frames import compute_poses
from .turn_steps import WIDE, count_steps

_HALVINGS = 24  # of a motion
_MOST_SAMPLES, _MOST_PER_RECORD = 50_000, 2  # what is added in all


class SampledPath(NamedTuple):
    """Poses (m, axes) along a tool path, and where its n records are among them, (n,) or all.

    mode : in which it was sampled
    joints : (m, joints) the inverse's in that mode, for who follows the path in it to overwrite; None where they were
        not needed
    """

    poses: Array
    at_records: Indices | slice
    mode: str
    joints: Array | None = None


class _Samples(NamedTuple):
    """m places on a path: the motion of each by the record it leads to, and its share of that motion."""

    record: Indices
    share: Array


def sample_path(machine: Machine, path: ToolPath, frame: Array, mode: str, poses: Array) -> SampledPath:
    """Sample a path by bisection of the motions on which C or a wrist's first joint turns by more than 60° in a step.

    Turns A, B, C that a program gives are followed in steps of 5°, however far apart its records are.

    poses : (n, axes) of the records

    Raises :class:`PoseError` for a motion of thousands of turns.
    """
    if len(path) < 2 or (machine.wrist is None and not machine.has_direction):
        return SampledPath(poses, slice(None), mode)
    programmed = ProgrammedPath(path)
    samples = _place_samples(path)
    rows = poses if len(samples.record) == len(path) else _compute_rows(machine, programmed, frame, samples)
    room = _MOST_SAMPLES + _MOST_PER_RECORD * len(path)
    for _ in range(_HALVINGS):
        joints = None if machine.wrist is None else machine.inverse(rows, mode)
        wide = _find_wide_steps(machine, rows, joints, path.turns is None)
        wide = wide[~programmed.find_opposite(samples.record[wide + 1])]
        if not len(wide) or len(samples.record) + len(wide) > room:
            break
        begin = np.where(samples.record[wide] == samples.record[wide + 1], samples.share[wide], 0.0)
        added = _Samples(samples.record[wide + 1], 0.5 * (begin + samples.share[wide + 1]))
        samples = _Samples(*(np.insert(old, wide + 1, new) for old, new in zip(samples, added, strict=True)))
        rows, joints = _compute_rows(machine, programmed, frame, samples), None
    if len(samples.record) == len(path):
        return SampledPath(poses, slice(None), mode, joints)
    return SampledPath(rows, np.flatnonzero(samples.share == 1.0), mode, joints)


def _place_samples(path: ToolPath) -> _Samples:
    """Place samples at the records, and between them where the program's turns go far."""
    if path.turns is None:
        return _Samples(np.arange(len(path)), np.ones(len(path)))
    count = np.ones(len(path), np.int64)
    count[1:] = count_steps(np.abs(np.diff(path.turns, axis=0)).max(axis=1))
    record = np.repeat(np.arange(len(path)), count)
    number = count_repeats(count)
    return _Samples(record, (number + 1) / count[record])


def _compute_rows(machine: Machine, programmed: ProgrammedPath, frame: Array, samples: _Samples) -> Array:
    """Compute the poses (m, axes) at samples; those at records are computed from the records."""
    path, (record, share) = programmed.path, samples
    tip, axis = path.tip[record], path.axis[record]
    turns = None if path.turns is None else path.turns[record]
    between = np.flatnonzero(share < 1.0)
    tip[between], axis[between] = programmed.interpolate(record[between], share[between])
    if turns is not None:
        turns[between] = programmed.interpolate_turns(record[between], share[between])
    exact = None if path.exact is None else path.exact[record] & (share == 1.0)
    return compute_poses(machine, tip, axis, frame, turns, exact)[0]


def _find_wide_steps(machine: Machine, poses: Array, joints: Array | None, has_free_direction: bool) -> Indices:
    """Find the steps between rows off a pole on which C or the wrist's first joint turns too far, by the row before."""
    wide = np.zeros(len(poses) - 1, np.bool_)
    if machine.direction is not None and has_free_direction:
        b, c = fold_direction(poses[:, machine.direction.pair])
        wide |= _turns_far(c, is_upright(b, PRINTED))
    if machine.wrist is not None and joints is not None:
        wide |= _turns_far(joints[:, machine.wrist.first], machine.wrist.find_free(poses, PRINTED))
    return np.flatnonzero(wide)


def _turns_far(angle: Array, free: Flags) -> Flags:
    turned = np.diff(angle)
    far: Flags = (np.abs(turned) > WIDE) & ~free[1:] & ~free[:-1]
    at = np.flatnonzero(far)
    far[at] = np.abs(wrap_angle(turned[at])) > WIDE
    return far
