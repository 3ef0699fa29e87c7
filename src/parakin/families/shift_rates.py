"""How a machine's closures change with small shifts of its numbers: springs that give, tolerances that are used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..algebra import Scalar, derivative, evaluate_trace
from ..machine import Machine
from ..model.nominal_values import SizedTrace


class ShiftRates(NamedTuple):
    """A t' + C s' = B q' for the rates of the tool's twist, of shifts and of joints, at no shift; rows of scalars.

    a : (n, n); b : (n, m); c : (n, k)
    """

    a: list[list[Scalar]]
    b: list[list[Scalar]]
    c: list[list[Scalar]]


def trace_shift_rates(
    machine: Machine,
    pose: Sequence[Scalar],
    joints: Sequence[Scalar],
    shifted: Sequence[str],
    sizes: Mapping[str, Scalar],
) -> ShiftRates:
    """Trace the closures' rates at a pose and its joints, scalars of any kind.

    shifted : names of :attr:`Machine.parameters`, each with a shift of its own
    sizes : other values of parameters, by name
    """
    n, m, turns = len(pose), len(joints), len(machine.structure.turns)
    values = {parameter.name: parameter.value for parameter in machine.parameters}
    trace = SizedTrace(n + turns + m, [0.0] * len(shifted) + [values[name] for name in sizes])
    x, turn, q = trace.inputs(n), trace.inputs(turns, n), trace.inputs(m, n + turns)
    shifts, own = trace.sizes[: len(shifted)], trace.sizes[len(shifted) :]
    equations = machine.trace_equations(dict(zip(sizes, own, strict=True)), dict(zip(shifted, shifts, strict=True)))
    serial = equations.list_serial(q)
    rotation, origin, tilts = equations.structure.closure(x, serial, turn)
    closures = [*equations.closures(rotation, origin, q), *tilts]
    twist = [*(term for term, axis in zip(x, machine.axes, strict=True) if axis in "XYZ"), *turn]
    at_rest = [*pose, *[0.0] * turns, *joints, *[0.0] * len(shifted), *sizes.values()]

    def differentiate(terms: Sequence[Scalar], sign: float) -> list[list[Scalar]]:
        slopes = evaluate_trace(trace, [derivative(f, y) * sign for f in closures for y in terms], at_rest)
        return [slopes[len(terms) * i : len(terms) * (i + 1)] for i in range(len(closures))]

    return ShiftRates(differentiate(twist, 1.0), differentiate(q, -1.0), differentiate(shifts, 1.0))
