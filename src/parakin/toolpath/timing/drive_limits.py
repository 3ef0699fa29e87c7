"""The limits of the drives that a trajectory has to keep."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...machine import Machine


class DriveLimits(NamedTuple):
    """What each joint can do, (joints,) each, infinite where the machine gives no limit; mm or rad, and s."""

    speed: Array
    acceleration: Array
    jerk: Array

    @staticmethod
    def of(machine: Machine) -> DriveLimits:
        """Collect the limits of a machine's drives."""
        drives = machine.drives
        return DriveLimits(*(np.array([getattr(d, k) for d in drives]) for k in ("speed", "acceleration", "jerk")))

    @property
    def bounds_acceleration(self) -> bool:
        """Whether some joint has a limit of acceleration or jerk, so that it can't change its speed at once."""
        return bool(np.isfinite(self.acceleration).any() or np.isfinite(self.jerk).any())
