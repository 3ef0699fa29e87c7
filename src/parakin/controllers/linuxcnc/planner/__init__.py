"""The trajectory planner in C that LinuxCNC loads in the place of its own."""

from .planner_module import NO_TOLERANCE, SIGNAL, hash_planner, name_planner, write_planner

__all__ = ["NO_TOLERANCE", "SIGNAL", "hash_planner", "name_planner", "write_planner"]
