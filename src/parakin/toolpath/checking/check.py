"""The whole path: every limit between the records too, by bracketing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..posting.offences import SINGULARITY, TURNS, UNDECIDED, describe_broken_limit, find_gravest, format_measure
from ..posting.posted import Offence, Posted
from .search import Search
from .worst import Worst, first_place, worst, worst_anywhere

_BETTER = 1e-6  # relative: a place between records must be so much worse than the worst record to stand for the limit
_BLOCK = 1 << 16  # records
TURN = 2.0 * math.pi


def check_path(posted: Posted, progress: Callable[[float], None] | None = None) -> Posted:
    """A posted path with what its motions break between the records.

    From record to record every coordinate of the pose goes straight and the joints go on as the machine takes them,
    turns counted; where they pass from one working mode of head and table to the other, these go straight from value to
    value. Bounds of the margins' rates over boxes that hold many motions, some of them, parts of one (interval
    arithmetic) prove that a limit is kept; what they don't is cut in halves until they do, or a place is found that
    breaks it. A margin of no less than -1e-9 of the limit's size counts as kept. So is found what no limit names:

    - ``turns``: a turning joint can't go from record to record as their joints tell: it would end up whole turns off,
      or change its working mode farther than 0.01 rad from the pole;
    - ``singularity``: the closed chain passes a parallel singularity, or comes as near as 1e-4 of det A at home;
    - ``untold``: a motion's cutting was given up.

    Motions from or to a record that can't be reached are not looked at. Nor is what the machine's axes can't follow
    (``tilt``, ``X``, ``Y``, ``Z``): on straight motions it is greatest at the records; how far a great circle of the
    tool's axis leaves the pose's own way is a matter of interpolation.

    ``offences`` then has each limit at its worst place, to 1e-7 of its excess, ``first`` the first place within 1e-7
    of its motion. A path checked before is returned as it is.
    """
    if posted.checked:
        return posted
    say = progress or (lambda fraction: None)
    search = Search(posted)
    search.run(lambda fraction: say(0.9 * fraction))
    names = {search.turns: TURNS, search.singular: SINGULARITY, search.undecided: UNDECIDED}
    extra = [column for column in names if search.tallies[column].count]
    limits = (*posted.limits, *(names[column] for column in extra))
    broken_motions = search.broken_motions.copy()
    for number, column in enumerate(extra, len(posted.limits)):
        broken_motions[search.broken_motions == 1 + column] = 1 + number
    offences = _Merged(posted, search).offences()
    first = _first(posted, search, offences)
    grave = find_gravest(posted.machine, offences) if offences else None
    say(1.0)
    return replace(
        posted, limits=limits, offences=tuple(offences), first=first, worst=grave, checked=True,
        broken_motions=broken_motions,
    )  # fmt: skip


class _Merged:
    """The offences of records and motions together."""

    def __init__(self, posted: Posted, search: Search):
        self.posted, self.search = posted, search
        self.columns = {name: column for column, name in enumerate(posted.machine.limits)}
        self.of_records = {offence.limit: offence for offence in posted.offences}

    def offences(self) -> list[Offence]:
        """One for each broken limit at its worst, in the order in which the path breaks them."""
        tallies, firsts = self.search.tallies, self._first_records()
        at_records = {c: self._margin(o) for n, o in self.of_records.items() if (c := self.columns.get(n)) is not None}
        known = {c: min(at_records.get(c, math.inf), t.margin) for c, t in enumerate(tallies[: self.search.limits])}
        worsts = worst_anywhere(self.search, {c: margin for c, margin in known.items() if math.isfinite(margin)})
        found = []
        for name, offence in self.of_records.items():
            column = self.columns.get(name)
            begins = firsts[name]
            if column is not None:
                tally, margin = tallies[column], at_records[column]
                if tally.count:
                    begins = min(begins, (tally.motion, tally.share))
                least, motion, share = worsts.get(column, (tally.margin, tally.worst, tally.at))
                if least < margin - max(_BETTER * abs(margin), self.search.prover.tolerance[column]):
                    offence = offence_on(self.posted, column, motion, share, share, least, 0)
                offence = replace(offence, count=self.of_records[name].count + tally.count)
            found.append((begins, offence))
        for column, tally in enumerate(tallies):
            if tally.count and (
                column >= self.search.limits or self.posted.machine.limits[column] not in self.of_records
            ):
                found.append(((tally.motion, tally.share), self._only_between(column, worsts)))
        return [offence for _, offence in sorted(found, key=lambda pair: pair[0])]

    def _only_between(self, column: int, worsts: Worst) -> Offence:
        tally = self.search.tallies[column]
        if column == self.search.turns:
            return turned(self.posted, self.search)
        if column == self.search.undecided:
            return describe_undecided(self.posted, self.search)
        if column == self.search.singular:
            share = first_place(self.search, tally.motion, column, tally.share)
            return passing(self.posted, tally.motion, share, tally.count)
        margin, motion, share = worsts.get(column, (tally.margin, tally.worst, tally.at))
        return offence_on(self.posted, column, motion, share, share, margin, tally.count)

    def _margin(self, offence: Offence) -> float:
        """Of the limit at the offence's record."""
        posted, row = self.posted, [offence.record]
        margins = posted.machine.margins(posted.poses[row], posted.joints[row], posted.mode)
        margin = float(margins[0, self.columns[offence.limit]])
        return -math.inf if math.isnan(margin) else margin

    def _first_records(self) -> dict[str, tuple[int, float]]:
        """The first record that breaks each limit, as a place on its motion."""
        posted, firsts = self.posted, {}
        missing = {name: self.columns[name] for name in self.of_records if name in self.columns}
        off = np.flatnonzero(posted.broken)
        for start in range(0, len(off), _BLOCK):
            records = off[start : start + _BLOCK]
            if not missing:
                break
            margins = posted.machine.margins(posted.poses[records], posted.joints[records], posted.mode)
            for name, column in list(missing.items()):
                beyond = (margins[:, column] < 0.0) | (posted.broken[records] == 1 + column)
                if beyond.any():
                    firsts[name] = int(records[beyond.argmax()]), 1.0
                    del missing[name]
        for name, offence in self.of_records.items():
            if name not in firsts:
                own = np.flatnonzero(posted.broken == 1 + posted.limits.index(name))
                firsts[name] = (int(own[0]) if len(own) else offence.record), 1.0
        return firsts


def offence_on(
    posted: Posted, column: int, motion: int, share: float, begins: float, margin: float, count: int
) -> Offence:
    """A limit of the machine broken on a motion."""
    limit = posted.machine.limit_parts[column]
    said = describe_broken_limit(limit, -margin)
    line = int(posted.path.line[motion])
    return Offence(limit.name, said.text, motion, line, *said.numbers, count, share, begins)


def turned(posted: Posted, search: Search) -> Offence:
    """A joint that turns more than the records tell."""
    jump = search.jump
    assert jump is not None
    name, line = posted.machine.joints[jump.joint], int(posted.path.line[jump.motion])
    told, count = jump.told, search.tallies[search.turns].count
    if jump.beside is None:
        swing = told - TURN * round(jump.by / TURN)
        by, counted = (format_measure(value, "rad", 0.0) for value in (swing, told))
        text = f"joint {name} would turn by {by} from the record before, not by {counted}"
        return Offence(TURNS, text, jump.motion, line, swing, told, "rad", abs(swing - told), count)
    by, beside = (format_measure(abs(value), "rad", 0.0) for value in (jump.by, jump.beside))
    text = f"joint {name} would have to turn by {by} at once, where the tool passes {beside} beside its axis"
    share, by_how_much = jump.share, abs(jump.by)
    return Offence(TURNS, text, jump.motion, line, by_how_much, 0.0, "rad", by_how_much, count, share, share)


def passing(posted: Posted, motion: int, share: float, count: int) -> Offence:
    """A parallel singularity on a motion."""
    line = int(posted.path.line[motion])
    text = "the machine would pass a parallel singularity"
    return Offence(SINGULARITY, text, motion, line, 0.0, 0.0, "1", math.inf, count, share, share)


def describe_undecided(posted: Posted, search: Search) -> Offence:
    """A motion that could not be decided on."""
    tally = search.tallies[search.undecided]
    text = "whether this motion keeps all limits can't be told"
    line = int(posted.path.line[tally.motion])
    return Offence(UNDECIDED, text, tally.motion, line, math.nan, 0.0, "1", math.inf, tally.count)


def _first(posted: Posted, search: Search, offences: Sequence[Offence]) -> Offence | None:
    """The offence that the path comes to first."""
    counts = {offence.limit: offence.count for offence in offences}
    motions = [tally.motion for tally in search.tallies if tally.count]
    if posted.first is not None:
        motions.append(posted.first.record)
    if not motions:
        return None
    motion = min(motions)
    found: list[tuple[float, Offence]] = []
    for column, tally in enumerate(search.tallies):
        if tally.count and tally.motion == motion:
            found.append(_begun(posted, search, column))
    if posted.first is not None and posted.first.record == motion:
        found += _at_record(posted, search)
    first = min(found, key=lambda pair: pair[0])[1]
    return replace(first, count=counts[first.limit])


def _begun(posted: Posted, search: Search, column: int) -> tuple[float, Offence]:
    """A limit that is broken on the first motion off limits, from where, and with its worst there."""
    tally = search.tallies[column]
    if column == search.turns:
        offence = turned(posted, search)
        return offence.begins, offence
    if column == search.undecided:
        return 1.0, describe_undecided(posted, search)
    share = first_place(search, tally.motion, column, tally.share)
    if column == search.singular:
        return share, passing(posted, tally.motion, share, tally.count)
    found = worst(search, np.array([tally.motion]), {column: float(search.floor[column])})
    margin, _, at = found.get(column, (float(search.floor[column]), tally.motion, share))
    return share, offence_on(posted, column, tally.motion, at, min(share, at), margin, tally.count)


def _at_record(posted: Posted, search: Search) -> list[tuple[float, Offence]]:
    """The limits that the first record off limits breaks, each from where on the motion to it."""
    assert posted.first is not None
    record = posted.first.record
    if record == 0 or not np.isfinite(posted.joints[record - 1]).all():
        return [(1.0, posted.first)]
    margins = posted.machine.margins(posted.poses[[record]], posted.joints[[record]], posted.mode)[0]
    found = [(1.0, posted.first)]
    for column, limit in enumerate(posted.machine.limits):
        if margins[column] < 0.0 or limit == posted.first.limit:
            begins = first_place(search, record, column)
            offence = posted.first
            if limit != posted.first.limit:
                offence = offence_on(posted, column, record, 1.0, 1.0, float(margins[column]), 0)
            found.append((begins, replace(offence, begins=begins)))
    return found
