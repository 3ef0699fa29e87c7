"""Slow a trajectory down between two stands on a wrist's pole, so that a controller's cycles tell where it turns."""

from __future__ import annotations

import numpy as np

from ...kinematics.wrist.pole_thresholds import RIM, RIM_WIDTH
from .joint_path import JointPath
from .speed_profile import SpeedProfile

_TURNED = 1e-9  # rad: what is rounding
LEAST = 0.036  # s: a stretch on the pole takes no less; of cycles of a ms so many tell a spline


def slow_down_on_pole(joint_path: JointPath, profile: SpeedProfile) -> SpeedProfile:
    """Stretch in time what takes less than LEAST between two stands and touches the circle of a wrist's pole.

    The first joint leaves the circle at an angle that the least deviation of the pose turns. A spline through poses in
    a few cycles is not exact enough there, where the path bends on the rim and on the pole. Where no joint turns, as
    with the tool upright on a table's pole, nothing needs it.
    """
    wrist, turning = joint_path.posted.machine.wrist, joint_path.posted.machine.turning_joints
    if wrist is None:
        return profile
    stretches = joint_path.find_stretches()
    seconds = np.diff(profile.row_times[stretches], axis=1)[:, 0]
    factor = np.ones(len(stretches))
    for number in np.flatnonzero((seconds > 0.0) & (seconds < LEAST)).tolist():
        first, last = stretches[number]
        rows = np.arange(first, last + 1)
        turned = np.ptp(joint_path.joints[rows][:, turning], axis=0).max() > _TURNED
        if turned and wrist.find_free(joint_path.poses(rows, np.zeros(len(rows))), RIM + RIM_WIDTH).any():
            factor[number] = LEAST / seconds[number]
    if (factor == 1.0).all():
        return profile
    return profile.stretch_pieces(factor[np.searchsorted(stretches[:, 1], profile.row)])
