"""Where motions first break a limit, and the worst margins on them, by bisection with bounds."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags, Indices
from .ledger import WorstMargin
from .motion_bisection import SECTIONS_AT_ONCE, MotionBisection
from .motion_runs import find_unproved_motions, split_into_blocks
from .motion_sections import Sections
from .motions import MotionPoints, find_pole_crossings

_FIRST_SHARE = 1e-7  # a first share is bracketed to this fraction of a motion
_SHARES = np.arange(1, 8) / 8.0
_WORST_MARGIN = 1e-7  # relative, by which a worst margin may be missed
_MOST_SECTIONS = 1 << 16  # bounded for one answer; then the worst that is known, or the first, stands for it


def find_first_broken_share(bisection: MotionBisection, motion: int, column: int, known: float = 1.0) -> float:
    """Find the share of a motion at which a limit is first broken; ``known`` is one at which it is."""
    section = bisection.select_motions(np.array([motion]))
    side = bisection.motions.compute_determinants(section.first)

    def find_broken(points: MotionPoints) -> Flags:
        if column == bisection.singular:
            there = bisection.motions.compute_determinants(points)
            return bisection.find_passed_singularities(np.broadcast_to(side, len(there)), there)
        return np.asarray(~(points.margins[:, column] >= bisection.floor[column]))

    if find_broken(section.first)[0]:
        return 0.0
    is_of_wrist = column < bisection.limits and bisection.motions.wrist_limits[column]
    if is_of_wrist and find_pole_crossings(section.first, section.last)[0]:
        one, two = float(section.first.margins[0, column]), float(section.last.margins[0, column])
        return one / (one - two) if two < 0.0 else 1.0
    stack, left = [section], _MOST_SECTIONS // len(_SHARES)  # not proved to keep it, the first ones last
    while stack and left:
        section, left = stack.pop(), left - 1
        length = section.end[0] - section.begin[0]
        if section.begin[0] >= known or length <= _FIRST_SHARE or bool(bisection.prover.find_finest(section)[0]):
            continue
        share = section.begin + _SHARES * (section.end - section.begin)
        points = bisection.compute_inner_points(section.select(np.zeros(len(share), np.int64)), share)
        broken = share[find_broken(points)]
        known = min(known, float(broken[0])) if len(broken) else known
        pieces = section.divide(share, points)
        unproved = np.flatnonzero(~_prove_kept(bisection, pieces, column))
        stack += [pieces.select(unproved[[i]]) for i in reversed(range(len(unproved)))]
    return known


def _prove_kept(bisection: MotionBisection, sections: Sections, column: int) -> Flags:
    """Prove that sections can't break a limit first: they keep it, or no leg closes on them."""
    if column == bisection.singular:
        unreachable = [np.isnan(points.joints).any(1) for points in (sections.first, sections.last)]
        return bisection.prover.prove_regular(sections) | (unreachable[0] & unreachable[1])
    return np.asarray(bisection.prover.bound_sections(sections).least[:, column] >= bisection.floor[column])


def find_worst_margins(bisection: MotionBisection, motion: Indices, known: dict[int, float]) -> dict[int, WorstMargin]:
    """Find the least margins of limits on motions by branch and bound, where they are less than those known.

    known : a margin for each column of a limit
    """
    worst = {column: WorstMargin(margin, -1, 1.0) for column, margin in known.items()}
    columns = np.array(list(known))
    motions = bisection.select_motions(motion[bisection.find_reachable(motion)])
    exempt = find_pole_crossings(motions.first, motions.last)[:, None] & bisection.motions.wrist_limits
    stack, left = [motions], _MOST_SECTIONS + len(motions)  # the last ones first: little is kept
    while stack and left > 0:
        sections = stack.pop()
        if len(sections) > SECTIONS_AT_ONCE:
            half = np.arange(len(sections)) < len(sections) // 2
            stack += [sections.select(~half), sections.select(half)]
            continue
        left -= len(sections)
        floor = _compute_floor(bisection, columns, np.array([worst[c].margin for c in columns]))
        bounds = bisection.prover.bound_sections(sections).least[:, columns]
        kept = (bounds >= floor) | exempt[sections.number][:, columns]
        going = ~kept.all(1) & ~bisection.prover.find_finest(sections)
        one, two = sections.first.margins[:, columns], sections.last.margins[:, columns]
        going &= ~(np.isnan(one) & np.isnan(two)).all(1)
        sections = sections.select(going)
        if not len(sections):
            continue
        share = sections.middle
        points = bisection.compute_inner_points(sections, share)
        ignored = np.isnan(points.margins) | exempt[sections.number]
        for column in columns.tolist():
            margins = np.where(ignored[:, column], np.inf, points.margins[:, column])
            i = int(np.argmin(margins))
            if margins[i] < worst[column].margin:
                worst[column] = WorstMargin(float(margins[i]), int(sections.motion[i]), float(share[i]))
        stack.append(sections.halve(share, points))
    return {column: least for column, least in worst.items() if least.motion >= 0}


def _compute_floor(bisection: MotionBisection, columns: Indices, margins: Array) -> Array:
    """Compute the margins below which a worse one than those known counts as worse, (columns,)."""
    slack: Array = np.maximum(0.1 * bisection.prover.tolerance[columns], _WORST_MARGIN * np.abs(margins))
    return margins - slack


def find_worst_on_path(bisection: MotionBisection, known: dict[int, float]) -> dict[int, WorstMargin]:
    """Find the least margins of limits on the whole path, as :func:`find_worst_margins` on some motions."""
    worst = {column: WorstMargin(margin, -1, 1.0) for column, margin in known.items()}
    if not worst:
        return {}
    for records in split_into_blocks(len(bisection.posted.path)):
        columns = np.array(list(worst))
        floor = np.full(bisection.limits, -np.inf)
        floor[columns] = _compute_floor(bisection, columns, np.array([worst[c].margin for c in columns]))
        unproved = find_unproved_motions(bisection.prover, records, floor, whole=False)
        for start in range(0, len(unproved), SECTIONS_AT_ONCE):
            motion = unproved[start : start + SECTIONS_AT_ONCE]
            worst |= find_worst_margins(bisection, motion, {c: least.margin for c, least in worst.items()})
    return {column: least for column, least in worst.items() if least.motion >= 0}
