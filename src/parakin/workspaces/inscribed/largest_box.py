"""The largest box with edges along the axes inside a region, every place of it proved to be allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import PoseError
from ..certified.containment import verdicts
from ..certified.region import Region
from .growth import Family, climbed, grown
from .seeds import outline, starts

TOLERANCE = 1e-4  # of the region's extent
_HAIR = 1.0 - np.array([1e-14, 1e-12, 1e-9, 1e-6])
_OUTSIDE = 2.0 ** np.arange(6)  # tolerances by which a face is moved to see what stops it


@dataclass(frozen=True)
class Stop:
    """The limit that is broken just outside a face, at a pose.

    Both are None where the face alone could still move, or where nothing broken was met within 32 tolerances.
    """

    face: str  # "-X", "+X", "-Y", ...
    limit: str | None
    pose: tuple[float, ...] | None


@dataclass(frozen=True, eq=False)
class Box:
    """A box [low, high] of places, mm, all of them proved to be in the region.

    volume : mm³ (in the plane an area, mm²)
    stops : what stops each face, the lower and the upper one of each axis in turn
    tolerance : mm; by so much no face (of a box of given proportions or centre: not the box) could be proved to grow
    proved : always; a box that is not is none
    parameters : enough to run it again
    """

    region: Region
    low: Array
    high: Array
    stops: tuple[Stop, ...]
    tolerance: float
    parameters: Mapping[str, Any]
    proved: bool = True

    @property
    def axes(self) -> tuple[str, ...]:
        return self.region.free_axes

    @property
    def unit(self) -> str:
        """Of the volume."""
        return ("mm", "mm²", "mm³")[len(self.axes) - 1]

    @property
    def edges(self) -> Array:
        return self.high - self.low

    @property
    def centre(self) -> Array:
        return 0.5 * (self.low + self.high)

    @property
    def volume(self) -> float:
        return float(self.edges.prod())


def largest_box(
    region: Region,
    shape: Sequence[float] | None = None,
    around: ArrayLike | None = None,
    tolerance: float | None = None,
) -> Box:
    """A box inside a region that is as large as can be found, with edges along the axes.

    It is the best of several that were grown from great boxes of a coarse grid; each is proved by intervals, and none
    of its faces can be moved outward by more than the tolerance. No proof is given that no other is larger.

    Parameters
    ----------
    shape : proportions of its edges, one for each axis of a place; without them its volume is made greatest
    around : its centre, mm, one number for each axis of a place
    tolerance : mm; 1e-4 of the region's greatest extent if not given

    Raises :class:`PoseError` for a region in which nothing can be proved inside, a centre that is not, or a shape that
    is none.
    """
    proportions = None if shape is None else _shape(region, shape)
    centre = None if around is None else _centre(region, around)
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0.0):
        raise PoseError(f"tolerance: a length above 0 mm expected, not {tolerance:g}")
    cells = outline(region)
    low, high = cells.low.min(0), (cells.low + cells.size).max(0)
    smallest = TOLERANCE * float((high - low).max()) if tolerance is None else float(tolerance)
    found: list[Array] = []
    for bottom, top in starts(region, cells, proportions, centre):
        family = Family.of(bottom, top, proportions, centre)
        z = family.first
        if proportions is None or centre is None:
            z = climbed(region, family, z, smallest)
        z = grown(region, family, z, smallest)
        found.append(family.box(z))
    found.sort(key=lambda box: -float((box[1] - box[0]).prod()))
    proved = next((box for box in map(partial(_proved, region), found) if box is not None), None)
    if proved is None:
        what = "around the place" if centre is not None else "in the region"
        raise PoseError(f"no box {what} could be proved to be inside")
    first, last = proved
    parameters = {
        **region.parameters,
        "shape": None if shape is None else [float(part) for part in shape],
        "around": None if centre is None else centre.tolist(),
        "tolerance": smallest,
    }
    return Box(region, first, last, _stops(region, first, last, smallest), smallest, parameters)


def _proved(region: Region, box: Array) -> Array | None:
    """The box as it will be given, proved to the last digit; a hair smaller if it must be."""
    middle, half = box.mean(0), 0.5 * (box[1] - box[0])
    tries = np.array([box, *(np.array([middle - share * half, middle + share * half]) for share in _HAIR)])
    good = verdicts(region, tries[:, 0], tries[:, 1]).proved
    return np.asarray(tries[good.argmax()]) if good.any() else None


def _shape(region: Region, shape: Sequence[float]) -> Array:
    given = np.asarray(shape, float)
    if given.shape != (len(region.free_axes),) or not (np.isfinite(given).all() and (given > 0.0).all()):
        raise PoseError(f"shape: {len(region.free_axes)} numbers above 0 expected, for {' '.join(region.free_axes)}")
    return np.asarray(given / given.max())


def _centre(region: Region, around: ArrayLike) -> Array:
    place = np.asarray(around, float)
    if place.shape != (len(region.free_axes),) or not np.isfinite(place).all():
        raise PoseError(f"around: {len(region.free_axes)} numbers expected, for {' '.join(region.free_axes)}")
    found = verdicts(region, place[None], place[None])
    if found.limit[0] >= 0:
        where = ", ".join(f"{axis} {value:g}" for axis, value in zip(region.free_axes, place, strict=True))
        raise PoseError(f"around: {where} is outside the region, it breaks {found.names[int(found.limit[0])]}")
    return place


def _stops(region: Region, low: Array, high: Array, tolerance: float) -> tuple[Stop, ...]:
    """What is met just outside each face, by layers ever thicker."""
    stops = []
    for axis, name in enumerate(region.free_axes):
        for side, sign in enumerate("-+"):
            layers = np.tile(np.array([low, high]), (len(_OUTSIDE), 1, 1))
            layers[:, 1 - side, axis] = (low, high)[side][axis]
            layers[:, side, axis] += (2 * side - 1) * tolerance * _OUTSIDE
            found = verdicts(region, layers[:, 0], layers[:, 1])
            met = np.flatnonzero(found.limit >= 0)
            if found.proved[0] or not len(met):
                stops.append(Stop(sign + name, None, None))
                continue
            first = met[:1]
            pose = region.poses(found.places[first], found.turns[first])[0]
            stops.append(Stop(sign + name, found.names[int(found.limit[first[0]])], tuple(pose.tolist())))
    return tuple(stops)
