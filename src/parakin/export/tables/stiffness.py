"""The tool's stiffness and deflection at poses of a file, as CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...units import name_display_unit, to_display
from ..number_format import format_fixed

if TYPE_CHECKING:
    from ...arrays import Array, Indices
    from ...stiffness.stiffness import Stiffness


def format_stiffness_csv(stiffness: Stiffness, force: Array | None, lines: Indices) -> str:
    """Format the pose, its line, the least stiffness in N/mm, and the tip's deflection in mm of each row."""
    machine = stiffness.machine
    units = zip(machine.axes, machine.axis_units, strict=True)
    head = ["line", *(f"{axis} [{name_display_unit(unit)}]" for axis, unit in units), "least [N/mm]"]
    poses = [
        [to_display(value, unit) for value, unit in zip(row, machine.axis_units, strict=True)]
        for row in stiffness.poses.tolist()
    ]
    columns = [np.array(poses), stiffness.least[:, None]]
    if force is not None:
        head += [f"d{axis} [mm]" for axis in stiffness.translations]
        columns.append(stiffness.deflect(force)[:, : len(stiffness.translations)])
    rows = np.hstack(columns).tolist()
    cells = (
        [str(line), *(format_fixed(value, 6, "") for value in row)]
        for line, row in zip(lines.tolist(), rows, strict=True)
    )
    return "\n".join([",".join(head), *(",".join(row) for row in cells)]) + "\n"
