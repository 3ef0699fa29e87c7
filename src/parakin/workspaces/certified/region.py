"""Regions: which axes of a machine are free, fixed or swept, and which of its limits count."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from math import isfinite
from typing import Any, Literal

import numpy as np

from ...arguments import check_arguments, parse_coordinate, parse_range
from ...arrays import Array, AxisRange, Flags
from ...budget import Budget
from ...errors import PoseError
from ...kernels.elementary import GREATEST_ANGLE
from ...machine import Machine
from .assembly_mode import make_side_constraints
from .constraints import Constraint, TracedPose
from .inclusive import InclusiveSubdivision
from .subdivision import Subdivision
from .total import TotalSubdivision

CountedComponents = Literal["home", "all"]
RegionKind = Literal["constant", "total", "inclusive", "dexterous"]

FAR = 1e6  # mm: no machine reaches farther
_MANY = 20_000  # cells after which a bounded region has left the farthest ones
_TINY = 1e-3  # mm: cells so small end the search for the extent
_OF_ALL_COMPONENTS = ("traced_pose", "limit_constraints", "side_constraints", "extent")  # the components do not count
_SHRINKING = 0.6  # ratio of a cell's edge to that of the round before, while cells are much larger than the region


@dataclass(frozen=True, eq=False)
class Region:
    """A set of tool positions: those where the machine is allowed at every or at one orientation of given ranges.

    Made by :func:`parakin.region`. The total orientation workspace is the set of X, Y, Z at which (44) of FME
    Transactions 41 (2013) is 1 for every B and C of the ranges.

    machine, mode : the one that is asked about, and its working mode
    kind : constant (one orientation), total (every one of the ranges), inclusive (at least one), dexterous (every one)
    free_axes : the axes that make up a position
    fixed_axes : the axes with one value, mm and rad
    swept_axes : the turning axes with a range, (low, high) rad
    without : names of the limits that do not count
    components : ``home``, only the component in which home lies, in its assembly mode, or ``all``
    stated_axes : those of the fixed axes that are stated; the others are turning axes that keep their value at home
    """

    machine: Machine
    kind: RegionKind
    free_axes: tuple[str, ...]
    fixed_axes: Mapping[str, float]
    swept_axes: Mapping[str, AxisRange]
    without: tuple[str, ...]
    mode: str
    components: CountedComponents = "home"
    stated_axes: tuple[str, ...] = ()

    @cached_property
    def traced_pose(self) -> TracedPose:
        """The pose as terms, whose inputs are the free and the swept axes."""
        return TracedPose(self.machine, self.free_axes, tuple(self.swept_axes), self.fixed_axes, self.mode)

    @cached_property
    def limit_constraints(self) -> list[Constraint]:
        """What the limits alone ask of a pose, in every assembly mode."""
        return self.traced_pose.build_constraints(self.without)

    @cached_property
    def side_constraints(self) -> tuple[Constraint, ...]:
        """The sign of det A as at home, and the other one; none for a machine with more drives than freedoms.

        Its singular poses are those where several determinants vanish at once, and leave no side of their own.
        """
        return () if self.machine.is_redundant else make_side_constraints(self.traced_pose)

    @cached_property
    def constraints(self) -> list[Constraint]:
        """What must be ≥ 0 for a pose to be allowed, as functions of position and orientation."""
        limits = self.limit_constraints
        if self.components == "all":
            return limits
        first_implied = next((i for i, limit in enumerate(limits) if limit.implied), len(limits))
        return [*limits[:first_implied], *self.side_constraints[:1], *limits[first_implied:]]

    @property
    def limits(self) -> tuple[str, ...]:
        """Names of the limits that count, in the order of the constraints."""
        return tuple(constraint.name for constraint in self.constraints if not constraint.implied)

    @property
    def home_position(self) -> Array:
        """The position of home, (d,) mm."""
        return self.machine.home[[self.machine.axes.index(axis) for axis in self.free_axes]]

    @property
    def volume_unit(self) -> str:
        """Unit of a volume of positions: mm³, in the plane mm², along a line mm."""
        return ("mm", "mm²", "mm³")[len(self.free_axes) - 1]

    @property
    def every_orientation(self) -> bool:
        """Whether all orientations of the swept ranges must be allowed, not only one."""
        return self.kind != "inclusive"

    @cached_property
    def swept_bounds(self) -> tuple[Array, Array]:
        """Lower and upper ends of the swept ranges, (s,) rad each."""
        low, high = (np.array([ends[i] for ends in self.swept_axes.values()], float) for i in (0, 1))
        return low, high

    @property
    def parameters(self) -> dict[str, Any]:
        """What :func:`parakin.region` needs to make the region again, and what follows from it; mm and rad."""
        swept = {axis: list(ends) for axis, ends in self.swept_axes.items()}
        return {
            "machine": self.machine.name,
            "kind": self.kind,
            "places": list(self.free_axes),
            "at": dict(self.fixed_axes),
            "every": swept if self.every_orientation and self.kind != "dexterous" else {},
            "some": {} if self.every_orientation else swept,
            "without": list(self.without),
            "mode": self.mode,
            "components": self.components,
        }

    @check_arguments
    def fix(self, values: Mapping[str, float | str]) -> Region:
        """Make the region in which free or swept axes are fixed.

        values : by axis, mm and rad, or texts with their unit

        Raises :class:`PoseError` for values that are not finite or beyond what can be computed.
        """
        _refuse_unknown_axes(self.machine, values)
        values = parse_coordinates(self.machine, values)
        turning = _list_turning_axes(self.machine)
        for axis, value in values.items():
            _refuse_bad_value(axis, value, turning)
        fixed = {**self.fixed_axes, **values}
        swept = {axis: ends for axis, ends in self.swept_axes.items() if axis not in values}
        return replace(
            self,
            kind=self.kind if swept else "constant",
            free_axes=tuple(axis for axis in self.free_axes if axis not in values),
            fixed_axes={axis: float(fixed[axis]) for axis in self.machine.axes if axis in fixed},
            swept_axes=swept,
            stated_axes=(*self.stated_axes, *values),
        )

    def subdivide(self, low: Array, high: Array, more: Sequence[Constraint] = ()) -> Subdivision:
        """Begin the subdivision of a box of positions under the region's constraints.

        low, high : the box's corners, (d,) mm
        more : further constraints
        """
        return self._subdivide_under([*self.constraints, *more], low, high)

    def _subdivide_under(
        self, constraints: Sequence[Constraint], low: Array, high: Array, closely: bool = True
    ) -> Subdivision:
        subdivision = TotalSubdivision if self.every_orientation else InclusiveSubdivision
        return subdivision(constraints, low, high, self.swept_bounds, closely)

    def subdivide_all_components(self, low: Array, high: Array) -> Subdivision:
        """Begin the subdivision of a box of positions under the limits alone.

        low, high : the box's corners, (d,) mm
        """
        return self._subdivide_under(self.limit_constraints, low, high, closely=False)

    def include_all_components(self) -> Region:
        """Make the same region of all assembly modes, which has the same extent."""
        if self.components == "all":
            return self
        whole = replace(self, components="all")
        computed = self.__dict__
        whole.__dict__.update({name: computed[name] for name in _OF_ALL_COMPONENTS if name in computed})
        return whole

    @cached_property
    def extent(self) -> tuple[Array, Array] | None:
        """The box that :meth:`find_extent` finds in its own time."""
        return self.find_extent()

    def find_extent(self, budget: Budget | None = None) -> tuple[Array, Array] | None:
        """Find a box, (d,) mm each corner, that is proved to hold the whole region; None for one proved empty.

        It holds all components, for limits bound the machine and no sign of a determinant does; it is not much larger.

        budget : the time, by default 60 s; where it ends before, the box is larger than need be, else it is kept

        Raises :class:`PoseError` if the limits leave it unbounded, or are not proved to bound it.
        """
        known: dict[str, Any] = self.__dict__
        if "extent" in known:
            return self.extent
        budget = budget or Budget()
        box = _search_extent(self, budget)
        if not budget.is_spent():
            known["extent"] = box
        return box

    def poses(self, positions: Array, orientations: Array | None = None) -> Array:
        """Compute whole poses (N, axes), mm and rad.

        positions : (N, d) mm, of the free axes
        orientations : (N, s) rad, of the swept axes in their order
        """
        rows = np.empty((len(positions), len(self.machine.axes)))
        for axis, value in self.fixed_axes.items():
            rows[:, self.machine.axes.index(axis)] = value
        for i, axis in enumerate(self.free_axes):
            rows[:, self.machine.axes.index(axis)] = positions[:, i]
        for i, axis in enumerate(self.swept_axes):
            assert orientations is not None
            rows[:, self.machine.axes.index(axis)] = orientations[:, i]
        return rows

    def __repr__(self) -> str:
        fixed = ", ".join(f"{axis} {value:.6g}" for axis, value in self.fixed_axes.items())
        return (
            f"<parakin region of {self.machine.name}: {' '.join(self.free_axes)}, {self.kind}{fixed and ' at '}{fixed}>"
        )


def _search_extent(region: Region, budget: Budget) -> tuple[Array, Array] | None:
    """Search for a box that holds a region by ever smaller cells; None for a region proved empty."""
    far = np.full(len(region.free_axes), FAR)
    subdivision = region.subdivide_all_components(-far, far)
    before = 2.0 * far
    while True:
        cells = subdivision.collect_cells("gap")
        if not len(cells.low):
            return None
        low, high = cells.low.min(0), (cells.low + cells.size).max(0)
        far_out: Flags = np.asarray((low <= -FAR) | (high >= FAR))
        inside = cells.take(cells.inside)
        for_good: Flags = np.asarray(((inside.low <= -FAR) | (inside.low + inside.size >= FAR)).any(0))
        count = len(subdivision.open_cells.low)
        spent = budget.is_spent()
        done = not count or count > _MANY or subdivision.open_cells.size.max() < _TINY or spent
        if for_good.any():
            raise PoseError(f"the limits that count do not bound the workspace in {_name_first(region, for_good)}")
        if far_out.any() and done:
            axis = _name_first(region, far_out)
            raise PoseError(f"the limits that count are not proved to bound the workspace in {axis}")
        fine = ((high - low) >= 6.0 * cells.size.min(0)).any() or cells.size.max() < _TINY
        still = ((high - low) > _SHRINKING * before).all() or count > _MANY
        if not count or (fine and still and not far_out.any()) or spent:
            return low, high
        before = high - low
        subdivision.refine(np.arange(count), budget)


def _name_first(region: Region, flags: Flags) -> str:
    return region.free_axes[int(flags.argmax())]


@check_arguments
def make_region(
    machine: Machine,
    at: Mapping[str, float | str] | None = None,
    every: Mapping[str, Sequence[float | str]] | None = None,
    some: Mapping[str, Sequence[float | str]] | None = None,
    dexterous: bool = False,
    without: Sequence[str] = (),
    mode: str | None = None,
    components: CountedComponents = "home",
) -> Region:
    """Make the region of a workspace or an atlas: check which axes are fixed and swept and which limits count.

    Parameters
    ----------
    machine : the one that is asked about
    at : axes to fix, numbers in mm and rad or texts with their unit (``{"B": "30 deg"}``); turning axes that are not
        named keep their value at home
    every : turning axes with a range (low, high), rad or texts as above, at every value of which the machine must be
        allowed: total orientation workspace
    some : turning axes with a range at one value of which it must be: inclusive orientation workspace
    dexterous : the machine must be allowed at every value of every turning axis
    without : names of limits that do not count, with ``*`` for any letters; legs must reach in any case
    mode : working mode, by default the machine's
    components : ``home`` leaves out what the machine could reach in another assembly mode only, beyond a parallel
        singularity, such as the mirror image of its workspace behind the base; ``all`` counts it

    Raises :class:`PoseError` for an axis that is unknown or stated twice, a range that is empty or of a translation, no
    free axis, and a limit that is unknown or can't be left out.
    """
    _refuse_unknown_axes(machine, (*(at or {}), *(every or {}), *(some or {})))
    fixed = parse_coordinates(machine, at or {})
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    ranges = {**(every or {}), **(some or {})}
    swept = {axis: parse_range(axis, ends, units[axis]) for axis, ends in ranges.items()}
    turning = _list_turning_axes(machine)
    if sum((bool(every), bool(some), dexterous)) > 1:
        raise PoseError("one of every, some and dexterous can be asked at a time")
    if dexterous:
        swept = machine.orientation_ranges
    kind: RegionKind = "dexterous" if dexterous else "total" if every else "inclusive" if some else "constant"
    for axis, ends in swept.items():
        _refuse_bad_range(axis, ends, turning, fixed)
    for axis, value in fixed.items():
        _refuse_bad_value(axis, value, turning)
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    fixed |= {axis: home[axis] for axis in turning if axis not in fixed and axis not in swept}
    free = tuple(axis for axis in machine.axes if axis not in turning and axis not in fixed)
    if not free:
        raise PoseError(f"every axis is fixed; leave at least one of {' '.join('XYZ')} free")
    return Region(
        machine,
        kind,
        free,
        {axis: float(fixed[axis]) for axis in machine.axes if axis in fixed},
        {axis: swept[axis] for axis in machine.axes if axis in swept},
        _find_ignored_limits(machine, without),
        machine.checked_mode(mode),
        components,
        tuple(at or {}),
    )


def parse_coordinates(machine: Machine, values: Mapping[str, float | str]) -> dict[str, float]:
    """Parse values of axes, numbers (mm, rad) or texts with their unit; return mm and rad."""
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    return {axis: parse_coordinate(axis, value, units[axis]) for axis, value in values.items()}


def _list_turning_axes(machine: Machine) -> list[str]:
    return [machine.axes[column] for column in machine.turning_columns]


def _refuse_unknown_axes(machine: Machine, axes: Iterable[str]) -> None:
    for axis in axes:
        if axis not in machine.axes:
            raise PoseError(f"unknown axis {axis}, {machine.name} has {' '.join(machine.axes)}")


def _refuse_bad_range(axis: str, ends: AxisRange, turning: Sequence[str], fixed: Mapping[str, float]) -> None:
    if axis not in turning:
        raise PoseError(f"{axis} is no turning axis, only {' '.join(turning) or 'none here'} can be swept")
    if axis in fixed:
        raise PoseError(f"{axis} is fixed and swept")
    if not all(map(isfinite, ends)) or ends[0] > ends[1]:
        raise PoseError(f"the range of {axis} is empty: {ends[0]:g} to {ends[1]:g}")
    if max(map(abs, ends)) > GREATEST_ANGLE:
        raise PoseError(f"the range of {axis} is beyond what can be computed: {ends[0]:g} to {ends[1]:g}")


def _refuse_bad_value(axis: str, value: float, turning: Sequence[str]) -> None:
    if not isfinite(value):
        raise PoseError(f"{axis}: {value} is no place to hold it")
    if abs(value) > (GREATEST_ANGLE if axis in turning else FAR):
        raise PoseError(f"{axis}: {value:g} is beyond what can be computed")


def _find_ignored_limits(machine: Machine, patterns: Sequence[str]) -> tuple[str, ...]:
    """Find the limits to ignore, without the legs' reach; a pattern that matches nothing else is refused."""
    ignored: list[str] = []
    for pattern in patterns:
        matching = [name for name in machine.limits if fnmatchcase(name, pattern)]
        if not matching:
            raise PoseError(f"no limit {pattern}, {machine.name} has {', '.join(machine.limits)}")
        reach = [limit.name for limit in machine.limit_definitions if limit.side == "reach" and limit.name in matching]
        if reach and reach == matching:
            raise PoseError(f"{pattern} can't be switched off: where it fails, the legs don't close")
        ignored += [name for name in matching if name not in reach and name not in ignored]
    return tuple(ignored)
