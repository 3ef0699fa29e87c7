"""Joints along a path of poses: continuous, over poles too."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..model.traces import Model
from .inverse import solve_inverse
from .turns import fill_free, unwind_angles
from .wrist.pole_thresholds import EXACT
from .wrist.turning_joints import find_wrist


def follow_path(model: Model, poses: Array, mode: str, free_below: float = EXACT) -> Array:
    """Solve the inverse problem along a path (n, axes); see :meth:`parakin.Machine.follow`."""
    joints = solve_inverse(model, poses, mode)
    make_continuous(model, poses, joints, mode, free_below)
    return joints


def make_continuous(model: Model, poses: Array, joints: Array, mode: str, free_below: float = EXACT) -> None:
    """Make joints (n, joints) continuous that the inverse gives along a path (n, axes); in place.

    On a path that never leaves the pole the first joint stands as at home.
    """
    wrist = find_wrist(model)
    if wrist is not None:
        free = wrist.find_free(poses, free_below)
        wrist.cross_pole(poses, mode, joints, ~free)
        if free.any():
            at_home = solve_inverse(model, np.array([model.home]), model.mode)[0, wrist.first]
            first = np.full(len(poses), at_home) if free.all() else fill_free(joints[:, wrist.first], free)
            joints[free] = wrist.solve_with_first(poses[free], mode, first[free])
    for i in model.turning_joints:
        joints[:, i] = unwind_angles(joints[:, i])
