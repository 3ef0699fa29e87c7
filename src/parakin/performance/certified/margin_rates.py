"""How the limits' margins, the turning joints and the closed chain change over boxes of poses, all axes at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar, Term, Trace, derivative
from ...arrays import Array
from ...kernels.intervals import IntervalProgram
from ...machine import Machine
from ..characteristic_length import characteristic_length
from .bisection import Decided, regular
from .interval_matrices import Box, Linear, Over, Turns

_MOST = 1e300  # stands for no bound, so that times nought it is nought


@dataclass(frozen=True, eq=False)
class Variation:
    """A machine in one working mode, bounded over boxes [low, high] of poses, (N, axes) mm and rad.

    Margins are in the order of :attr:`Machine.limits`; ``turning`` are the joints that are angles. Bounds hold wherever
    in the box the legs close.

    Of an angle that jumps at ±180° sine and cosine are taken as quotients, which do not jump; but where the angle is
    free these have no bounds, so there they are taken as what they are.
    """

    machine: Machine
    mode: str

    @cached_property
    def turning(self) -> list[int]:
        return [i for i, unit in enumerate(self.machine.joint_units) if unit == "rad"]

    def _margins(self, pose: list[Term]) -> list[Scalar]:
        return [margin for _, margin in self.machine.model.own_margins(pose, self.mode)]

    def _rates_in(self, trace: Trace) -> IntervalProgram:
        pose = trace.inputs(len(self.machine.axes))
        joints = self.machine.model.invert(pose, self.mode)[0]
        values = [*self._margins(pose), *(joints[i] for i in self.turning)]
        return IntervalProgram(trace, [derivative(value, axis) for value in values for axis in pose])

    @cached_property
    def _rates(self) -> IntervalProgram:
        return self._rates_in(Turns())

    @cached_property
    def _rates_where_free(self) -> IntervalProgram:
        return self._rates_in(Trace())

    @cached_property
    def _values(self) -> IntervalProgram:
        pose = Trace().inputs(len(self.machine.axes))
        freedom = self.machine.model.invert(pose, self.mode)[1].freedom
        return IntervalProgram(pose[0].trace, [*self._margins(pose), 1.0 if freedom is None else freedom])

    def rates(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of the derivatives of every margin, then of every turning joint, by every axis: (N, values, axes).

        Those of an angle know no jump at ±180°. What has no bound is ±1e300.
        """
        down, up = self._rates(low, high)
        if self.machine.wrist is not None:
            rows = np.flatnonzero(~(np.isfinite(down) & np.isfinite(up)).all(1))
            lower, upper = self._rates_where_free(low[rows], high[rows])
            down[rows], up[rows] = np.maximum(down[rows], lower), np.minimum(up[rows], upper)
        shape = (len(low), -1, len(self.machine.axes))
        return np.clip(down, -_MOST, _MOST).reshape(shape), np.clip(up, -_MOST, _MOST).reshape(shape)

    def least(self, low: Array, high: Array) -> tuple[Array, Array]:
        """What every margin (N, margins) is at least, with angles within ±180°, and what sin² of the tool's axis
        against the first axis of head and table is at most, (N,); 1 where there is none."""
        down, up = self._values(low, high)
        return down[:, :-1], up[:, -1]

    def regular(self, low: Array, high: Array) -> NDArray[np.bool_]:
        """(N,) where it is proved that no parallel singularity is in the box."""
        decided: NDArray[np.bool_] = self._regular(low, high)[0]
        if self.machine.wrist is not None:
            rows = np.flatnonzero(~decided)
            decided[rows] = self._regular_where_free(low[rows], high[rows])[0]
        return decided

    @cached_property
    def _regular(self) -> Callable[[Array, Array], Decided]:
        box = Box(self.machine, self._spans, {}, self.mode, characteristic_length(self.machine))
        return regular(Over(box.parallel, box.inputs, box.trace), np.ones(len(self._spans)))

    @cached_property
    def _regular_where_free(self) -> Callable[[Array, Array], Decided]:
        box = _PlainBox(self.machine, self._spans, {}, self.mode, characteristic_length(self.machine))
        return regular(_ByValue(box.parallel, box.inputs, box.trace), np.ones(0))

    @property
    def _spans(self) -> dict[str, tuple[float, float]]:
        return dict.fromkeys(self.machine.axes, (0.0, 0.0))


class _PlainBox(Box):
    """A box whose terms take sine and cosine of an angle as what they are."""

    @cached_property
    def inputs(self) -> list[Term]:
        return Trace().inputs(len(self.spans))


class _ByValue(Over):
    """Matrices bounded by their entries alone, where these have no bounded derivatives."""

    @cached_property
    def _entries(self) -> IntervalProgram:
        return IntervalProgram(self.trace, [entry for row in self.matrix for entry in row])

    def __call__(self, low: Array, high: Array) -> Linear:
        count, shape = len(low), (len(self.matrix), len(self.matrix[0]))
        down, up = (end.reshape(count, *shape) for end in self._entries(low, high))
        with np.errstate(invalid="ignore", over="ignore"):
            middle = 0.5 * down + 0.5 * up
            own = np.maximum(up - middle, middle - down) * (1.0 + 1e-15)
        none = np.zeros((count, 0, *shape))
        return Linear(middle, own, none, none, np.zeros((count, 0)))
