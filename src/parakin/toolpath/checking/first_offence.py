"""The offence that a path comes to first, with the share of its motion from which the limit is broken."""

from __future__ import annotations

from collections.abc import Sequence
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
from .worst_margins import find_first_broken_share, find_worst_margins


def find_first_offence(posted: Posted, bisection: MotionBisection, offences: Sequence[Offence]) -> Offence | None:
    """Find the offence that the path comes to first, at records or on motions; counted as in ``offences``."""
    counts = {offence.limit: offence.count for offence in offences}
    motions = [tally.motion for tally in bisection.tallies if tally.count]
    if posted.first is not None:
        motions.append(posted.first.record)
    if not motions:
        return None
    motion = min(motions)
    started: list[tuple[float, Offence]] = []
    for column, tally in enumerate(bisection.tallies):
        if tally.count and tally.motion == motion:
            started.append(_find_on_motion(posted, bisection, column))
    if posted.first is not None and posted.first.record == motion:
        started += _list_at_record(posted, bisection)
    first = min(started, key=lambda pair: pair[0])[1]
    return replace(first, count=counts[first.limit])


def _find_on_motion(posted: Posted, bisection: MotionBisection, column: int) -> tuple[float, Offence]:
    """Find from which share the first motion off limits breaks a limit, and the offence at its worst there."""
    tally = bisection.tallies[column]
    if column == bisection.turns:
        offence = make_turns_offence(posted, bisection)
        return offence.begins, offence
    if column == bisection.undecided:
        offence = make_undecided_offence(posted, bisection)
        return offence.begins, offence
    share = find_first_broken_share(bisection, tally.motion, column, tally.share)
    if column == bisection.singular:
        return share, make_singularity_offence(posted, tally.motion, share, tally.count)
    floor = float(bisection.floor[column])
    worst_margins = find_worst_margins(bisection, np.array([tally.motion]), {column: floor})
    worst = worst_margins.get(column, WorstMargin(floor, tally.motion, share))
    return share, make_limit_offence(posted, column, worst, min(share, worst.share), tally.count)


def _list_at_record(posted: Posted, bisection: MotionBisection) -> list[tuple[float, Offence]]:
    """List the limits that the first record off limits breaks, each with the share of its motion where that begins."""
    assert posted.first is not None
    record = posted.first.record
    if record == 0 or not np.isfinite(posted.joints[record - 1]).all():
        return [(1.0, posted.first)]
    margins = posted.machine.margins(posted.poses[[record]], posted.joints[[record]], posted.mode)[0]
    started = [(1.0, posted.first)]
    for column, limit in enumerate(posted.machine.limits):
        if margins[column] < 0.0 or limit == posted.first.limit:
            begins = find_first_broken_share(bisection, record, column)
            offence = posted.first
            if limit != posted.first.limit:
                worst = WorstMargin(float(margins[column]), record, 1.0)
                offence = make_limit_offence(posted, column, worst, 1.0, 0)
            started.append((begins, replace(offence, begins=begins)))
    return started
