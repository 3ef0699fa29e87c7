"""The polar sweep (z, ρ, β) of the Lambda paper (IJEEC 6, 2022, section V): rays from an axis, plane by plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arguments import check_arguments, check_positive, read_vector
from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ..certified.region import Region
from .sampling import (
    TURNS_STEP,
    BrokenLimitFinder,
    LimitCodes,
    SampledWorkspace,
    find_bounding_box,
    list_cell_middles,
)

NOTE = "a ray ends at the first place that is not allowed: what lies behind, or off an axis not allowed, is not seen"
MOST_RAYS, MOST_STEPS = 20_000_000, 10_000_000
_STEPS = 32  # steps of each ray that are tested at a time
_RAYS = 1 << 16  # rays that are marched at a time


@dataclass(frozen=True, eq=False, repr=False)
class PolarWorkspace(SampledWorkspace):
    """A region along rays from an axis: only what is star-shaped about the axis in each plane, as :attr:`note` says.

    axis : (2,) mm, where the axis goes through the planes
    heights : (planes,) mm, the third coordinate of each; None in the plane
    angles : (rays,) rad from the first coordinate towards the second
    radii : (planes, rays) mm, the last allowed position of each ray; NaN where the axis itself is not allowed
    note : what the method does not find
    broken : (planes, rays), 1 + the index in ``region.limits`` of the limit broken at the next position
    """

    axis: Array
    heights: Array | None
    angles: Array
    radii: Array
    broken: LimitCodes
    note: str = NOTE

    @property
    def areas(self) -> Array:
        """The sum of each plane's sectors, (planes,) mm²; a ray ends half a step beyond its last allowed position."""
        return _compute_areas(self.radii, self.step)

    @property
    def outlines(self) -> list[Array]:
        """Last allowed positions as a closed line, (rays + 1, d) mm, for each plane where the axis is allowed."""
        around = np.append(np.arange(len(self.angles)), 0)
        directions = np.stack([np.cos(self.angles), np.sin(self.angles)], 1)
        lines = []
        for i in np.flatnonzero(~np.isnan(self.radii).any(1)):
            line = self.axis + (self.radii[i, :, None] * directions)[around]
            if self.heights is not None:
                line = np.column_stack([line, np.full(len(line), self.heights[i])])
            lines.append(line)
        return lines


@check_arguments
def sweep_polar(
    region: Region,
    step: float,
    planes: float | None = None,
    rays: int = 72,
    axis: Sequence[float] | None = None,
    turns_step: float | None = None,
    progress: Progress | None = None,
    seconds: float | None = SECONDS,
) -> PolarWorkspace:
    """Sample a region along rays from an axis, in planes of z: ρ grows until the first position that is not allowed.

    This is the search of IJEEC 6 (2022), section V. Only what is star-shaped about the axis is found. If axes are
    swept, a position counts as the region says, by samples of them. Where the machine moves in a plane, or an axis is
    fixed, there is one plane.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    step : of ρ, mm
    planes : distance of the planes, mm; ``step`` by default. They stand at odd multiples of half of it
    rays : how many in a plane
    axis : the two coordinates of the axis, mm; home's by default
    turns_step : as for :func:`parakin.sample_grid`
    progress : called with the fraction done
    seconds : the time in which all must be sampled; None for no end

    Raises :class:`PoseError` for invalid numbers, too many rays or steps, too little time, or a region that no limit
    bounds.
    """
    check_positive("step", step, "mm")
    distance = step if planes is None else check_positive("planes", planes, "mm")
    if rays < 3:
        raise PoseError(f"rays: at least 3 expected, not {rays}")
    if rays > MOST_RAYS:
        raise PoseError(f"rays: at most {MOST_RAYS:,} expected, not {rays}")
    if len(region.free_axes) < 2:
        raise PoseError(f"a polar sweep needs a plane, only {' '.join(region.free_axes)} is left free")
    home = dict(zip(region.machine.axes, region.machine.home.tolist(), strict=True))
    names = region.free_axes[:2]
    middle = np.array([home[name] for name in names]) if axis is None else read_vector("axis", axis, names)
    budget = Budget(seconds)
    finder = BrokenLimitFinder(region, turns_step, budget)
    box = find_bounding_box(region, budget)
    heights = None
    if len(region.free_axes) == 3:
        heights = np.zeros(0) if box is None else _list_heights(*box, distance, rays)
    if box is not None and (steps := float(np.linalg.norm(box[1] - box[0])) / step) > MOST_STEPS:
        raise PoseError(f"step: {step:g} mm makes {steps:.2g} steps of a ray, at most {MOST_STEPS:,} go")
    angles = 2.0 * np.pi * np.arange(rays) / rays
    radii, broken = _march_rays(finder, step, middle, heights, angles, progress)
    parameters = {
        **region.parameters,
        "method": "polar",
        "step": step,
        "planes": distance,
        "rays": rays,
        "axis": middle.tolist(),
        "turns_step": TURNS_STEP if turns_step is None else turns_step,
    }
    estimate = float(_compute_areas(radii, step).sum()) * (1.0 if heights is None else distance)
    return PolarWorkspace(region, "polar", estimate, step, parameters, middle, heights, angles, radii, broken)


def _compute_areas(radii: Array, step: float) -> Array:
    sectors = (radii + 0.5 * step) ** 2 * (np.pi / radii.shape[1])
    return np.asarray(np.where(np.isnan(sectors), 0.0, sectors).sum(1))


def _list_heights(low: Array, high: Array, distance: float, rays: int) -> Array:
    planes = (high[2] - low[2]) / distance
    if planes * rays > MOST_RAYS:
        raise PoseError(f"planes: {planes:.2g} planes of {rays} rays, at most {MOST_RAYS:,} rays go")
    return list_cell_middles(low[2], high[2], distance)


def _march_rays(
    finder: BrokenLimitFinder,
    step: float,
    middle: Array,
    heights: Array | None,
    angles: Array,
    progress: Progress | None,
) -> tuple[Array, LimitCodes]:
    """March along every ray; returns its last allowed radius and the limit broken at the next, (planes, rays)."""
    rays = len(angles)
    directions = np.stack([np.cos(angles), np.sin(angles)], 1)
    count = rays * (1 if heights is None else len(heights))
    radii, broken = np.full(count, np.nan), np.zeros(count, np.int64)
    for start in range(0, count, _RAYS):
        going, first = np.arange(start, min(start + _RAYS, count)), 0
        while len(going):
            steps = step * np.arange(first, first + _STEPS)
            positions = middle + steps[None, :, None] * directions[going % rays, None, :]
            if heights is not None:
                third = np.broadcast_to(heights[going // rays, None, None], (*positions.shape[:2], 1))
                positions = np.concatenate([positions, third], 2)
            codes = finder.find_at(positions.reshape(-1, positions.shape[2])).reshape(len(going), _STEPS)
            end = (codes > 0).argmax(1)
            ended = codes[np.arange(len(going)), end] > 0
            last = first + end - 1
            radii[going[ended]] = np.where(last >= 0, step * last, np.nan)[ended]
            broken[going[ended]] = codes[ended, end[ended]]
            going, first = going[~ended], first + _STEPS
        if progress:
            progress(min(start + _RAYS, count) / count)
    return radii.reshape(-1, rays), broken.reshape(-1, rays)
