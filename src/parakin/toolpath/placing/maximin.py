"""Maximin: the greatest least value of many smooth rows in a box, by linear programs within a trust region."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from ...arrays import Array, Flags

# Points (m, d) of the unit box -> hard rows (m, h), which must not be negative; soft rows (m, s), whose least counts.
Rows: TypeAlias = Callable[[Array], tuple[Array, Array]]

LOST = -1000.0  # what a point is worth where a hard row is negative, and less by as much as that is
_STEP = 1e-5  # of the box, for derivatives
_FIRST, _WIDEST, _FINEST = 0.15, 0.5, 1e-9  # of the box: radii of the trust region
_GAIN = 1e-10  # predicted: a smaller one ends the search
_FLAT = 1e-9  # slope of a row that nothing changes
_SAME = 1e-12  # of rows
_INSIDE = 1e-3  # how far hard rows are raised above zero while one is negative
_MADE, _WEAK = (
    0.7,
    0.2,
)  # of the predicted gain: a step that makes more widens the region, one that makes less shrinks it


class LocalMaximum(NamedTuple):
    """A point (d,), what it is worth, and what it is worth without the rows that nothing changes there."""

    point: Array
    worth: float
    rest: float


def score_rows(hard: Array, soft: Array) -> Array:
    """Score points by their rows (m, ...): the least soft row, (m,); one where nothing limits a point."""
    low = np.where(np.isnan(hard), -1.0, hard).min(axis=1, initial=np.inf)
    least = np.where(np.isnan(soft), -np.inf, soft).min(axis=1, initial=1.0 if not soft.shape[1] else np.inf)
    worth: Array = np.where(low < 0.0, LOST + np.maximum(low, LOST), np.maximum(least, 0.5 * LOST))
    return worth


def find_local_maximum(rows: Rows, start: Array, rounds: int = 60, trust: float = _FIRST) -> LocalMaximum:
    """Find a local maximum of the least soft row in the unit box, from ``start`` (d,): sequential linear programs.

    Where the least row is one that nothing changes, the least of the others is raised.
    """
    here, d = start, len(start)
    hard, soft = (values[0] for values in rows(start[None]))
    is_flat = np.zeros(len(soft), bool)
    for _ in range(rounds if d else 0):
        around = np.concatenate([here + _STEP * np.eye(d), here - _STEP * np.eye(d)])
        hard_slopes, soft_slopes = ((values[:d] - values[d:]).T / (2.0 * _STEP) for values in rows(around))
        is_flat = np.abs(soft_slopes).max(axis=1) < _FLAT
        low, high = np.maximum(-trust, -here), np.minimum(trust, 1.0 - here)
        step, gain = _find_best_step(
            _Linear(hard, hard_slopes), _Linear(soft[~is_flat], soft_slopes[~is_flat]), low, high
        )
        if gain < _GAIN:
            break
        there = np.clip(here + step, 0.0, 1.0)
        new_hard, new_soft = (values[0] for values in rows(there[None]))
        before, after = _score_point(hard, soft, is_flat), _score_point(new_hard, new_soft, is_flat)
        made = (after.rest - before.rest) / gain if after.worth >= before.worth - _SAME else -1.0
        if made > 0.0:
            here, hard, soft = there, new_hard, new_soft
        trust = min(_WIDEST, 2.0 * trust) if made > _MADE else trust if made > _WEAK else 0.3 * trust
        if trust < _FINEST:
            break
    return LocalMaximum(here, *_score_point(hard, soft, is_flat))


class _Worth(NamedTuple):
    """The scores of a point: by all rows, and by those that are not flat."""

    worth: float
    rest: float


def _score_point(hard: Array, soft: Array, is_flat: Flags) -> _Worth:
    return _Worth(float(score_rows(hard[None], soft[None])[0]), float(score_rows(hard[None], soft[None, ~is_flat])[0]))


class _Linear(NamedTuple):
    """Rows about a point: their values (k,) and slopes (k, d)."""

    values: Array
    slopes: Array

    def keep_finite(self) -> _Linear:
        """Keep the rows whose value and slopes are finite."""
        finite = np.isfinite(self.values) & np.isfinite(self.slopes).all(axis=1)
        return _Linear(self.values[finite], self.slopes[finite])


def _find_best_step(hard: _Linear, soft: _Linear, low: Array, high: Array) -> tuple[Array, float]:
    """Find the step between ``low`` and ``high`` (d,) that raises the least row most, by linear programming."""
    from scipy.optimize import linprog

    hard = hard.keep_finite()
    is_lost = bool((hard.values < 0.0).any())
    values, slopes = hard if is_lost else soft.keep_finite()
    if not len(values):
        return np.zeros(len(low)), 0.0
    change = np.abs(slopes) @ np.maximum(-low, high)
    can_be_least = values - change <= (values + change).min()
    values, slopes = values[can_be_least], slopes[can_be_least]
    left, right = [np.column_stack([-slopes, np.ones(len(values))])], [values]
    if not is_lost:
        near = hard.values - np.abs(hard.slopes) @ np.maximum(-low, high) < 0.0
        left.append(np.column_stack([-hard.slopes[near], np.zeros(near.sum())]))
        right.append(hard.values[near])
    least = float(values.min())
    most = (_INSIDE if is_lost else np.inf) - least
    right[0] = right[0] - least  # the program is of the gain: its digits are not lost beside the value's
    gain_bounds = (0.0, None if np.isinf(most) else most)
    optimum = linprog(
        np.append(np.zeros(len(low)), -1.0),
        A_ub=np.vstack(left),
        b_ub=np.concatenate(right),
        bounds=[*zip(low.tolist(), high.tolist(), strict=True), gain_bounds],
        method="highs",
    )
    if optimum.x is None:
        return np.zeros(len(low)), 0.0
    return np.asarray(optimum.x[:-1]), float(optimum.x[-1])
