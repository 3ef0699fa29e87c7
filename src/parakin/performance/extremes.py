"""Extremes of performance and isotropic poses over the allowed positions of a region, found by search, not proved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Array, Indices
from ..budget import Budget
from ..workspaces.certified.assembly_mode import ZERO
from ..workspaces.certified.region import Region
from .indices import Performance, compute_performance
from .jacobians import compute_scaled_rates
from .search import find_roots, pick_best_apart, pick_best_of_blocks, search_maxima
from .singularities import compute_singularity_margins

ExtremeSide = Literal["least", "greatest"]
SIDES: tuple[ExtremeSide, ExtremeSide] = ("least", "greatest")
MEASURES = ("condition", "greatest", "least", "manipulability")

_ISOTROPIC = 1e-9  # the greatest entry of J⁻¹J⁻ᵀ, divided by its mean diagonal, less 1
_STARTS, _BEST = 27, 3  # of each extreme: positions to start from, and those of them that are refined
_ROUGH, _FINE = 0.02, 1e-10  # last steps of the two searches, in steps of the grid
_ROOTS = 96  # starts for isotropic poses
_DEFICIENT = 1e-6  # rank deficiency of the residuals' derivative below which a root is one of a curve of roots


@dataclass(frozen=True, eq=False)
class Extreme:
    """The least or the greatest value of a quantity over the allowed positions.

    quantity : ``condition``, ``greatest``, ``least`` or ``manipulability``, as
        :class:`parakin.performance.indices.Performance` has them, or a singularity margin's name
    side : ``least`` or ``greatest``
    value : in the quantity's unit
    pose : (axes,) mm and rad, that has it
    """

    quantity: str
    side: ExtremeSide
    value: float
    pose: Array

    def __repr__(self) -> str:
        return f"<parakin extreme: {self.side} {self.quantity} {self.value:.6g}>"


def compute_slack(region: Region, positions: Array) -> Array:
    """Compute a field that is zero on a region's boundary, positive inside: (N,) for positions (N, d).

    It is the least margin of the limits that count, each divided by its greatest value here.
    """
    machine = region.machine
    columns = [machine.limits.index(name) for name in region.limits if name in machine.limits]
    poses = region.poses(positions)
    margins = machine.margins(poses, mode=region.mode)[:, columns]
    if region.components == "home":
        parallel = compute_singularity_margins(machine, poses, None, region.mode)[:, :1]
        margins = np.concatenate([margins, parallel - ZERO], 1)
    if not margins.shape[1]:
        return np.ones(len(positions))
    size = np.fmax.reduce(np.abs(margins), 0, initial=1e-300)
    least: Array = np.fmin.reduce(margins / size, 1)
    return np.where(np.isnan(margins).any(1), np.fmin(least, -1e-3), least)


def _tabulate_quantities(performance: Performance) -> Array:
    """Tabulate :data:`MEASURES`, then the margins: (N, quantities)."""
    return np.concatenate([np.stack([getattr(performance, name) for name in MEASURES], 1), performance.margins], 1)


def _list_positions(region: Region, performance: Performance) -> Array:
    return performance.poses[:, [region.machine.axes.index(axis) for axis in region.free_axes]]


class _ExtremeSearch:
    """The search for the extremes of quantities (m,), greatest where their signs are 1 and least where they are -1."""

    def __init__(self, region: Region, inside: Performance, kinds: Indices, signs: Array, apart: float, budget: Budget):
        self.region, self.inside, self.kinds, self.signs, self.budget = region, inside, kinds, signs, budget
        self.step = np.full(len(region.free_axes), apart)

    def climb(self, starts: list[Array], finest: float) -> list[tuple[Array, Array]]:
        """Climb from the starts of each extreme; returns positions, and values times the sign."""
        owner = np.repeat(np.arange(len(starts)), [len(own) for own in starts])

        def evaluate(points: Array, search: Indices) -> Array:
            poses = self.region.poses(points)
            performance = compute_performance(self.region.machine, poses, self.inside.length.value, self.region.mode)
            which = owner[search]
            table = _tabulate_quantities(performance)
            values = self.signs[which] * table[np.arange(len(points)), self.kinds[which]]
            return np.where(compute_slack(self.region, points) >= 0.0, values, np.nan)

        points, best = search_maxima(evaluate, np.concatenate(starts), self.step, finest, self.budget)
        return [(points[owner == number], best[owner == number]) for number in range(len(starts))]


def find_extremes(
    region: Region, inside: Performance, apart: float, budget: Budget | None = None
) -> tuple[Extreme, ...]:
    """Find extremes over a region by search, from the performance at allowed positions of a grid of step ``apart``, mm.

    Measures have a least and a greatest value; margins are of interest where they are least.
    """
    names = (*MEASURES, *inside.margin_names)
    wanted: list[tuple[int, float]] = [(i, sign) for i in range(len(MEASURES)) for sign in (-1.0, 1.0)]
    wanted += [(i, -1.0) for i in range(len(MEASURES), len(names))]
    positions = _list_positions(region, inside)
    values = _tabulate_quantities(inside)
    columns, signs = np.array(wanted).T
    kinds = columns.astype(int)
    search = _ExtremeSearch(region, inside, kinds, signs, apart, budget or Budget())
    first = [
        positions[pick_best_of_blocks(positions, sign * values[:, kind], _STARTS)]
        for kind, sign in zip(kinds, signs, strict=True)
    ]
    rough = search.climb(first, _ROUGH)
    fine = search.climb([points[np.argsort(-best)[:_BEST]] for points, best in rough], _FINE)
    extremes = []
    for (kind, sign), (points, best) in zip(wanted, fine, strict=True):
        if len(best):
            top = int(best.argmax())
            side: ExtremeSide = "greatest" if sign > 0.0 else "least"
            pose = region.poses(points[top : top + 1])[0]
            extremes.append(Extreme(names[kind], side, float(sign * best[top]), pose))
    return tuple(extremes)


def find_isotropic_poses(
    region: Region, inside: Performance, apart: float, budget: Budget | None = None
) -> tuple[Array, bool]:
    """Find allowed poses (k, axes) where J⁻ᵀJ⁻¹ is a multiple of 1 to 1e-9, and whether each stands alone.

    The starts are the best conditioned of the positions ``inside``, at least ``apart`` (mm) from each other.
    """
    n = inside.psi.shape[-1]
    upper = np.triu_indices(n)
    positions = _list_positions(region, inside)

    def compute_residuals(points: Array) -> Array:
        rates = compute_scaled_rates(region.machine, region.poses(points), inside.length, region.mode)
        with np.errstate(invalid="ignore"):
            regular = np.abs(np.linalg.det(rates.b)) > 1e-12
        back = np.linalg.solve(np.where(regular[:, None, None], rates.b, np.eye(rates.b.shape[1])), rates.a)
        square = back.swapaxes(1, 2) @ back
        mean = np.einsum("nii->n", square) / n
        off = square / mean[:, None, None] - np.eye(n)
        return np.where(regular[:, None], off[:, *upper], np.nan)

    step = np.full(positions.shape[1], apart)
    first = pick_best_apart(positions, -inside.condition, _ROOTS, 2.0 * step)
    if not len(first):
        return inside.poses[:0], True
    points, worst, deficiency = find_roots(compute_residuals, positions[first], step, budget or Budget())
    good = (worst < _ISOTROPIC) & (compute_slack(region, points) >= 0.0)
    isolated = bool((deficiency[good] > _DEFICIENT).all())
    distance = np.full(len(step), 1e-5 * apart if isolated else apart)
    kept = pick_best_apart(points[good], -worst[good], int(good.sum()), distance)
    return region.poses(points[good][kept]), isolated or len(kept) == 1
