"""Which limits a path of poses breaks, where, by how much, and how to say it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...machine import Machine
from ...model.limits import Limit
from ..path import Floats
from .frames import PathLimit
from .posted import Offence, Posted

_BLOCK = 1 << 16  # records whose margins are held at once
_NO_JOINTS = "reach"  # the path's own limit for what no margin tells
TURNS, SINGULARITY, UNDECIDED = "turns", "singularity", "untold"  # what only motions break


@dataclass(frozen=True, eq=False)
class Judgement:
    """``broken``, ``limits``, ``offences``, ``first`` and ``worst`` as in ``Posted``."""

    broken: NDArray[np.int64]
    limits: tuple[str, ...]
    offences: tuple[Offence, ...]
    first: Offence | None
    worst: Offence | None


@dataclass
class _Tally:
    """What is known of one broken limit: how many records, the first, the worst."""

    count: int = 0
    first: int = -1
    worst: int = -1
    excess: float = -math.inf
    first_excess: float = 0.0

    def add(self, records: NDArray[np.int64], excess: Floats) -> None:
        """``records`` that break it, ascending, and their excess."""
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
    poses: Floats,
    joints: Floats,
    lines: NDArray[np.int64],
    mode: str | None = None,
    own: Sequence[PathLimit] = (),
) -> Judgement:
    """Every limit that poses and the joints taken there break.

    Parameters
    ----------
    poses, joints : (n, axes) and (n, joints), mm and rad
    lines : (n,) source lines
    mode : working mode of the joints
    own : limits that are the path's; they go before the machine's, for there the pose isn't the one asked for
    """
    parts = machine.limit_parts
    broken: NDArray[np.int64] = np.atleast_1d(machine.check(poses, joints, mode))
    limits = (*machine.limits, *(limit.name for limit in own))
    tallies = [_Tally() for _ in limits]
    off = np.flatnonzero(broken)
    for start in range(0, len(off), _BLOCK):
        records = off[start : start + _BLOCK]
        margins = machine.margins(poses[records], joints[records], mode)
        beyond = margins < 0.0
        unsaid = np.flatnonzero(~beyond.any(axis=1))  # the check's first margin is not a number there
        beyond[unsaid, broken[records[unsaid]] - 1] = True
        excess = np.where(np.isnan(margins), np.inf, -margins)
        for index in np.flatnonzero(beyond.any(axis=0)).tolist():
            tallies[index].add(records[beyond[:, index]], excess[beyond[:, index], index])
    for index, limit in enumerate(own, len(parts)):
        records = np.flatnonzero(limit.broken)
        broken[records] = 1 + index
        tallies[index].add(records, np.abs(limit.values[records]))
    lost = np.flatnonzero((broken == 0) & ~np.isfinite(joints).all(axis=1))
    if len(lost):
        limits, tallies = (*limits, _NO_JOINTS), [*tallies, _Tally()]
        broken[lost] = len(limits)
        tallies[-1].add(lost, np.full(len(lost), np.inf))

    def offence(index: int, record: int, excess: float) -> Offence:
        said = (
            describe_broken_limit(parts[index], excess) if index < len(parts) else _own(own, index - len(parts), record)
        )
        count = tallies[index].count
        return Offence(limits[index], said.text, record, int(lines[record]), *said.numbers, count)

    seen = sorted((i for i, tally in enumerate(tallies) if tally.count), key=lambda i: (tallies[i].first, i))
    if not seen:
        return Judgement(broken, limits, (), None, None)
    offences = [offence(i, tallies[i].worst, tallies[i].excess) for i in seen]
    start_record = min(tallies[i].first for i in seen)
    start_index = int(broken[start_record]) - 1
    first = offence(start_index, start_record, tallies[start_index].first_excess)
    return Judgement(broken, limits, tuple(offences), first, find_gravest(machine, offences))


@dataclass(frozen=True)
class OffenceText:
    """An offence's text and its value, bound, unit and excess."""

    text: str
    numbers: tuple[float, float, str, float]


def _own(own: Sequence[PathLimit], index: int, record: int) -> OffenceText:
    if index == len(own):
        return OffenceText("the machine can't take this pose", (math.nan, math.nan, "1", math.inf))
    limit = own[index]
    value = float(limit.values[record])
    return OffenceText(limit.text(format_measure(value, limit.unit, 0.0)), (value, 0.0, limit.unit, abs(value)))


def describe_broken_limit(limit: Limit, excess: float) -> OffenceText:
    """What to say of a limit of the machine that is broken by ``excess``, its margin below 0."""
    if limit.side == "reach":
        return _reach(limit, excess)
    if not math.isfinite(excess):
        return OffenceText(f"{limit.subject} can't be told at this pose", (math.nan, limit.bound, limit.unit, math.inf))
    value = limit.value(-excess)
    would_be, bound = format_measure(value, limit.unit, limit.bound), format_bound(limit.bound, limit.unit)
    text = f"{limit.subject} would be {would_be}, limit {bound}"
    return OffenceText(text, (value, limit.bound, limit.unit, excess))


def _reach(limit: Limit, excess: float) -> OffenceText:
    if limit.unit == "1":
        return OffenceText("the head can't point the tool that way", (-excess, 0.0, "1", excess))
    text = f"{limit.subject} can't close"
    if not math.isfinite(excess):
        return OffenceText(text, (math.nan, 0.0, "mm", math.inf))
    if limit.bound > 0.0:
        rod = limit.bound
        needed = math.sqrt(rod * rod + excess)
        shown = format_measure(needed - rod, "mm", 0.0)
        return OffenceText(f"{text}: its rod would have to be {shown} longer", (needed, rod, "mm", needed - rod))
    return OffenceText(f"{text} there", (-math.sqrt(excess), 0.0, "mm", math.sqrt(excess)))


def find_gravest(machine: Machine, offences: Sequence[Offence]) -> Offence:
    """The one farthest off."""
    return max(offences, key=lambda offence: _gravity(machine, offence))


def _gravity(machine: Machine, offence: Offence) -> tuple[bool, float]:
    """What can't be reached at all is worse than what only lies out of range."""
    parts = {limit.name: limit for limit in machine.limit_parts}
    limit = parts.get(offence.limit)
    if offence.limit == TURNS:
        return False, offence.excess
    if limit is None or limit.side == "reach":
        return True, offence.excess
    ends = [parts[name].bound for name in _both_ends(limit.name) if name in parts]
    span = ends[1] - ends[0] if len(ends) == 2 else abs(limit.bound)
    return False, offence.excess / (span or 1.0)


def _both_ends(name: str) -> tuple[str, str]:
    stem = name.removesuffix(".min").removesuffix(".max")
    return f"{stem}.min", f"{stem}.max"


def describe_place(posted: Posted, offence: Offence) -> str:
    """Where an offence is: ``part.cls:214`` at a record, on a motion ``part.cls:214: 37 % on the way there, X 12.3 Y
    -40.1 Z -1650.2``; ``from 37 %`` where it begins there and its value is that of a later place."""
    where = f"{posted.path.source}:{offence.line}"
    if offence.share >= 1.0:
        return where
    start, end = posted.poses[offence.record - 1], posted.poses[offence.record]
    named = zip(posted.machine.axes, start + offence.begins * (end - start), strict=True)
    tip = " ".join(f"{letter} {value:.1f}" for letter, value in named if letter in "XYZ")
    since = "from " if offence.begins < offence.share else ""
    return f"{where}: {since}{_percent(offence.begins)} % on the way there, {tip}"


def _percent(share: float) -> str:
    percent = 100.0 * share
    return f"{percent:.0f}" if 1.0 <= percent <= 99.0 else f"{percent:.2f}"


def format_measure(value: float, unit: str, against: float) -> str:
    """A value with its unit, in as many digits as it takes to see that it isn't the value it is held against.

    rad are shown as degrees; ``1,533.2 mm``, ``12.34°``.
    """
    shown, other = (math.degrees(value), math.degrees(against)) if unit == "rad" else (value, against)
    digits = 1
    while digits < 9 and abs(shown - other) < 10.0**-digits:
        digits += 1
    return _with_unit(f"{shown:,.{digits}f}", unit)


def format_bound(value: float, unit: str) -> str:
    """A limit's bound: a round number as such, ``1,520``; angles with their sign, ``60°``."""
    shown = math.degrees(value) if unit == "rad" else value
    text = f"{shown:,.6f}".rstrip("0").rstrip(".")
    return f"{text}°" if unit == "rad" else text


def _with_unit(text: str, unit: str) -> str:
    return f"{text}°" if unit == "rad" else text if unit == "1" else f"{text} {unit}"
