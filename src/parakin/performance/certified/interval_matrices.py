"""Interval matrices: A and B of a machine as terms over a box of poses, and linear bounds of matrices of terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...algebra import Scalar, Term, Trace, derivative
from ...arrays import Array, Flags, Indices
from ...kernels.intervals import IntervalProgram, JumpFreeTrace
from ...machine import Machine
from ...model.rates import TwistRates
from ..characteristic_length import CharacteristicLength
from ..jacobians import list_column_scales, list_constraint_scales
from ..singularities import has_serial_turns

Matrix = Sequence[Sequence[Scalar]]

_SAMPLES = {0: 1, 1: 65, 2: 17, 3: 9, 4: 5}  # along each input of a box; 3 of more than these


@dataclass(frozen=True, eq=False)
class PoseBox:
    """A box of poses of a machine: the axes in ``ranges`` vary, ``fixed_axes`` have one value; mm and rad."""

    machine: Machine
    ranges: Mapping[str, tuple[float, float]]
    fixed_axes: Mapping[str, float]
    mode: str
    length: CharacteristicLength

    @cached_property
    def low(self) -> Array:
        return np.array([ends[0] for ends in self.ranges.values()], float)

    @cached_property
    def high(self) -> Array:
        return np.array([ends[1] for ends in self.ranges.values()], float)

    @cached_property
    def samples(self) -> Array:
        """Points (N, d) of a lattice all over the box, its corners among them."""
        d = len(self.ranges)
        lines = [np.linspace(*ends, _SAMPLES.get(d, 3)) for ends in self.ranges.values()]
        return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, d) if d else np.zeros((1, 0))

    def poses(self, points: Array) -> Array:
        """Compute whole poses (N, axes) at points (N, d) of the box."""
        rows = np.empty((len(points), len(self.machine.axes)))
        for i, axis in enumerate(self.machine.axes):
            rows[:, i] = points[:, list(self.ranges).index(axis)] if axis in self.ranges else self.fixed_axes[axis]
        return rows

    @cached_property
    def inputs(self) -> list[Term]:
        return JumpFreeTrace().inputs(len(self.ranges))

    @cached_property
    def trace(self) -> Trace:
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
        columns_a, columns_b = list_column_scales(machine, self.length)
        a = [[x * float(k) for x, k in zip(row, columns_a, strict=True)] for row in rates.a]
        b = [[x * float(k) for x, k in zip(row, columns_b, strict=True)] for row in rates.b]
        reach = [*platform.constraint_reach, *platform.reach, *(reach.margin for leg in legs for reach in leg.reach)]
        return TwistRates(a, b, rates.wrench_norms), reach

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


@dataclass(frozen=True, eq=False)
class LinearMatrices:
    """Matrices over N boxes: ``middle`` + Σ (``slopes`` ± ``spread``)·δ ± ``own``, entry by entry, for |δ| ≤ ``half``.

    middle, own (N, n, m); slopes, spread (N, d, n, m); half (N, d). An entry without bounds is infinite or NaN.
    """

    middle: Array
    own: Array
    slopes: Array
    spread: Array
    half: Array

    def take(self, which: Flags) -> LinearMatrices:
        """Keep some of the boxes."""
        columns = (self.middle, self.own, self.slopes, self.spread, self.half)
        return LinearMatrices(*(column[which] for column in columns))

    @cached_property
    def bounded(self) -> Flags:
        """(N,) where everything is finite."""
        ends = np.isfinite(self.middle).all((1, 2)) & np.isfinite(self.own).all((1, 2))
        return np.asarray(ends & np.isfinite(self.slopes).all((1, 2, 3)) & np.isfinite(self.spread).all((1, 2, 3)))

    def multiply_left(self, left: Array) -> LinearMatrices:
        """Multiply by matrices (N, k, n) from the left."""
        size = np.abs(left)
        spread = size[:, None] @ self.spread
        return LinearMatrices(left @ self.middle, size @ self.own, left[:, None] @ self.slopes, spread, self.half)

    @cached_property
    def linear_change(self) -> Array:
        """By how much the linear part changes at most, (N, n, m)."""
        return np.asarray(np.einsum("nd,ndij->nij", self.half, np.abs(self.slopes)))

    @cached_property
    def rest(self) -> Array:
        """How far the matrices are from the linear part at most, (N, n, m)."""
        return np.asarray(self.own + np.einsum("nd,ndij->nij", self.half, self.spread))

    @property
    def widest(self) -> Indices:
        """The input that changes the matrix most, (N,)."""
        sizes = (np.sqrt(np.square(changes).sum((2, 3))) for changes in (self.slopes, self.spread))
        return np.asarray((self.half * sum(sizes)).argmax(1))


@dataclass(frozen=True, eq=False)
class MatrixBounds:
    """A matrix of terms, to be bounded over boxes of their inputs by the mean value theorem."""

    matrix: Matrix
    inputs: Sequence[Term]
    trace: Trace

    @cached_property
    def _programs(self) -> tuple[IntervalProgram, IntervalProgram]:
        entries = [x for row in self.matrix for x in row]
        slopes = [derivative(x, term) for term in self.inputs for x in entries]
        return IntervalProgram(self.trace, entries), IntervalProgram(self.trace, slopes)

    def __call__(self, low: Array, high: Array) -> LinearMatrices:
        """Bound it over boxes [low, high], (N, d)."""
        count, d = low.shape
        shape = len(self.matrix), len(self.matrix[0])
        at, over = self._programs
        middle = 0.5 * (low + high)
        half = np.maximum(middle - low, high - middle)
        entries = _compute_middles(*(end.reshape(count, *shape) for end in at(middle, middle)))
        slopes = _compute_middles(*(end.reshape(count, d, *shape) for end in over(low, high)))
        return LinearMatrices(*entries, *slopes, half)


def _compute_middles(down: Array, up: Array) -> tuple[Array, Array]:
    """Compute middles and radii of intervals, radii rounded up."""
    with np.errstate(invalid="ignore", over="ignore"):
        middle = 0.5 * down + 0.5 * up
        return middle, np.maximum(up - middle, middle - down) * (1.0 + 1e-15)
