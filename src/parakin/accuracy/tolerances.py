"""Tolerances of a machine's numbers, by names, patterns and groups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..algebra import Scalar, dot
from ..arrays import Array, Indices
from ..errors import PoseError, quote
from ..families.family import Family, list_scales, select_parameters
from ..families.shift_rates import trace_shift_rates
from ..kernels.intervals import JumpFreeTrace
from ..machine import Machine
from ..model.nominal_values import SizedTrace
from ..units import ANGLE, LENGTH, Quantity, QuantityError, evaluate_expression

UNIFORM = float(1.0 / np.sqrt(3.0))  # standard deviation of what lies evenly within ±1
_UNITS = {LENGTH.dimension: "mm", ANGLE.dimension: "rad"}


class SizedJumpFreeTrace(SizedTrace, JumpFreeTrace):
    """A trace of sizes whose angles do not jump over intervals."""


class Tolerance(NamedTuple):
    """What the numbers of a name, a pattern or a group may be off, either way.

    name : as it was given
    value : mm or rad
    unit : of the numbers that it is for: those of a group that have it
    """

    name: str
    value: float
    unit: str


class ToleranceFamily(NamedTuple):
    """The numbers that have tolerances.

    family : in which these k numbers are free
    tolerances : as they were given
    halves : (k,) how far each may be off either way, mm and rad
    groups : for each tolerance, the columns of its numbers
    """

    family: Family
    tolerances: tuple[Tolerance, ...]
    halves: Array
    groups: tuple[Indices, ...]


def read_tolerances(tolerances: Mapping[str, str] | Sequence[tuple[str, str]]) -> tuple[Tolerance, ...]:
    """Read tolerances with their units: a dict by names, or pairs; ``{"feet": "0.05 mm", "encoders": "2 um"}``.

    Raises :class:`PoseError`.
    """
    result = []
    for name, text in tolerances.items() if isinstance(tolerances, Mapping) else tolerances:
        try:
            quantity = evaluate_expression(text) if isinstance(text, str) else Quantity(float(text))
        except (QuantityError, TypeError, ValueError) as error:
            raise PoseError(f"tolerance {name}: {error}") from None
        if quantity.dimension not in _UNITS:
            raise PoseError(f"tolerance {name}: {quote(text)} needs a unit: {LENGTH.units}, {ANGLE.units}")
        if not 0.0 < quantity.value < np.inf:
            raise PoseError(f"tolerance {name}: {quote(text)}, expected more than 0")
        result.append(Tolerance(name, quantity.value, _UNITS[quantity.dimension]))
    if not result:
        raise PoseError("tolerances: at least one expected, such as feet of 0.05 mm")
    return tuple(result)


def make_tolerance_family(machine: Machine, tolerances: Sequence[Tolerance]) -> ToleranceFamily:
    """Make the family of the numbers that have tolerances.

    Raises :class:`PoseError` for a tolerance of no number, and for a number with two.
    """
    owner: dict[str, int] = {}
    for index, tolerance in enumerate(tolerances):
        chosen = select_parameters(machine, [tolerance.name], f"tolerance {tolerance.name}")
        of_unit = [p for p in chosen if p.unit == tolerance.unit]
        if not of_unit:
            wanted = "an angle" if chosen[0].unit == "rad" else "a length"
            raise PoseError(f"tolerance {tolerance.name}: {chosen[0].name} is {wanted}")
        for parameter in of_unit:
            if parameter.name in owner:
                other = tolerances[owner[parameter.name]].name
                raise PoseError(f"tolerance {tolerance.name}: {parameter.name} has one already, of {other}")
            owner[parameter.name] = index
    family = Family(machine, [p for p in machine.parameters if p.name in owner], added=True)
    indices = np.array([owner[name] for name in family.names])
    halves = np.array([tolerances[i].value for i in indices])
    groups = tuple(np.flatnonzero(indices == i) for i in range(len(tolerances)))
    return ToleranceFamily(family, tuple(tolerances), halves, groups)


def trace_error(
    machine: Machine, pose: Sequence[Scalar], within: ToleranceFamily, sizes: Mapping[str, Scalar]
) -> tuple[list[list[Scalar]], list[list[Scalar]]]:
    """Trace A of the tool's twist, and W: the deviation of the tip is the norm (Frobenius') of its rows of A⁻¹W.

    Of numbers that lie evenly within their tolerances, to the first order. With more drives than freedoms they are
    those of the forward's least squares: AᵀVA and AᵀVW, with V of the closures' scales.

    sizes : other values of the machine's parameters, by name
    """
    joints, _, _ = machine.trace_equations(sizes).invert(pose, machine.mode)
    a, _, c = trace_shift_rates(machine, pose, joints, within.family.names, sizes)
    w = [[x * (UNIFORM * half) for x, half in zip(row, within.halves.tolist(), strict=True)] for row in c]
    if not machine.is_redundant:
        return a, w
    scaled, off = ([[x / s for x in row] for row, s in zip(m, list_scales(machine), strict=True)] for m in (a, w))
    columns = list(zip(*scaled, strict=True))
    normal = [[dot(column, other) for other in columns] for column in columns]
    return normal, [[dot(column, other) for other in zip(*off, strict=True)] for column in columns]
