"""Offences on motions: a limit of the machine, turns that can't go on, a singularity, an undecided motion."""

from __future__ import annotations

import math

from ...kinematics.turns import TURN
from ..posting.offence_texts import describe_broken_limit, format_bound, format_measure
from ..posting.offences import SINGULARITY, TURNS, UNDECIDED
from ..posting.posted import Offence, Posted
from .ledger import Doubt, WorstMargin
from .motion_bisection import MotionBisection


def make_limit_offence(posted: Posted, column: int, worst: WorstMargin, begins: float, count: int) -> Offence:
    """Make the offence of a limit of the machine, by its worst margin on a motion."""
    limit = posted.machine.limit_definitions[column]
    described = describe_broken_limit(limit, -worst.margin)
    line = int(posted.path.line[worst.motion])
    return Offence(limit.name, described.text, worst.motion, line, *described.numbers, count, worst.share, begins)


def make_turns_offence(posted: Posted, bisection: MotionBisection) -> Offence:
    """Make the offence of the first turning joint that jumps, or turns farther than the records tell."""
    jump = bisection.jump
    assert jump is not None
    name, line = posted.machine.joints[jump.joint], int(posted.path.line[jump.motion])
    count = bisection.tallies[bisection.turns].count
    if jump.off_axis is None:
        swing = jump.counted - TURN * round(jump.change / TURN)
        by, counted = (format_measure(angle, "rad", 0.0) for angle in (swing, jump.counted))
        text = f"joint {name} would turn by {by} from the record before, not by {counted}"
        excess = abs(swing - jump.counted)
        return Offence(TURNS, text, jump.motion, line, swing, jump.counted, "rad", excess, count)
    by, beside = (format_measure(abs(angle), "rad", 0.0) for angle in (jump.change, jump.off_axis))
    text = f"joint {name} would have to turn by {by} at once, where the tool passes {beside} beside its axis"
    share, change = jump.share, abs(jump.change)
    return Offence(TURNS, text, jump.motion, line, change, 0.0, "rad", change, count, share, share)


def make_singularity_offence(posted: Posted, motion: int, share: float, count: int) -> Offence:
    """Make the offence of a parallel singularity on a motion."""
    line = int(posted.path.line[motion])
    text = "the machine would pass a parallel singularity"
    return Offence(SINGULARITY, text, motion, line, 0.0, 0.0, "1", math.inf, count, share, share)


def make_undecided_offence(posted: Posted, bisection: MotionBisection) -> Offence:
    """Make the offence of the first motion that bisection could not decide, with what hinders the proof."""
    tally, doubt = bisection.tallies[bisection.undecided], bisection.doubt
    text, share = "whether this motion keeps all limits can't be told", 1.0
    if doubt is not None and doubt.motion == tally.motion:
        text, share = f"{text}: {_describe_doubt(posted, doubt)}", doubt.share
    line = int(posted.path.line[tally.motion])
    return Offence(UNDECIDED, text, tally.motion, line, math.nan, 0.0, "1", math.inf, tally.count, share, share)


def _describe_doubt(posted: Posted, doubt: Doubt) -> str:
    machine = posted.machine
    if doubt.joint is not None:
        joint, turn = machine.joints[doubt.joint], format_measure(doubt.turn, "rad", 0.0)
        return f"joint {joint} goes {turn} on a short piece of it"
    if doubt.column is None:
        return "no bound keeps it from a parallel singularity"
    limit = machine.limit_definitions[doubt.column]
    if limit.side == "reach":
        return f"{limit.subject} nearly can't close"
    value, bound = limit.value(doubt.margin), format_bound(limit.bound, limit.unit)
    return f"{limit.subject} is {format_measure(value, limit.unit, limit.bound)}, limit {bound}"
