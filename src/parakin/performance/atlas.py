"""The performance atlas: conditioning, amplification and singularity margins all over a region of places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import floor, isfinite, log10, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Progress
from ..errors import PoseError
from ..machine import Machine
from ..workspaces.certified.region import Region
from .certified.counterexamples import NOUGHT
from .characteristic_length import Length, characteristic_length
from .extremes import Extreme, Side, extremes, isotropic, room
from .indices import Performance, performance

MOST = 4_000_000  # places of a grid
_ALONG = {1: 400, 2: 120, 3: 36}  # places along the longest side, at most, if no step is given
_AT_ONCE = 1 << 15
_ON = 1e-3  # of a grid's step: a pose no farther off is on the slice
_ROUGH, _SECONDS = 0.1, 10.0  # how well the region is known before its grid is laid


@dataclass(frozen=True, eq=False)
class Map:
    """Performance on a grid over a region.

    grid : coordinates along each of the region's places, mm
    allowed : (grid) whether the machine is allowed there
    room : (grid) what is 0 on the region's boundary, positive within and negative without
    performance : of all places of the grid, allowed or not; NaN out of reach
    """

    region: Region
    step: float
    grid: tuple[Array, ...]
    allowed: NDArray[np.bool_]
    room: Array
    performance: Performance

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of a place."""
        return self.region.free_axes

    @cached_property
    def inside(self) -> Performance:
        """Of the allowed places alone, (N,)."""
        return _each(self.performance, lambda column: column[self.allowed])


@dataclass(frozen=True, eq=False)
class Atlas:
    """Performance over a region: the map, and what was found between its places.

    extremes : over the allowed places; begun on the grid, refined between its places, found by search
    isotropic : (k, axes) allowed poses at which J is a multiple of a rotation
    isolated : whether these stand alone; else they are samples of a curve or a surface of them
    """

    map: Map
    extremes: tuple[Extreme, ...]
    isotropic: Array
    isolated: bool

    @property
    def machine(self) -> Machine:
        return self.map.region.machine

    @property
    def singular(self) -> tuple[str, ...]:
        """Names of the margins that are not positive all over the region: it meets these singularities."""
        names = self.map.performance.margin_names
        return tuple(e.quantity for e in self.extremes if e.quantity in names and e.value <= NOUGHT)

    def extreme(self, quantity: str, side: Side) -> Extreme:
        """One of :attr:`extremes`: of ``condition``, ``greatest``, ``least``, ``manipulability`` or of a margin."""
        return next(e for e in self.extremes if e.quantity == quantity and e.side == side)

    def isotropic_on(self, drawn: Map) -> Array:
        """Those of the isotropic poses that lie on a slice, (k, axes)."""
        off = np.zeros(len(self.isotropic))
        for axis, value in drawn.region.fixed_axes.items():
            off = np.maximum(off, np.abs(self.isotropic[:, self.machine.axes.index(axis)] - value))
        return self.isotropic[off < _ON * drawn.step]


def atlas(
    region: Region,
    step: float | None = None,
    length: float | None = None,
    progress: Progress | None = None,
) -> Atlas:
    """Compute the performance over a region at one orientation: on a grid, and its extremes by search between.

    Parameters
    ----------
    region : made by :func:`parakin.region`, without swept axes; a fixed X, Y or Z makes it a slice
    step : between positions of the grid, mm; the grid stands on its multiples
    length : characteristic length, mm; see :func:`parakin.performance.characteristic_length.characteristic_length`
    progress : called with the fraction done

    Raises :class:`PoseError` for invalid numbers, and for a region that is swept, unbounded or empty.
    """
    if region.swept_axes:
        raise PoseError(f"region: an atlas is of one orientation, {' '.join(region.swept_axes)} must not be swept")
    report = progress or (lambda fraction: None)
    drawn = map_of(region, step, length, lambda fraction: report(0.4 * fraction))
    found = extremes(region, drawn.inside, drawn.step)
    report(0.9)
    poses, isolated = isotropic(region, drawn.inside, drawn.step)
    return Atlas(drawn, found, poses, isolated)


def map_of(
    asked: Region,
    step: float | None = None,
    length: float | None = None,
    progress: Progress | None = None,
) -> Map:
    """The map alone, over a region without swept turns; parameters and errors as of :func:`atlas`."""
    scale = characteristic_length(asked.machine, length)
    if step is not None and not (isfinite(step) and step > 0.0):
        raise PoseError(f"step: a length above 0 mm expected, not {step:g}")
    low, high = _extent(asked)
    step = _round(float((high - low).max()) / _ALONG[len(asked.free_axes)]) if step is None else float(step)
    counts = [(b - a) / step + 1.0 for a, b in zip(low, high, strict=True)]
    if prod(counts) > MOST:
        size = " x ".join(f"{count:,.0f}" for count in counts)
        raise PoseError(f"step: {step:g} mm makes {size} places, at most {MOST:,} are possible")
    grid = tuple(_multiples(a, b, step) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(*grid, indexing="ij"), -1).reshape(-1, len(grid))
    shape = tuple(len(line) for line in grid)
    found = _computed(asked, places, scale, progress)
    free = room(asked, places)
    if not (free >= 0.0).any():
        raise PoseError(f"step: no place of a grid of {step:g} mm is allowed, choose a finer one")
    whole = _each(found, lambda column: column.reshape(*shape, *column.shape[1:]))
    return Map(asked, step, grid, (free >= 0.0).reshape(shape), free.reshape(shape), whole)


def _extent(asked: Region) -> tuple[Array, Array]:
    """A box that holds the region, tight enough for a grid to be worth its places."""
    around = asked.extent
    if around is not None:
        cells = asked.subdivide(*around).run(_ROUGH, seconds=_SECONDS)
        if len(cells.low):
            return cells.low.min(0), (cells.low + cells.size).max(0)
    raise PoseError("the machine is allowed nowhere there")


def _round(width: float) -> float:
    """The least of 1, 2 and 5 times a power of ten that is no less than a width."""
    power = 10.0 ** floor(log10(width)) if width > 0.0 else 1.0
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= width * (1.0 - 1e-9))


def _multiples(low: float, high: float, step: float) -> Array:
    """Multiples of the step from low to high; what lies between two of them gets its middle."""
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return np.arange(first, last + 1.0) * step if last >= first else np.array([0.5 * (low + high)])


_COLUMNS = ("poses", "psi", "directions", "margins")


def _each(found: Performance, change: Callable[[Array], Array]) -> Performance:
    columns: dict[str, Any] = {name: change(getattr(found, name)) for name in _COLUMNS}
    return replace(found, **columns)


def _computed(asked: Region, places: Array, length: Length, progress: Progress | None) -> Performance:
    parts = []
    for start in range(0, len(places), _AT_ONCE):
        poses = asked.poses(places[start : start + _AT_ONCE])
        parts.append(performance(asked.machine, poses, length.value, asked.mode))
        if progress:
            progress(min(1.0, (start + len(poses)) / len(places)))
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
    return replace(parts[0], length=length, **columns)
