"""Joints at poses of a curve: followed from its start, or those nearest to a guess; and on poles of a wrist.

A pole is where the tool's axis lies along the first turning joint's: that joint is free there, and beside it the less
exact the nearer. On a pole it goes smoothly from where it was to where it has to be, and the other joints take the
pose with it.
"""

from __future__ import annotations

import numpy as np

from ...kernels.batch import run, split
from ...kinematics.follow import FREE
from ...machine import Machine
from ..path import Floats
from .corners import LEVER
from .kernels.splines import nearest

_CLEAR = 1e-2  # rad from a pole: from here on the first joint counts as exact as the others
_ON = np.sin(FREE) ** 2


def followed(machine: Machine, mode: str, poses: Floats, way: Floats) -> Floats:
    """Joints along poses (rows, axes), continuous; ``way`` (rows,) tells how far along the curve each is."""
    joints = machine.follow(poses, mode, FREE)
    first = machine.model.first_serial
    if first is not None:
        free = _freedom(machine, poses) < _ON
        if free.any() and not free.all():
            guess = np.stack([np.interp(way[free], way[~free], column) for column in joints[~free].T], axis=1)
            guess[:, first] = _eased(way[free], way[~free], joints[~free, first])
            joints[free] = close_to(machine, mode, np.ascontiguousarray(poses[free]), guess)[0]
    return joints


def close_to(machine: Machine, mode: str, poses: Floats, guess: Floats) -> tuple[Floats, Floats]:
    """The joints at poses nearest to a guess (rows, joints), and how much less exact the first turning one is, ≥ 1."""
    first, modes = machine.model.first_serial, [mode]
    if first is not None:
        modes.append(mode[:-1] + ("-" if mode[-1] == "+" else "+"))
    both, blur = [machine.inverse(poses, mode) for mode in modes], np.ones(len(poses))
    if first is not None:
        freedom = _freedom(machine, poses)
        free = freedom < _ON
        if free.any():
            held, some = np.ascontiguousarray(guess[free][:, [first]]), np.ascontiguousarray(poses[free])
            for mode, joints in zip(modes, both, strict=True):
                joints[free] = run(machine.model.held_tape(mode), some, np.empty((len(some), guess.shape[1])), held)
        blur = np.maximum(1.0, _CLEAR / np.sqrt(np.maximum(freedom, _ON)))
    units = np.array(machine.joint_units)
    args = (both[0], both[-1], guess, units == "rad", np.where(units == "mm", LEVER, 1.0))
    split(len(poses), lambda start, stop: nearest(*args, start, stop))
    return both[0], blur


def _freedom(machine: Machine, poses: Floats) -> Floats:
    return run(machine.model.freedom_tape(), poses, np.empty((len(poses), 1)))[:, 0]


def _eased(at: Floats, known: Floats, angles: Floats) -> Floats:
    """Angles between those that are known, both ascending; they leave each and come to the next at rest."""
    after = np.searchsorted(known, at)
    a, b = np.maximum(after - 1, 0), np.minimum(after, len(known) - 1)
    t = (at - known[a]) / np.where(b > a, known[b] - known[a], 1.0)
    eased: Floats = angles[a] + (angles[b] - angles[a]) * (t**3 * (10.0 + t * (6.0 * t - 15.0)))
    return np.where(after == 0, angles[0], eased)
