"""First places and worst values of limits that are known to be broken."""

from __future__ import annotations

import numpy as np

from ..path import Floats
from .motions import Indices, Motions, Places
from .runs import blocks, unproved
from .search import AT_ONCE, Search
from .sections import Flags, Parts

_PLACE = 1e-7  # of a motion: how closely a first place is bracketed
_SHARES = np.arange(1, 8) / 8.0
_WORST = 1e-7  # relative, by which a worst value may be missed

Worst = dict[int, tuple[float, int, float]]  # of each column: the least margin, the motion and the share where it is


def first_place(search: Search, motion: int, column: int, known: float = 1.0) -> float:
    """The share of a motion at which a limit is first broken; ``known`` is one where it is."""
    whole = search.whole(np.array([motion]))
    side = search.motions.sides(whole.start)

    def breaks(places: Places) -> Flags:
        if column == search.singular:
            return search.passed(np.broadcast_to(side, len(places.sign)), search.motions.sides(places))
        return np.asarray(~(places.margins[:, column] >= search.floor[column]))

    if breaks(whole.start)[0]:
        return 0.0
    if column < search.limits and search.motions.of_serial[column] and Motions.over_the_pole(whole.start, whole.end)[0]:
        one, two = float(whole.start.margins[0, column]), float(whole.end.margins[0, column])
        return one / (one - two) if two < 0.0 else 1.0
    stack = [whole]  # not proved to keep it, the first ones last
    while stack:
        part = stack.pop()
        if part.a[0] >= known or part.b[0] - part.a[0] <= _PLACE or bool(search.prover.finest(part)[0]):
            continue
        share = part.a + _SHARES * (part.b - part.a)
        there = search.between(part.take(np.zeros(len(share), np.int64)), share)
        broken = share[breaks(there)]
        known = min(known, float(broken[0])) if len(broken) else known
        pieces = part.pieces(share, there)
        left = np.flatnonzero(~_proved(search, pieces, column))
        stack += [pieces.take(left[[i]]) for i in reversed(range(len(left)))]
    return known


def _proved(search: Search, parts: Parts, column: int) -> Flags:
    """Which parts can't break a limit first: they keep it, or no leg closes on them."""
    if column == search.singular:
        lost = [np.isnan(end.joints).any(1) for end in (parts.start, parts.end)]
        return search.prover.regular(parts) | (lost[0] & lost[1])
    return np.asarray(search.prover.over(parts).least[:, column] >= search.floor[column])


def worst(search: Search, motion: Indices, margins: dict[int, float]) -> Worst:
    """The least margin of some limits on motions, where it is less than one known."""
    best = {column: (margin, -1, 1.0) for column, margin in margins.items()}
    columns = np.array(list(margins))
    whole = search.whole(motion[search.reached(motion - 1) & search.reached(motion)])
    exempt = Motions.over_the_pole(whole.start, whole.end)[:, None] & search.motions.of_serial
    stack = [whole]  # the last ones first: little is kept
    while stack:
        parts = stack.pop()
        if len(parts) > AT_ONCE:
            half = np.arange(len(parts)) < len(parts) // 2
            stack += [parts.take(~half), parts.take(half)]
            continue
        floor = _floors(search, columns, np.array([best[c][0] for c in columns]))
        kept = (search.prover.over(parts).least[:, columns] >= floor) | exempt[parts.number][:, columns]
        going = ~kept.all(1) & ~search.prover.finest(parts)
        one, two = parts.start.margins[:, columns], parts.end.margins[:, columns]
        going &= ~(np.isnan(one) & np.isnan(two)).all(1)
        parts = parts.take(going)
        if not len(parts):
            continue
        share = 0.5 * (parts.a + parts.b)
        there = search.between(parts, share)
        nothing = np.isnan(there.margins) | exempt[parts.number]
        for column in columns.tolist():
            values = np.where(nothing[:, column], np.inf, there.margins[:, column])
            i = int(np.argmin(values))
            if values[i] < best[column][0]:
                best[column] = float(values[i]), int(parts.motion[i]), float(share[i])
        stack.append(parts.halved(share, there))
    return {column: found for column, found in best.items() if found[1] >= 0}


def _floors(search: Search, columns: Indices, margins: Floats) -> Floats:
    slack: Floats = np.maximum(0.1 * search.prover.tolerance[columns], _WORST * np.abs(margins))
    return margins - slack


def worst_anywhere(search: Search, margins: dict[int, float]) -> Worst:
    """As :func:`worst`, on the whole path."""
    best = {column: (margin, -1, 1.0) for column, margin in margins.items()}
    if not best:
        return {}
    for records in blocks(len(search.posted.path)):
        columns = np.array(list(best))
        floor = _scattered(_floors(search, columns, np.array([best[c][0] for c in columns])), columns, search.limits)
        left = unproved(search.prover, records, floor, whole=False)
        for start in range(0, len(left), AT_ONCE):
            some = left[start : start + AT_ONCE]
            best |= worst(search, some, {column: found[0] for column, found in best.items()})
    return {column: found for column, found in best.items() if found[1] >= 0}


def _scattered(floor: Floats, columns: Indices, count: int) -> Floats:
    """A floor for all limits: those not among ``columns`` have none."""
    result = np.full(count, -np.inf)
    result[columns] = floor
    return result
