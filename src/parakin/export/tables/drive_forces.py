"""The drives' forces and powers along a part, as CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..number_format import format_fixed

if TYPE_CHECKING:
    from ...toolpath.timing.drive_forces import DriveForces


def format_drive_forces_csv(result: DriveForces) -> str:
    """Format time, forces (N, Nm) and powers (W) at every state; accelerations may step where two have one time."""
    machine = result.trajectory.posted.machine
    units = [("Nm", 1e-3) if unit == "rad" else ("N", 1.0) for unit in machine.joint_units]
    names = zip(machine.joints, units, strict=True)
    head = ["time [s]", *(f"{joint} [{unit}]" for joint, (unit, _) in names), *(f"{j} [W]" for j in machine.joints)]
    forces = result.forces * np.array([scale for _, scale in units])
    rows = np.column_stack([result.times, forces, result.powers]).tolist()
    return "\n".join([",".join(head), *(",".join(format_fixed(value, 6, "") for value in row) for row in rows)]) + "\n"
