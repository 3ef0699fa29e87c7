"""What a workspace is asked of: which axes are places, which are held, which turns are swept, which limits count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from math import isfinite, pi
from typing import Literal

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...kernels.elementary import GREATEST_ANGLE
from ...machine import Machine
from .constraints import Constraint, Slice
from .inclusive import SomeTurn
from .subdivision import Subdivision
from .total import EveryTurn

Kind = Literal["constant", "total", "inclusive", "dexterous"]
Span = tuple[float, float]

FAR = 1e6  # mm: no machine reaches farther
_MANY = 20_000  # cells by which a bounded region has left the farthest ones
_TINY = 1e-3  # mm
_SHRINKING = 0.6  # of an edge from round to round, while the cells are much larger than the region
_EVERY_WAY: dict[str, Span] = {"A": (-pi, pi), "B": (-pi / 2, pi / 2), "C": (-pi, pi)}


@dataclass(frozen=True, eq=False)
class Region:
    """A set of places: those where the machine is allowed for every or for some turn of given ranges.

    ``places`` are the axes that a place is made of, ``held`` the axes with one value, ``turns`` those swept, with
    their ranges (rad). ``without`` names the limits that don't count. Made by :func:`region`.
    """

    machine: Machine
    kind: Kind
    places: tuple[str, ...]
    held: Mapping[str, float]
    turns: Mapping[str, Span]
    without: tuple[str, ...]
    mode: str

    @cached_property
    def slice(self) -> Slice:
        return Slice(self.machine, self.places, tuple(self.turns), self.held, self.mode)

    @cached_property
    def constraints(self) -> list[Constraint]:
        return self.slice.constraints(self.without)

    @property
    def limits(self) -> tuple[str, ...]:
        """Names of the limits that count, in the order of the constraints."""
        return tuple(constraint.name for constraint in self.constraints if not constraint.implied)

    @property
    def every(self) -> bool:
        """All turns must be allowed, not only one."""
        return self.kind != "inclusive"

    def subdivision(self, low: Array, high: Array, more: Sequence[Constraint] = ()) -> Subdivision:
        """The subdivision of a box of places, under ``more`` constraints besides."""
        ends = (np.array([span[i] for span in self.turns.values()], float) for i in (0, 1))
        kind = EveryTurn if self.every else SomeTurn
        return kind([*self.constraints, *more], low, high, tuple(ends))  # type: ignore[arg-type]

    @cached_property
    def extent(self) -> tuple[Array, Array] | None:
        """A box proved to hold the whole region, not much larger than it; None for a region proved empty.

        Raises :class:`PoseError` if the limits leave it unbounded.
        """
        far = np.full(len(self.places), FAR)
        work = self.subdivision(-far, far)
        before = 2.0 * far
        while True:
            cells = work.cells("gap")
            if not len(cells.low):
                return None
            low, high = cells.low.min(0), (cells.low + cells.size).max(0)
            far_out = (low <= -FAR) | (high >= FAR)
            inside = cells.take(cells.inside)
            for_good = ((inside.low <= -FAR) | (inside.low + inside.size >= FAR)).any(0)
            done = not len(work.open.low) or len(work.open.low) > _MANY or work.open.size.max() < _TINY
            if for_good.any() or (far_out.any() and done):
                axis = self.places[int((for_good if for_good.any() else far_out).argmax())]
                raise PoseError(f"the limits that count do not bound the workspace in {axis}")
            fine = ((high - low) >= 6.0 * cells.size.min(0)).any() or cells.size.max() < _TINY
            still = ((high - low) > _SHRINKING * before).all() or len(work.open.low) > _MANY
            if not len(work.open.low) or (fine and still and not far_out.any()):
                return low, high
            before = high - low
            work.refine(np.arange(len(work.open.low)))

    def poses(self, places: Array, turns: Array | None = None) -> Array:
        """Whole poses (N, axes) at places (N, d) with turns (N, s), in the order of :attr:`turns`."""
        rows = np.empty((len(places), len(self.machine.axes)))
        for axis, value in self.held.items():
            rows[:, self.machine.axes.index(axis)] = value
        for i, axis in enumerate(self.places):
            rows[:, self.machine.axes.index(axis)] = places[:, i]
        for i, axis in enumerate(self.turns):
            assert turns is not None
            rows[:, self.machine.axes.index(axis)] = turns[:, i]
        return rows


def region(
    machine: Machine,
    at: Mapping[str, float] | None = None,
    every: Mapping[str, Span] | None = None,
    some: Mapping[str, Span] | None = None,
    dexterous: bool = False,
    without: Sequence[str] = (),
    mode: str | None = None,
) -> Region:
    """What is asked, checked.

    Parameters
    ----------
    at : axes to hold, mm and rad; turning axes that are not named stand as at home
    every : turning axes of which every value in a range (low, high), rad, must be allowed: total orientation
    some : turning axes of which one value in a range must be: inclusive
    dexterous : every value of every turning axis must be allowed
    without : names of limits that do not count, with ``*`` for any letters; legs must reach in any case
    mode : working mode

    Raises :class:`PoseError`.
    """
    held = dict(at or {})
    swept = {axis: (float(low), float(high)) for axis, (low, high) in {**(every or {}), **(some or {})}.items()}
    turning = [axis for axis, unit in zip(machine.axes, machine.axis_units, strict=True) if unit == "rad"]
    if sum((bool(every), bool(some), dexterous)) > 1:
        raise PoseError("one of every, some and dexterous can be asked at a time")
    if dexterous:
        swept = {axis: _EVERY_WAY[axis] for axis in turning}
        if turning == ["B", "C"]:
            swept["B"] = (0.0, pi)
    kind: Kind = "dexterous" if dexterous else "total" if every else "inclusive" if some else "constant"
    for axis in (*held, *swept):
        if axis not in machine.axes:
            raise PoseError(f"unknown axis {axis}, {machine.name} has {' '.join(machine.axes)}")
    for axis, span in swept.items():
        if axis not in turning:
            raise PoseError(f"{axis} is no turning axis, only {' '.join(turning) or 'none here'} can be swept")
        if axis in held:
            raise PoseError(f"{axis} is held and swept")
        if not all(map(isfinite, span)) or span[0] > span[1]:
            raise PoseError(f"the range of {axis} is empty: {span[0]:g} to {span[1]:g}")
        if max(map(abs, span)) > GREATEST_ANGLE:
            raise PoseError(f"the range of {axis} is beyond what can be computed: {span[0]:g} to {span[1]:g}")
    for axis, value in held.items():
        if not isfinite(value):
            raise PoseError(f"{axis}: {value} is no place to hold it")
        if abs(value) > (GREATEST_ANGLE if axis in turning else FAR):
            raise PoseError(f"{axis}: {value:g} is beyond what can be computed")
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    held |= {axis: home[axis] for axis in turning if axis not in held and axis not in swept}
    places = tuple(axis for axis in machine.axes if axis not in turning and axis not in held)
    if not places:
        raise PoseError(f"every axis is held; leave at least one of {' '.join('XYZ')} free")
    order = tuple(axis for axis in machine.axes if axis in swept)
    return Region(
        machine,
        kind,
        places,
        {axis: float(held[axis]) for axis in machine.axes if axis in held},
        {axis: swept[axis] for axis in order},
        _switched_off(machine, without),
        machine.checked_mode(mode),
    )


def _switched_off(machine: Machine, patterns: Sequence[str]) -> tuple[str, ...]:
    off: list[str] = []
    for pattern in patterns:
        found = [name for name in machine.limits if fnmatchcase(name, pattern)]
        if not found:
            raise PoseError(f"no limit {pattern}, {machine.name} has {', '.join(machine.limits)}")
        reach = [limit.name for limit in machine.limit_parts if limit.side == "reach" and limit.name in found]
        if reach and reach == found:
            raise PoseError(f"{pattern} can't be switched off: where it fails, the legs don't close")
        off += [name for name in found if name not in reach and name not in off]
    return tuple(off)
