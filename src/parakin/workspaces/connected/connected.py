"""Connected parts of a region: what a continuous path can reach without a singularity or another working mode.

The t-connected regions of Chablat and Wenger. Where a leg is out of reach a region ends in any case, and there are the
serial singularities of a working mode; the parallel ones cut it where det A changes its sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import PoseError
from ..certified.constraints import Constraint
from ..certified.containment import verdicts
from ..certified.region import Region
from ..certified.workspace import ROUNDING, Volume
from ..inscribed.seeds import outline
from .adjacency import not_too_many
from .assembly_mode import sides
from .components import Island, islands

_FINE = {1: 4096, 2: 512, 3: 128}  # cells along the longest edge
_NEAR = 32  # cells of a part that are looked at from a place


@dataclass(frozen=True, eq=False)
class Part:
    """One part of a region.

    sign : of det A, 1 where it is as at home, else -1
    volume : mm³ (in the plane mm²): at least what is proved to hang together, at most with all cells that may
    place : a place in it, (d,) mm
    low, high : corners of a box proved to hold it
    apart : it is proved to hang together with no other part
    """

    sign: int
    volume: Volume
    place: Array
    low: Array
    high: Array
    apart: bool


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of a region, the largest first.

    at_least : how many are proved to be different
    undecided : volume of what may or may not be more of them, or belong to one: too small for the cells
    start : index of the part that holds the pose asked for; None if none was
    cell : edge to which the boundary was refined, mm
    stopped : why the work ended, as of :class:`Workspace`
    parameters : enough to run it again
    """

    region: Region
    parts: tuple[Part, ...]
    at_least: int
    undecided: float
    start: int | None
    cell: float
    stopped: str
    parameters: Mapping[str, Any]

    def __len__(self) -> int:
        return len(self.parts)


def connected_parts(
    region: Region,
    start: ArrayLike | None = None,
    cell: float | None = None,
    seconds: float | None = 60.0,
) -> Parts:
    """The parts of a region that a path can go through without crossing a singularity or changing the working mode.

    Of a total region, for every one of its turns. Cells proved inside that share a face hang together, and those
    further ones that a small box proved inside joins.

    Parameters
    ----------
    start : a pose, mm and rad; told is the part that holds it
    cell : edge to which the boundary is refined, mm; 1/128 of the region's extent if not given (1/512 in the plane)
    seconds : stop refining cells after this time, for each sign of det A; None for no end

    Raises :class:`PoseError` for an inclusive region, a start outside it, or one that is too near to the boundary.
    """
    if not region.every_orientation:
        raise PoseError("some: of one turn for each place nothing is known of the turns between; hold or sweep them")
    if cell is not None and not (isfinite(cell) and cell > 0.0):
        raise PoseError(f"cell: a size above 0 mm expected, not {cell:g}")
    both = dict(zip((1, -1), sides(region), strict=True))
    place, sign = (None, 0) if start is None else _place(region, start, both)
    rough = outline(region)
    low, high = rough.low.min(0), (rough.low + rough.size).max(0)
    edge = float((high - low).max()) / _FINE[len(low)] if cell is None else cell
    not_too_many(np.ceil((high - low) / edge), edge)
    named: list[tuple[Part, Island]] = []
    at_least, undecided, stopped = 0, 0.0, "cell"
    for own, constraint in both.items():
        found = islands(region, constraint, low, high, edge, seconds)
        named += [(_part(own, island), island) for island in found.islands]
        at_least += found.at_least
        undecided += found.undecided
        stopped = found.stopped if stopped == "cell" else stopped
    named.sort(key=lambda each: -each[0].volume.estimate)
    parameters = {
        **region.parameters,
        "start": None if start is None else np.asarray(start, float).tolist(),
        "cell": edge,
        "seconds": seconds,
    }
    index = None if place is None else _holding(region, place, sign, both[sign], named)
    parts = tuple(part for part, _ in named)
    return Parts(region, parts, at_least, undecided, index, edge, stopped, parameters)


def _part(sign: int, island: Island) -> Part:
    volume = Volume(island.inner * (1.0 - ROUNDING), island.estimate, island.outer * (1.0 + ROUNDING))
    largest = int(island.size.prod(1).argmax())
    place = island.low[largest] + 0.5 * island.size[largest]
    return Part(sign, volume, place, *island.box, island.apart)


def _place(region: Region, start: ArrayLike, both: Mapping[int, Constraint]) -> tuple[Array, int]:
    """The start's place, which is in the region, and the sign of det A there."""
    machine = region.machine
    rows, lead = machine.rows(start, machine.axes, "start")
    if lead:
        raise PoseError(f"start: one pose of {' '.join(machine.axes)} expected")
    pose = dict(zip(machine.axes, rows[0].tolist(), strict=True))
    for axis, value in region.fixed_axes.items():
        if not abs(pose[axis] - value) <= 1e-9 * max(1.0, abs(value)):
            raise PoseError(f"start: {axis} is {pose[axis]:g}, but held at {value:g} here")
    for axis, (first, last) in region.swept_axes.items():
        if not first <= pose[axis] <= last:
            raise PoseError(f"start: {axis} is {pose[axis]:g}, beyond its range {first:g} to {last:g}")
    place = np.array([pose[axis] for axis in region.free_axes])
    if not np.isfinite(place).all():
        raise PoseError("start: a pose of finite numbers expected")
    found = verdicts(region, place[None], place[None])
    if found.limit[0] >= 0:
        raise PoseError(f"start: it is outside the region, {found.names[int(found.limit[0])]} is broken")
    for sign, constraint in both.items():
        if verdicts(region, place[None], place[None], [constraint]).proved[0]:
            return place, sign
    raise PoseError("start: it is on the region's boundary or at a parallel singularity")


def _holding(region: Region, place: Array, sign: int, constraint: Constraint, named: list[tuple[Part, Island]]) -> int:
    """The part that holds a place, or that a box proved inside joins to it."""
    near: list[tuple[float, int, Array, Array]] = []
    for number, (part, island) in enumerate(named):
        if part.sign == sign:
            point = np.clip(place, island.low, island.low + island.size)
            distance = np.abs(point - place).max(1)
            for cell in np.argsort(distance, kind="stable")[:_NEAR]:
                near.append(
                    (float(distance[cell]), number, np.minimum(point[cell], place), np.maximum(point[cell], place))
                )
    near.sort(key=lambda each: each[0])
    if near:
        low, high = (np.array([each[i] for each in near]) for i in (2, 3))
        joined = verdicts(region, low, high, [constraint]).proved
        if joined.any():
            return near[int(joined.argmax())][1]
    raise PoseError("start: it is too near to the boundary to tell its part; smaller cells would")
