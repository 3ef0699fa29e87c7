"""Where to put the part: the workpiece's placement that leaves the greatest least margin over a whole tool path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from ...arguments import check_arguments, check_positive, parse_range
from ...arrays import Array, AxisRange, Progress
from ...errors import PoseError, quote
from ...machine import Machine
from ...units import AXIS_UNITS, to_display
from ..path import ToolPath
from ..posting.frames import compose_frames
from ..posting.posted import Posted
from ..posting.range_use import find_tightest_limit, measure_range_use
from ..posting.tool_lengths import fit_tool_lengths
from ..posting.working_mode import HELD, list_candidate_modes
from .margins import AXES, PlacementMargins, PlacementScore, Steering
from .placement_search import PlacementSearch

AxisRanges: TypeAlias = Mapping[str, AxisRange | Sequence[float | str]]


@dataclass(frozen=True, eq=False)
class Placement:
    """The best placement found.

    workpiece : (3, 4), the transform to post with: M ← workpiece ← path.frame ← W
    values : mm and rad, by axis, of those that the bounds name
    mode : the working mode it was found in, to post with
    margin : the least of all margins over the path, over half its limit's range (a broken reach: over the rod's length
        squared); negative where no allowed placement was found
    limit, record : the limit that leaves it, or one of the path's own: ``tilt``, ``X``, ``Y``, ``Z``; and where
        (0-based)
    tried : how many placements were computed
    """

    workpiece: Array
    values: dict[str, float]
    mode: str
    margin: float
    limit: str
    record: int
    tried: int

    def measure(self, posted: Posted) -> Placement:
        """Return it with the margin that a posted path leaves there, where its own records break a limit.

        posted : the path on the machine at this placement; it may be led through poles and rewound, and ``record`` is
            then one of its records
        """
        if self.allowed:
            return self
        relative = measure_range_use(posted)[1]
        record = int(relative.argmin())
        limit = find_tightest_limit(posted, record)
        return replace(self, margin=float(relative[record]), limit=limit, record=record)

    def format_values(self) -> str:
        """Format its values as options take them, mm and degrees: ``X=10,C=90``."""
        return ",".join(f"{axis}={to_display(value, AXIS_UNITS[axis]):.6g}" for axis, value in self.values.items())

    def describe_refusal(self) -> str:
        """Describe, of a placement that is not allowed, where it is and what it breaks."""
        return (
            f"no placement within these bounds is allowed; the nearest is {self.format_values() or 'the only one'}: "
            f"{-self.margin:.1%} of half a range beyond {self.limit}"
        )

    @property
    def allowed(self) -> bool:
        """Whether the machine can follow the whole path there."""
        return self.margin >= 0.0

    def __repr__(self) -> str:
        values = ", ".join(f"{axis} {value:.6g}" for axis, value in self.values.items())
        return (
            f"<parakin placement: {values or 'no axis free'} (mm, rad), mode {self.mode!r}, margin {self.margin:.4g}>"
        )


@check_arguments
def find_placement(
    machine: Machine,
    path: ToolPath,
    bounds: AxisRanges,
    *,
    mode: str | None = None,
    rewinds: bool = False,
    angle: float = 5e-4,
    progress: Progress | None = None,
) -> Placement:
    """Find the placement within bounds that has the greatest least margin over all records of a path.

    The first of :func:`find_placements`, where the same arguments are told at length. Between the records a limit may
    be broken all the same, which :func:`parakin.prepare` tells.

    machine, path, bounds, mode, rewinds, angle, progress : as for :func:`find_placements`

    Raises :class:`PoseError` also where no placement within the bounds keeps the limits at all records.
    """
    placements = find_placements(machine, path, bounds, mode=mode, rewinds=rewinds, angle=angle, progress=progress)
    if not placements[0].allowed:
        raise PoseError(f"bounds: {placements[0].describe_refusal()}")
    return placements[0]


def bound_near_home(machine: Machine, path: ToolPath, reach: float) -> dict[str, tuple[float, float]]:
    """Bound the workpiece's place, mm by axis, so that the middle of a path is within a reach of home along each axis.

    Raises :class:`PoseError` for a path without records.
    """
    if not len(path):
        raise PoseError("a path without records has no middle")
    frame = compose_frames(None, path.frame)
    tips = path.tip @ frame[:, :3].T + frame[:, 3]
    middle = 0.5 * (tips.min(axis=0) + tips.max(axis=0))
    home = {axis: float(value) for axis, value in zip(machine.axes, machine.home, strict=True) if axis in "XYZ"}
    places = {axis: round(value - float(middle["XYZ".index(axis)]), 1) for axis, value in home.items()}
    return {axis: (place - reach, place + reach) for axis, place in places.items()}


@check_arguments
def find_placements(
    machine: Machine,
    path: ToolPath,
    bounds: AxisRanges,
    *,
    mode: str | None = None,
    rewinds: bool = False,
    angle: float = 5e-4,
    progress: Progress | None = None,
) -> list[Placement]:
    """Find the placements within bounds at which the least margin over all records of a path is greatest, best first.

    The first is the best one found; the others are local maxima elsewhere, for where the motions between the records
    break a limit at the best.

    Parameters
    ----------
    machine, path : as for :func:`parakin.prepare`
    bounds : by axis the least and the greatest value, mm and rad or texts with their unit
    mode : working mode; None: the default one, and head and table's other sign where that allows no placement
    rewinds : the turns of a wrist's first joint are taken back, so that the ends of its range do not count
    angle : rad; a tool's axis so near to a wrist's pole will be held there, and turns no joint
    progress : called now and then with the fraction done, 0 to 1

    The same arguments give the same placements. The search (:class:`~.placement_search.PlacementSearch`) finds the
    greatest, it does not prove it.

    Raises :class:`PoseError` for invalid bounds, an unknown mode and a path without records.
    """
    for axis in bounds:
        if axis not in tuple(AXES):
            raise PoseError(f"bounds: unknown axis {quote(axis)}, an axis of X Y Z A B C and low <= high expected")
    ranges = {axis: parse_range(axis, ends, AXIS_UNITS[axis]) for axis, ends in bounds.items()}
    for axis, (low, high) in ranges.items():
        if not -math.inf < low <= high < math.inf:
            raise PoseError(f"bounds: {axis} from {low} to {high}; an axis of X Y Z A B C and low <= high expected")
    if not len(path):
        raise PoseError("path: no records to place")
    path = fit_tool_lengths(machine, path)
    report = progress or (lambda fraction: None)
    axes = tuple(axis for axis in AXES if axis in ranges and ranges[axis][0] < ranges[axis][1])
    fixed = {axis: ends[0] for axis, ends in ranges.items() if axis not in axes}
    low_high = np.array([ranges[axis] for axis in axes]).reshape(-1, 2)
    results, tried = list[tuple[Array, PlacementScore, PlacementMargins]](), 0
    for candidate in list_candidate_modes(machine, mode):
        way = Steering(candidate, HELD * check_positive("angle", angle, "rad"), rewinds)
        margins = PlacementMargins(machine, path, way, axes, low_high[:, 0], low_high[:, 1], fixed)
        search = PlacementSearch(margins, report)
        results += [(point, score, margins) for point, score in search.run()]
        tried += search.tried
        if any(score.margin >= 0.0 for _, score, _ in results):
            break
    report(1.0)
    results.sort(key=lambda result: -result[1].worth)
    return [_describe_placement(*result, tried) for result in results]


def _describe_placement(point: Array, score: PlacementScore, margins: PlacementMargins, tried: int) -> Placement:
    values = margins.list_values(point)
    values = {axis: values[axis] for axis in AXES if axis in values}
    workpiece = margins.build_workpiece(point)
    return Placement(workpiece, values, margins.steering.mode, score.margin, score.limit, score.record, tried)
