"""The machine's joints at poses of a curve: followed from its start, or those nearest to a guess.

On a pole of the wrist the first turning joint is free, and beside it the less exact the nearer. There it turns smoothly
from its angle before the pole to its angle behind, and the other joints are solved with it given.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kinematics.turns import count_nearest_turns
from ...kinematics.wrist.pole_thresholds import STANDING
from ...machine import Machine


def follow_curve(machine: Machine, mode: str, poses: Array, length: Array) -> Array:
    """Follow the joints continuously along poses (rows, axes); ``length`` (rows,) is each one's place on the curve."""
    joints, wrist = machine.follow(poses, mode, STANDING), machine.wrist
    if wrist is not None:
        free = wrist.find_free(poses, STANDING)
        if free.any() and not free.all():
            guess = np.stack([np.interp(length[free], length[~free], column) for column in joints[~free].T], axis=1)
            guess[:, wrist.first] = _ease_angles(length[free], length[~free], joints[~free, wrist.first])
            joints[free] = find_nearest_joints(machine, mode, np.ascontiguousarray(poses[free]), guess)
    return joints


def find_nearest_joints(machine: Machine, mode: str, poses: Array, guess: Array) -> Array:
    """Find the joints of poses that are nearest to a guess (rows, joints), in either mode of the wrist."""
    if machine.wrist is not None:
        return machine.wrist.solve_nearest(poses, mode, guess, STANDING)[0]
    joints = machine.inverse(poses, mode)
    count_nearest_turns(joints, guess, machine.turning_joints)
    return joints


def _ease_angles(at: Array, known: Array, angles: Array) -> Array:
    """Interpolate angles between known ones, both places ascending; they leave each and come to the next at rest."""
    after = np.searchsorted(known, at)
    a, b = np.maximum(after - 1, 0), np.minimum(after, len(known) - 1)
    t = (at - known[a]) / np.where(b > a, known[b] - known[a], 1.0)
    eased: Array = angles[a] + (angles[b] - angles[a]) * (t**3 * (10.0 + t * (6.0 * t - 15.0)))
    return np.where(after == 0, angles[0], eased)
