"""The performance atlas: conditioning, amplification and singularity margins over a region of positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import floor, isfinite, log10, prod
from typing import Any

import numpy as np

from ..arguments import check_arguments
from ..arrays import Array, Flags, Progress, make_lattice
from ..budget import SECONDS, Budget
from ..errors import PoseError
from ..machine import Machine
from ..workspaces.certified.region import Region
from ..workspaces.sampled.sampling import TOO_SLOW
from .certified.region_singularities import RegionSingularity, judge_singularities
from .characteristic_length import CharacteristicLength, choose_characteristic_length
from .extremes import Extreme, ExtremeSide, compute_slack, find_extremes, find_isotropic_poses
from .indices import Performance, compute_performance
from .singularities import compute_singularity_margins

MOST = 4_000_000  # positions of a grid
_ALONG = {1: 400, 2: 120, 3: 36}  # positions along the longest side, at most, if no step is given
_AT_ONCE = 1 << 15
_ON = 1e-3  # a pose nearer than this fraction of a grid's step lies on the slice
_ROUGH, _OUTLINE = 0.1, 0.2  # gap, and fraction of the time, of the workspace by which the grid is placed
_FEW = 25  # allowed positions of a map that shows something
_SEARCH = 0.4  # of the time that is left, for the extremes, and then for isotropic poses


@dataclass(frozen=True, eq=False)
class PerformanceMap:
    """Performance on a grid over a region.

    region : without swept axes
    step : between positions of the grid, mm
    grid : the coordinates along each of the region's free axes, (n0,), (n1,) ... mm
    allowed : (n0, n1, ...) whether the machine is allowed there
    slack : (n0, n1, ...) zero on the region's boundary, positive inside, negative outside
    performance : at all positions of the grid, allowed or not; NaN out of reach
    """

    region: Region
    step: float
    grid: tuple[Array, ...]
    allowed: Flags
    slack: Array
    performance: Performance

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of a position."""
        return self.region.free_axes

    @cached_property
    def inside(self) -> Performance:
        """Of the allowed positions alone, (N,)."""
        return _change_columns(self.performance, lambda column: column[self.allowed])

    def __repr__(self) -> str:
        return (
            f"<parakin map of {self.region.machine.name}: "
            f"{' x '.join(map(str, self.allowed.shape))} positions, {self.step:.6g} mm apart>"
        )


@dataclass(frozen=True, eq=False)
class Atlas:
    """Performance over a region: the map, and what was found between its positions.

    map : on the grid
    extremes : over the allowed positions, found by search from the grid's best
    isotropic : (k, axes) allowed poses, mm and rad, at which J is a multiple of a rotation: (6a) and (6b) of Chablat
        and Wenger (Chemnitz, 2000) for three rods on slides
    singularities : of each margin, whether the machine's limits keep it from zero all over, whether a path inside them
        is proved to pass through zero, or neither
    isolated : whether these stand alone; else they are samples of a curve or a surface of them
    """

    map: PerformanceMap
    extremes: tuple[Extreme, ...]
    isotropic: Array
    isolated: bool
    singularities: tuple[RegionSingularity, ...]

    @property
    def machine(self) -> Machine:
        """The machine that this is about."""
        return self.map.region.machine

    @property
    def singular(self) -> tuple[str, ...]:
        """Names of the margins that are proved to change their sign within the limits."""
        return tuple(singularity.margin for singularity in self.singularities if singularity.verdict == "met")

    @cached_property
    def isotropic_margins(self) -> Array:
        """The parallel margin at the isotropic poses, (k,): below zero, a singularity separates them from home."""
        region, length = self.map.region, self.map.performance.length.value
        return compute_singularity_margins(self.machine, self.isotropic, length, region.mode)[:, 0]

    def extreme(self, quantity: str, side: ExtremeSide) -> Extreme:
        """Return one of :attr:`extremes`.

        quantity : ``condition``, ``greatest``, ``least``, ``manipulability``, or a margin's name
        side : ``least`` or ``greatest``
        """
        return next(e for e in self.extremes if e.quantity == quantity and e.side == side)

    def isotropic_on(self, drawn: PerformanceMap) -> Array:
        """Find the isotropic poses that lie on a slice, (k, axes).

        drawn : the map of the slice
        """
        off = np.zeros(len(self.isotropic))
        for axis, value in drawn.region.fixed_axes.items():
            off = np.maximum(off, np.abs(self.isotropic[:, self.machine.axes.index(axis)] - value))
        return self.isotropic[off < _ON * drawn.step]

    def __repr__(self) -> str:
        return (
            f"<parakin atlas of {self.machine.name}: "
            f"{len(self.map.inside.poses)} positions, {len(self.extremes)} extremes>"
        )


@check_arguments
def atlas(
    region: Region,
    step: float | None = None,
    length: float | None = None,
    progress: Progress | None = None,
    seconds: float | None = SECONDS,
) -> Atlas:
    """Compute the performance over a region at one orientation: on a grid, and its extremes by search between.

    Parameters
    ----------
    region : made by :func:`parakin.region`, without swept axes; a fixed X, Y or Z makes it a slice
    step : between positions of the grid, mm; the grid stands on its multiples
    length : characteristic length, mm; see :func:`~.characteristic_length.choose_characteristic_length`
    progress : called with the fraction done
    seconds : of all the work; singularities that are not proved by then are unproved, extremes the best found by then

    Raises :class:`PoseError` for invalid numbers, for a region that is swept, unbounded or empty, and where the time is
    up before the grid is done.
    """
    if region.swept_axes:
        raise PoseError(f"region: an atlas is of one orientation, {' '.join(region.swept_axes)} must not be swept")
    budget, report = Budget(seconds), progress or (lambda fraction: None)
    drawn = map_performance(region, step, length, lambda fraction: report(0.4 * fraction), budget)
    extremes = find_extremes(region, drawn.inside, drawn.step, budget.take_fraction(_SEARCH))
    report(0.6)
    poses, isolated = find_isotropic_poses(region, drawn.inside, drawn.step, budget.take_fraction(_SEARCH))
    report(0.7)
    return Atlas(drawn, extremes, poses, isolated, judge_singularities(region, budget))


def map_performance(
    region: Region,
    step: float | None = None,
    length: float | None = None,
    progress: Progress | None = None,
    budget: Budget | None = None,
) -> PerformanceMap:
    """Compute the map alone, over a region without swept axes; parameters and errors as of :func:`atlas`."""
    budget = budget or Budget()
    scale = choose_characteristic_length(region.machine, length)
    if step is not None and not (isfinite(step) and step > 0.0):
        raise PoseError(f"step: a length above 0 mm expected, not {step:g}")
    outline = budget.take_fraction(_OUTLINE)
    low, high = _find_bounds(region, outline)
    longest = float((high - low).max())
    grid_step = _round_up(longest / _ALONG[len(region.free_axes)]) if step is None else float(step)
    counts = [(b - a) / grid_step + 1.0 for a, b in zip(low, high, strict=True)]
    if prod(counts) > MOST:
        if outline.is_spent():  # the bounds are wider than need be
            raise PoseError(TOO_SLOW)
        size = " x ".join(f"{count:,.0f}" for count in counts)
        raise PoseError(f"step: {grid_step:g} mm makes {size} places, at most {MOST:,} are possible")
    grid = tuple(_list_multiples(a, b, grid_step) for a, b in zip(low, high, strict=True))
    positions = make_lattice(grid)
    shape = tuple(len(line) for line in grid)
    performance = _compute_in_blocks(region, positions, scale, budget, progress)
    slack = compute_slack(region, positions)
    if step is None and outline.is_spent() and np.count_nonzero(slack >= 0.0) < _FEW:
        raise PoseError(TOO_SLOW)  # the bounds were far too wide to choose a step by
    if not (slack >= 0.0).any():
        if (compute_slack(region.include_all_components(), positions) >= 0.0).any():
            raise PoseError(
                f"step: no place of a grid of {grid_step:g} mm lies on home's side of the parallel singularities"
            )
        raise PoseError(f"step: no place of a grid of {grid_step:g} mm is allowed, choose a finer one")
    on_grid = _change_columns(performance, lambda column: column.reshape(*shape, *column.shape[1:]))
    return PerformanceMap(region, grid_step, grid, (slack >= 0.0).reshape(shape), slack.reshape(shape), on_grid)


def _find_bounds(region: Region, budget: Budget) -> tuple[Array, Array]:
    """Find a box that holds the region, close enough for a grid."""
    extent = region.find_extent(budget)
    if extent is not None:
        cells = region.subdivide(*extent).run(_ROUGH, budget=budget)
        if len(cells.low):
            return cells.low.min(0), (cells.low + cells.size).max(0)
    raise PoseError("the machine is allowed nowhere there")


def _round_up(width: float) -> float:
    """Round a width up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** floor(log10(width)) if width > 0.0 else 1.0
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= width * (1.0 - 1e-9))


def _list_multiples(low: float, high: float, step: float) -> Array:
    """List the multiples of the step from low to high, or the middle if there is none."""
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return np.arange(first, last + 1.0) * step if last >= first else np.array([0.5 * (low + high)])


_COLUMNS = ("poses", "psi", "directions", "margins")


def _change_columns(performance: Performance, change: Callable[[Array], Array]) -> Performance:
    columns: dict[str, Any] = {name: change(getattr(performance, name)) for name in _COLUMNS}
    return replace(performance, **columns)


def _compute_in_blocks(
    region: Region, positions: Array, length: CharacteristicLength, budget: Budget, progress: Progress | None
) -> Performance:
    """Compute the performance at positions (N, d), a block at a time; raises :class:`PoseError` where time is up."""
    blocks = []
    for start in range(0, len(positions), _AT_ONCE):
        if start and budget.is_spent():
            raise PoseError(TOO_SLOW)
        poses = region.poses(positions[start : start + _AT_ONCE])
        blocks.append(compute_performance(region.machine, poses, length.value, region.mode))
        if progress:
            progress(min(1.0, (start + len(poses)) / len(positions)))
    columns: dict[str, Any] = {name: np.concatenate([getattr(block, name) for block in blocks]) for name in _COLUMNS}
    return replace(blocks[0], length=length, **columns)
