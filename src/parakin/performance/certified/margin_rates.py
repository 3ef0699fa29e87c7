"""Rates of margins: how limits' margins, turning joints and the closed chain change over boxes of poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...algebra import Scalar, Term, Trace, derivative
from ...arrays import Array, Flags
from ...kernels.intervals import IntervalProgram, JumpFreeTrace
from ...machine import Machine
from ...workspaces.certified.matrix_bounds import LinearMatrices, MatrixBounds
from ..characteristic_length import choose_characteristic_length
from .bisection import Decided, decide_regular
from .interval_matrices import PoseBox

_MOST = 1e300  # stands for no bound, so that times zero it is zero


@dataclass(frozen=True, eq=False)
class MarginRates:
    """A machine in one working mode, bounded over boxes [low, high] of poses, (N, axes) mm and rad.

    Margins are in the order of :attr:`Machine.limits`; behind them are the joints that are angles. Bounds hold wherever
    in the box the legs close.

    Sine and cosine of an angle that jumps at ±180° are taken as quotients, which do not jump. Where the angle is free
    the quotients have no bounds, and there the functions themselves are taken.
    """

    machine: Machine
    mode: str

    def _compile_rates(self, trace: Trace) -> IntervalProgram:
        pose = trace.inputs(len(self.machine.axes))
        joints = self.machine.trace_inverse(pose, self.mode)[0]
        margins = self.machine.trace_margins(pose, self.mode)
        values: list[Scalar] = [*margins, *(joints[i] for i in self.machine.turning_joints)]
        return IntervalProgram(trace, [derivative(value, axis) for value in values for axis in pose])

    @cached_property
    def _rates(self) -> IntervalProgram:
        return self._compile_rates(JumpFreeTrace())

    @cached_property
    def _rates_where_free(self) -> IntervalProgram:
        return self._compile_rates(Trace())

    @cached_property
    def _values(self) -> IntervalProgram:
        pose = Trace().inputs(len(self.machine.axes))
        freedom = self.machine.trace_inverse(pose, self.mode)[1].freedom
        margins = self.machine.trace_margins(pose, self.mode)
        return IntervalProgram(pose[0].trace, [*margins, 1.0 if freedom is None else freedom])

    def bound_rates(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bound the derivatives of every margin, then of every turning joint, by every axis: (N, values, axes).

        Those of an angle have no jump at ±180°. A derivative without bounds gives ±1e300.
        """
        down, up = self._rates(low, high)
        if self.machine.wrist is not None:
            rows = np.flatnonzero(~(np.isfinite(down) & np.isfinite(up)).all(1))
            lower, upper = self._rates_where_free(low[rows], high[rows])
            down[rows], up[rows] = np.maximum(down[rows], lower), np.minimum(up[rows], upper)
        shape = (len(low), -1, len(self.machine.axes))
        return np.clip(down, -_MOST, _MOST).reshape(shape), np.clip(up, -_MOST, _MOST).reshape(shape)

    def bound_margins(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bound every margin from below, (N, margins), and the wrist's freedom from above, (N,).

        Angles are within ±180°. The freedom is sin² of the tool's axis against the first axis of head and table; 1 for
        a machine without.
        """
        down, up = self._values(low, high)
        return down[:, :-1], up[:, -1]

    def enclose_margins(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bound every margin from below and above, (N, margins) each; NaN where nothing is known."""
        down, up = self._values(low, high)
        return down[:, :-1], up[:, :-1]

    def prove_regular(self, low: Array, high: Array) -> Flags:
        """Prove that no parallel singularity is in the box, (N,)."""
        decided: Flags = self._decide_regular(low, high)[0]
        if self.machine.wrist is not None:
            rows = np.flatnonzero(~decided)
            decided[rows] = self._decide_regular_where_free(low[rows], high[rows])[0]
        return decided

    @cached_property
    def _decide_regular(self) -> Callable[[Array, Array], Decided]:
        box = PoseBox(self.machine, self._spans, {}, self.mode, choose_characteristic_length(self.machine))
        return decide_regular(MatrixBounds(box.parallel, box.inputs, box.trace), np.ones(len(self._spans)))

    @cached_property
    def _decide_regular_where_free(self) -> Callable[[Array, Array], Decided]:
        box = _PlainPoseBox(self.machine, self._spans, {}, self.mode, choose_characteristic_length(self.machine))
        return decide_regular(_EntryBounds(box.parallel, box.inputs, box.trace), np.ones(0))

    @property
    def _spans(self) -> dict[str, tuple[float, float]]:
        return dict.fromkeys(self.machine.axes, (0.0, 0.0))


class _PlainPoseBox(PoseBox):
    """A box whose terms keep sine and cosine of an angle as they are."""

    @cached_property
    def inputs(self) -> list[Term]:
        return Trace().inputs(len(self.ranges))


class _EntryBounds(MatrixBounds):
    """A matrix bounded by its entries alone, where these have no bounded derivatives."""

    @cached_property
    def _entries(self) -> IntervalProgram:
        return IntervalProgram(self.trace, [entry for row in self.matrix for entry in row])

    def __call__(self, low: Array, high: Array) -> LinearMatrices:
        """Bound it over boxes [low, high], (N, d)."""
        count, shape = len(low), (len(self.matrix), len(self.matrix[0]))
        down, up = (end.reshape(count, *shape) for end in self._entries(low, high))
        with np.errstate(invalid="ignore", over="ignore"):
            middle = 0.5 * down + 0.5 * up
            own = np.maximum(up - middle, middle - down) * (1.0 + 1e-15)
        none = np.zeros((count, 0, *shape))
        return LinearMatrices(middle, own, none, none, np.zeros((count, 0)))
