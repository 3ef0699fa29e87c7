"""The Jacobians of the tool's twist as numbers, A t' = B q', scaled to one unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..algebra import Scalar
from ..arrays import Array
from ..machine import Machine
from ..model.rates import TwistRates
from .characteristic_length import CharacteristicLength


def list_twist_names(machine: Machine) -> tuple[str, ...]:
    """List the twist's components: the machine's translations, then its small turns.

    ``wx``, ``wy``, ``wz`` turn about the machine frame's axes; of a five-axis tool ``w1`` and ``w2`` move its axis k in
    the directions in which a growing B and a growing C do.
    """
    return (*(axis for axis in machine.axes if axis in "XYZ"), *machine.structure.turns)


@dataclass(frozen=True, eq=False)
class ScaledRates:
    """A (N, m, n) and B (N, m, m) of :func:`compute_scaled_rates`, and how many of their first rows are the legs'.

    constraints : (N, c, c) the constraints' unit wrenches against the parasitic motions; c is 0 without constraints
    """

    a: Array
    b: Array
    legs: int
    constraints: Array


def compute_scaled_rates(machine: Machine, rows: Array, length: CharacteristicLength, mode: str | None) -> ScaledRates:
    """Compute A and B in one unit: angles times the length, legs' rows divided by their rods' lengths.

    A leg's row of A is a unit wrench, of B the part of each drive's motion that reaches the platform's joint; the rows
    of turning heads and tables are 1/mm times the length. NaN out of reach.
    """
    a, b, wrench_norms = machine.twist_rates(rows, machine.inverse(rows, mode))
    columns_a, columns_b = list_column_scales(machine, length)
    legs = wrench_norms.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        serial_factors = np.full((len(a), a.shape[1] - legs), get_serial_factor(machine, length))
        factors = np.concatenate([1.0 / wrench_norms, serial_factors], 1)[:, :, None]
        constraints = machine.constraint_rates(rows) * list_constraint_scales(machine, length)
        constraints /= np.linalg.norm(constraints, axis=2, keepdims=True)
        return ScaledRates(a * columns_a * factors, b * columns_b * factors, legs, constraints)


def get_serial_factor(machine: Machine, length: CharacteristicLength) -> float:
    """Return the factor of head and table's rows that brings them to mm: slides' are that already."""
    return 1.0 if machine.structure.has_slides else length.factor


def list_constraint_scales(machine: Machine, length: CharacteristicLength) -> Array:
    """List the factors of the columns of the constraints' rates that leave them without unit."""
    turns = machine.structure.parasitic_turns
    return np.array([1.0] * (len(machine.constraints) - turns) + [1.0 / length.factor] * turns)


def trace_unit_wrenches(machine: Machine, rates: TwistRates, length: CharacteristicLength) -> list[list[Scalar]]:
    """Trace the rows of A in one unit that tell parallel singularities: where their determinant is zero.

    Each of a leg is a unit wrench. They are the legs' alone where head and table never matter, and their columns then
    the translations.
    """
    (height, width), others = machine.parallel_block, len(machine.joints) - machine.leg_count
    factors = [*(1.0 / norm for norm in rates.wrench_norms), *[get_serial_factor(machine, length)] * others]
    scales = list_column_scales(machine, length)[0].tolist()
    return [[rates.a[row][i] * factors[row] * scales[i] for i in range(width)] for row in range(height)]


def list_column_scales(machine: Machine, length: CharacteristicLength) -> tuple[Array, Array]:
    """List the factors of the columns of A and of B that bring the rates they multiply to mm."""
    small = 1.0 / length.factor
    turns = len(machine.structure.turns)
    a = np.array([1.0] * (len(machine.axes) - turns) + [small] * turns)
    return a, np.array([small if unit == "rad" else 1.0 for unit in machine.joint_units])


def scale_twist_rates(machine: Machine, rates: TwistRates, length: CharacteristicLength) -> TwistRates:
    """Scale the columns of A and B to mm: angles times the length."""
    a, b = (
        [[x * factor for x, factor in zip(row, scales.tolist(), strict=True)] for row in rows]
        for rows, scales in zip((rates.a, rates.b), list_column_scales(machine, length), strict=True)
    )
    return TwistRates(a, b, rates.wrench_norms)
