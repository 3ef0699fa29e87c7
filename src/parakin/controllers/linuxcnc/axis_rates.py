"""How fast LinuxCNC's axes may be, so that it can follow a trajectory."""

from __future__ import annotations

from math import isfinite, pi

import numpy as np

from ...arrays import Array
from ...machine import Machine
from ...model.elements import Drive

# Speed and acceleration where a machine's description leaves them open, by the drive's unit; mm, rad and s.
SPEED = {"mm": 200.0, "rad": pi / 3.0}
ACCELERATION = {"mm": 2000.0, "rad": 10.0 * pi / 3.0}

# Factors on the slowest drive's. LinuxCNC begins and ends a motion that turns the tool with half of this acceleration,
# as if it stood still there; so it must be more than the drives' own, or paths of short motions would crawl. And where
# the tool is nearly upright C turns fast, though no drive does.
_SPEED_FACTOR = {"mm": 1.0, "rad": 4.0}
_ACCELERATION_FACTOR = {"mm": 6.0, "rad": 12.0}


def find_slowest_drive(machine: Machine, unit: str) -> tuple[float, float]:
    """Find the least speed and the least acceleration of the drives of a unit, ``mm`` or ``rad``."""
    drives = [drive for drive in machine.drives if drive.unit == unit]
    speeds = [drive.speed for drive in drives if isfinite(drive.speed)] or [SPEED[unit]]
    accelerations = [drive.acceleration for drive in drives if isfinite(drive.acceleration)] or [ACCELERATION[unit]]
    return min(speeds), min(accelerations)


def choose_drive_rates(drive: Drive) -> tuple[float, float]:
    """Take a drive's speed and acceleration, or choose them where the description leaves them open; mm, rad and s."""
    speed = drive.speed if isfinite(drive.speed) else SPEED[drive.unit]
    return speed, drive.acceleration if isfinite(drive.acceleration) else ACCELERATION[drive.unit]


def choose_unit_rates(machine: Machine, unit: str) -> tuple[float, float]:
    """Choose speed and acceleration of the axes of a unit; mm, rad and s."""
    speed, acceleration = find_slowest_drive(machine, unit)
    return _SPEED_FACTOR[unit] * speed, _ACCELERATION_FACTOR[unit] * acceleration


def choose_axis_rates(machine: Machine) -> tuple[Array, Array]:
    """Choose speeds and accelerations of all axes, (axes,) each; mm, rad and s."""
    rates = np.array([choose_unit_rates(machine, unit) for unit in machine.axis_units])
    return rates[:, 0], rates[:, 1]
