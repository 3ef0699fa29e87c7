"""Compiled kernels of the trajectory planner."""
