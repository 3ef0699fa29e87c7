"""Boxes of poses: A and B of a machine as terms over them, to be bounded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...algebra import Scalar, Term, Trace
from ...arrays import Array, make_lattice
from ...kernels.intervals import JumpFreeTrace
from ...machine import Machine
from ...model.rates import TwistRates
from ...workspaces.certified.matrix_bounds import Matrix
from ..characteristic_length import CharacteristicLength
from ..jacobians import list_constraint_scales, scale_twist_rates
from ..singularities import has_serial_turns

_SAMPLES = {0: 1, 1: 65, 2: 17, 3: 9, 4: 5}  # along each input of a box; 3 of more than these


@dataclass(frozen=True, eq=False)
class PoseBox:
    """A box of poses of a machine.

    machine, mode : whose poses these are, and in which working mode
    ranges : low and high of the d axes that vary, mm and rad
    fixed_axes : the others' values, mm and rad
    length : by which angles are multiplied
    """

    machine: Machine
    ranges: Mapping[str, tuple[float, float]]
    fixed_axes: Mapping[str, float]
    mode: str
    length: CharacteristicLength

    @cached_property
    def low(self) -> Array:
        """The lower ends of the ranges, (d,) mm and rad."""
        return np.array([ends[0] for ends in self.ranges.values()], float)

    @cached_property
    def high(self) -> Array:
        """The upper ends of the ranges, (d,) mm and rad."""
        return np.array([ends[1] for ends in self.ranges.values()], float)

    @property
    def searched(self) -> int:
        """How many inputs, the first ones, differ among the samples and are worth a search."""
        return len(self.ranges)

    @property
    def widths(self) -> Array:
        """What the widths of parts are compared with, where one is bisected, (d,)."""
        return self.high - self.low

    @cached_property
    def samples(self) -> Array:
        """Points (N, d) of a lattice all over the box, its corners among them."""
        d = len(self.ranges)
        lines = [np.linspace(*ends, _SAMPLES.get(d, 3)) for ends in self.ranges.values()]
        return make_lattice(lines) if d else np.zeros((1, 0))

    def poses(self, points: Array) -> Array:
        """Compute whole poses (N, axes) at ``points`` (N, d) of the box."""
        rows = np.empty((len(points), len(self.machine.axes)))
        for i, axis in enumerate(self.machine.axes):
            rows[:, i] = points[:, list(self.ranges).index(axis)] if axis in self.ranges else self.fixed_axes[axis]
        return rows

    @cached_property
    def inputs(self) -> list[Term]:
        """A term for each axis that varies."""
        return JumpFreeTrace().inputs(len(self.ranges))

    @cached_property
    def trace(self) -> Trace:
        """The trace of the inputs."""
        return self.inputs[0].trace if self.inputs else JumpFreeTrace()

    @cached_property
    def pose(self) -> list[Scalar]:
        """The whole pose as terms of the inputs."""
        varied = dict(zip(self.ranges, self.inputs, strict=True))
        return [varied[axis] if axis in varied else np.float64(self.fixed_axes[axis]) for axis in self.machine.axes]

    @cached_property
    def _rates(self) -> tuple[TwistRates, list[Scalar]]:
        machine = self.machine
        with np.errstate(all="ignore"):
            joints, platform, legs = machine.trace_inverse(self.pose, self.mode)
            rates = machine.trace_rates(self.pose, joints)
        reach = [*platform.constraint_reach, *platform.reach, *(reach.margin for leg in legs for reach in leg.reach)]
        return scale_twist_rates(machine, rates, self.length), reach

    @property
    def reach(self) -> list[Scalar]:
        """Margins that are ≥ 0 where the legs close and the tool can be pointed."""
        return self._rates[1]

    @property
    def a(self) -> Matrix:
        """A, angles times the characteristic length."""
        return self._rates[0].a

    @property
    def b(self) -> Matrix:
        """B, angles times the characteristic length."""
        return self._rates[0].b

    @cached_property
    def parallel(self) -> Matrix:
        """The matrix that is singular at parallel singularities: A, of five axes the legs' rows by the translations."""
        a, (rows, columns) = self._rates[0].a, self.machine.parallel_block
        return [row[:columns] for row in a[:rows]]

    @cached_property
    def serial(self) -> Matrix:
        """The matrix that is singular at serial singularities: the determinants of B's blocks on a diagonal."""
        b = self._rates[0].b
        blocks = [b[row][joint] for row, joint in enumerate(self.machine.closure_joints)]
        if not has_serial_turns(self.machine):
            return _put_on_diagonal(blocks)
        turns = [row[len(blocks) :] for row in b[len(blocks) :]]
        if len(turns) == 1:
            blocks.append(turns[0][0])
        elif turns:
            blocks.append(turns[0][0] * turns[1][1] - turns[0][1] * turns[1][0])
        return _put_on_diagonal(blocks)

    @cached_property
    def constraint(self) -> Matrix:
        """The matrix that is singular at constraint singularities: the constraints' rates, angles times the length."""
        scales = list_constraint_scales(self.machine, self.length)
        with np.errstate(all="ignore"):
            rates = self.machine.trace_constraint_rates(self.pose)
        return [[rate * float(k) for rate, k in zip(row, scales, strict=True)] for row in rates]


def _put_on_diagonal(blocks: Sequence[Scalar]) -> Matrix:
    return [[block if i == j else 0.0 for j in range(len(blocks))] for i, block in enumerate(blocks)]
