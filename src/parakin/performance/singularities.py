"""Singularity margins: how far a machine is from parallel, serial and constraint singularities; zero at them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..kinematics.tall_matrices import compute_determinants
from ..machine import Machine
from .characteristic_length import CharacteristicLength, choose_characteristic_length
from .jacobians import ScaledRates, compute_scaled_rates

PARALLEL = "parallel"
CONSTRAINT = "constraint"
_ZERO = 1e-12  # a margin no greater has no sign


def list_margin_names(machine: Machine) -> tuple[str, ...]:
    """List the margins: ``parallel``, ``serial JOINT`` for each joint of the legs, and what else the machine has.

    ``serial JOINT-JOINT`` is of turning heads and tables, ``constraint`` of machines with constraints.
    """
    order = machine.closure_joints
    names = [PARALLEL, *(f"serial {machine.joints[i]}" for i in order)]
    if has_serial_turns(machine):
        names.append(f"serial {'-'.join(machine.joints[len(order) :])}")
    return (*names, CONSTRAINT) if machine.constraints else tuple(names)


def has_serial_turns(machine: Machine) -> bool:
    """Tell whether head and table have turning drives, and a serial margin of their own."""
    return len(machine.joints) > machine.leg_count and not machine.structure.has_slides


def compute_singularity_margins(
    machine: Machine, poses: ArrayLike, length: float | None = None, mode: str | None = None
) -> Array:
    """Compute signed margins (..., margins), named by :func:`list_margin_names`; 0 where singular, NaN out of reach.

    - parallel: det A of unit wrenches (legs' rows divided by their rods' lengths, angles times the characteristic
      length), positive as at home. Of a five-axis machine, whose head and table never matter here, that is the
      determinant of the legs' rows against the translations. Where it is zero the tool moves though the drives stand.
      With more drives than freedoms it is the volume √det(AᵀA), which has no sign.
    - serial, of a leg's joint: the part of the drive's motion that reaches the platform's joint (mm a mm; a radian
      counts as the characteristic length), positive as at home. Where it is zero the drive moves and the platform's
      joint need not.
    - serial, of head and table: |(a1 × a2)·k| of their turning axes and the tool's; of axes at right angles the sine of
      the angle between the tool and the first one.
    - constraint: the determinant of the constraints' unit wrenches against the parasitic motions (angles times the
      characteristic length), positive as at home. Where it is zero the platform moves though all independent
      coordinates stand.

    Parameters
    ----------
    poses : (..., axes), mm and rad
    length : characteristic length, mm; see :func:`~.characteristic_length.choose_characteristic_length`
    mode : working mode
    """
    rows, lead = machine.rows(poses, machine.axes, "poses")
    mode, scale = machine.checked_mode(mode), choose_characteristic_length(machine, length)
    signs = find_home_signs(machine, scale, mode)
    margins = derive_margins(machine, compute_scaled_rates(machine, rows, scale, mode), signs)
    return margins.reshape(*lead, margins.shape[1])


def find_home_signs(machine: Machine, length: CharacteristicLength, mode: str) -> Array:
    """Find ±1 for each margin, by which it is positive at home; 1 where home itself is singular or out of reach."""
    margins = _compute_determinants(machine, compute_scaled_rates(machine, machine.home[None], length, mode))[0]
    return np.where(margins < -_ZERO, -1.0, 1.0)


def derive_margins(machine: Machine, rates: ScaledRates, signs: Array) -> Array:
    """Derive the margins (N, margins) from scaled rates."""
    return _compute_determinants(machine, rates) * signs + 0.0  # zero has no sign


def _compute_determinants(machine: Machine, rates: ScaledRates) -> Array:
    legs = rates.legs
    height, width = machine.parallel_block
    with np.errstate(invalid="ignore"):
        columns = [compute_determinants(rates.a[:, :height, :width])]
        columns += [rates.b[:, row, joint] for row, joint in enumerate(machine.closure_joints)]
        if has_serial_turns(machine):
            columns.append(np.abs(np.linalg.det(rates.b[:, legs:, legs:])))
        if machine.constraints:
            columns.append(np.linalg.det(rates.constraints))
    return np.stack(columns, 1)
