"""The connected components of a region: what a continuous path can reach without a singularity or another working mode.

They are the t-connected regions of Chablat and Wenger. A region ends where a leg is out of reach, and there are the
serial singularities of a working mode; the parallel ones separate components where det A changes its sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from ...arguments import RowsLike, check_arguments
from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ..certified.constraints import Constraint
from ..certified.containment import prove_boxes
from ..certified.region import Region
from ..certified.workspace import ROUNDING, Volume
from ..inscribed.seeds import find_outline_cells
from .adjacency import refuse_too_many_cells
from .cell_components import CellComponent, Resolution, find_cell_components

_FINE = {1: 4096, 2: 512, 3: 128}  # cells along the longest edge, by dimension
_OUTLINE = 0.2  # fraction of the time for the outline
_NEAR = 32  # cells of a component from which a path to a position is looked for

ONE_ORIENTATION = "of one turn for each place nothing is known of the turns between; hold or sweep them"

_Side = tuple[Constraint, ...]
_ONE_SIDE: dict[int, _Side] = {1: ()}  # of more drives than freedoms: no singularity separates poses

_Pair = tuple["Component", CellComponent]


@dataclass(frozen=True, eq=False)
class Component:
    """One connected component of a region.

    sign : of det A, 1 where it is as at home, else -1; 1 with more drives than freedoms
    volume : mm³ (in the plane mm²): at least what is proved to hang together, at most with all cells that may
    position : a position in it, (d,) mm
    low, high : corners of a box proved to hold it, (d,) mm
    apart : it is proved to hang together with no other component
    """

    sign: int
    volume: Volume
    position: Array
    low: Array
    high: Array
    apart: bool

    def __repr__(self) -> str:
        return f"<parakin component: sign {self.sign:+d}, {self.volume.inner:.6g} to {self.volume.outer:.6g}>"


@dataclass(frozen=True, eq=False)
class Components:
    """The connected components of a region, the largest first.

    region : the one that this is about
    components : those found
    at_least : how many are proved to be different
    undecided : volume of what may be more of them, or belong to one: too small for the cells
    start : index of the component that holds the start; None if none was given
    cell : edge to which the boundary was refined, mm
    stopped : why the subdivision ended, as of :class:`~.certified.workspace.Workspace`
    parameters : enough to run it again
    """

    region: Region
    components: tuple[Component, ...]
    at_least: int
    undecided: float
    start: int | None
    cell: float
    stopped: str
    parameters: Mapping[str, Any]

    def __len__(self) -> int:
        return len(self.components)

    def __repr__(self) -> str:
        return (
            f"<parakin components of a region of {self.region.machine.name}: "
            f"{len(self)}, at least {self.at_least} different>"
        )


@check_arguments
def find_components(
    region: Region,
    start: RowsLike | None = None,
    cell: float | None = None,
    seconds: float | None = SECONDS,
    progress: Progress | None = None,
) -> Components:
    """Find the connected components of a region under singularities and the working mode, by certified cells.

    They are the t-connected regions of Chablat and Wenger. Of a total region every orientation counts. Cells proved
    inside hang together if they share a face, or if a small box proved inside joins them.

    Parameters
    ----------
    region : made by :func:`parakin.region`
    start : a pose (axes,), mm and rad, whose component is wanted
    cell : edge to which the boundary is refined, mm; 1/128 of the region's extent if not given (1/512 in the plane)
    seconds : stop refining cells after this time; None for no end
    progress : called with the fraction done

    Raises :class:`PoseError` for an inclusive region, a start outside it, or one that is too near to the boundary.
    """
    if not region.every_orientation:
        raise PoseError(f"some: {ONE_ORIENTATION}")
    if cell is not None and not (isfinite(cell) and cell > 0.0):
        raise PoseError(f"cell: a size above 0 mm expected, not {cell:g}")
    budget, report = Budget(seconds), progress or (lambda fraction: None)
    region = region.include_all_components()
    sides = {
        sign: (constraint,) for sign, constraint in zip((1, -1), region.side_constraints, strict=False)
    } or _ONE_SIDE
    position, sign = (None, 0) if start is None else _locate_start(region, start, sides)
    outline = find_outline_cells(region, budget.take_fraction(_OUTLINE))
    low, high = outline.low.min(0), (outline.low + outline.size).max(0)
    edge = float((high - low).max()) / _FINE[len(low)] if cell is None else cell
    refuse_too_many_cells(np.ceil((high - low) / edge), edge)
    pairs: list[_Pair] = []
    at_least, undecided, stopped = 0, 0.0, "cell"
    for done, (own_sign, side) in enumerate(sides.items()):
        report((1.0 + done) / (1.0 + len(sides)))
        one_side = find_cell_components(
            region, side, low, high, Resolution(edge, budget.take_fraction(1.0 / (len(sides) - done)))
        )
        pairs += [(_describe_component(own_sign, cells), cells) for cells in one_side.components]
        at_least += one_side.at_least
        undecided += one_side.undecided
        stopped = one_side.stopped if stopped == "cell" else stopped
    pairs.sort(key=lambda each: -each[0].volume.estimate)
    parameters = {
        **region.parameters,
        "start": None if start is None else region.machine.rows(start, region.machine.axes, "start")[0][0].tolist(),
        "cell": edge,
        "seconds": seconds,
    }
    index = None if position is None else _find_holder(region, position, sign, sides[sign], pairs)
    components = tuple(component for component, _ in pairs)
    return Components(region, components, at_least, undecided, index, edge, stopped, parameters)


def _describe_component(sign: int, cells: CellComponent) -> Component:
    volume = Volume(cells.inner * (1.0 - ROUNDING), cells.estimate, cells.outer * (1.0 + ROUNDING))
    largest = int(cells.size.prod(1).argmax())
    position = cells.low[largest] + 0.5 * cells.size[largest]
    return Component(sign, volume, position, *cells.box, cells.apart)


def _locate_start(region: Region, start: RowsLike, sides: Mapping[int, _Side]) -> tuple[Array, int]:
    """Check that the start is in the region; returns its position, and the sign of det A there."""
    machine = region.machine
    rows, lead = machine.rows(start, machine.axes, "start")
    if lead:
        raise PoseError(f"start: one pose of {' '.join(machine.axes)} expected")
    pose = dict(zip(machine.axes, rows[0].tolist(), strict=True))
    for axis, value in region.fixed_axes.items():
        if not abs(pose[axis] - value) <= 1e-9 * max(1.0, abs(value)):
            raise PoseError(f"start: {axis} is {pose[axis]:g}, but fixed at {value:g} here")
    for axis, (first, last) in region.swept_axes.items():
        if not first <= pose[axis] <= last:
            raise PoseError(f"start: {axis} is {pose[axis]:g}, beyond its range {first:g} to {last:g}")
    position = np.array([pose[axis] for axis in region.free_axes])
    if not np.isfinite(position).all():
        raise PoseError("start: a pose of finite numbers expected")
    containment = prove_boxes(region, position[None], position[None])
    if containment.limit[0] >= 0:
        name = containment.names[int(containment.limit[0])]
        raise PoseError(f"start: it is outside the region, {name} is broken")
    for sign, side in sides.items():
        if prove_boxes(region, position[None], position[None], side).proved[0]:
            return position, sign
    raise PoseError("start: it is on the region's boundary or at a parallel singularity")


def _find_holder(region: Region, position: Array, sign: int, side: _Side, pairs: list[_Pair]) -> int:
    """Find the component that contains a position, or that a box proved inside connects with it."""
    near: list[tuple[float, int, Array, Array]] = []
    for number, (component, cells) in enumerate(pairs):
        if component.sign == sign:
            points = np.clip(position, cells.low, cells.low + cells.size)
            distance = np.abs(points - position).max(1)
            for cell in np.argsort(distance, kind="stable")[:_NEAR]:
                low, high = np.minimum(points[cell], position), np.maximum(points[cell], position)
                near.append((float(distance[cell]), number, low, high))
    near.sort(key=lambda each: each[0])
    if near:
        bottom, top = (np.array([each[i] for each in near]) for i in (2, 3))
        joined = prove_boxes(region, bottom, top, side).proved
        if joined.any():
            return near[int(joined.argmax())][1]
    raise PoseError("start: it is too near to the boundary to tell its part; smaller cells would")
