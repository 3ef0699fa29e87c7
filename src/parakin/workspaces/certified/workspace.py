"""The certified workspace: a region's volume, proved to lie between two numbers, and what follows from its cells."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Flags, Progress, split_rows
from ...budget import SECONDS, Budget
from ...displays import Displayed
from ...errors import PoseError
from .best_orientation import find_best_orientations
from .region import Region
from .region_result import RegionResult
from .separation import find_joined_cells
from .subdivision import Cells, make_empty_cells

ROUNDING = 1e-9  # relative, of the sums of volumes
_VAGUE = 0.2  # gap from which the estimate of an inclusive region is sampled
_MOST_SAMPLED, _SAMPLED_AT_ONCE = 20_000, 500  # cells
_PROVING = 0.8  # fraction of the time for the bounds of an inclusive region; the rest is for its estimate
_CLOSE = 1.0 / 128.0  # size of the cells at the bounding box's faces, as a fraction of the box


@dataclass(frozen=True)
class Volume:
    """A volume, mm³ (in the plane an area, mm²): at least ``inner``, at most ``outer``, likely ``estimate``."""

    inner: float
    estimate: float
    outer: float

    @property
    def gap(self) -> float:
        """(outer - inner)/estimate; 0 if both are zero."""
        return (
            (self.outer - self.inner) / self.estimate if self.estimate > 0.0 else (np.inf if self.outer > 0.0 else 0.0)
        )


NOTHING = Volume(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class BoundingLimit:
    """A limit that bounds a region.

    limit : its name
    fraction : of the boundary, that it makes
    middle : (d,) of that part, mm
    """

    limit: str
    fraction: float
    middle: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Workspace(RegionResult, Displayed):
    """A region with its proved volume, and the cells that prove it.

    cells : of the subdivision, each proved inside, outside, or on the boundary
    stopped : why the subdivision ended: ``gap`` reached, ``cell`` size reached, ``time``, ``interrupted``,
        ``resolution`` (of the numbers) or ``memory``
    parameters : enough to run it again
    apart : volume of the cells that were left out, for they are proved not to hang together with home
    """

    cells: Cells
    stopped: str
    parameters: Mapping[str, Any]
    apart: Volume = NOTHING

    @cached_property
    def volume(self) -> Volume:
        """The two numbers between which the volume is proved to lie, in the region's unit."""
        return _sum_volumes(self.cells)

    @property
    def empty(self) -> bool:
        """Whether it is proved to hold no position."""
        return not len(self.cells.low)

    @cached_property
    def box(self) -> tuple[Array, Array] | None:
        """Lower and upper corner of a box proved to hold the region, (d,) mm each; None if it is empty."""
        if self.empty:
            return None
        return self.cells.low.min(0), (self.cells.low + self.cells.size).max(0)

    @cached_property
    def centroid(self) -> Array | None:
        """The middle of the volume, (d,) mm, as estimated; None without a volume."""
        weights = self.cells.estimate * self.cells.volumes
        if not weights.sum() > 0.0:
            return None
        return np.asarray(weights @ (self.cells.low + 0.5 * self.cells.size) / weights.sum())

    @cached_property
    def bounded_by(self) -> tuple[BoundingLimit, ...]:
        """The limits that bound the region, the one with most of its boundary first."""
        edge = ~self.cells.inside & (self.cells.area > 0.0)
        limit, area = self.cells.limit[edge], self.cells.area[edge]
        middles = (self.cells.low + 0.5 * self.cells.size)[edge]
        limits = []
        for number in np.unique(limit):
            own = area[limit == number]
            middle = own @ middles[limit == number] / own.sum()
            fraction = float(own.sum() / area.sum())
            limits.append(BoundingLimit(self.region.limits[number], fraction, tuple(middle.tolist())))
        return tuple(sorted(limits, key=lambda limit: -limit.fraction))

    @property
    def surface(self) -> float:
        """The boundary's area, mm² (in the plane its length, mm), as estimated."""
        return float(self.cells.area[~self.cells.inside].sum())

    def __repr__(self) -> str:
        low, high = self.volume.inner, self.volume.outer
        return (
            f"<parakin workspace of {self.machine.name}: "
            f"{low:.6g} to {high:.6g} {self.unit}, {len(self.cells.low)} cells>"
        )


@check_arguments
def workspace(
    region: Region,
    gap: float = 0.01,
    cell: float | None = None,
    seconds: float | None = SECONDS,
    progress: Progress | None = None,
) -> Workspace:
    """Find the workspace of a region by adaptive subdivision, its volume proved to lie between two numbers.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    gap : stop as soon as (outer - inner)/estimate of the volume is no greater
    cell : refine all cells of the boundary to this size, mm, instead
    seconds : stop after this time with what there is; None for no end
    progress : called with the fraction done

    Raises :class:`PoseError` for invalid numbers, or a region that no limit bounds.
    """
    if not (isfinite(gap) and gap > 0.0):
        raise PoseError(f"gap: a number above 0 expected, not {gap:g}")
    if cell is not None and not (isfinite(cell) and cell > 0.0):
        raise PoseError(f"cell: a size above 0 mm expected, not {cell:g}")
    budget = Budget(seconds)
    parameters = {**region.parameters, "method": "certified", "gap": gap, "cell": cell, "seconds": seconds}
    extent = region.find_extent(budget)
    if extent is None:
        return Workspace(region, make_empty_cells(len(region.free_axes)), "gap", parameters)
    subdivision = region.subdivide(*extent)
    stopped = subdivision.run(
        gap, cell, budget.take_fraction(1.0 if region.every_orientation else _PROVING), progress
    ).stopped
    if stopped == "gap":
        with suppress(KeyboardInterrupt):  # the volume is known; only its box could be closer
            subdivision.tighten(_CLOSE, budget)
    cells = subdivision.collect_cells(stopped)
    if not region.every_orientation and cells.gap > _VAGUE:
        cells = _sample_estimates(region, cells, budget)
    joined = _find_home_cells(region, cells)
    if joined is None or joined.all():
        return Workspace(region, cells, stopped, parameters)
    return Workspace(region, cells.take(joined), stopped, parameters, _sum_volumes(cells.take(~joined)))


def _sample_estimates(region: Region, cells: Cells, budget: Budget) -> Cells:
    """Estimate cells at the boundary by whether a position at random in each is allowed at its best orientation.

    Bounds of planes are far apart where orientations are still wide, and say little of what lies between them. Of very
    many cells, or within little time, some are sampled, the others get these cells' mean.
    """
    edge = np.flatnonzero(~cells.inside)
    rng = np.random.default_rng(0)
    sampled = edge if len(edge) <= _MOST_SAMPLED else rng.choice(edge, _MOST_SAMPLED, replace=False)
    sampled = rng.permutation(sampled)
    positions = cells.low[sampled] + rng.random((len(sampled), cells.low.shape[1])) * cells.size[sampled]
    allowed = np.zeros(len(sampled))
    done = 0
    for block in split_rows(len(sampled), _SAMPLED_AT_ONCE):
        if done and budget.is_spent():
            break
        margins = find_best_orientations(region, positions[block])[1]
        allowed[block] = (margins >= 0.0).all(1)
        done = min(block.stop, len(sampled))
    sampled, allowed = sampled[:done], allowed[:done]
    volumes = cells.volumes[sampled]
    estimate = cells.estimate.copy()
    estimate[edge] = float(allowed @ volumes / volumes.sum())
    estimate[sampled] = allowed
    return replace(cells, estimate=np.clip(estimate, cells.inner, cells.outer))


def _find_home_cells(region: Region, cells: Cells) -> Flags | None:
    """Find the cells that may hang together with home; None where home does not tell, or all components count."""
    if region.components == "all" or any(axis in region.fixed_axes for axis in "XYZ"):
        return None  # what is apart in a slice may hang together beyond it
    return find_joined_cells(cells, region.home_position)


def measure_elsewhere(workspace: Workspace, gap: float = 0.05, seconds: float | None = 10.0) -> Volume:
    """Measure what the machine reaches besides home's component: what is apart from it, and other assembly modes.

    Parameters
    ----------
    workspace : of ``components="home"``; of all of them there is nothing besides
    gap, seconds : as for :func:`workspace`, of the other assembly modes

    Raises :class:`PoseError` for a region that no limit bounds in the other assembly modes.
    """
    region = workspace.region
    if region.components == "all":
        return NOTHING
    budget = Budget(seconds)
    extent, everywhere = region.find_extent(budget), region.include_all_components()
    if extent is None:
        return workspace.apart
    if not everywhere.side_constraints:
        return workspace.apart
    other = everywhere.side_constraints[0].negate()  # a singularity all over an orientation is no part of home's either
    cells = everywhere.subdivide(*extent, [other]).run(gap, budget=budget)
    beyond = _sum_volumes(cells)
    return Volume(*(a + b for a, b in zip(astuple(workspace.apart), astuple(beyond), strict=True)))


def _sum_volumes(cells: Cells) -> Volume:
    inner, estimate, outer = (cells.total(fractions) for fractions in (cells.inner, cells.estimate, cells.outer))
    return Volume(inner * (1.0 - ROUNDING), estimate, outer * (1.0 + ROUNDING))
