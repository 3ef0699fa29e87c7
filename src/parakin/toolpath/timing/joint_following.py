"""The machine's joints at poses of a curve: followed from its start, or those nearest to a guess.

On a pole of the wrist the first turning joint is free, and beside it the less exact the nearer. There it turns smoothly
from its angle before the pole to its angle behind, and the other joints are solved with it given.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kernels.batch import run_in_threads
from ...kinematics.wrist import DISTINCT, EXACT
from ...machine import Machine
from .corners import LEVER
from .kernels.splines import choose_nearest


def follow_curve(machine: Machine, mode: str, poses: Array, length: Array) -> Array:
    """Follow the joints continuously along poses (rows, axes); ``length`` (rows,) is each one's place on the curve."""
    joints, wrist = machine.follow(poses, mode, EXACT), machine.wrist
    if wrist is not None:
        free = wrist.find_free(poses, EXACT)
        if free.any() and not free.all():
            guess = np.stack([np.interp(length[free], length[~free], column) for column in joints[~free].T], axis=1)
            guess[:, wrist.first] = _ease_angles(length[free], length[~free], joints[~free, wrist.first])
            joints[free] = find_nearest_joints(machine, mode, np.ascontiguousarray(poses[free]), guess)[0]
    return joints


def find_nearest_joints(machine: Machine, mode: str, poses: Array, guess: Array) -> tuple[Array, Array]:
    """Find the joints of poses that are nearest to a guess (rows, joints), in either mode of the wrist.

    The second array (rows,), ≥ 1, is the factor by which the first turning joint is less exact than the others.
    """
    wrist, blur = machine.wrist, np.ones(len(poses))
    modes = [mode] if wrist is None else [mode, wrist.other_mode(mode)]
    solutions = [machine.inverse(poses, mode) for mode in modes]
    if wrist is not None:
        freedom, least = wrist.measure_freedom(poses), np.sin(EXACT) ** 2
        free = freedom < least
        if free.any():
            for mode, joints in zip(modes, solutions, strict=True):
                joints[free] = wrist.solve_with_first(poses[free], mode, guess[free, wrist.first])
        blur = np.maximum(1.0, DISTINCT / np.sqrt(np.maximum(freedom, least)))
    units = np.array(machine.joint_units)
    args = (solutions[0], solutions[-1], guess, units == "rad", np.where(units == "mm", LEVER, 1.0))
    run_in_threads(len(poses), lambda start, stop: choose_nearest(*args, start, stop))
    return solutions[0], blur


def _ease_angles(at: Array, known: Array, angles: Array) -> Array:
    """Interpolate angles between known ones, both places ascending; they leave each and come to the next at rest."""
    after = np.searchsorted(known, at)
    a, b = np.maximum(after - 1, 0), np.minimum(after, len(known) - 1)
    t = (at - known[a]) / np.where(b > a, known[b] - known[a], 1.0)
    eased: Array = angles[a] + (angles[b] - angles[a]) * (t**3 * (10.0 + t * (6.0 * t - 15.0)))
    return np.where(after == 0, angles[0], eased)
