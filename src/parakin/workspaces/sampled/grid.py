"""The dense grid: every place of a regular lattice, looked at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import floor, prod

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import PoseError
from ..certified.region import Region
from ..certified.workspace import Bound
from .sampling import TURNS_STEP, Codes, FirstBroken, Swept, centres, positive, surroundings

MOST_CELLS = 500_000_000  # a byte each


@dataclass(frozen=True, eq=False)
class GridWorkspace(Swept):
    """A region by the cells whose middles are allowed: ``estimate`` is their number times the volume of one.

    coordinates : each axis's, mm, of the cells' middles
    broken : as many numbers as coordinates, 0 where the place is allowed, else 1 + the index in ``region.limits`` of
        the first limit broken: with every turn, in the first turn sample that breaks one; with some, near the middle
    """

    coordinates: tuple[Array, ...]
    broken: Codes

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Where a place is allowed."""
        return np.asarray(self.broken == 0)

    @cached_property
    def _lines(self) -> list[NDArray[np.int64]]:
        """How many cells are allowed in each layer across each axis."""
        mask, d = self.mask, len(self.coordinates)
        return [np.count_nonzero(mask, axis=tuple(b for b in range(d) if b != a)) for a in range(d)]

    @property
    def empty(self) -> bool:
        """No cell's middle is allowed; the region may still be smaller than the cells."""
        return not self._lines[0].any()

    @property
    def box(self) -> tuple[Array, Array] | None:
        """Lower and upper corner of the box about all allowed cells; None if there are none."""
        if self.empty:
            return None
        used = [x[count > 0] for x, count in zip(self.coordinates, self._lines, strict=True)]
        return np.array([x[0] for x in used]) - 0.5 * self.step, np.array([x[-1] for x in used]) + 0.5 * self.step

    @property
    def centroid(self) -> Array | None:
        if self.empty:
            return None
        lines = zip(self.coordinates, self._lines, strict=True)
        return np.array([float(np.dot(x, count) / count.sum()) for x, count in lines])

    @cached_property
    def bounded_by(self) -> tuple[Bound, ...]:
        """The limits broken just outside, with their shares of the cells' faces there, the greatest first.

        Where the region goes on beyond the grid nothing is counted.
        """
        names, d = self.region.limits, len(self.coordinates)
        count, total = np.zeros(len(names)), np.zeros((len(names), d))
        for a in range(d):
            order = [a, *[b for b in range(d) if b != a]]
            broken = self.broken.transpose(order)
            mask = broken == 0
            for outside, shift in ((mask[:-1] < mask[1:], 0), (mask[1:] < mask[:-1], 1)):
                found = list(np.nonzero(outside))
                found[0] = found[0] + shift
                limit = broken[tuple(found)].astype(np.int64) - 1
                count += np.bincount(limit, minlength=len(names))
                for b, index in zip(order, found, strict=True):
                    place = self.coordinates[b][index] + ((0.5 - shift) * self.step if b == a else 0.0)
                    total[:, b] += np.bincount(limit, place, len(names))
        bounds = [
            Bound(names[i], float(count[i] / count.sum()), tuple((total[i] / count[i]).tolist()))
            for i in np.flatnonzero(count)
        ]
        return tuple(sorted(bounds, key=lambda bound: -bound.share))


def dense_grid(
    asked: Region,
    step: float,
    box: tuple[Sequence[float], Sequence[float]] | None = None,
    turns_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> GridWorkspace:
    """A region looked at in the middle of every cell of a lattice.

    Parameters
    ----------
    asked : made by :func:`parakin.workspaces.certified.region.region`
    step : edge of the cells, mm; their middles are odd multiples of half of it
    box : lower and upper corner, mm; only cells with their middle in it are looked at. Else all that may be allowed
    turns_step : of swept turns samples at most so far apart, rad, are looked at, both ends included; 5° by default
    progress : called with the fraction done

    Raises :class:`PoseError` for numbers that make no sense, more than 5e8 cells, or limits that do not bound the
    region where no box does.
    """
    positive("step", step, "mm")
    look = FirstBroken(asked, turns_step)
    where = surroundings(asked) if box is None else _checked(box, asked.free_axes)
    parameters = {
        **asked.parameters,
        "method": "grid",
        "step": step,
        "box": None if box is None else [list(map(float, corner)) for corner in box],
        "turns_step": TURNS_STEP if turns_step is None else turns_step,
    }
    if where is None:
        nothing = tuple(np.zeros(0) for _ in asked.free_axes)
        return GridWorkspace(asked, "grid", 0.0, step, parameters, nothing, look.on_grid(nothing))
    cells = prod(floor((b - a) / step) + 1 for a, b in zip(*where, strict=True))
    if cells > MOST_CELLS:
        room = float(np.prod([b - a for a, b in zip(*where, strict=True)]))
        least = (room / MOST_CELLS) ** (1.0 / len(asked.free_axes))
        raise PoseError(f"step: {step:g} mm makes {cells:.2g} cells, at most {MOST_CELLS:,} go; from {least:.2g} mm on")
    coordinates = tuple(centres(a, b, step) for a, b in zip(*where, strict=True))
    broken = look.on_grid(coordinates, progress)
    allowed = broken.size - np.count_nonzero(broken)
    return GridWorkspace(asked, "grid", allowed * step**broken.ndim, step, parameters, coordinates, broken)


def _checked(box: tuple[Sequence[float], Sequence[float]], places: Sequence[str]) -> tuple[Array, Array]:
    low, high = (np.array(corner, float).reshape(-1) for corner in box)
    if not (len(low) == len(high) == len(places) and np.isfinite(high - low).all() and (low < high).all()):
        raise PoseError(f"box: a lower and an upper corner expected, each of {' '.join(places)} in mm")
    return low, high
