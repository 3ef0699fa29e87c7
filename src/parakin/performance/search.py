"""Local search from many starts at a time: maxima by a compass search, roots by least squares. Nothing is proved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array, Indices
from ..budget import Budget

# Points (N, d), the search each belongs to (N,) -> values (N,); NaN: not allowed.
Objective = Callable[[Array, Indices], Array]

_ROUNDS = 200
_FINEST = 1e-10  # last step as a fraction of the first
_RANDOM = 3  # directions at random, and near the last one that led on, for each axis: edges of the region slant


def search_maxima(
    objective: Objective, starts: Array, step: Array, finest: float = _FINEST, budget: Budget | None = None
) -> tuple[Array, Array]:
    """Find local maxima (m, d) of an objective and its values (m,) there, from starts (m, d), by compass search.

    ``step`` (d,) is the first step, ``finest`` times that the last. All searches go on side by side, in the same
    directions every time, until the budget is spent.
    """
    rng = np.random.default_rng(7)
    count, d = starts.shape
    points, lead, search = starts.copy(), np.zeros((count, d)), np.arange(count)
    best = _replace_nan(objective(points, search))
    width, axes = np.ones(count), np.vstack([np.eye(d), -np.eye(d)])
    for _ in range(_ROUNDS):
        alive = np.flatnonzero((width > finest) & np.isfinite(best))
        if not len(alive) or (budget is not None and budget.is_spent()):
            break
        random = rng.normal(size=(2, _RANDOM * d, d))
        led = lead[alive, None] + random[1] * np.geomspace(1.0, 0.01, _RANDOM * d)[:, None]
        directions = np.concatenate(
            [np.broadcast_to(np.vstack([axes, random[0]]), (len(alive), (_RANDOM + 2) * d, d)), led], 1
        )
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        tries = points[alive, None] + width[alive, None, None] * step * directions
        owner = np.repeat(alive, directions.shape[1])
        values = _replace_nan(objective(tries.reshape(-1, d), owner)).reshape(len(alive), -1)
        which = values.argmax(1)
        row = np.arange(len(alive))
        better = values[row, which] > best[alive]
        moved = alive[better]
        points[moved], best[moved] = tries[row, which][better], values[row, which][better]
        lead[moved] = directions[row, which][better]
        width[alive] *= np.where(better, 1.5, 0.6)
    return points, best


def search_maxima_in_box(
    objective: Callable[[Array], Array], low: Array, high: Array, starts: Array, finest: float
) -> tuple[Array, Array]:
    """Find local maxima in a box, as :func:`search_maxima`; ``finest`` is a fraction of a quarter of the box."""

    def restrict(points: Array, _: Indices) -> Array:
        inside = ((points >= low) & (points <= high)).all(1)
        return np.where(inside, objective(np.clip(points, low, high)), np.nan)

    return search_maxima(restrict, starts, 0.25 * (high - low), finest)


def _replace_nan(values: Array) -> Array:
    return np.where(np.isnan(values), -np.inf, values)


def pick_best_of_blocks(points: Array, values: Array, blocks: int) -> Indices:
    """Pick the index of the greatest value in each of some ``blocks`` boxes that the points (N, d) fill."""
    d = points.shape[1]
    each = max(1, round(blocks ** (1.0 / d)))
    low, high = points.min(0), points.max(0)
    cell = np.minimum((each * (points - low) / np.where(high > low, high - low, 1.0)).astype(int), each - 1)
    number = cell @ each ** np.arange(d)
    order = np.lexsort((-_replace_nan(values), number))
    first = order[np.unique(number[order], return_index=True)[1]]
    return np.asarray(first[values[first] > -np.inf])


def pick_best_apart(points: Array, values: Array, count: int, apart: Array) -> Indices:
    """Pick up to ``count`` indices of the greatest values, no two closer than ``apart`` (d,) in every coordinate."""
    picked: list[int] = []
    for index in np.argsort(-_replace_nan(values), kind="stable")[: 50 * count].tolist():
        if len(picked) == count or not values[index] > -np.inf:
            break
        if all((np.abs(points[index] - points[other]) >= apart).any() for other in picked):
            picked.append(index)
    return np.array(picked, np.int64)


def find_roots(
    residuals: Callable[[Array], Array], starts: Array, step: Array, budget: Budget | None = None
) -> tuple[Array, Array, Array]:
    """Find points (m, d) where residuals (m, k) are least by squares, from starts (m, d), by Levenberg and Marquardt.

    Returns the points, the greatest residual there (m,), and the rank deficiency (m,): the least singular value of the
    residuals' derivative divided by its greatest, zero where the root is one of a curve of them. ``step`` (d,) scales
    the coordinates.
    """
    count, d = starts.shape
    points, damping = starts.copy(), np.full(count, 1e-3)
    r = residuals(points)
    for _ in range(60):
        if budget is not None and budget.is_spent():
            break
        slopes = _estimate_derivatives(residuals, points, step)
        normal = slopes.swapaxes(1, 2) @ slopes
        size = np.einsum("nii->n", normal)[:, None, None] + 1e-300
        way = -np.linalg.solve(
            normal + damping[:, None, None] * size * np.eye(d), slopes.swapaxes(1, 2) @ r[:, :, None]
        )
        tries = points + np.clip(way[:, :, 0], -2.0, 2.0) * step
        new = residuals(tries)
        with np.errstate(invalid="ignore", over="ignore"):
            better = (new * new).sum(1) < (r * r).sum(1)
        points[better], r[better] = tries[better], new[better]
        damping = np.clip(np.where(better, 0.1 * damping, 10.0 * damping), 1e-18, 1e6)
    worst = np.abs(r).max(1)
    sizes = np.linalg.svd(_estimate_derivatives(residuals, points, step), compute_uv=False)
    return points, np.where(np.isnan(worst), np.inf, worst), sizes[:, -1] / (sizes[:, 0] + 1e-300)


def _estimate_derivatives(residuals: Callable[[Array], Array], points: Array, step: Array) -> Array:
    """Estimate derivatives (m, k, d) by central differences, by coordinates in units of ``step``; 0 if not finite."""
    h = 1e-5
    columns = [(residuals(points + h * way) - residuals(points - h * way)) / (2.0 * h) for way in np.diag(step)]
    return np.nan_to_num(np.stack(columns, -1), nan=0.0, posinf=0.0, neginf=0.0)
