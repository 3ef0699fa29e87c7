"""Local search from many starts at a time: maxima by a compass, roots by least squares. Found, not proved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array

Indices = NDArray[np.int64]
Values = Callable[[Array, Indices], Array]  # points (N, d), the search each belongs to (N,) -> (N,); NaN: not allowed

_ROUNDS = 200
_FINEST = 1e-10  # of the first step
_RANDOM = 3  # directions at random, and near the last one that led on, for each axis: edges of the region slant


def climb(value: Values, starts: Array, step: Array, finest: float = _FINEST) -> tuple[Array, Array]:
    """Local maxima (m, d) of ``value`` and what it is there (m,), from starts (m, d): a compass search.

    ``step`` (d,) is as far as it looks at first, ``finest`` times that at last. All searches go on side by
    side, in the same directions every time.
    """
    rng = np.random.default_rng(7)
    count, d = starts.shape
    here, lead, search = starts.copy(), np.zeros((count, d)), np.arange(count)
    best = _known(value(here, search))
    width, full = np.ones(count), np.vstack([np.eye(d), -np.eye(d)])
    for _ in range(_ROUNDS):
        alive = np.flatnonzero((width > finest) & np.isfinite(best))
        if not len(alive):
            break
        random = rng.normal(size=(2, _RANDOM * d, d))
        led = lead[alive, None] + random[1] * np.geomspace(1.0, 0.01, _RANDOM * d)[:, None]
        ways = np.concatenate(
            [np.broadcast_to(np.vstack([full, random[0]]), (len(alive), (_RANDOM + 2) * d, d)), led], 1
        )
        ways /= np.linalg.norm(ways, axis=2, keepdims=True)
        points = here[alive, None] + width[alive, None, None] * step * ways
        found = _known(value(points.reshape(-1, d), np.repeat(alive, ways.shape[1]))).reshape(len(alive), -1)
        which = found.argmax(1)
        row = np.arange(len(alive))
        better = found[row, which] > best[alive]
        moved = alive[better]
        here[moved], best[moved] = points[row, which][better], found[row, which][better]
        lead[moved] = ways[row, which][better]
        width[alive] *= np.where(better, 1.5, 0.6)
    return here, best


def climb_within(
    value: Callable[[Array], Array], low: Array, high: Array, starts: Array, finest: float
) -> tuple[Array, Array]:
    """As :func:`climb`, in a box; ``finest`` is a share of a quarter of it."""

    def inside(points: Array, _: Indices) -> Array:
        within = ((points >= low) & (points <= high)).all(1)
        return np.where(within, value(np.clip(points, low, high)), np.nan)

    return climb(inside, starts, 0.25 * (high - low), finest)


def _known(values: Array) -> Array:
    return np.where(np.isnan(values), -np.inf, values)


def best_of_blocks(points: Array, values: Array, blocks: int) -> Indices:
    """The index of the greatest value in each of some ``blocks`` boxes that the points (N, d) fill."""
    d = points.shape[1]
    each = max(1, round(blocks ** (1.0 / d)))
    low, high = points.min(0), points.max(0)
    cell = np.minimum((each * (points - low) / np.where(high > low, high - low, 1.0)).astype(int), each - 1)
    number = cell @ each ** np.arange(d)
    order = np.lexsort((-_known(values), number))
    first = order[np.unique(number[order], return_index=True)[1]]
    return np.asarray(first[values[first] > -np.inf])


def spread(points: Array, values: Array, count: int, apart: Array) -> Indices:
    """Up to ``count`` indices of the greatest values, no two of them closer than ``apart`` (d,) in every coordinate."""
    found: list[int] = []
    for index in np.argsort(-_known(values), kind="stable")[: 50 * count].tolist():
        if len(found) == count or not values[index] > -np.inf:
            break
        if all((np.abs(points[index] - points[other]) >= apart).any() for other in found):
            found.append(index)
    return np.array(found, np.int64)


def roots(residuals: Callable[[Array], Array], starts: Array, step: Array) -> tuple[Array, Array, Array]:
    """Points (m, d) where residuals (m, k) are least by squares (Levenberg and Marquardt), from starts (m, d).

    Returns the points, the greatest residual there (m,), and the rank deficiency (m,): the least singular value of the
    residuals' derivative as a share of its greatest, 0 where the root is one of a curve of them. ``step`` (d,) scales
    the coordinates.
    """
    count, d = starts.shape
    here, damping = starts.copy(), np.full(count, 1e-3)
    r = residuals(here)
    for _ in range(60):
        slopes = _slopes(residuals, here, step)
        normal = slopes.swapaxes(1, 2) @ slopes
        size = np.einsum("nii->n", normal)[:, None, None] + 1e-300
        way = -np.linalg.solve(
            normal + damping[:, None, None] * size * np.eye(d), slopes.swapaxes(1, 2) @ r[:, :, None]
        )
        there = here + np.clip(way[:, :, 0], -2.0, 2.0) * step
        new = residuals(there)
        with np.errstate(invalid="ignore", over="ignore"):
            better = (new * new).sum(1) < (r * r).sum(1)
        here[better], r[better] = there[better], new[better]
        damping = np.clip(np.where(better, 0.1 * damping, 10.0 * damping), 1e-18, 1e6)
    worst = np.abs(r).max(1)
    sizes = np.linalg.svd(_slopes(residuals, here, step), compute_uv=False)
    return here, np.where(np.isnan(worst), np.inf, worst), sizes[:, -1] / (sizes[:, 0] + 1e-300)


def _slopes(residuals: Callable[[Array], Array], here: Array, step: Array) -> Array:
    """Derivatives (m, k, d) by coordinates in units of ``step``; 0 where they are not numbers."""
    h = 1e-5
    columns = [(residuals(here + h * way) - residuals(here - h * way)) / (2.0 * h) for way in np.diag(step)]
    return np.nan_to_num(np.stack(columns, -1), nan=0.0, posinf=0.0, neginf=0.0)
