"""The greatest least value of many smooth rows in a box: linear programs in a region of trust."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..path import Floats

# points (m, d) of the unit box -> rows that must not be below 0 (m, h), and rows whose least counts (m, s)
Rows = Callable[[Floats], tuple[Floats, Floats]]

LOST = -1000.0  # the value of a point where a row is below 0 that must not be, and less by as much as it is
_STEP = 1e-5  # for derivatives
_FIRST, _WIDEST, _FINEST = 0.15, 0.5, 1e-9  # regions of trust
_GAIN = 1e-10  # foretold: less is none
_FLAT = 1e-9  # slope of a row that nothing changes
_SAME = 1e-12  # of rows
_INSIDE = 1e-3  # how far above 0 rows are sought that must not be below


class Top(NamedTuple):
    """A local maximum: the point (d,), what it is worth, and what without the rows that nothing changes there."""

    point: Floats
    worth: float
    rest: float


def score_rows(hard: Floats, soft: Floats) -> Floats:
    """What each point is worth (m,), from its rows; 1 where nothing limits it."""
    low = np.where(np.isnan(hard), -1.0, hard).min(axis=1, initial=np.inf)
    least = np.where(np.isnan(soft), -np.inf, soft).min(axis=1, initial=1.0 if not soft.shape[1] else np.inf)
    worth: Floats = np.where(low < 0.0, LOST + np.maximum(low, LOST), np.maximum(least, 0.5 * LOST))
    return worth


def maximise_least(rows: Rows, start: Floats, rounds: int = 60, trust: float = _FIRST) -> Top:
    """A local maximum of the least soft row in the unit box, from ``start`` (d,).

    Where the least row is one that nothing changes, the least of the others is raised.
    """
    here, d = start, len(start)
    hard, soft = (part[0] for part in rows(start[None]))
    flat = np.zeros(len(soft), bool)
    for _ in range(rounds if d else 0):
        around = np.concatenate([here + _STEP * np.eye(d), here - _STEP * np.eye(d)])
        slopes = [(part[:d] - part[d:]).T / (2.0 * _STEP) for part in rows(around)]
        flat = np.abs(slopes[1]).max(axis=1) < _FLAT
        low, high = np.maximum(-trust, -here), np.minimum(trust, 1.0 - here)
        way, gain = _way(hard, soft[~flat], slopes[0], slopes[1][~flat], low, high)
        if gain < _GAIN:
            break
        there = np.clip(here + way, 0.0, 1.0)
        new_hard, new_soft = (part[0] for part in rows(there[None]))
        before, after = _worth(hard, soft, flat), _worth(new_hard, new_soft, flat)
        made = (after.rest - before.rest) / gain if after.worth >= before.worth - _SAME else -1.0
        if made > 0.0:
            here, hard, soft = there, new_hard, new_soft
        trust = min(_WIDEST, 2.0 * trust) if made > 0.7 else trust if made > 0.2 else 0.3 * trust
        if trust < _FINEST:
            break
    worth = _worth(hard, soft, flat)
    return Top(here, worth.worth, worth.rest)


class _Worth(NamedTuple):
    worth: float
    rest: float


def _worth(hard: Floats, soft: Floats, flat: NDArray[np.bool_]) -> _Worth:
    """What all rows make a point worth, and what those that aren't flat do."""
    return _Worth(float(score_rows(hard[None], soft[None])[0]), float(score_rows(hard[None], soft[None, ~flat])[0]))


def _way(
    hard: Floats, soft: Floats, hard_slopes: Floats, soft_slopes: Floats, low: Floats, high: Floats
) -> tuple[Floats, float]:
    """The step between ``low`` and ``high`` (d,) that raises the least row most, by the slopes, and by how much."""
    from scipy.optimize import linprog

    bounds = list(zip(low.tolist(), high.tolist(), strict=True))
    ok = np.isfinite(hard) & np.isfinite(hard_slopes).all(axis=1)
    hard, hard_slopes = hard[ok], hard_slopes[ok]
    lost = bool((hard < 0.0).any())
    ok = np.isfinite(soft) & np.isfinite(soft_slopes).all(axis=1)
    rows, slopes = (hard, hard_slopes) if lost else (soft[ok], soft_slopes[ok])
    if not len(rows):
        return np.zeros(len(low)), 0.0
    reach = np.abs(slopes) @ np.maximum(-low, high)
    kept = rows - reach <= (rows + reach).min()  # no other can be the least
    rows, slopes = rows[kept], slopes[kept]
    left, right = [np.column_stack([-slopes, np.ones(len(rows))])], [rows]
    if not lost:
        near = hard - np.abs(hard_slopes) @ np.maximum(-low, high) < 0.0
        left.append(np.column_stack([-hard_slopes[near], np.zeros(near.sum())]))
        right.append(hard[near])
    least = float(rows.min())
    most = (_INSIDE if lost else np.inf) - least
    right[0] = right[0] - least  # of the gain: its digits are not lost beside the value's
    found = linprog(
        np.append(np.zeros(len(low)), -1.0),
        A_ub=np.vstack(left),
        b_ub=np.concatenate(right),
        bounds=[*bounds, (0.0, None if np.isinf(most) else most)],
        method="highs",
    )
    if found.x is None:
        return np.zeros(len(low)), 0.0
    return np.asarray(found.x[:-1]), float(found.x[-1])
