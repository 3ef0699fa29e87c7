"""The offences of a path's records and of its motions merged: each broken limit once, at its worst."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..posting.posted import Offence, Posted
from .ledger import WorstMargin
from .motion_bisection import MotionBisection
from .motion_offences import (
    make_limit_offence,
    make_singularity_offence,
    make_turns_offence,
    make_undecided_offence,
)
from .worst_margins import find_first_broken_share, find_worst_on_path

_BETTER = 1e-6  # relative: a point between records must be so much worse than the worst record to stand for the limit
_BLOCK = 1 << 16  # records

OffenceStart = tuple[int, float]  # a motion, and the share of it from which a limit is broken


class OffenceMerger:
    """Merge a posted path's offences at its records with what bisection found on its motions."""

    def __init__(self, posted: Posted, bisection: MotionBisection):
        self.posted, self.bisection = posted, bisection
        self.columns = {name: column for column, name in enumerate(posted.machine.limits)}
        self.of_records = {offence.limit: offence for offence in posted.offences}

    def list_offences(self) -> list[Offence]:
        """List one offence for each broken limit, at its worst, in the order in which the path breaks them."""
        tallies, starts = self.bisection.tallies, self._find_first_records()
        at_records = {
            column: self._compute_margin(offence)
            for name, offence in self.of_records.items()
            if (column := self.columns.get(name)) is not None
        }
        known = {
            column: min(at_records.get(column, math.inf), tally.worst.margin)
            for column, tally in enumerate(tallies[: self.bisection.limits])
        }
        finite = {column: margin for column, margin in known.items() if math.isfinite(margin)}
        worst_margins = find_worst_on_path(self.bisection, finite)
        started: list[tuple[OffenceStart, Offence]] = []
        for name, offence in self.of_records.items():
            column = self.columns.get(name)
            start = starts[name]
            if column is not None:
                tally = tallies[column]
                if tally.count:
                    start = min(start, (tally.motion, tally.share))
                worst = worst_margins.get(column, tally.worst)
                offence = self._replace_if_worse(offence, column, at_records[column], worst)
                offence = replace(offence, count=self.of_records[name].count + tally.count)
            started.append((start, offence))
        for column, tally in enumerate(tallies):
            is_new = column >= self.bisection.limits or self.posted.machine.limits[column] not in self.of_records
            if tally.count and is_new:
                started.append(((tally.motion, tally.share), self._make_motion_offence(column, worst_margins)))
        return [offence for _, offence in sorted(started, key=lambda pair: pair[0])]

    def _replace_if_worse(self, offence: Offence, column: int, margin: float, worst: WorstMargin) -> Offence:
        """Replace the offence at a record, with its margin, if a motion is clearly worse."""
        if worst.margin < margin - max(_BETTER * abs(margin), self.bisection.prover.tolerance[column]):
            return make_limit_offence(self.posted, column, worst, worst.share, 0)
        return offence

    def _make_motion_offence(self, column: int, worst_margins: dict[int, WorstMargin]) -> Offence:
        """Make the offence of a limit that only motions break."""
        tally = self.bisection.tallies[column]
        if column == self.bisection.turns:
            return make_turns_offence(self.posted, self.bisection)
        if column == self.bisection.undecided:
            return make_undecided_offence(self.posted, self.bisection)
        if column == self.bisection.singular:
            share = find_first_broken_share(self.bisection, tally.motion, column, tally.share)
            return make_singularity_offence(self.posted, tally.motion, share, tally.count)
        worst = worst_margins.get(column, tally.worst)
        return make_limit_offence(self.posted, column, worst, worst.share, tally.count)

    def _compute_margin(self, offence: Offence) -> float:
        """Compute the margin of an offence's limit at its record; -inf where it does not exist."""
        posted, row = self.posted, [offence.record]
        margins = posted.machine.margins(posted.poses[row], posted.joints[row], posted.mode)
        margin = float(margins[0, self.columns[offence.limit]])
        return -math.inf if math.isnan(margin) else margin

    def _find_first_records(self) -> dict[str, OffenceStart]:
        """Find the first record that breaks each limit, as the end of its motion."""
        posted, starts = self.posted, {}
        missing = {name: self.columns[name] for name in self.of_records if name in self.columns}
        off_limits = np.flatnonzero(posted.broken)
        for start in range(0, len(off_limits), _BLOCK):
            records = off_limits[start : start + _BLOCK]
            if not missing:
                break
            margins = posted.machine.margins(posted.poses[records], posted.joints[records], posted.mode)
            for name, column in list(missing.items()):
                beyond = (margins[:, column] < 0.0) | (posted.broken[records] == 1 + column)
                if beyond.any():
                    starts[name] = int(records[beyond.argmax()]), 1.0
                    del missing[name]
        for name, offence in self.of_records.items():
            if name not in starts:
                records = np.flatnonzero(posted.broken == 1 + posted.limits.index(name))
                starts[name] = (int(records[0]) if len(records) else offence.record), 1.0
        return starts
