"""What quantities of designs are computed by: a family's tapes, whose inputs are poses and sizes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from ..accuracy.tolerances import ToleranceFamily, make_tolerance_family, read_tolerances, trace_error
from ..algebra import Scalar
from ..arrays import Array
from ..errors import PoseError
from ..families.family import make_family
from ..machine import Machine
from ..performance.characteristic_length import choose_characteristic_length
from ..performance.jacobians import list_column_scales
from ..performance.quotients import compute_quotients
from ..stiffness.springs import MachineSprings, read_springs, trace_compliance

# Traces M and N at a pose, for sizes by their names, where the first rows of M⁻¹N tell a quantity of the tip.
TracedQuotient = Callable[[Sequence[Scalar], Mapping[str, Scalar]], tuple[list[list[Scalar]], list[list[Scalar]]]]


class DesignTapes:
    """A machine with free numbers, its springs, and the tolerances of its numbers.

    machine, free : whose numbers are free, and which
    fit_strokes : whether the ranges of the legs' drives do not count
    drives, struts, tolerances : as of :class:`DesignProblem`

    Its methods share these arguments:

    poses, pose : rows (..., axes), mm and rad, or scalars of one
    sizes : rows (..., k) of the free numbers, mm and rad, or scalars by their names

    family : of the free numbers
    length : by which angles are multiplied
    scales : (n,) and (m,) what the columns of A and of B are multiplied by, so that all rates are mm
    size : the greatest leg's length, mm
    limits, limit_scales : names of the limits that count, and what their margins are multiplied by
    counted : numbers of the machine's limits that count, without those of drives whose ranges are fitted
    """

    def __init__(
        self,
        machine: Machine,
        free: Sequence[str],
        fit_strokes: bool,
        drives: Mapping[str, str] | str | None,
        struts: Mapping[str, str] | str | None,
        tolerances: Mapping[str, str] | None,
    ):
        self.machine, self.family = machine, make_family(machine, free)
        self._drives, self._struts, self._tolerances = drives, struts, tolerances
        self.length = choose_characteristic_length(machine)
        self.scales = list_column_scales(machine, self.length)
        names = [drive.name for drive in machine.drives[: machine.leg_count]]
        fitted = {f"{name}.{end}" for name in names for end in ("min", "max")} if fit_strokes else set()
        self.counted = [i for i, name in enumerate(machine.limits) if name not in fitted]
        self.limits = [machine.limits[i] for i in self.counted]
        units = [machine.limit_definitions[i].unit for i in self.counted]
        self.size = max(machine.leg_sizes)
        powers = {"mm": 1.0, "mm²": 2.0}
        self.limit_scales = np.array([self.size ** -powers.get(unit, 0.0) for unit in units])

    @cached_property
    def tip(self) -> int:
        """How many translations the tip has: the first rows of a twist."""
        return sum(axis in "XYZ" for axis in self.machine.axes)

    @cached_property
    def springs(self) -> MachineSprings:
        """The springs of drives and struts, as they are given or as the machine's file says.

        Raises :class:`PoseError` where neither tells a drive's.
        """
        return read_springs(self.machine, self._drives, self._struts)

    @cached_property
    def tolerances(self) -> ToleranceFamily:
        """The tolerances of the machine's numbers.

        Raises :class:`PoseError` where there are none, or one of no number.
        """
        if self._tolerances is None:
            raise PoseError("tolerances: missing, accuracy needs them")
        return make_tolerance_family(self.machine, read_tolerances(self._tolerances))

    def trace_compliance(
        self, pose: Sequence[Scalar], sizes: Mapping[str, Scalar]
    ) -> tuple[list[list[Scalar]], list[list[Scalar]]]:
        """Trace A and W of the quotient A⁻¹W that the tip's compliance follows from."""
        return trace_compliance(self.machine, pose, self.springs, sizes)

    def trace_error(
        self, pose: Sequence[Scalar], sizes: Mapping[str, Scalar]
    ) -> tuple[list[list[Scalar]], list[list[Scalar]]]:
        """Trace A and W of the quotient A⁻¹W that the tip's deviation follows from."""
        return trace_error(self.machine, pose, self.tolerances, sizes)

    def evaluate_quotient(self, name: str, trace: TracedQuotient, poses: Array, sizes: Array, rows: int) -> Array:
        """Evaluate the tip's rows of a quotient A⁻¹W, (..., tip, k); infinite where it is singular, NaN out of reach.

        name : by which the tape is kept
        trace : traces A and W, as :meth:`trace_compliance`
        rows : of A, which is tall with more drives than freedoms
        """
        n = len(self.machine.axes)

        def list_outputs(pose: Sequence[Scalar], own: Mapping[str, Scalar]) -> list[Scalar]:
            a, w = trace(pose, own)
            return [x for row in (*a, *w) for x in row]

        values = self.family.evaluate(name, list_outputs, poses, sizes)
        lead = values.shape[:-1]
        a, w = np.split(values.reshape(-1, values.shape[-1]), [rows * n], axis=1)
        ways = compute_quotients(a.reshape(-1, rows, n), w.reshape(len(w), rows, -1))[:, : self.tip]
        return ways.reshape(*lead, *ways.shape[1:])

    def measure_distances(self, poses: Array, sizes: Array) -> Array:
        """Measure the distances of the axes of struts that share no joint, (..., pairs) mm."""
        mode = self.machine.mode
        return self.family.evaluate(
            "distances",
            lambda pose, own: self.machine.trace_equations(own).list_strut_distances(pose, mode),
            poses,
            sizes,
        )
