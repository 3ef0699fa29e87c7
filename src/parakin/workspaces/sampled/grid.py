"""The dense grid: a workspace by the cells of a regular lattice whose middles are allowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import floor, prod

import numpy as np

from ...arguments import check_arguments, check_positive, read_corners
from ...arrays import Array, Flags, Indices, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ..certified.region import Region
from ..certified.workspace import BoundingLimit
from .sampling import (
    TURNS_STEP,
    BrokenLimitFinder,
    LimitCodes,
    SampledWorkspace,
    find_bounding_box,
    list_cell_middles,
)

MOST_CELLS = 500_000_000  # a byte each


@dataclass(frozen=True, eq=False, repr=False)
class GridWorkspace(SampledWorkspace):
    """A region by the cells whose middles are allowed: ``estimate`` is their number times the volume of one.

    coordinates : of the cells' middles along each axis, (n0,), (n1,) ... mm
    broken : (n, ...) as many axes as coordinates, 0 where the position is allowed, else 1 + the index in
        ``region.limits`` of the first limit broken
    """

    coordinates: tuple[Array, ...]
    broken: LimitCodes

    @property
    def mask(self) -> Flags:
        """Where a position is allowed."""
        return np.asarray(self.broken == 0)

    @cached_property
    def _layer_counts(self) -> list[Indices]:
        """How many cells are allowed in each layer across each axis."""
        mask, d = self.mask, len(self.coordinates)
        return [np.count_nonzero(mask, axis=tuple(b for b in range(d) if b != a)) for a in range(d)]

    @property
    def empty(self) -> bool:
        """Whether no cell's middle is allowed; the region may still be smaller than the cells."""
        return not self._layer_counts[0].any()

    @property
    def box(self) -> tuple[Array, Array] | None:
        """Lower and upper corner of the box about all allowed cells, (d,) mm each; None if there are none."""
        if self.empty:
            return None
        allowed = [x[count > 0] for x, count in zip(self.coordinates, self._layer_counts, strict=True)]
        return np.array([x[0] for x in allowed]) - 0.5 * self.step, np.array([x[-1] for x in allowed]) + 0.5 * self.step

    @property
    def centroid(self) -> Array | None:
        """The middle of the allowed cells, (d,) mm; None if there are none."""
        if self.empty:
            return None
        layers = zip(self.coordinates, self._layer_counts, strict=True)
        return np.array([float(np.dot(x, count) / count.sum()) for x, count in layers])

    @cached_property
    def bounded_by(self) -> tuple[BoundingLimit, ...]:
        """The limits broken just outside, by the number of the cells' faces there, the greatest first.

        Faces at the end of the grid are not counted.
        """
        names, d = self.region.limits, len(self.coordinates)
        count, total = np.zeros(len(names)), np.zeros((len(names), d))
        for a in range(d):
            order = [a, *[b for b in range(d) if b != a]]
            broken = self.broken.transpose(order)
            mask = broken == 0
            for outside, shift in ((mask[:-1] < mask[1:], 0), (mask[1:] < mask[:-1], 1)):
                cells = list(np.nonzero(outside))
                cells[0] = cells[0] + shift
                limit = broken[tuple(cells)].astype(np.int64) - 1
                count += np.bincount(limit, minlength=len(names))
                for b, index in zip(order, cells, strict=True):
                    coordinate = self.coordinates[b][index] + ((0.5 - shift) * self.step if b == a else 0.0)
                    total[:, b] += np.bincount(limit, coordinate, len(names))
        limits = [
            BoundingLimit(names[i], float(count[i] / count.sum()), tuple((total[i] / count[i]).tolist()))
            for i in np.flatnonzero(count)
        ]
        return tuple(sorted(limits, key=lambda limit: -limit.fraction))


@check_arguments
def sample_grid(
    region: Region,
    step: float,
    box: tuple[Sequence[float], Sequence[float]] | None = None,
    turns_step: float | None = None,
    progress: Progress | None = None,
    seconds: float | None = SECONDS,
) -> GridWorkspace:
    """Sample a region in the middle of every cell of a regular lattice.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    step : edge of the cells, mm; their middles are odd multiples of half of it
    box : lower and upper corner, mm, of the cells' middles; by default a box that holds the region
    turns_step : between samples of the swept axes at most, rad, both ends of each range included; 5° by default
    progress : called with the fraction done
    seconds : the time in which all must be sampled; None for no end

    Raises :class:`PoseError` for invalid numbers, more than 5e8 cells, too little time, or a region that neither limits
    nor a box bound.
    """
    check_positive("step", step, "mm")
    budget = Budget(seconds)
    finder = BrokenLimitFinder(region, turns_step, budget)
    bounds = find_bounding_box(region, budget) if box is None else read_corners("box", box, region.free_axes)
    parameters = {
        **region.parameters,
        "method": "grid",
        "step": step,
        "box": None if box is None else [list(map(float, corner)) for corner in box],
        "turns_step": TURNS_STEP if turns_step is None else turns_step,
    }
    if bounds is None:
        coordinates = tuple(np.zeros(0) for _ in region.free_axes)
        return GridWorkspace(region, "grid", 0.0, step, parameters, coordinates, finder.find_on_grid(coordinates))
    cells = prod(floor((b - a) / step) + 1 for a, b in zip(*bounds, strict=True))
    if cells > MOST_CELLS:
        volume = float(np.prod([b - a for a, b in zip(*bounds, strict=True)]))
        least = (volume / MOST_CELLS) ** (1.0 / len(region.free_axes))
        raise PoseError(f"step: {step:g} mm makes {cells:.2g} cells, at most {MOST_CELLS:,} go; from {least:.2g} mm on")
    coordinates = tuple(list_cell_middles(a, b, step) for a, b in zip(*bounds, strict=True))
    broken = finder.find_on_grid(coordinates, progress)
    allowed = broken.size - np.count_nonzero(broken)
    return GridWorkspace(region, "grid", allowed * step**broken.ndim, step, parameters, coordinates, broken)
