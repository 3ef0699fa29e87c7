"""The largest box with edges along the axes inside a region, every position of it proved to be allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arguments import RowsLike, check_arguments, read_vector
from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ..certified.containment import prove_boxes
from ..certified.region import Region
from ..certified.region_result import RegionResult
from .growth import BoxFamily, climb_volume, grow_faces
from .seeds import COUNT, find_outline_cells, find_seeds

_THINNEST = 1e6  # greatest proportion of a box's edges
TOLERANCE = 1e-4  # fraction of the region's extent
_SLIGHTLY_SMALLER = 1.0 - np.array([1e-14, 1e-12, 1e-9, 1e-6])
_SEARCH, _OUTLINE, _FINAL = 0.7, 0.3, 0.7  # shares of the time: for the search, the outline in it, the last proof
_OUTSIDE = 2.0 ** np.arange(6)  # tolerances by which a face is moved to find what stops it


class NoBoxError(PoseError):
    """No box was proved to be inside: the region is too thin, or the time too short."""


@dataclass(frozen=True)
class FaceStop:
    """The limit that is broken just outside a face, and a pose where it is.

    face : ``-X``, ``+X``, ``-Y`` ...
    limit, pose : its name, and (axes,) mm and rad; both are None where the face alone could still move, or where no
        broken limit was found within 32 tolerances
    """

    face: str
    limit: str | None
    pose: tuple[float, ...] | None


@dataclass(frozen=True, eq=False)
class InscribedBox(RegionResult):
    """A box of positions, all of them proved to be in the region.

    low, high : its corners, (d,) mm
    stops : what stops each face, the lower and the upper one of each axis in turn
    tolerance : mm; by so much no face (of a box of given proportions or centre: not the box) could be proved to grow
    stopped : why the search ended: ``tolerance``, or ``time``; then the faces may have room to grow
    parameters : enough to run it again
    proved : always true
    """

    low: Array
    high: Array
    stops: tuple[FaceStop, ...]
    tolerance: float
    parameters: Mapping[str, Any]
    stopped: str = "tolerance"
    proved: bool = True

    @property
    def edges(self) -> Array:
        """The lengths of its edges, (d,) mm."""
        return self.high - self.low

    @property
    def centre(self) -> Array:
        """Its middle, (d,) mm."""
        return 0.5 * (self.low + self.high)

    @property
    def volume(self) -> float:
        """The volume, mm³ (in the plane an area, mm²)."""
        return float(self.edges.prod())

    def __repr__(self) -> str:
        edges = ", ".join(
            f"{axis} {low:.6g} to {high:.6g}" for axis, low, high in zip(self.axes, self.low, self.high, strict=True)
        )
        return f"<parakin box in {self.region.machine.name}: {edges}, {self.volume:.6g} {self.unit}>"


@check_arguments
def find_largest_box(
    region: Region,
    shape: Sequence[float] | None = None,
    around: RowsLike | None = None,
    tolerance: float | None = None,
    seconds: float | None = SECONDS,
    progress: Progress | None = None,
) -> InscribedBox:
    """Find a large axis-parallel box inside a region, by growth from several seeds.

    The best of them is taken. It is proved by intervals, and none of its faces can be moved outward by more than the
    tolerance; that no other box is larger is not proved.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    shape : proportions of its edges, one for each axis of a position; without them its volume is made greatest
    around : its centre, mm, one number for each axis of a position
    tolerance : mm; 1e-4 of the region's greatest extent if not given
    seconds : stop after this time with the largest box proved so far; None for no end
    progress : called with the fraction done

    Raises :class:`PoseError` for a region in which no box is proved inside (in that time), a centre outside, or an
    invalid shape.
    """
    proportions = None if shape is None else _check_shape(region, shape)
    centre = None if around is None else _check_centre(region, around)
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0.0):
        raise PoseError(f"tolerance: a length above 0 mm expected, not {tolerance:g}")
    budget = Budget(seconds)
    search = budget.take_fraction(_SEARCH)
    outline = find_outline_cells(region, search.take_fraction(_OUTLINE))
    low, high = outline.low.min(0), (outline.low + outline.size).max(0)
    smallest = TOLERANCE * float((high - low).max()) if tolerance is None else float(tolerance)
    boxes: list[Array] = []
    for seed_low, seed_high in find_seeds(region, outline, proportions, centre, search):
        if progress:
            progress((1.0 + len(boxes)) / (COUNT + 2.0))
        family = BoxFamily.start_from(seed_low, seed_high, proportions, centre)
        z = family.first
        if proportions is None or centre is None:
            z = climb_volume(region, family, z, smallest, search)
        boxes.append(family.make_boxes(grow_faces(region, family, z, smallest, search)))
    stopped = "time" if search.is_spent() else "tolerance"
    first, last = _prove_largest(region, boxes, budget.take_fraction(_FINAL), centre is not None, stopped)
    parameters = {
        **region.parameters,
        "shape": None if shape is None else [float(proportion) for proportion in shape],
        "around": None if centre is None else centre.tolist(),
        "tolerance": smallest,
        "seconds": seconds,
    }
    stops = _find_stops(region, first, last, smallest, budget)
    return InscribedBox(region, first, last, stops, smallest, parameters, stopped)


def _prove_largest(region: Region, boxes: list[Array], budget: Budget, is_centred: bool, stopped: str) -> Array:
    """Prove the largest box (2, d) that can be proved as it will be given."""
    for box in sorted(boxes, key=lambda box: -float((box[1] - box[0]).prod())):
        proved = _prove_final_box(region, box, budget)
        if proved is not None:
            return proved
    what = "around the place" if is_centred else "in the region"
    within = " in the time given" if stopped == "time" else ""
    raise NoBoxError(f"no box {what} could be proved to be inside{within}")


def _prove_final_box(region: Region, box: Array, budget: Budget) -> Array | None:
    """Prove the box as it will be given, to the last digit, or a slightly smaller one."""
    middle, half = box.mean(0), 0.5 * (box[1] - box[0])
    smaller = (np.array([middle - scale * half, middle + scale * half]) for scale in _SLIGHTLY_SMALLER)
    tries = np.array([box, *smaller])
    proved = prove_boxes(region, tries[:, 0], tries[:, 1], budget=budget).proved
    return np.asarray(tries[proved.argmax()]) if proved.any() else None


def _check_shape(region: Region, shape: Sequence[float]) -> Array:
    given = read_vector("shape", shape, region.free_axes, "numbers above 0")
    if not (given > 0.0).all():
        raise PoseError(f"shape: {len(region.free_axes)} numbers above 0 expected, for {' '.join(region.free_axes)}")
    if given.max() > _THINNEST * given.min():
        raise PoseError(f"shape: no proportion more than {_THINNEST:,.0f} times another expected")
    return np.asarray(given / given.max())


def _check_centre(region: Region, around: RowsLike) -> Array:
    centre = read_vector("around", around, region.free_axes)
    containment = prove_boxes(region, centre[None], centre[None])
    if containment.limit[0] >= 0:
        where = ", ".join(f"{axis} {value:g}" for axis, value in zip(region.free_axes, centre, strict=True))
        name = containment.names[int(containment.limit[0])]
        raise PoseError(f"around: {where} is outside the region, it breaks {name}")
    return centre


def _find_stops(region: Region, low: Array, high: Array, tolerance: float, budget: Budget) -> tuple[FaceStop, ...]:
    """Find a broken limit just outside each face, by layers ever thicker."""
    stops: list[FaceStop] = []
    for axis, name in enumerate(region.free_axes):
        for side, sign in enumerate("-+"):
            layers = np.tile(np.array([low, high]), (len(_OUTSIDE), 1, 1))
            layers[:, 1 - side, axis] = (low, high)[side][axis]
            layers[:, side, axis] += (2 * side - 1) * tolerance * _OUTSIDE
            own = budget.take_fraction(1.0 / (2 * len(low) - len(stops)))
            containment = prove_boxes(region, layers[:, 0], layers[:, 1], budget=own)
            broken = np.flatnonzero(containment.limit >= 0)
            if containment.proved[0] or not len(broken):
                stops.append(FaceStop(sign + name, None, None))
                continue
            first = broken[:1]
            pose = region.poses(containment.positions[first], containment.orientations[first])[0]
            limit = containment.names[int(containment.limit[first[0]])]
            stops.append(FaceStop(sign + name, limit, tuple(pose.tolist())))
    return tuple(stops)
