"""Rates of the tool's twist against the joints', as numbers: A t' = B q', plain and scaled to one unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..kernels.batch import evaluate_tape
from ..machine import Machine
from ..model.rates import list_closure_joints
from .characteristic_length import Length


def twist_names(machine: Machine) -> tuple[str, ...]:
    """The twist's components: the machine's translations, then its small turns.

    ``wx``, ``wy``, ``wz`` turn about the machine frame's axes; of a five-axis tool ``w1`` and ``w2`` move its axis k in
    the directions in which a growing B and a growing C do.
    """
    return (*(axis for axis in machine.axes if axis in "XYZ"), *machine.model.structure.turns)


def twist_jacobians(machine: Machine, poses: ArrayLike, mode: str | None = None) -> tuple[Array, Array]:
    """A and B, each (..., n, n), with A t' = B q' for the twist t' (:func:`twist_names`) and the joints q.

    They are :meth:`Machine.jacobians` with small turns for the pose's angles: what is singular there because an angle
    is free (B = 0 on five axes, B = ±90° on six) is not here. The twist is the tool's motion in the workpiece's
    frame, mm/s and rad/s. NaN where the pose is out of reach.
    """
    rows, lead = machine.rows(poses, machine.axes, "poses")
    a, b, _ = _computed(machine, rows, mode)
    n = len(machine.axes)
    return a.reshape(*lead, n, n), b.reshape(*lead, n, n)


def _computed(machine: Machine, rows: Array, mode: str | None) -> tuple[Array, Array, Array]:
    n = len(machine.axes)
    tape = machine.model.rates_tape()
    found = evaluate_tape(tape, rows, np.empty((len(rows), tape.outputs)), machine.inverse(rows, mode))
    a, b = (found[:, i * n * n : (i + 1) * n * n].reshape(-1, n, n) for i in (0, 1))
    return a, b, found[:, 2 * n * n :]


@dataclass(frozen=True, eq=False)
class Scaled:
    """A and B (N, n, n) of :func:`scaled_rates`, and how many of their first rows are the legs'."""

    a: Array
    b: Array
    legs: int


def scaled_rates(machine: Machine, rows: Array, length: Length, mode: str | None) -> Scaled:
    """A and B in one unit: angles times the length, legs' rows divided by their rods' lengths.

    What is left of a leg's row of A is a unit wrench, of B the share of each drive's motion that reaches the
    platform's joint; the rows of head and table are 1/mm times the length.
    """
    a, b, spans = _computed(machine, rows, mode)
    columns_a, columns_b = column_scales(machine, length)
    legs = spans.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.concatenate([1.0 / spans, np.full((len(a), a.shape[1] - legs), length.factor)], 1)[:, :, None]
        return Scaled(a * columns_a * factors, b * columns_b * factors, legs)


def column_scales(machine: Machine, length: Length) -> tuple[Array, Array]:
    """What the columns of A and B are multiplied by, so that the rates they go with are in mm."""
    small = 1.0 / length.factor
    turns = len(machine.model.structure.turns)
    a = np.array([1.0] * (len(machine.axes) - turns) + [small] * turns)
    return a, np.array([small if unit == "rad" else 1.0 for unit in machine.joint_units])


def drives_of_legs(machine: Machine) -> list[int]:
    """The joint that each leg's row is of."""
    return list_closure_joints(machine.spec)
