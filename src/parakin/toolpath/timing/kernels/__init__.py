"""Compiled kernels of the trajectory planner, each named by what it bounds or computes.

The path speed is bounded by the feed and the joints' speeds in ``speed_ceilings``, by the joints' accelerations in
``acceleration_limits`` and ``reachability``. Where jerks are limited too, ``grading`` cuts steps that are too long,
``slowing`` makes a profile that keeps all limits, and ``interior_point`` shortens it, by the ``barriers`` of the limits
in ``step_limits``. ``utilisation`` measures how much of each limit a trajectory takes.
"""
