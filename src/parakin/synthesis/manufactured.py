"""All machines within manufacturing tolerance: their poses as terms of the sizes too, and what a design loses by them.

Merlet's appropriate design: a want holds for every machine that may be made, not for the nominal one alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..accuracy.tolerances import SizedJumpFreeTrace, make_tolerance_family, read_tolerances
from ..algebra import Scalar, Term
from ..arrays import Array
from ..errors import PoseError
from ..families.shift_rates import trace_shift_rates
from ..machine import Machine
from ..model.equations import Equations
from ..model.geometric_parameters import SIZES
from ..model.nominal_values import SizedTrace
from ..model.rates import TwistRates
from ..performance.characteristic_length import CharacteristicLength
from ..performance.jacobians import scale_twist_rates
from .pose_sets import PoseSet, SetBox, TracedSet

_SAME = 1e-3  # relative: a reserve that grows by less is the same


@dataclass(eq=False)
class Reserve:
    """What the nominal machine keeps in hand, so that all machines within tolerance keep the wants.

    margins : of the limits that count, as :attr:`Measures.margins`; zero without tolerances, as all others
    low, high : (legs,) of the ends of the legs' drives, mm and rad
    losses : of quantities by their names
    """

    margins: Array
    low: Array
    high: Array
    losses: dict[str, float] = field(default_factory=dict)

    def grow(self, other: Reserve) -> bool:
        """Grow to another one where that is greater by more than rounding; tell whether it is."""
        grows = [bool((new > old * (1.0 + _SAME)).any()) for new, old in self._pair(other)]
        grows += [loss > self.losses.get(name, 0.0) * (1.0 + _SAME) for name, loss in other.losses.items()]
        self.margins, self.low, self.high = (np.maximum(new, old) for new, old in self._pair(other))
        self.losses |= {name: max(loss, self.losses.get(name, 0.0)) for name, loss in other.losses.items()}
        return any(grows)

    def _pair(self, other: Reserve) -> list[tuple[Array, Array]]:
        return [(other.margins, self.margins), (other.low, self.low), (other.high, self.high)]


class SizeBox:
    """The numbers that have tolerances, and between which values each may be.

    Raises :class:`PoseError` for tolerances of no number, or of a named size, from which a made machine deviates in
    each number on its own.
    """

    def __init__(self, machine: Machine, within: Mapping[str, str]):
        tolerances = make_tolerance_family(machine, read_tolerances(within))
        self.family, self.halves = tolerances.family, tolerances.halves
        named = [p.name for p in self.family.parameters if p.group == SIZES]
        if named:
            raise PoseError(f"{named[0]} is a named size; tolerances of numbers that are made expected, such as feet")

    @property
    def names(self) -> tuple[str, ...]:
        return self.family.names

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Low and high of each number."""
        return self.family.nominal - self.halves, self.family.nominal + self.halves

    def trace_equations(self, sizes: Sequence[Scalar]) -> Equations:
        return self.family.machine.trace_equations(dict(zip(self.names, sizes, strict=True)))

    def trace_set(self, poses: PoseSet) -> TracedSet:
        """Trace the pose of a set's coordinates, with the sizes as further inputs."""
        machine, plain = self.family.machine, poses.trace(self.family.machine)
        return _SizedSet(machine, plain.free_axes, plain.swept_axes, {}, machine.mode, poses, self)

    def make_box(self, poses: PoseSet, length: CharacteristicLength) -> _SizedBox:
        """Make the box of a set's coordinates and the sizes, for bounds of matrices."""
        plain = poses.make_box(self.family.machine, length)
        ends = dict(zip(self.names, zip(*(end.tolist() for end in self.bounds), strict=True), strict=True))
        return _SizedBox(plain.machine, {**plain.ranges, **ends}, {}, plain.mode, length, poses, self)


@dataclass(frozen=True, eq=False)
class _SizedSet(TracedSet):
    size_box: SizeBox

    @property
    def _count(self) -> int:
        return len(self.free_axes) + len(self.swept_axes)

    @cached_property
    def inputs(self) -> list[Term]:
        nominal = self.size_box.family.nominal.tolist()
        return SizedTrace(self._count, nominal).inputs(self._count + len(nominal))

    @cached_property
    def jump_free_inputs(self) -> list[Term]:
        nominal = self.size_box.family.nominal.tolist()
        return SizedJumpFreeTrace(self._count, nominal).inputs(self._count + len(nominal))

    def place(self, inputs: Sequence[Scalar]) -> list[Scalar]:
        return super().place(inputs[: self._count])

    def trace_equations(self, inputs: Sequence[Scalar]) -> Equations:
        return self.size_box.trace_equations(inputs[self._count :])

    def trace_twist_rows(self, inputs: Sequence[Scalar]) -> list[list[Scalar]]:
        return _trace_rates(self.size_box, self.place(inputs), inputs[self._count :], self.mode).a


@dataclass(frozen=True, eq=False)
class _SizedBox(SetBox):
    size_box: SizeBox

    @property
    def searched(self) -> int:
        return len(self.ranges) - len(self.size_box.names)

    @cached_property
    def inputs(self) -> list[Term]:
        return SizedJumpFreeTrace(self.searched, self.size_box.family.nominal.tolist()).inputs(len(self.ranges))

    @property
    def sizes(self) -> Mapping[str, Scalar]:
        return dict(zip(self.size_box.names, self.inputs[self.searched :], strict=True))

    @property
    def widths(self) -> Array:
        """The sizes' are infinite: poses alone are bisected."""
        return np.concatenate([(self.high - self.low)[: self.searched], np.full(len(self.sizes), np.inf)])

    @cached_property
    def samples(self) -> Array:
        plain = self.pose_set.make_box(self.machine, self.length).samples
        return np.hstack([plain, np.tile(self.size_box.family.nominal, (len(plain), 1))])

    @cached_property
    def pose(self) -> list[Scalar]:
        return self.pose_set.place(dict(zip(self.ranges, self.inputs[: self.searched], strict=False)))

    @cached_property
    def _rates(self) -> tuple[TwistRates, list[Scalar]]:
        rates = _trace_rates(self.size_box, self.pose, list(self.sizes.values()), self.mode)
        return scale_twist_rates(self.machine, rates, self.length), []


def _trace_rates(sizes: SizeBox, pose: Sequence[Scalar], values: Sequence[Scalar], mode: str) -> TwistRates:
    with np.errstate(all="ignore"):
        joints, _, _ = sizes.trace_equations(values).invert(pose, mode)
        own = dict(zip(sizes.names, values, strict=True))
        a, b, _ = trace_shift_rates(sizes.family.machine, pose, joints, (), own)
    return TwistRates(a, b, [])
