"""The budget of a search: the time and the work that it may take before it answers with what it has."""

from __future__ import annotations

import time
from math import inf

from .errors import PoseError

SECONDS = 60.0  # of a search, if nothing else is said


class _Clock:
    """Counts seconds, but not those in which kernels are compiled: that happens once, and is no part of a search."""

    def __init__(self) -> None:
        self.compiling = 0.0

    def read(self) -> float:
        return time.monotonic() - self.compiling


CLOCK = _Clock()


class Budget:
    """The time, s, and the number of boxes that a search may still examine; None for time without end.

    Time in which kernels are compiled does not count. A search asks :meth:`is_spent` between its steps and then answers
    with what is proved so far. ``used`` counts the boxes that it has examined.

    Raises :class:`PoseError` for a time that is not above 0.
    """

    def __init__(self, seconds: float | None = SECONDS, boxes: float = inf):
        if seconds is not None and not seconds > 0.0:
            raise PoseError(f"seconds: a time above 0 s expected, not {seconds:g}")
        self.boxes, self.used = boxes, 0
        self._deadline = inf if seconds is None else CLOCK.read() + seconds

    @property
    def seconds_left(self) -> float:
        """The time that is left, s, at least zero."""
        return max(0.0, self._deadline - CLOCK.read())

    def is_spent(self) -> bool:
        return self.used >= self.boxes or CLOCK.read() > self._deadline

    def take_fraction(self, fraction: float) -> Budget:
        """Make a budget of a fraction of what is left, for one step of several."""
        step = Budget(None, max(0.0, self.boxes - self.used) * fraction)
        step._deadline = self._deadline if self._deadline == inf else CLOCK.read() + fraction * self.seconds_left
        return step

    def __repr__(self) -> str:
        return f"<parakin budget: {self.seconds_left:.3g} s left>"
