"""Turns taken back in rapid motions: C of the pose goes on by whole turns, and the first joint of a wrist with it."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...kinematics.wrist import TURN
from ...machine import Machine
from ..path import ToolPath
from .turn_counts import TurningJoint, choose_turns
from .turn_steps import trace_passage

_TRIED = 8  # motions of a run of rapids
_SAME = 1e-6  # mm, rad


class Rewinding(NamedTuple):
    """Poses (n, axes) and joints (n, joints) with turns taken back, and the records that such motions lead to."""

    poses: Array
    joints: Array
    records: tuple[int, ...]


class _Rewind(NamedTuple):
    """A motion by the record it leads to, and the counts of a joint's turns before and behind it."""

    record: int
    before: int
    behind: int


def rewind_in_rapids(
    machine: Machine, path: ToolPath, poses: Array, joints: Array, mode: str, home: float
) -> Rewinding:
    """Choose the turns of a wrist's first joint, and take turns back in rapid motions.

    A motion is fit for that if an even turn of C, with what else of the pose changes, takes the joint along by as many
    turns, breaks no limit on the way and ends where the joints are to be. Where the motion chosen in a run of rapid
    motions is unfit, the next one of the run is tried, and all turns are chosen anew.

    home : the joint's angle at home, rad
    """
    assert machine.wrist is not None
    column = machine.wrist.first
    joint = TurningJoint.of(machine, poses, joints, mode, column, home)

    @cache
    def find_turns(rewind: _Rewind) -> int:
        return _find_turns_of_c(machine, poses, joints, mode, column, rewind)

    runs = _find_rapid_runs(path)
    while True:
        cuts = [run[0] for run in runs]
        counts = choose_turns(joint, cuts)
        rewinds = [_Rewind(*rewind) for rewind in zip(cuts, counts[:-1], counts[1:], strict=True)]
        unfit = [
            run
            for run, rewind in zip(runs, rewinds, strict=True)
            if rewind.before != rewind.behind and not find_turns(rewind)
        ]
        if not unfit:
            break
        for run in unfit:
            run.pop(0)
        runs = [run for run in runs if run]
    rewinds = [rewind for rewind in rewinds if rewind.before != rewind.behind]
    new_poses, new_joints, c = poses.copy(), joints.copy(), machine.wrist.direction.c
    new_joints[:, column] += TURN * counts[0]
    for rewind in rewinds:
        new_poses[rewind.record :, c] += TURN * find_turns(rewind)
        new_joints[rewind.record :, column] += TURN * (rewind.behind - rewind.before)
    return Rewinding(new_poses, new_joints, tuple(rewind.record for rewind in rewinds))


def _find_rapid_runs(path: ToolPath) -> list[list[int]]:
    """Find the runs of rapid motions: for each the records that its motions lead to, the fittest to turn back in first.

    That is the longest of the lines that neither leave the part nor lead up to it, if there is one.
    """
    rapid = path.rapid.copy()
    rapid[:1] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rapid, [False]]).astype(np.int8)))
    runs = []
    for start, stop in edges.reshape(-1, 2).tolist():
        length = np.linalg.norm(np.diff(path.tip[start - 1 : stop], axis=0), axis=1)
        line = path.line[start:stop]
        number = np.cumsum(np.diff(line, prepend=line[0]) != 0)
        line_length = np.bincount(number, length)[number]
        is_outer = (number == 0) | (number == number[-1])
        order = np.lexsort((-length, -line_length, is_outer))
        runs.append((start + order[:_TRIED]).tolist())
    return runs


def _find_turns_of_c(machine: Machine, poses: Array, joints: Array, mode: str, column: int, rewind: _Rewind) -> int:
    """Find the turns of C that take the joint along as wanted in a motion; zero where no turns do."""
    assert machine.wrist is not None
    record = rewind.record
    start, goal = joints[record - 1].copy(), joints[record].copy()
    start[column] += TURN * rewind.before
    goal[column] += TURN * rewind.behind
    if not (np.isfinite(start).all() and np.isfinite(goal).all()):
        return 0
    ends_allowed = not machine.check(poses[record - 1 : record + 1], np.array([start, goal]), mode).any()
    wanted = rewind.behind - rewind.before
    for turns in (wanted, -wanted):
        end = poses[record].copy()
        end[machine.wrist.direction.c] += TURN * turns
        passage = trace_passage(machine, mode, poses[record - 1], end, start, record)
        off = max(np.abs(passage.joints[0] - start).max(), np.abs(passage.joints[-1] - goal).max())
        if passage.smooth and off < _SAME:
            is_allowed = not ends_allowed or not machine.check(passage.poses, passage.joints, mode).any()
            return turns if is_allowed else 0
    return 0
