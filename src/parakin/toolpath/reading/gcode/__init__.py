"""G-code, RS274/NGC as LinuxCNC reads it.

``reader`` splits the file into lines; ``control_flow`` executes O words. ``block``, ``expressions`` and ``parameters``
turn a line into words and values, ``execution`` acts on them, with ``offsets`` and ``cycles``. ``motion`` keeps the
modal state in the program's coordinates and makes the ``records``; ``work_systems`` leads from these to W.
"""
