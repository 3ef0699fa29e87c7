"""The polar sweep (z, ρ, β) of the Lambda paper (IJEEC 6, 2022, section V): rays from an axis, plane by plane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ..certified.region import Region
from .sampling import TURNS_STEP, Codes, FirstBroken, Swept, centres, positive, surroundings

NOTE = "a ray ends at the first place that is not allowed: what lies behind, or off an axis not allowed, is not seen"
MOST_RAYS, MOST_STEPS = 20_000_000, 10_000_000
_STEPS = 32  # along all rays at a time
_RAYS = 1 << 16


@dataclass(frozen=True, eq=False)
class PolarWorkspace(Swept):
    """A region as it is seen from an axis: only what is star-shaped about it in each plane; :attr:`note` says so.

    axis : (2,) mm, where the axis goes through the planes
    heights : (planes,) mm, the third coordinate of each; None in the plane
    angles : (rays,) rad from the first coordinate towards the second
    radii : (planes, rays) mm, the last allowed place of each ray; NaN where the axis itself is not allowed
    broken : (planes, rays), 1 + the index in ``region.limits`` of the limit broken at the next place
    """

    axis: Array
    heights: Array | None
    angles: Array
    radii: Array
    broken: Codes
    note: str = NOTE

    @property
    def areas(self) -> Array:
        """Of each plane, (planes,) mm²: the sectors' sum, each ray ending half a step beyond its last allowed place."""
        return _areas(self.radii, self.step)

    @property
    def outlines(self) -> list[Array]:
        """Last allowed places as a closed line, (rays + 1, d) mm, for each plane where the axis is allowed."""
        around = np.append(np.arange(len(self.angles)), 0)
        ways = np.stack([np.cos(self.angles), np.sin(self.angles)], 1)
        lines = []
        for i in np.flatnonzero(~np.isnan(self.radii).any(1)):
            line = self.axis + (self.radii[i, :, None] * ways)[around]
            if self.heights is not None:
                line = np.column_stack([line, np.full(len(line), self.heights[i])])
            lines.append(line)
        return lines


def polar_sweep(
    asked: Region,
    step: float,
    planes: float | None = None,
    rays: int = 72,
    axis: Sequence[float] | None = None,
    turns_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> PolarWorkspace:
    """A region by rays about an axis, in planes of z; ρ grows until the first place that is not allowed.

    Only what is star-shaped about the axis is seen. With swept turns a place counts as they say (total orientation:
    allowed in every turn sample). Where the machine moves in a plane, or an axis is held, there is one plane.

    Parameters
    ----------
    asked : made by :func:`parakin.workspaces.certified.region.region`
    step : of ρ, mm
    planes : distance of the planes, mm; ``step`` by default. They stand at odd multiples of half of it
    rays : how many in a plane
    axis : the two coordinates of the axis, mm; home's by default
    turns_step : as in :func:`parakin.workspaces.sampled.grid.dense_grid`
    progress : called with the fraction done

    Raises :class:`PoseError` for numbers that make no sense, too many rays or steps, or a region that nothing bounds.
    """
    positive("step", step, "mm")
    distance = step if planes is None else positive("planes", planes, "mm")
    if rays < 3:
        raise PoseError(f"rays: at least 3 expected, not {rays}")
    if len(asked.free_axes) < 2:
        raise PoseError(f"a polar sweep needs a plane, only {' '.join(asked.free_axes)} is left free")
    home = dict(zip(asked.machine.axes, asked.machine.home.tolist(), strict=True))
    middle = np.array([home[name] for name in asked.free_axes[:2]] if axis is None else axis, float)
    if middle.shape != (2,) or not np.isfinite(middle).all():
        raise PoseError(f"axis: two numbers expected, {' and '.join(asked.free_axes[:2])} in mm")
    look = FirstBroken(asked, turns_step)
    box = surroundings(asked)
    heights = None
    if len(asked.free_axes) == 3:
        heights = np.zeros(0) if box is None else _heights(*box, distance, rays)
    if box is not None and (steps := float(np.linalg.norm(box[1] - box[0])) / step) > MOST_STEPS:
        raise PoseError(f"step: {step:g} mm makes {steps:.2g} steps of a ray, at most {MOST_STEPS:,} go")
    angles = 2.0 * np.pi * np.arange(rays) / rays
    radii, broken = _marched(look, step, middle, heights, angles, progress)
    parameters = {
        **asked.parameters,
        "method": "polar",
        "step": step,
        "planes": distance,
        "rays": rays,
        "axis": middle.tolist(),
        "turns_step": TURNS_STEP if turns_step is None else turns_step,
    }
    estimate = float(_areas(radii, step).sum()) * (1.0 if heights is None else distance)
    return PolarWorkspace(asked, "polar", estimate, step, parameters, middle, heights, angles, radii, broken)


def _areas(radii: Array, step: float) -> Array:
    sectors = (radii + 0.5 * step) ** 2 * (np.pi / radii.shape[1])
    return np.asarray(np.where(np.isnan(sectors), 0.0, sectors).sum(1))


def _heights(low: Array, high: Array, distance: float, rays: int) -> Array:
    planes = (high[2] - low[2]) / distance
    if planes * rays > MOST_RAYS:
        raise PoseError(f"planes: {planes:.2g} planes of {rays} rays, at most {MOST_RAYS:,} rays go")
    return centres(low[2], high[2], distance)


def _marched(
    look: FirstBroken,
    step: float,
    middle: Array,
    heights: Array | None,
    angles: Array,
    progress: Callable[[float], None] | None,
) -> tuple[Array, Codes]:
    """The last allowed radius of every ray and what breaks at the next one, (planes, rays)."""
    rays = len(angles)
    ways = np.stack([np.cos(angles), np.sin(angles)], 1)
    count = rays * (1 if heights is None else len(heights))
    radii, broken = np.full(count, np.nan), np.zeros(count, np.int64)
    for start in range(0, count, _RAYS):
        going, first = np.arange(start, min(start + _RAYS, count)), 0
        while len(going):
            steps = step * np.arange(first, first + _STEPS)
            places = middle + steps[None, :, None] * ways[going % rays, None, :]
            if heights is not None:
                there = np.broadcast_to(heights[going // rays, None, None], (*places.shape[:2], 1))
                places = np.concatenate([places, there], 2)
            codes = look.at(places.reshape(-1, places.shape[2])).reshape(len(going), _STEPS)
            end = (codes > 0).argmax(1)
            ended = codes[np.arange(len(going)), end] > 0
            last = first + end - 1
            radii[going[ended]] = np.where(last >= 0, step * last, np.nan)[ended]
            broken[going[ended]] = codes[ended, end[ended]]
            going, first = going[~ended], first + _STEPS
        if progress:
            progress(min(start + _RAYS, count) / count)
    return radii.reshape(-1, rays), broken.reshape(-1, rays)
