"""Plan a trajectory: from a posted path over its curve and its joints to the speed along it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Flags
from ...errors import PoseError
from ..path import ToolPath
from ..posting.posted import Posted
from .corners import Corners, check_tolerance, round_corners
from .drive_limits import DriveLimits
from .force_limits import ForceLimits
from .jerk_limited import limit_jerk
from .joint_path import build_joint_path
from .pole_pace import slow_down_on_pole
from .rated_forces import keep_rated_forces
from .speed_profile import SpeedProfile
from .time_optimal import (
    build_accelerated_profile,
    build_uniform_profile,
    find_quickest,
)
from .trajectory import Trajectory, name_limits


def plan_trajectory(
    posted: Posted,
    *,
    corners: Corners = "round",
    tolerance: float = 0.01,
    axis_tolerance: float = 1e-3,
    stops: Sequence[int] = (),
) -> Trajectory:
    """Plan the quickest trajectory along a posted path that keeps its feeds and its drives' limits.

    Parameters
    ----------
    posted : a path with joints at every record
    corners : ``round`` rounds them; ``stop`` stands still at each that turns by more than a degree (angles counted as
        in :class:`~.corners.Curve`), and rounds the others
    tolerance, axis_tolerance : mm of the tool's tip and rad of its axis that rounding may take it off
    stops : records at which the tool stands still, besides the first and the last

    Between records the tip moves straight and the pose's angles evenly. The feed is that of the record that the motion
    leads to; in rapid, and where none is programmed, drives are the only limit. A drive's force and its power, where
    its file says them, bound what weight, inertia and cutting ask of it; where the rms of its force would be more than
    its file says, the whole takes longer. Where no drive has an acceleration, a jerk, a force or a power, corners are
    neither rounded nor stopped at, and speeds change at once. With jerks the trajectory is the quickest but for less
    than 0.5 %, on paths of more than 100,000 rows for less than 10 %. For the rms all times are longer alike.

    Raises
    ------
    PoseError : a record or a motion between two where the legs can't close, or a motion that nothing limits
    """
    if corners not in ("round", "stop"):
        raise PoseError(f"corners: 'round' or 'stop' expected, not {corners!r}")
    check_tolerance(tolerance, "tolerance")
    check_tolerance(axis_tolerance, "axis_tolerance")
    _refuse_untimed(posted)
    parted, limits, names = (
        flag_stops(posted.path, stops),
        DriveLimits.of(posted.machine),
        name_limits(posted.machine.joints),
    )
    forces = ForceLimits(posted)
    bounded = limits.bounds_acceleration or bool(forces)
    curve = round_corners(posted, corners, tolerance, axis_tolerance, parted, bounded)
    joint_path = build_joint_path(posted, curve, limits, tolerance, axis_tolerance)
    if not len(joint_path.step):
        return Trajectory(posted, curve, joint_path, SpeedProfile.allocate(0, 1), np.full(1, len(names) - 1), names)
    if not bounded:
        profile, binding = build_uniform_profile(joint_path, limits)
        return Trajectory(posted, curve, joint_path, profile, binding, names)
    joint_path, x, u = find_quickest(joint_path, limits, forces)
    if np.isfinite(limits.jerk).any():
        joint_path, profile, binding = limit_jerk(joint_path, limits, x)
    else:
        profile, binding = build_accelerated_profile(joint_path, limits, x, u)
    profile = slow_down_on_pole(joint_path, profile)
    trajectory = keep_rated_forces(Trajectory(posted, curve, joint_path, profile, binding, names))
    trajectory.binding[joint_path.find_ends()] = len(names) - 1
    return trajectory


def _refuse_untimed(posted: Posted) -> None:
    """Raise :class:`PoseError` for a path without records or with poses out of reach."""
    if not len(posted.path):
        raise PoseError("the path has no records")
    lost = ~np.isfinite(posted.joints.sum(axis=1))
    if lost.any():
        raise PoseError(f"{posted.path.locate(int(lost.argmax()))}: the machine can't take this pose")


def flag_stops(path: ToolPath, stops: Sequence[int]) -> Flags:
    """Flag the records to stop at, (n,).

    Raises :class:`PoseError` for a feed of zero, and for stops at records that there are not.
    """
    count = len(path)
    idle = ~path.rapid & (path.feed <= 0.0)
    if idle.any():
        raise PoseError(f"{path.locate(int(idle.argmax()))}: more than 0 expected for the feed")
    flags = np.zeros(count, bool)
    for stop in stops:
        if not 0 <= stop < count:
            raise PoseError(f"stops: records from 0 to {count - 1} expected, not {stop}")
        flags[stop] = True
    return flags
