"""Which limits a path of poses breaks, where, by how much, and in which words to tell it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Indices, find_finite_rows, split_rows
from ...machine import Machine
from .frames import PathLimit
from .margin_blocks import BLOCK
from .offence_texts import describe_broken_limit, describe_path_limit
from .posted import Offence

_NO_JOINTS = "reach"  # the path's own limit where joints do not exist and no margin says why
TURNS, SINGULARITY, UNDECIDED = "turns", "singularity", "untold"  # what only motions break


@dataclass(frozen=True, eq=False)
class Judgement:
    """``broken``, ``limits``, ``offences``, ``first`` and ``worst`` as in :class:`~.posted.Posted`."""

    broken: Indices
    limits: tuple[str, ...]
    offences: tuple[Offence, ...]
    first: Offence | None
    worst: Offence | None


@dataclass
class _Tally:
    """One broken limit: how many records break it, the first of them, the worst, and the excess at both."""

    count: int = 0
    first: int = -1
    worst: int = -1
    excess: float = -math.inf
    first_excess: float = 0.0

    def add(self, records: Indices, excess: Array) -> None:
        """Count in ``records`` that break the limit, ascending, and their excess."""
        if not len(records):
            return
        if self.first < 0:
            self.first, self.first_excess = int(records[0]), float(excess[0])
        top = int(np.argmax(excess))
        if excess[top] > self.excess:
            self.worst, self.excess = int(records[top]), float(excess[top])
        self.count += len(records)


def judge_path(
    machine: Machine,
    poses: Array,
    joints: Array,
    lines: Indices,
    mode: str | None = None,
    path_limits: Sequence[PathLimit] = (),
) -> Judgement:
    """Find every limit that poses and the joints taken there break.

    Parameters
    ----------
    poses, joints : (n, axes) and (n, joints), mm and rad
    lines : (n,) source lines
    mode : working mode of the joints
    path_limits : the path's own; they go before the machine's, for there the pose isn't the one asked for
    """
    machine_limits = machine.limit_definitions
    broken: Indices = np.atleast_1d(machine.check(poses, joints, mode))
    limits = (*machine.limits, *(limit.name for limit in path_limits))
    tallies = [_Tally() for _ in limits]
    _tally_margins(machine, poses, joints, mode, broken, tallies)
    for index, limit in enumerate(path_limits, len(machine_limits)):
        records = np.flatnonzero(limit.broken)
        broken[records] = 1 + index
        tallies[index].add(records, np.abs(limit.values[records]))
    lost = np.flatnonzero((broken == 0) & ~find_finite_rows(joints))
    if len(lost):
        limits, tallies = (*limits, _NO_JOINTS), [*tallies, _Tally()]
        broken[lost] = len(limits)
        tallies[-1].add(lost, np.full(len(lost), np.inf))

    def make_offence(index: int, record: int, excess: float) -> Offence:
        if index < len(machine_limits):
            text = describe_broken_limit(machine_limits[index], excess)
        else:
            text = describe_path_limit(path_limits, index - len(machine_limits), record)
        return Offence(limits[index], text.text, record, int(lines[record]), *text.numbers, tallies[index].count)

    seen = sorted((i for i, tally in enumerate(tallies) if tally.count), key=lambda i: (tallies[i].first, i))
    if not seen:
        return Judgement(broken, limits, (), None, None)
    offences = [make_offence(i, tallies[i].worst, tallies[i].excess) for i in seen]
    first_record = min(tallies[i].first for i in seen)
    first_index = int(broken[first_record]) - 1
    first = make_offence(first_index, first_record, tallies[first_index].first_excess)
    return Judgement(broken, limits, tuple(offences), first, find_gravest(machine, offences))


def _tally_margins(
    machine: Machine, poses: Array, joints: Array, mode: str | None, broken: Indices, tallies: Sequence[_Tally]
) -> None:
    """Tally the machine's limits at the records that break one, in place; ``broken`` (n,) is the machine's check."""
    off = np.flatnonzero(broken)
    for block in split_rows(len(off), BLOCK):
        records = off[block]
        margins = machine.margins(poses[records], joints[records], mode)
        beyond = margins < 0.0
        undefined = np.flatnonzero(~beyond.any(axis=1))  # the margin that the check found broken is not a number
        beyond[undefined, broken[records[undefined]] - 1] = True
        excess = np.where(np.isnan(margins), np.inf, -margins)
        for index in np.flatnonzero(beyond.any(axis=0)).tolist():
            tallies[index].add(records[beyond[:, index]], excess[beyond[:, index], index])


def find_gravest(machine: Machine, offences: Sequence[Offence]) -> Offence:
    """Find the offence that is farthest off."""
    return max(offences, key=lambda offence: _rate_gravity(machine, offence))


def _rate_gravity(machine: Machine, offence: Offence) -> tuple[bool, float]:
    """Rate an offence: what can't be reached at all is worse than what only lies out of range."""
    limits = {limit.name: limit for limit in machine.limit_definitions}
    limit = limits.get(offence.limit)
    if offence.limit == TURNS:
        return False, offence.excess
    if limit is None or limit.side == "reach":
        return True, offence.excess
    stem = limit.name.removesuffix(".min").removesuffix(".max")
    ends = [limits[name].bound for name in (f"{stem}.min", f"{stem}.max") if name in limits]
    span = ends[1] - ends[0] if len(ends) == 2 else abs(limit.bound)
    return False, offence.excess / (span or 1.0)
