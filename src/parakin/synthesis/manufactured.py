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

    margins : (limits,) of those that count, as :attr:`Measures.margins`; zero without tolerances, as all others
    low, high : (legs,) of the ends of the legs' drives, mm and rad
    losses : of quantities by their names
    """

    margins: Array
    low: Array
    high: Array
    losses: dict[str, float] = field(default_factory=dict)

    def grow(self, other: Reserve) -> bool:
        """Grow to the ``other`` one where that is greater by more than rounding; tell whether it is."""
        grows = [bool((new > old * (1.0 + _SAME)).any()) for new, old in self._pair(other)]
        grows += [loss > self.losses.get(name, 0.0) * (1.0 + _SAME) for name, loss in other.losses.items()]
        self.margins, self.low, self.high = (np.maximum(new, old) for new, old in self._pair(other))
        self.losses |= {name: max(loss, self.losses.get(name, 0.0)) for name, loss in other.losses.items()}
        return any(grows)

    def _pair(self, other: Reserve) -> list[tuple[Array, Array]]:
        return [(other.margins, self.margins), (other.low, self.low), (other.high, self.high)]


class SizeBox:
    """The numbers that have tolerances, and between which values each may be.

    A number that follows a named size is what that makes it, and its own deviation is added.

    machine : with its nominal numbers
    within : the tolerances, as for :func:`parakin.analyse_accuracy`
    poses : a set, as its methods take it
    names, nominal, halves : of the k numbers: (k,) mm and rad, and how far each may be off, either way
    inputs : scalars that the numbers are, each with its own deviation alone, mm and rad

    Raises :class:`PoseError` for tolerances of no number.
    """

    def __init__(self, machine: Machine, within: Mapping[str, str]):
        tolerances = make_tolerance_family(machine, read_tolerances(within))
        self.machine, self.halves = machine, tolerances.halves
        self.names, self.nominal = tolerances.family.names, tolerances.family.nominal
        self._parameters = tolerances.family.parameters

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Low and high of each number, (k,) mm and rad."""
        return self.nominal - self.halves, self.nominal + self.halves

    @cached_property
    def follow_rates(self) -> Array:
        """How each number moves with each one that is off, (k, k): with itself, and with the named sizes."""
        rates = np.eye(len(self.names))
        for column, parameter in enumerate(self._parameters):
            if parameter.group == SIZES:
                followers = self.machine.list_follow_rates(parameter.name)
                rates[:, column] += [followers.get(name, 0.0) for name in self.names]
        return rates

    def list_values(self, inputs: Sequence[Scalar]) -> dict[str, Scalar]:
        """List what the numbers are by their names, where each is off to an input, and some follow others."""
        values = dict[str, Scalar]()
        for row, (name, x) in enumerate(zip(self.names, inputs, strict=True)):
            for column in np.flatnonzero(self.follow_rates[row]).tolist():
                if column != row:
                    x = x + (inputs[column] - float(self.nominal[column])) * float(self.follow_rates[row, column])
            values[name] = x
        return values

    def trace_equations(self, inputs: Sequence[Scalar]) -> Equations:
        """Trace the machine's equations with these numbers."""
        return self.machine.trace_equations(self.list_values(inputs))

    def trace_set(self, poses: PoseSet) -> TracedSet:
        """Trace the pose of a set's coordinates, with the sizes as further inputs."""
        machine, plain = self.machine, poses.trace(self.machine)
        return _SizedSet(machine, plain.free_axes, plain.swept_axes, {}, machine.mode, poses, self)

    def make_box(self, poses: PoseSet, length: CharacteristicLength) -> _SizedBox:
        """Make the box of a set's coordinates and the sizes, for bounds of matrices.

        length : by which angles are multiplied
        """
        plain = poses.make_box(self.machine, length)
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
        nominal = self.size_box.nominal.tolist()
        return SizedTrace(self._count, nominal).inputs(self._count + len(nominal))

    @cached_property
    def jump_free_inputs(self) -> list[Term]:
        nominal = self.size_box.nominal.tolist()
        return SizedJumpFreeTrace(self._count, nominal).inputs(self._count + len(nominal))

    def place(self, inputs: Sequence[Scalar]) -> list[Scalar]:
        return super().place(inputs[: self._count])

    def trace_equations(self, inputs: Sequence[Scalar]) -> Equations:
        return self.size_box.trace_equations(inputs[self._count :])

    def trace_twist_rows(self, inputs: Sequence[Scalar]) -> list[list[Scalar]]:
        sizes = self.size_box.list_values(inputs[self._count :])
        return _trace_rates(self.machine, self.place(inputs), sizes, self.mode).a


@dataclass(frozen=True, eq=False)
class _SizedBox(SetBox):
    size_box: SizeBox

    @property
    def searched(self) -> int:
        return len(self.ranges) - len(self.size_box.names)

    @cached_property
    def inputs(self) -> list[Term]:
        return SizedJumpFreeTrace(self.searched, self.size_box.nominal.tolist()).inputs(len(self.ranges))

    @property
    def sizes(self) -> Mapping[str, Scalar]:
        return self.size_box.list_values(self.inputs[self.searched :])

    @property
    def widths(self) -> Array:
        """The sizes' are infinite: poses alone are bisected."""
        return np.concatenate([(self.high - self.low)[: self.searched], np.full(len(self.size_box.names), np.inf)])

    @cached_property
    def samples(self) -> Array:
        plain = self.pose_set.make_box(self.machine, self.length).samples
        return np.hstack([plain, np.tile(self.size_box.nominal, (len(plain), 1))])

    @cached_property
    def pose(self) -> list[Scalar]:
        return self.pose_set.place(dict(zip(self.ranges, self.inputs[: self.searched], strict=False)))

    @cached_property
    def _rates(self) -> tuple[TwistRates, list[Scalar]]:
        rates = _trace_rates(self.machine, self.pose, self.sizes, self.mode)
        return scale_twist_rates(self.machine, rates, self.length), []


def _trace_rates(machine: Machine, pose: Sequence[Scalar], sizes: Mapping[str, Scalar], mode: str) -> TwistRates:
    with np.errstate(all="ignore"):
        joints, _, _ = machine.trace_equations(sizes).invert(pose, mode)
        a, b, _ = trace_shift_rates(machine, pose, joints, (), sizes)
    return TwistRates(a, b, [])
