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
    """Where half a turn of the first joint is spared by it, go on in head and table's other working mode; in place.

    Not for a stretch in which that takes the second joint out of its range, or a leg out of reach.
    """
    first, last = machine.model.first_serial, joints.shape[1] - machine.model.serial
    columns = [first, last + 1 if first == last else last]
    at = np.flatnonzero(regular & np.isfinite(joints[:, first]))
    here = joints[at][:, columns]
    if not swings(here):
        return
    other = machine.inverse(poses[at], mode[:-1] + ("-" if mode[-1] == "+" else "+"))
    across = over_the_pole(here, other[:, columns])
    drive = machine.model.drives[columns[1]]
    out = (other[:, columns[1]] < drive.low) | (other[:, columns[1]] > drive.high) | ~np.isfinite(other).all(1)
    stretch = np.cumsum(np.diff(across, prepend=False))  # numbered; the odd ones are across
    across &= ~np.isin(stretch, stretch[across & out])
    joints[at[across]] = other[across]


def swings(angles: Array) -> bool:
    """Some of the first angles (n, 2) of neighbours lie more than a quarter turn apart."""
    return bool((np.abs(wrapped(np.diff(angles[:, 0]))) > _SWING).any())


def over_the_pole(here: Array, there: Array) -> NDArray[np.bool_]:
    """Which rows of a path (n,) go on in the other of two pairs of angles (n, 2) that point a tool the same way.

    A path that passes over its pole between two records, the first angle half a turn on and the second small, is
    continuous in the other pair, in which the second angle changes its sign instead.
    """
    stay, cross = wrapped(np.diff(here, axis=0)), wrapped(there[1:] - here[:-1])
    with np.errstate(invalid="ignore"):
        spared = (np.abs(stay[:, 0]) > _SWING) & ((cross**2).sum(1) < 0.25 * (stay**2).sum(1))
    return np.concatenate([np.zeros(min(len(here), 1), bool), np.cumsum(spared) % 2 == 1])


def wrapped(angle: Array) -> Array:
    """The angle within half a turn of 0."""
    result: Array = angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    return result


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
