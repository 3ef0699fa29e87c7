"""Joints along a path of poses: continuous, with free angles kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.batch import run

if TYPE_CHECKING:
    from ..machine import Array, Machine

FREE = 1e-18  # sin² of the tool's axis against a turning axis: below 1e-9 rad its angle is rounding


def follow(machine: Machine, poses: Array, mode: str) -> Array:
    """See :meth:`parakin.Machine.follow`."""
    model = machine.model
    joints = machine.inverse(poses, mode)
    turning = [i for i, drive in enumerate(model.drives) if drive.unit == "rad"]
    first = model.first_serial
    if first is not None:
        freedom = run(model.freedom_tape(), poses, np.empty((len(poses), 1)))[:, 0]
        free = freedom < FREE
        if free.any() and not free.all():
            joints[free, first] = neighbours(joints[:, first], free)[free]
            held = run(
                model.held_tape(mode),
                np.ascontiguousarray(poses[free]),
                np.empty((int(free.sum()), joints.shape[1])),
                np.ascontiguousarray(joints[free][:, [first]]),
            )
            joints[free] = held
    for i in turning:
        joints[:, i] = unwound(joints[:, i])
    return joints


def neighbours(values: Array, free: NDArray[np.bool_]) -> Array:
    """``values`` with the free ones replaced by the last that is not free, at the start by the first to come."""
    index = np.where(free | ~np.isfinite(values), -1, np.arange(len(values)))
    last = np.maximum.accumulate(index)
    fixed = np.flatnonzero(index >= 0)
    return values[np.where(last < 0, fixed[0], last)] if len(fixed) else values


def unwound(angles: Array) -> Array:
    """Angles without jumps over ±180°; NaN stays where it is and does not spread."""
    with np.errstate(invalid="ignore"):
        if not (np.abs(np.diff(angles)) > np.pi).any() and not np.isnan(angles).any():
            return angles
    result = angles.copy()
    finite = np.isfinite(angles)
    result[finite] = np.unwrap(angles[finite])
    return result
