"""Timing: a trajectory along a posted tool path that keeps the feed and every joint's limits."""

from .corners import Corners
from .plan import plan_trajectory
from .trajectory import Setpoints, Trajectory

__all__ = ["Corners", "Setpoints", "Trajectory", "plan_trajectory"]
