"""Extremes of performance and isotropic poses over the allowed places of a region, found by search, not proved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Array
from ..workspaces.certified.region import Region
from .indices import Performance, performance
from .jacobians import scaled_rates
from .search import Indices, best_of_blocks, climb, roots, spread

Side = Literal["least", "greatest"]
SIDES: tuple[Side, Side] = ("least", "greatest")
MEASURES = ("condition", "greatest", "least", "manipulability")

_ISOTROPIC = 1e-9  # the greatest entry of J⁻¹J⁻ᵀ, as a share of its mean diagonal, less 1
_STARTS, _BEST = 27, 3  # of each extreme: places to start from, and those of them that are worth a second look
_ROUGH, _FINE = 0.02, 1e-10  # how finely these look at last, in steps of the grid
_ROOTS = 96  # starts for isotropic poses
_DEFICIENT = 1e-6  # of the residuals' derivative: a root with less is one of a curve of them


@dataclass(frozen=True, eq=False)
class Extreme:
    """The least or the greatest value of a quantity over the allowed places, and a pose (axes,) where it stands.

    ``quantity`` is one of :data:`MEASURES` (properties of :class:`Performance`) or a singularity margin's name.
    """

    quantity: str
    side: Side
    value: float
    pose: Array


def room(asked: Region, places: Array) -> Array:
    """What is 0 on a region's boundary, positive within and negative without: the least margin of the limits that
    count, each as a share of its greatest value here; (N,) for places (N, d)."""
    machine = asked.machine
    count = [machine.limits.index(name) for name in asked.limits]
    if not count:
        return np.ones(len(places))
    margins = machine.margins(asked.poses(places), mode=asked.mode)[:, count]
    size = np.fmax.reduce(np.abs(margins), 0, initial=1e-300)
    least: Array = np.fmin.reduce(margins / size, 1)
    return np.where(np.isnan(margins).any(1), np.fmin(least, -1e-3), least)


def _table(found: Performance) -> Array:
    """(N, quantities): :data:`MEASURES`, then the margins."""
    return np.concatenate([np.stack([getattr(found, name) for name in MEASURES], 1), found.margins], 1)


def extremes(asked: Region, inside: Performance, apart: float) -> tuple[Extreme, ...]:
    """Extremes over a region, from the performance at allowed places of a grid whose step is ``apart``, mm."""
    names = (*MEASURES, *inside.margin_names)
    wanted: list[tuple[int, float]] = [(i, sign) for i in range(len(MEASURES)) for sign in (-1.0, 1.0)]
    wanted += [(i, -1.0) for i in range(len(MEASURES), len(names))]  # margins are of interest where they are least
    places = inside.poses[:, [asked.machine.axes.index(axis) for axis in asked.free_axes]]
    values = _table(inside)
    step = np.full(places.shape[1], apart)
    columns, signs = np.array(wanted).T
    kinds = columns.astype(int)

    def climbed(starts: list[Array], finest: float) -> list[tuple[Array, Array]]:
        """For each extreme wanted what its starts lead to: places, and values made to be greatest."""
        owner = np.repeat(np.arange(len(starts)), [len(some) for some in starts])

        def value(points: Array, search: Indices) -> Array:
            table = _table(performance(asked.machine, asked.poses(points), inside.length.value, asked.mode))
            which = owner[search]
            found = signs[which] * table[np.arange(len(points)), kinds[which]]
            return np.where(room(asked, points) >= 0.0, found, np.nan)

        points, best = climb(value, np.concatenate(starts), step, finest)
        return [(points[owner == number], best[owner == number]) for number in range(len(starts))]

    first = [
        places[best_of_blocks(places, sign * values[:, kind], _STARTS)] for kind, sign in zip(kinds, signs, strict=True)
    ]
    rough = climbed(first, _ROUGH)
    fine = climbed([points[np.argsort(-best)[:_BEST]] for points, best in rough], _FINE)
    found = []
    for (kind, sign), (points, best) in zip(wanted, fine, strict=True):
        if len(best):
            top = int(best.argmax())
            side: Side = "greatest" if sign > 0.0 else "least"
            found.append(Extreme(names[kind], side, float(sign * best[top]), asked.poses(points[top : top + 1])[0]))
    return tuple(found)


def isotropic(asked: Region, inside: Performance, apart: float) -> tuple[Array, bool]:
    """Allowed poses (k, axes) where J⁻¹J⁻ᵀ is a multiple of 1 to 1e-9, and whether each stands alone.

    The starts are the best conditioned of the places ``inside``, some ``apart`` (mm) from each other.
    """
    n = inside.psi.shape[1]
    upper = np.triu_indices(n)
    places = inside.poses[:, [asked.machine.axes.index(axis) for axis in asked.free_axes]]

    def residuals(points: Array) -> Array:
        rates = scaled_rates(asked.machine, asked.poses(points), inside.length, asked.mode)
        with np.errstate(invalid="ignore"):
            regular = np.abs(np.linalg.det(rates.b)) > 1e-12
        back = np.linalg.solve(np.where(regular[:, None, None], rates.b, np.eye(n)), rates.a)
        square = back @ back.swapaxes(1, 2)
        mean = np.einsum("nii->n", square) / n
        off = square / mean[:, None, None] - np.eye(n)
        return np.where(regular[:, None], off[:, *upper], np.nan)

    step = np.full(places.shape[1], apart)
    first = spread(places, -inside.condition, _ROOTS, 2.0 * step)
    if not len(first):
        return inside.poses[:0], True
    points, worst, deficiency = roots(residuals, places[first], step)
    good = (worst < _ISOTROPIC) & (room(asked, points) >= 0.0)
    isolated = bool((deficiency[good] > _DEFICIENT).all())
    kept = spread(points[good], -worst[good], int(good.sum()), np.full(len(step), 1e-5 * apart if isolated else apart))
    return asked.poses(points[good][kept]), isolated or len(kept) == 1
