"""How far a machine is from its singularities, as dimensionless margins that are 0 at them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..machine import Machine
from .characteristic_length import Length, characteristic_length
from .jacobians import Scaled, drives_of_legs, scaled_rates

PARALLEL = "parallel"
_NOUGHT = 1e-12  # a margin no greater has no sign


def margin_names(machine: Machine) -> tuple[str, ...]:
    """``parallel``, then ``serial JOINT`` for each joint of the legs, then ``serial JOINT-JOINT`` of head and table."""
    order = drives_of_legs(machine)
    serial = machine.joints[len(order) :]
    names = [PARALLEL, *(f"serial {machine.joints[i]}" for i in order)]
    return (*names, f"serial {'-'.join(serial)}") if serial else tuple(names)


def singularity_margins(
    machine: Machine, poses: ArrayLike, length: float | None = None, mode: str | None = None
) -> Array:
    """Signed margins (..., margins) in the order of :func:`margin_names`; 0 where singular, NaN out of reach.

    - parallel: det A of unit wrenches (legs' rows divided by their rods' lengths, angles times the characteristic
      length), positive as at home. Of a five-axis machine, whose head and table never matter here, that is the
      determinant of the legs' rows against the translations. Where it is 0 the tool moves though the drives stand.
    - serial, of a leg's joint: the share of the drive's motion that reaches the platform's joint (mm a mm; a radian
      counts as the characteristic length), positive as at home. Where it is 0 the drive moves and the platform's joint
      need not.
    - serial, of head and table: |(a1 × a2)·k| of their turning axes and the tool's; of axes at right angles the sine of
      the angle between the tool and the first one.

    Parameters
    ----------
    poses : (..., axes), mm and rad
    length : characteristic length, mm; see :func:`parakin.performance.characteristic_length.characteristic_length`
    mode : working mode
    """
    rows, lead = machine.rows(poses, machine.axes, "poses")
    mode, scale = machine.checked_mode(mode), characteristic_length(machine, length)
    found = margins_of(machine, scaled_rates(machine, rows, scale, mode), home_signs(machine, scale, mode))
    return found.reshape(*lead, found.shape[1])


def home_signs(machine: Machine, length: Length, mode: str) -> Array:
    """±1 for each margin, by which it is positive at home; 1 where home itself is singular or out of reach."""
    found = _unsigned(machine, scaled_rates(machine, machine.home[None], length, mode))[0]
    return np.where(found < -_NOUGHT, -1.0, 1.0)


def margins_of(machine: Machine, rates: Scaled, signs: Array) -> Array:
    """The margins (N, margins) that follow from scaled rates."""
    return _unsigned(machine, rates) * signs + 0.0  # nought has no sign


def _unsigned(machine: Machine, rates: Scaled) -> Array:
    legs, n = rates.legs, rates.a.shape[1]
    block = legs if n - legs == 2 else n
    with np.errstate(invalid="ignore"):
        columns = [np.linalg.det(rates.a[:, :block, :block])]
        columns += [rates.b[:, row, joint] for row, joint in enumerate(drives_of_legs(machine))]
        if n > legs:
            columns.append(np.abs(np.linalg.det(rates.b[:, legs:, legs:])))
    return np.stack(columns, 1)
