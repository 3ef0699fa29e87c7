"""Compiled kernels of the trajectory planner, each named by what it bounds or computes.

The path speed is bounded by the feed and the joints' speeds in ``speed_ceilings``, by the joints' accelerations in
``acceleration_limits`` and ``reachability``, by their jerks in ``jerk_passes`` and ``jerk_limiting``; ``utilisation``
measures how much of each limit a trajectory takes.
"""
