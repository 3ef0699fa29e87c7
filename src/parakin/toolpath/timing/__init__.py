"""Timing: the trajectory along a posted tool path, as fast as the feed and every joint's limits allow.

``plan`` leads through it: ``corners`` rounds the path, ``joint_path`` makes splines of the joints along it,
``time_optimal`` finds the quickest speed profile with their speeds and accelerations, ``jerk_limited`` one that keeps
their jerks too. A ``trajectory`` is the result.
"""

from .corners import Corners
from .plan import plan_trajectory
from .trajectory import Setpoints, Trajectory

__all__ = ["Corners", "Setpoints", "Trajectory", "plan_trajectory"]
