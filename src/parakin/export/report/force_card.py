"""The report's card of what the part asks of the drives: a table, and each drive's force over the cycle."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..colours import BLUE
from ..number_format import format_use
from .cards import make_card
from .figures import PlotTrace, embed_figure, round_numbers
from .joint_curves import pick_extremes
from .panels import Panel, stack_panels

if TYPE_CHECKING:
    from ...toolpath.timing.drive_forces import DriveForces

_POINTS = 3000  # a curve


def render_force_card(forces: DriveForces) -> str:
    """Render peak, rms and peak power of each drive against what its file says, and the forces over the time."""
    drives = forces.trajectory.posted.machine.drives
    rows, panels = [], []
    for i, drive in enumerate(drives):
        scale, unit = (1e-3, "Nm") if drive.unit == "rad" else (1.0, "N")
        used = [
            format_use(scale * float(forces.peaks[i]), scale * drive.force, unit),
            format_use(scale * float(forces.rms[i]), scale * drive.rated, unit),
            format_use(float(forces.peak_powers[i]), 1e-3 * drive.power, "W"),
        ]
        cells = "".join(f"<td class=n>{cell}</td>" for cell in used)
        rows.append(f"<tr><td>{escape(drive.name)}</td>{cells}<td>{escape(forces.describe_peak(i))}</td></tr>\n")
        values = scale * forces.forces[:, i]
        kept = pick_extremes(values, _POINTS)
        line: PlotTrace = {"type": "scatter", "mode": "lines", "line": {"color": BLUE, "width": 1.2}}
        line |= {"x": round_numbers(forces.times[kept]), "y": round_numbers(values[kept], 2)}
        low, high = float(np.min(values)), float(np.max(values))
        room = 0.08 * (high - low) or 1.0
        bounds = [-scale * drive.force, scale * drive.force]
        panels.append([Panel(f"{escape(drive.name)} <b>[{unit}]</b>", [line], [low - room, high + room], bounds)])
    head = "<tr><th>Drive</th><th class=n>Peak</th><th class=n>rms</th><th class=n>Peak power</th><th>Peak at</th></tr>"
    figure, height = stack_panels(panels, "time, s")
    body = (
        f"<div class=wide><table>{head}{''.join(rows)}</table></div>"
        f"<h3>Over the cycle</h3><div class=wide>{embed_figure('forces', figure, f'{height}px')}</div>"
    )
    acting = ", ".join(
        f"{axis} {value:g} N" for axis, value in zip(forces.force_axes, forces.force.tolist(), strict=True) if value
    )
    said = f"with a force of {acting} on the tip where it cuts" if acting else "without a force on the tool"
    return make_card("Forces of the drives", body, f"Weight and inertia of all that moves, {said}; without friction.")
