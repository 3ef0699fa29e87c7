"""Homing of a parallel machine: directions and order in which its drives find themselves without harm."""

from .homing_plan import HomingPlan, JointHoming, find_homing

__all__ = ["HomingPlan", "JointHoming", "find_homing"]
