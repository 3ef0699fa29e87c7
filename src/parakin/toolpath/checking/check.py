"""Check a posted path everywhere: every limit at the records and on the motions between them."""

from __future__ import annotations

from dataclasses import replace

from ...arrays import Progress
from ..posting.offences import SINGULARITY, TURNS, UNDECIDED, find_gravest
from ..posting.posted import Posted
from .first_offence import find_first_offence
from .merged_offences import OffenceMerger
from .motion_bisection import MotionBisection


def check_path(posted: Posted, progress: Progress | None = None) -> Posted:
    """Check the motions between a posted path's records by interval arithmetic and bisection.

    From record to record every coordinate of the pose goes straight and the joints go on without a jump, turns counted;
    where they pass from one working mode of the wrist to the other, its joints go straight from value to value. Bounds
    of the margins' derivatives over boxes that hold many motions, some of them, or sections of one prove that a limit
    is kept. What they do not prove is halved until they do, or a point is found that breaks the limit. A margin of no
    less than -1e-9 of the limit's size counts as kept. Besides the machine's limits the check finds:

    - ``turns``: a turning joint can't go from record to record as their joints tell: it would end up whole turns off,
      or change its working mode farther than 0.01 rad from the pole;
    - ``singularity``: the closed chain passes a parallel singularity, or comes as near as 1e-4 of det A at home;
    - ``untold``: the bisection of a motion was given up, and whether it keeps its limits is undecided.

    Motions from or to a record that can't be reached are not checked. Nor is what the machine's axes can't follow
    (``tilt``, ``X``, ``Y``, ``Z``): on straight motions it is greatest at the records; how far a great circle of the
    tool's axis leaves the pose's straight way is a matter of interpolation.

    ``offences`` of the result has each limit at its worst point, to 1e-7 of its excess; ``first`` is the first point
    off limits, within 1e-7 of its motion. A path that is checked already is returned as it is.
    """
    if posted.checked:
        return posted
    report = progress or (lambda fraction: None)
    bisection = MotionBisection(posted)
    bisection.check_motions(lambda fraction: report(0.9 * fraction))
    names = {bisection.turns: TURNS, bisection.singular: SINGULARITY, bisection.undecided: UNDECIDED}
    broken_columns = [column for column in names if bisection.tallies[column].count]
    limits = (*posted.limits, *(names[column] for column in broken_columns))
    broken_motions = bisection.broken_motions.copy()
    for number, column in enumerate(broken_columns, len(posted.limits)):
        broken_motions[bisection.broken_motions == 1 + column] = 1 + number
    offences = OffenceMerger(posted, bisection).list_offences()
    first = find_first_offence(posted, bisection, offences)
    worst = find_gravest(posted.machine, offences) if offences else None
    report(1.0)
    return replace(
        posted, limits=limits, offences=tuple(offences), first=first, worst=worst, checked=True,
        broken_motions=broken_motions,
    )  # fmt: skip
