"""The drives' forces along a part as an object for JSON, ``parakin.forces/1``."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...toolpath.timing.drive_forces import DriveForces


def encode_drive_forces(result: DriveForces, files: Mapping[str, str]) -> dict[str, Any]:
    """Encode each drive's peak and rms in N or Nm, its greatest power in W, and the masses in kg."""
    machine = result.trajectory.posted.machine
    joints = {}
    for i, drive in enumerate(machine.drives):
        scale = 1e-3 if drive.unit == "rad" else 1.0
        joints[drive.name] = {
            "unit": "Nm" if drive.unit == "rad" else "N",
            "peak": scale * float(result.peaks[i]),
            "rms": scale * float(result.rms[i]),
            "peak_power": float(result.peak_powers[i]),
            "peak_at": result.describe_peak(i),
            "force_limit": scale * drive.force if isfinite(drive.force) else None,
            "rated": scale * drive.rated if isfinite(drive.rated) else None,
            "power_limit": 1e-3 * drive.power if isfinite(drive.power) else None,
        }
    return {
        "schema": "parakin.forces/1",
        "machine": machine.name,
        "part": result.trajectory.posted.path.source,
        "seconds": result.trajectory.seconds,
        "force": dict(zip(result.force_axes, result.force.tolist(), strict=True)),
        "joints": joints,
        "overloaded": list(result.overloaded),
        "masses": dict(result.masses),
        "files": dict(files),
    }
