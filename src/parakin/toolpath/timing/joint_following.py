"""Joints at poses of a curve: followed from its start, or those nearest to a guess; and on poles of a wrist.

A pole is where the tool's axis lies along the first turning joint's: that joint is free there, and beside it the less
exact the nearer. On a pole it goes smoothly from where it was to where it has to be, and the other joints take the
pose with it.
"""

from __future__ import annotations

import numpy as np

from ...kernels.batch import run_in_threads
from ...kinematics.wrist import DISTINCT, EXACT
from ...machine import Machine
from ..path import Floats
from .corners import LEVER
from .kernels.splines import choose_nearest


def followed(machine: Machine, mode: str, poses: Floats, way: Floats) -> Floats:
    """Joints along poses (rows, axes), continuous; ``way`` (rows,) tells how far along the curve each is."""
    joints, wrist = machine.follow(poses, mode, EXACT), machine.wrist
    if wrist is not None:
        free = wrist.find_free(poses, EXACT)
        if free.any() and not free.all():
            guess = np.stack([np.interp(way[free], way[~free], column) for column in joints[~free].T], axis=1)
            guess[:, wrist.first] = _eased(way[free], way[~free], joints[~free, wrist.first])
            joints[free] = close_to(machine, mode, np.ascontiguousarray(poses[free]), guess)[0]
    return joints


def close_to(machine: Machine, mode: str, poses: Floats, guess: Floats) -> tuple[Floats, Floats]:
    """The joints at poses nearest to a guess (rows, joints), and how much less exact the first turning one is, ≥ 1."""
    wrist, blur = machine.wrist, np.ones(len(poses))
    modes = [mode] if wrist is None else [mode, wrist.other_mode(mode)]
    both = [machine.inverse(poses, mode) for mode in modes]
    if wrist is not None:
        freedom, on = wrist.measure_freedom(poses), np.sin(EXACT) ** 2
        free = freedom < on
        if free.any():
            for mode, joints in zip(modes, both, strict=True):
                joints[free] = wrist.solve_with_first(poses[free], mode, guess[free, wrist.first])
        blur = np.maximum(1.0, DISTINCT / np.sqrt(np.maximum(freedom, on)))
    units = np.array(machine.joint_units)
    args = (both[0], both[-1], guess, units == "rad", np.where(units == "mm", LEVER, 1.0))
    run_in_threads(len(poses), lambda start, stop: choose_nearest(*args, start, stop))
    return both[0], blur


def _eased(at: Floats, known: Floats, angles: Floats) -> Floats:
    """Angles between those that are known, both ascending; they leave each and come to the next at rest."""
    after = np.searchsorted(known, at)
    a, b = np.maximum(after - 1, 0), np.minimum(after, len(known) - 1)
    t = (at - known[a]) / np.where(b > a, known[b] - known[a], 1.0)
    eased: Floats = angles[a] + (angles[b] - angles[a]) * (t**3 * (10.0 + t * (6.0 * t - 15.0)))
    return np.where(after == 0, angles[0], eased)
