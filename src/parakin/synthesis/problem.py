"""Design problems: which numbers of a machine are free, what is wanted of it, and what is minimised."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite

import numpy as np

from ..arrays import Array, AxisRange
from ..errors import PoseError, quote, suggest
from ..families.family import Family, make_family
from ..machine import Machine

QUANTITIES = ("amplification", "greatest_amplification", "stroke", "footprint")  # that can be bounded and minimised
MOST_OBJECTIVES = 2


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """A problem of dimensional synthesis; lengths are mm, angles rad.

    Parameters
    ----------
    free : the ranges of the machine's free numbers, by names of :attr:`Machine.parameters`
    box : (low, high) of each axis X, Y, Z, of the tool's orientation a range or one value; axes left out are as at home
    minimise : one or two of the quantities that ``bounds`` can have and the free numbers
    shift : how far the box may be moved: ranges by an axis, or by several that are moved together (``"X Y Z"``)
    bounds : the greatest ``amplification`` λ (1/λ ≤ psi ≤ λ all over the box) or ``greatest_amplification`` (psi ≤ λ
        alone), the greatest ``stroke`` of a leg's drive, the greatest ``footprint``: the diameter, about the machine's
        Z axis, of the circle that holds the struts' joints at the base
    fit_strokes : the ranges of the legs' drives become what the box needs; otherwise they are the machine's own

    Raises :class:`PoseError` for a problem that makes no sense.
    """

    machine: Machine
    free: Mapping[str, AxisRange]
    box: Mapping[str, AxisRange | float]
    minimise: Sequence[str]
    shift: Mapping[str, AxisRange] = field(default_factory=dict)
    bounds: Mapping[str, float] = field(default_factory=dict)
    fit_strokes: bool = False

    def __repr__(self) -> str:
        return f"<parakin design problem of {self.machine.name}: {len(self.free)} free numbers>"

    def __post_init__(self) -> None:
        if not self.free:
            raise PoseError("free: at least one number expected")
        known = [parameter.name for parameter in self.machine.parameters]
        for name in self.free:
            if name not in known:
                raise PoseError(f"free: unknown {quote(name)}{suggest(name, known)}")
        for what, ranges in (("free", self.free), ("shift", self.shift)):
            for name, (low, high) in ranges.items():
                if not (isfinite(low) and isfinite(high) and low < high):
                    raise PoseError(f"{what}: {name}: a range that rises expected, not {low:g} to {high:g}")
        self._check_box()
        self._check_wants()

    def _check_box(self) -> None:
        axes = self.machine.axes
        for axis in (*self.box, *(axis for key in self.shift for axis in key.split())):
            if axis not in axes:
                raise PoseError(f"unknown axis {quote(axis)}, {self.machine.name} has {' '.join(axes)}")
        for axis, (low, high) in self.ends.items():
            if not (isfinite(low) and isfinite(high) and low <= high):
                raise PoseError(f"box: {axis}: a range that rises expected, not {low:g} to {high:g}")
        for axis in axes:
            if axis in "XYZ" and axis not in self.box:
                raise PoseError(f"box: {axis} is missing")
        if not any(low < high for axis, (low, high) in self.ends.items() if axis in "XYZ"):
            raise PoseError("box: a range of X, Y or Z expected")
        moved = [axis for key in self.shift for axis in key.split()]
        if len(set(moved)) < len(moved) or not set(moved) <= set("XYZ"):
            raise PoseError("shift: X, Y and Z expected, each once")

    def _check_wants(self) -> None:
        for name, bound in self.bounds.items():
            if name not in QUANTITIES:
                raise PoseError(f"bounds: unknown {quote(name)}{suggest(name, QUANTITIES)}")
            least = 1.0 if name == "amplification" else 0.0
            if not (isfinite(bound) and bound > least):
                raise PoseError(f"{name}: a bound above {least:g} expected, not {bound:g}")
        if not 1 <= len(self.minimise) <= MOST_OBJECTIVES or len(set(self.minimise)) < len(self.minimise):
            raise PoseError(f"minimise: one or two objectives expected, not {len(self.minimise)}")
        known = [*QUANTITIES, *self.free]
        for name in self.minimise:
            if name not in known:
                raise PoseError(f"minimise: unknown {quote(name)}{suggest(name, known)}")
        if "stroke" in (*self.bounds, *self.minimise) and not self.fit_strokes:
            raise PoseError("stroke: the drives' ranges are the machine's own; let them be fitted to the box")

    @cached_property
    def ends(self) -> dict[str, AxisRange]:
        """Low and high of every axis, the box where it is stated."""
        home = dict(zip(self.machine.axes, self.machine.home.tolist(), strict=True))
        given = {axis: self.box.get(axis, home[axis]) for axis in self.machine.axes}
        return {axis: (e, e) if isinstance(e, (int, float)) else (e[0], e[1]) for axis, e in given.items()}

    @cached_property
    def wide_axes(self) -> tuple[str, ...]:
        """The axes along which the box has a width."""
        return tuple(axis for axis, (low, high) in self.ends.items() if low < high)

    @cached_property
    def family(self) -> Family:
        return make_family(self.machine, list(self.free))

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """The free numbers, in the family's order, and the shifts."""
        return (*self.family.names, *(f"shift {key}" for key in self.shift))

    @cached_property
    def ranges(self) -> Array:
        """Low and high of each variable, (variables, 2)."""
        return np.array([*(self.free[name] for name in self.family.names), *self.shift.values()], float)

    def place_box(self, x: Array) -> dict[str, AxisRange]:
        """Place the box of a design x (variables,)."""
        d = len(self.wide_axes)
        low, high = self.place_poses(x, np.array([np.zeros(d), np.ones(d)])).tolist()
        return {axis: (a, b) for axis, a, b in zip(self.machine.axes, low, high, strict=True)}

    def place_poses(self, x: Array, points: Array) -> Array:
        """Place poses of designs x (..., variables) at points (..., wide axes) of a box of edges 1; (..., axes)."""
        lead = np.broadcast_shapes(x.shape[:-1], points.shape[:-1])
        poses = np.empty((*lead, len(self.machine.axes)))
        shifts = [set(key.split()) for key in self.shift]
        for column, (axis, (low, high)) in enumerate(self.ends.items()):
            poses[..., column] = low
            if axis in self.wide_axes:
                poses[..., column] += (high - low) * points[..., self.wide_axes.index(axis)]
            for number, axes in enumerate(shifts, len(self.family.names)):
                if axis in axes:
                    poses[..., column] += x[..., number]
        return poses
