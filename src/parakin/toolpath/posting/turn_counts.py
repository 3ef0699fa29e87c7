"""Turns counted into a joint's range, and taken back in rapid motions where no one count serves a whole path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...kinematics.wrist import TURN
from ...machine import Machine
from ...model.parts import Drive
from ..path import Floats, ToolPath
from .turn_steps import trace_passage

_BLOCK = 1 << 16  # records whose margins are held at once
_AT_START, _OFF = 41, 9  # counts of turns that are tried: of a path's first stretch, and where none fits
_TRIED = 8  # motions of a run of rapids
_SAME = 1e-6  # mm, rad
_NEARER = 1e-6  # rad: what is no matter of rounding

Cost = tuple[int, float, float]  # records off limits, rad turned between the stretches, rad from home


def find_turns_in_range(drive: Drive, angles: Floats, home: float) -> int | None:
    """How many turns on angles (n,) are all in the drive's range, and nearest to home; None if that can't be."""
    low, high = float(np.fmin.reduce(angles)), float(np.fmax.reduce(angles))
    if math.isnan(low) or not (math.isfinite(drive.low) or math.isfinite(drive.high)):
        return 0
    fitting = _fitting(drive, low, high)
    if fitting[0] > fitting[1]:
        return None
    least, near = _clipped(0, fitting), _clipped(round((home - 0.5 * (low + high)) / TURN), fitting)
    return near if _away(near, low, high, home) < _away(least, low, high, home) - _NEARER else least


def _fitting(drive: Drive, low: float, high: float) -> tuple[int, int]:
    """The least and the greatest count of turns that put low..high into the range; the wrong way round: none does."""
    most = 1 << 40
    up = math.ceil((drive.low - low) / TURN) if math.isfinite(drive.low) else -most
    down = math.floor((drive.high - high) / TURN) if math.isfinite(drive.high) else most
    return up, down


def _clipped(turns: int, ends: tuple[int, int]) -> int:
    return min(max(turns, ends[0]), ends[1])


def _away(turns: int, low: float, high: float, home: float) -> float:
    return max(abs(low + turns * TURN - home), abs(high + turns * TURN - home))


@dataclass(frozen=True, eq=False)
class _Joint:
    """A turning joint along a path: its angles (n,), the margins (n,) to its range, whether all other limits hold."""

    drive: Drive
    column: int
    angles: Floats
    low: Floats
    high: Floats
    fine: NDArray[np.bool_]
    home: float

    @classmethod
    def of(cls, machine: Machine, poses: Floats, joints: Floats, mode: str, column: int, home: float) -> _Joint:
        drive, count = machine.drives[column], len(joints)
        low, high, fine = np.full(count, np.inf), np.full(count, np.inf), np.empty(count, bool)
        own = {f"{drive.name}.min": low, f"{drive.name}.max": high}
        others = np.array([name not in own for name in machine.limits])
        for start in range(0, count, _BLOCK):
            part = slice(start, start + _BLOCK)
            margins = machine.margins(poses[part], joints[part], mode)
            fine[part] = (margins[:, others] >= 0.0).all(axis=1) & np.isfinite(joints[part]).all(axis=1)
            for name, into in own.items():
                if name in machine.limits:
                    into[part] = margins[:, machine.limits.index(name)]
        return cls(drive, column, joints[:, column].copy(), low, high, fine, home)

    def off(self, start: int, stop: int, turns: int) -> int:
        """Records from start to stop that break only this joint's range, so many turns on."""
        part, shift = slice(start, stop), turns * TURN
        kept = (self.low[part] + shift >= 0.0) & (self.high[part] - shift >= 0.0)
        return int(np.count_nonzero(self.fine[part] & ~kept))


@dataclass(frozen=True)
class _Stretch:
    """Records over which the turns stay: from ``start`` to ``stop``, the joint between ``low`` and ``high``."""

    start: int
    stop: int
    low: float
    high: float

    def tried(self, joint: _Joint, before: Sequence[int]) -> list[int]:
        """Counts of turns worth trying, where ``before`` are those of the stretch before."""
        if math.isnan(self.low):
            return sorted(before) or [0]
        ends = _fitting(joint.drive, self.low, self.high)
        if ends[0] > ends[1]:
            middle = (joint.drive.low + joint.drive.high - self.low - self.high) / (2.0 * TURN)
            return _nearest(ends[1], ends[0], middle, _OFF)
        near = (joint.home - 0.5 * (self.low + self.high)) / TURN
        if not before:
            return _nearest(*ends, near, _AT_START)
        return sorted({*ends, _clipped(round(near), ends), *(_clipped(turns, ends) for turns in before)})

    def cost(self, joint: _Joint, turns: int) -> tuple[int, float]:
        away = 0.0 if math.isnan(self.low) else _away(turns, self.low, self.high, joint.home)
        return joint.off(self.start, self.stop, turns), away


def _nearest(low: int, high: int, middle: float, most: int) -> list[int]:
    """Up to so many whole numbers from low to high, those nearest to a middle."""
    if high - low >= most:
        low = min(max(low, round(middle) - most // 2), high - most + 1)
        high = low + most - 1
    return list(range(low, high + 1))


def _stretches(joint: _Joint, cuts: Sequence[int]) -> list[_Stretch]:
    ends = [0, *cuts, len(joint.angles)]
    found = []
    for start, stop in pairwise(ends):
        part = joint.angles[start:stop]
        found.append(_Stretch(start, stop, float(np.fmin.reduce(part)), float(np.fmax.reduce(part))))
    return found


def _best(joint: _Joint, cuts: Sequence[int]) -> list[int]:
    """The best count of turns in every stretch between the cuts: dynamic programming over the stretches."""
    before: dict[int, Cost] = {}
    back: list[dict[int, int]] = []
    for stretch in _stretches(joint, cuts):
        here: dict[int, Cost] = {}
        came: dict[int, int] = {}
        step = 0.0 if not stretch.start else float(joint.angles[stretch.start] - joint.angles[stretch.start - 1])
        step = 0.0 if math.isnan(step) else step
        for turns in stretch.tried(joint, list(before)):
            off, away = stretch.cost(joint, turns)
            best: Cost = (off, 0.0, away)
            for last, (offs, turned, aways) in before.items():
                more = round(turned + abs(step + TURN * (turns - last)), 6)
                cost = (off + offs, more, away + aways)
                if turns not in came or cost < best:
                    best, came[turns] = cost, last
            here[turns] = best
        before = here
        back.append(came)
    turns = min(before, key=lambda t: (before[t], abs(t)))
    found = [turns]
    for came in reversed(back[1:]):
        turns = came[turns]
        found.append(turns)
    return found[::-1]


def choose_turns(machine: Machine, poses: Floats, joints: Floats, mode: str, column: int, home: float) -> int:
    """The turns by which a joint as a whole breaks its range in the fewest records."""
    return _best(_Joint.of(machine, poses, joints, mode, column, home), ())[0]


def rewind_in_rapids(
    machine: Machine, path: ToolPath, poses: Floats, joints: Floats, mode: str, home: float
) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Poses and joints, the first joint of head and table turned back in rapid motions, and the records these lead to.

    A motion will do if an even turn of C, with what else of the pose it changes, takes the joint along by as many
    turns, breaks no limit on the way and ends where the joints are to be.
    """
    assert machine.wrist is not None
    column = machine.wrist.first
    joint = _Joint.of(machine, poses, joints, mode, column, home)
    runs = _runs(path)
    known: dict[tuple[int, int, int], int] = {}  # by motion and the turns before and behind it: the turns of C, 0: none
    while True:
        cuts = [run[0] for run in runs]
        turns = _best(joint, cuts)
        unfit = False
        for run, before, behind in zip(runs, turns[:-1], turns[1:], strict=True):
            key = (run[0], before, behind)
            if before == behind:
                continue
            if key not in known:
                known[key] = _turns_of_c(machine, poses, joints, mode, column, key)
            if not known[key]:
                run.pop(0)
                unfit = True
        runs = [run for run in runs if run]
        if not unfit:
            break
    poses, joints, back = poses.copy(), joints.copy(), []
    c = machine.axes.index("C")
    joints[:, column] += TURN * turns[0]
    for cut, before, behind in zip(cuts, turns[:-1], turns[1:], strict=True):
        if before != behind:
            poses[cut:, c] += TURN * known[cut, before, behind]
            joints[cut:, column] += TURN * (behind - before)
            back.append(cut)
    return poses, joints, tuple(back)


def _runs(path: ToolPath) -> list[list[int]]:
    """For each run of rapid motions the records they lead to, those first that are fittest to turn back in.

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
        together = np.bincount(number, length)[number]
        outer = (number == 0) | (number == number[-1])
        order = np.lexsort((-length, -together, outer))
        runs.append((start + order[:_TRIED]).tolist())
    return runs


def _turns_of_c(
    machine: Machine, poses: Floats, joints: Floats, mode: str, column: int, motion: tuple[int, int, int]
) -> int:
    """The turns of C that take the joint along as wanted in the motion to a record; 0 where none do."""
    record, before, behind = motion
    start, goal = joints[record - 1].copy(), joints[record].copy()
    start[column] += TURN * before
    goal[column] += TURN * behind
    if not (np.isfinite(start).all() and np.isfinite(goal).all()):
        return 0
    ends_fine = not machine.check(poses[record - 1 : record + 1], np.array([start, goal]), mode).any()
    for turns in (behind - before, before - behind):
        end = poses[record].copy()
        end[machine.axes.index("C")] += TURN * turns
        along = trace_passage(machine, mode, poses[record - 1], end, start, record)
        off = max(np.abs(along.joints[0] - start).max(), np.abs(along.joints[-1] - goal).max())
        if along.smooth and off < _SAME:
            return turns if not ends_fine or not machine.check(along.poses, along.joints, mode).any() else 0
    return 0
