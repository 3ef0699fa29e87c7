"""Joints along a path of poses: continuous, with free angles kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.batch import run

if TYPE_CHECKING:
    from ..machine import Array, Machine

FREE = 1e-9  # rad: a tool's axis nearer to a turning axis tells its angle by rounding only
_SWING = 0.5 * np.pi


def follow(machine: Machine, poses: Array, mode: str, free_below: float = FREE) -> Array:
    """See :meth:`parakin.Machine.follow`."""
    model = machine.model
    joints = machine.inverse(poses, mode)
    first = model.first_serial
    if first is not None:
        freedom = run(model.freedom_tape(), poses, np.empty((len(poses), 1)))[:, 0]
        free = freedom < np.sin(free_below) ** 2
        _go_on_over_the_pole(machine, poses, mode, joints, ~free)
        if free.any() and not free.all():
            joints[free, first] = neighbours(joints[:, first], free)[free]
            held = np.ascontiguousarray(joints[free][:, [first]])
            into = np.empty((len(held), joints.shape[1]))
            joints[free] = run(model.held_tape(mode), np.ascontiguousarray(poses[free]), into, held)
    for i, drive in enumerate(model.drives):
        if drive.unit == "rad":
            joints[:, i] = unwound(joints[:, i])
    return joints


def _go_on_over_the_pole(machine: Machine, poses: Array, mode: str, joints: Array, regular: NDArray[np.bool_]) -> None:
    """Where the tool's axis passes its turning axis between two records, half a turn of the first joint is spared by
    going on in head and table's other working mode, in which the second joint changes sign instead; in place."""
    first, last = machine.model.first_serial, joints.shape[1] - machine.model.serial
    second = last + 1 if first == last else last
    at = np.flatnonzero(regular & np.isfinite(joints[:, first]))
    a = joints[at][:, [first, second]]
    stay = _wrapped(np.diff(a, axis=0))
    if not (np.abs(stay[:, 0]) > _SWING).any():
        return
    other = machine.inverse(poses[at], mode[:-1] + ("-" if mode[-1] == "+" else "+"))
    cross = _wrapped(other[1:][:, [first, second]] - a[:-1])
    with np.errstate(invalid="ignore"):
        spared = (np.abs(stay[:, 0]) > _SWING) & ((cross**2).sum(1) < 0.25 * (stay**2).sum(1))
    across = np.concatenate([[False], np.cumsum(spared) % 2 == 1])
    joints[at[across]] = other[across]


def _wrapped(angle: Array) -> Array:
    wrapped: Array = angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    return wrapped


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
