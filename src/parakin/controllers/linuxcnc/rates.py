"""How fast LinuxCNC's axes may be, so that it can follow a trajectory along a path."""

from __future__ import annotations

from math import isfinite, pi

import numpy as np

from ...arrays import Array
from ...machine import Machine

# Speed and acceleration where a machine's description leaves them open, by the drive's unit; mm, rad and s.
SPEED = {"mm": 200.0, "rad": pi / 3.0}
ACCELERATION = {"mm": 2000.0, "rad": 10.0 * pi / 3.0}

# Times the slowest drive. A motion that turns the tool LinuxCNC begins and ends with half of this acceleration as if it
# stood still there, so it must be more than the drives' own or paths of short motions would crawl. And where the tool
# is nearly upright C turns fast, though no drive does.
_FASTER = {"mm": 1.0, "rad": 4.0}
_BRISKER = {"mm": 6.0, "rad": 12.0}


def slowest(machine: Machine, unit: str) -> tuple[float, float]:
    """Speed and acceleration of the slowest drive of a unit."""
    drives = [drive for drive in machine.drives if drive.unit == unit]
    speeds = [drive.speed for drive in drives if isfinite(drive.speed)] or [SPEED[unit]]
    accelerations = [drive.acceleration for drive in drives if isfinite(drive.acceleration)] or [ACCELERATION[unit]]
    return min(speeds), min(accelerations)


def of_axes(machine: Machine, unit: str) -> tuple[float, float]:
    """Speed and acceleration of the axes of a unit; mm, rad and s."""
    speed, acceleration = slowest(machine, unit)
    return _FASTER[unit] * speed, _BRISKER[unit] * acceleration


def axis_rates(machine: Machine) -> tuple[Array, Array]:
    """Speeds and accelerations of all axes, (axes,) each; mm, rad and s."""
    rates = np.array([of_axes(machine, unit) for unit in machine.axis_units])
    return rates[:, 0], rates[:, 1]
