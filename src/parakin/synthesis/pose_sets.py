"""Wanted poses: a box of the axes, or a cylinder, with ranges of orientation; as numbers and as terms alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite, pi

import numpy as np

from ..algebra import Scalar, sincos
from ..arrays import Array, AxisRange, make_lattice
from ..errors import PoseError, quote, suggest
from ..machine import Machine
from ..performance.certified.interval_matrices import PoseBox
from ..performance.characteristic_length import CharacteristicLength
from ..units import LONGEST
from ..workspaces.certified.constraints import TracedPose

_TRANSLATIONS = "XYZ"
RADIUS, ANGLE = "radius", "angle"  # coordinates in a cylinder's section, in the place of its two axes
_ALONG = {1: 17, 2: 9, 3: 5, 4: 4}  # lattice points along each coordinate; 3 of more of them


@dataclass(frozen=True, eq=False)
class PoseSet:
    """A set of poses: every axis has a range, or a value twice.

    axes : of the machine
    ends : low and high of every axis, mm and rad
    diameter : of a cylinder, mm; the axes ``across`` it have its middle for a value
    """

    axes: tuple[str, ...]
    ends: Mapping[str, AxisRange]
    across: tuple[str, ...] = ()
    diameter: float = 0.0

    @cached_property
    def coordinates(self) -> dict[str, AxisRange]:
        """What tells a pose of the set: the translations, of which there is one at least, then turns with a range."""
        translations = {axis: ends for axis, ends in self.ends.items() if axis in _TRANSLATIONS}
        wide = {axis: ends for axis, ends in translations.items() if ends[0] < ends[1] and axis not in self.across}
        if self.across:
            wide = {RADIUS: (0.0, 0.5 * self.diameter), ANGLE: (0.0, 2.0 * pi)} | wide
        first = next(iter(translations))
        return (wide or {first: translations[first]}) | self.turns

    @property
    def turns(self) -> dict[str, AxisRange]:
        """The turning axes that have a range."""
        return {axis: e for axis, e in self.ends.items() if axis not in _TRANSLATIONS and e[0] < e[1]}

    def place(self, coordinates: Mapping[str, Scalar]) -> list[Scalar]:
        """Compute the pose of ``coordinates``, scalars of any kind by axis; what is left out has its low end."""
        known = dict(coordinates)
        if self.across:
            sine, cosine = sincos(known[ANGLE])
            for axis, share in zip(self.across, (cosine, sine), strict=True):
                known[axis] = known[RADIUS] * share + self.ends[axis][0]
        return [known[axis] if axis in known else np.float64(self.ends[axis][0]) for axis in self.axes]

    def place_rows(self, points: Array) -> Array:
        """Compute the poses (..., axes), mm and rad, of points of a box of edges 1.

        points : (..., coordinates); of more columns the first
        """
        ends = enumerate(self.coordinates.items())
        pose = self.place({name: low + (high - low) * points[..., i] for i, (name, (low, high)) in ends})
        return np.stack([np.broadcast_to(value, points.shape[:-1]) for value in pose], -1)

    def move(self, by: Mapping[str, float]) -> PoseSet:
        """Make the set that is moved ``by`` so much, mm and rad, along axes."""
        moved = {axis: (low + by.get(axis, 0.0), high + by.get(axis, 0.0)) for axis, (low, high) in self.ends.items()}
        return replace(self, ends=moved)

    def make_lattice(self) -> Array:
        """Make points (P, coordinates) all over the box of edges 1."""
        wide = sum(low < high for low, high in self.coordinates.values())
        count = _ALONG.get(wide, 3)
        lines = [np.linspace(0.0, 1.0, count) if low < high else [0.5] for low, high in self.coordinates.values()]
        return make_lattice(lines)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Low and high of the coordinates, (coordinates,) mm and rad each."""
        low, high = np.array(list(self.coordinates.values())).T
        return low, high

    def trace(self, machine: Machine) -> TracedSet:
        """Trace the pose of coordinates of a ``machine`` with these axes, for constraints."""
        turns = tuple(self.turns)
        free = tuple(self.coordinates)[: len(self.coordinates) - len(turns)]
        return TracedSet(machine, free, turns, {}, machine.mode, self)

    def make_box(self, machine: Machine, length: CharacteristicLength) -> PoseBox:
        """Make the box of the coordinates for bounds of matrices.

        machine : one with these axes
        length : by which angles are multiplied
        """
        wide = {name: ends for name, ends in self.coordinates.items() if ends[0] < ends[1]}
        return SetBox(machine, wide, {}, machine.mode, length, self)


@dataclass(frozen=True, eq=False)
class TracedSet(TracedPose):
    """The pose of a set's coordinates.

    pose_set : the set
    """

    pose_set: PoseSet

    def place(self, inputs: Sequence[Scalar]) -> list[Scalar]:
        return self.pose_set.place(dict(zip((*self.free_axes, *self.swept_axes), inputs, strict=True)))


@dataclass(frozen=True, eq=False)
class SetBox(PoseBox):
    """The box of a set's coordinates.

    pose_set : the set
    """

    pose_set: PoseSet

    def poses(self, points: Array) -> Array:
        pose = self.pose_set.place(dict(zip(self.ranges, points.T, strict=True)))
        return np.stack([np.broadcast_to(value, len(points)) for value in pose], -1)

    @cached_property
    def pose(self) -> list[Scalar]:
        return self.pose_set.place(dict(zip(self.ranges, self.inputs, strict=True)))


def check_ends(where: str, low: float, high: float, rises: bool) -> None:
    """Refuse the ends of a range that are not finite, do not rise, or lie farther out than any machine's."""
    if not (isfinite(low) and isfinite(high) and rises):
        raise PoseError(f"{where}: a range that rises expected, not {low:g} to {high:g}")
    if max(abs(low), abs(high)) > LONGEST:
        raise PoseError(f"{where}: {low:g} to {high:g} is out of range, at most 1 km expected")


def make_box_set(machine: Machine, axes: Mapping[str, AxisRange | float], what: str) -> PoseSet:
    """Make a box of poses; axes that are not stated are as at home.

    Raises :class:`PoseError` for axes that are unknown, missing or no range.
    """
    for axis in axes:
        if axis not in machine.axes:
            raise PoseError(f"{what}: unknown axis {quote(axis)}, {machine.name} has {' '.join(machine.axes)}")
    home = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    ends: dict[str, AxisRange] = {}
    for axis in machine.axes:
        if axis in _TRANSLATIONS and axis not in axes:
            raise PoseError(f"{what}: {axis} is missing")
        own = axes.get(axis, home[axis])
        low, high = (own, own) if isinstance(own, (int, float)) else own
        check_ends(f"{what}: {axis}", low, high, low <= high)
        ends[axis] = (low, high)
    return PoseSet(machine.axes, ends)


def make_cylinder_set(machine: Machine, said: Mapping[str, AxisRange | float | str]) -> PoseSet:
    """Make a cylinder of poses: ``along`` an axis X, Y or Z, its ``diameter``, the axes' values and ranges.

    Raises :class:`PoseError` for what is missing or no cylinder.
    """
    for key in ("along", "diameter"):
        if key not in said:
            raise PoseError(f"cylinder: {key} is missing")
    along, diameter = said["along"], said["diameter"]
    if along not in tuple(_TRANSLATIONS):
        raise PoseError(f"cylinder: along: {quote(along)}{suggest(str(along), tuple(_TRANSLATIONS))}")
    if not (isinstance(diameter, (int, float)) and 0.0 < diameter <= LONGEST):
        raise PoseError("cylinder: a diameter above 0 mm expected, at most 1 km")
    axes = {key: ends for key, ends in said.items() if key != "diameter" and not isinstance(ends, str)}
    whole = make_box_set(machine, axes, "cylinder")
    across = tuple(axis for axis in machine.axes if axis in _TRANSLATIONS and axis != along)
    if len(across) != 2:
        raise PoseError(f"cylinder: {machine.name} does not move in two axes across {along}")
    for axis in across:
        if whole.ends[axis][0] < whole.ends[axis][1]:
            raise PoseError(f"cylinder: {axis}: the middle, one value, expected across {along}")
    return replace(whole, across=across, diameter=float(diameter))
