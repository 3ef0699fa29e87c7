"""A machine's rates over whole boxes of poses: A, B and J⁻¹ as terms, and what is proved of matrices of such terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ... import algebra as alg
from ...algebra import Scalar, Term, Trace, derivative, norm
from ...arrays import Array
from ...kernels.intervals import IntervalProgram
from ...machine import Machine
from ...model.rates import TwistRates, compute_twist_rates
from ..characteristic_length import Length
from ..jacobians import column_scales, drives_of_legs

Matrix = Sequence[Sequence[Scalar]]

_SAMPLES = {0: 1, 1: 65, 2: 17, 3: 9, 4: 5}  # along each input of a box; 3 of more than these


class Turns(Trace):
    """A trace in which the sine and cosine of an arc tangent are quotients: their bounds know no jump at ±180°."""

    def node(self, op: int, args: tuple[Term, ...], k: tuple[float, ...]) -> Term:
        if op in (alg.SIN, alg.COS):
            turned = self._turned(args[0])
            if turned is not None:
                sine, cosine = turned
                result: Term = sine if op == alg.SIN else cosine
                return result
        return super().node(op, args, k)

    @staticmethod
    def _turned(angle: Term) -> tuple[Scalar, Scalar] | None:
        offset, sign, inner = 0.0, 1.0, angle
        if angle.op == alg.LIN and len(angle.args) == 1 and abs(angle.k[1]) == 1.0:
            (offset, sign), inner = angle.k, angle.args[0]
        if inner.op != alg.ATAN2:
            return None
        y, x = inner.args
        size = norm((x, y))
        s, c = sign * y / size, x / size
        if offset == 0.0:
            return s, c
        so, co = np.sin(offset), np.cos(offset)
        return co * s + so * c, co * c - so * s


@dataclass(frozen=True, eq=False)
class Box:
    """Poses of a machine that fill a box: the axes in ``spans`` vary, the others are ``held``; mm and rad."""

    machine: Machine
    spans: Mapping[str, tuple[float, float]]
    held: Mapping[str, float]
    mode: str
    length: Length

    @cached_property
    def low(self) -> Array:
        return np.array([span[0] for span in self.spans.values()], float)

    @cached_property
    def high(self) -> Array:
        return np.array([span[1] for span in self.spans.values()], float)

    @cached_property
    def samples(self) -> Array:
        """Points (N, d) of a lattice all over the box, its corners among them."""
        d = len(self.spans)
        lines = [np.linspace(*span, _SAMPLES.get(d, 3)) for span in self.spans.values()]
        return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, d) if d else np.zeros((1, 0))

    def poses(self, points: Array) -> Array:
        """Whole poses (N, axes) at points (N, d) of the box."""
        rows = np.empty((len(points), len(self.machine.axes)))
        for i, axis in enumerate(self.machine.axes):
            rows[:, i] = points[:, list(self.spans).index(axis)] if axis in self.spans else self.held[axis]
        return rows

    @cached_property
    def inputs(self) -> list[Term]:
        return Turns().inputs(len(self.spans))

    @cached_property
    def trace(self) -> Trace:
        return self.inputs[0].trace if self.inputs else Turns()

    @cached_property
    def _pose(self) -> list[Scalar]:
        free = dict(zip(self.spans, self.inputs, strict=True))
        return [free[axis] if axis in free else np.float64(self.held[axis]) for axis in self.machine.axes]

    @cached_property
    def _rates(self) -> tuple[TwistRates, list[Scalar]]:
        model = self.machine.model
        with np.errstate(all="ignore"):
            joints, placed, legs = model.invert(self._pose, self.mode)
            found = compute_twist_rates(model.spec, model.structure, self._pose, joints)
        columns_a, columns_b = column_scales(self.machine, self.length)
        a = [[x * float(k) for x, k in zip(row, columns_a, strict=True)] for row in found.a]
        b = [[x * float(k) for x, k in zip(row, columns_b, strict=True)] for row in found.b]
        reach = [*placed.reach, *(reach.margin for leg in legs for reach in leg.reach)]
        return TwistRates(a, b, found.spans), reach

    @property
    def reach(self) -> list[Scalar]:
        """What is ≥ 0 where the legs close and the tool can be pointed."""
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
        """What is regular but at parallel singularities: A, of five axes the legs' rows against the translations."""
        a, legs = self._rates[0].a, len(self._rates[0].spans)
        size = legs if len(a) - legs == 2 else len(a)
        return [row[:size] for row in a[:size]]

    @cached_property
    def serial(self) -> Matrix:
        """What is regular but at serial singularities: the determinants of B's blocks along a diagonal."""
        found = self._rates[0]
        blocks = [found.b[row][joint] for row, joint in enumerate(drives_of_legs(self.machine))]
        turns = [row[len(blocks) :] for row in found.b[len(blocks) :]]
        if len(turns) == 1:
            blocks.append(turns[0][0])
        elif turns:
            blocks.append(turns[0][0] * turns[1][1] - turns[0][1] * turns[1][0])
        return [[blocks[i] if i == j else 0.0 for j in range(len(blocks))] for i in range(len(blocks))]


@dataclass(frozen=True, eq=False)
class Linear:
    """Matrices over boxes: ``middle`` + Σ (``slopes`` ± ``spread``)·δ ± ``own``, entry by entry, for |δ| ≤ ``half``.

    middle, own (N, n, m); slopes, spread (N, d, n, m); half (N, d). What is not bounded is infinite or NaN.
    """

    middle: Array
    own: Array
    slopes: Array
    spread: Array
    half: Array

    def take(self, which: NDArray[np.bool_]) -> Linear:
        return Linear(*(column[which] for column in (self.middle, self.own, self.slopes, self.spread, self.half)))

    @cached_property
    def bounded(self) -> NDArray[np.bool_]:
        """(N,) where everything is finite."""
        ends = np.isfinite(self.middle).all((1, 2)) & np.isfinite(self.own).all((1, 2))
        return np.asarray(ends & np.isfinite(self.slopes).all((1, 2, 3)) & np.isfinite(self.spread).all((1, 2, 3)))

    def times(self, left: Array) -> Linear:
        """``left`` (N, n, n) times these."""
        size = np.abs(left)
        spread = size[:, None] @ self.spread
        return Linear(left @ self.middle, size @ self.own, left[:, None] @ self.slopes, spread, self.half)

    @cached_property
    def turned(self) -> Array:
        """By how much the linear part changes at most, (N, n, m)."""
        return np.asarray(np.einsum("nd,ndij->nij", self.half, np.abs(self.slopes)))

    @cached_property
    def rest(self) -> Array:
        """How far the matrices are from the linear part at most, (N, n, m)."""
        return np.asarray(self.own + np.einsum("nd,ndij->nij", self.half, self.spread))

    @property
    def widest(self) -> NDArray[np.int64]:
        """(N,) the input whose range changes most."""
        sizes = (np.sqrt(np.square(part).sum((2, 3))) for part in (self.slopes, self.spread))
        return np.asarray((self.half * sum(sizes)).argmax(1))


@dataclass(frozen=True, eq=False)
class Over:
    """Matrices of terms, to be bounded over boxes of their inputs by the mean value theorem."""

    matrix: Matrix
    inputs: Sequence[Term]
    trace: Trace

    @cached_property
    def _programs(self) -> tuple[IntervalProgram, IntervalProgram]:
        entries = [x for row in self.matrix for x in row]
        slopes = [derivative(x, term) for term in self.inputs for x in entries]
        return IntervalProgram(self.trace, entries), IntervalProgram(self.trace, slopes)

    def __call__(self, low: Array, high: Array) -> Linear:
        count, d = low.shape
        shape = len(self.matrix), len(self.matrix[0])
        at, over = self._programs
        middle = 0.5 * (low + high)
        half = np.maximum(middle - low, high - middle)
        entries = _centred(*(end.reshape(count, *shape) for end in at(middle, middle)))
        slopes = _centred(*(end.reshape(count, d, *shape) for end in over(low, high)))
        return Linear(*entries, *slopes, half)


def _centred(down: Array, up: Array) -> tuple[Array, Array]:
    """Middles and radii, rounded up."""
    with np.errstate(invalid="ignore", over="ignore"):
        middle = 0.5 * down + 0.5 * up
        return middle, np.maximum(up - middle, middle - down) * (1.0 + 1e-15)
