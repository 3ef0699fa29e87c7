"""How fast LinuxCNC's drives and axes may be."""

from __future__ import annotations

from math import isfinite, pi

from ...machine import Machine
from ...model.elements import Drive

# Speed and acceleration where a machine's description leaves them open, by the drive's unit; mm, rad and s.
SPEED = {"mm": 200.0, "rad": pi / 3.0}
ACCELERATION = {"mm": 2000.0, "rad": 10.0 * pi / 3.0}

# Of the slowest drive's rates, for the axes of programs, which must bind nothing: the planner keeps the joints within
# theirs. Beside the pole C turns as fast as one likes, though no drive does.
_FACTOR = {"mm": 100.0, "rad": 1e6}


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
    """Choose speed and acceleration of the axes of a unit in programs; mm, rad and s."""
    speed, acceleration = find_slowest_drive(machine, unit)
    return _FACTOR[unit] * speed, _FACTOR[unit] * acceleration
