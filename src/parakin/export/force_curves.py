"""The drives' forces and powers along a part as curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arguments import check_arguments
from .colours import FAINT, INK
from .figure_file import render_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..arrays import Array
    from ..toolpath.timing.drive_forces import DriveForces

_WIDTH, _ROW, _REST = 9.0, 1.9, 1.5  # inches
_STRETCHES = 2000  # along the time: of each the least and the greatest are drawn


@check_arguments
def render_drive_forces(result: DriveForces, suffix: str = ".png") -> bytes:
    """Render the forces of drives along their joints, N, their torques, Nm, and all powers, W, over the time.

    result : of :func:`parakin.compute_drive_forces`
    suffix : of the file, ``.png``, ``.pdf`` or ``.svg``
    """
    machine = result.trajectory.posted.machine
    panels = [("power [W]", dict(enumerate(result.powers.T)))]
    for unit, label, scale in (("rad", "torque [Nm]", 1e-3), ("mm", "force [N]", 1.0)):
        own = {i: scale * result.forces[:, i] for i, its in enumerate(machine.joint_units) if its == unit}
        if own:
            panels.insert(0, (label, own))
    height = _ROW * len(panels) + _REST

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        figure.subplots_adjust(left=0.1, right=0.86, top=1.0 - 0.65 / height, bottom=0.55 / height, hspace=0.15)
        for axes, (label, curves) in zip(rows, panels, strict=True):
            _draw_panel(axes, result.times, {machine.joints[i]: (f"C{i}", curve) for i, curve in curves.items()})
            axes.set_ylabel(label, color=INK, fontsize=9)
        rows[-1].set_xlabel("time [s]", color=INK, fontsize=9)

    def add_heading(figure: Figure) -> None:
        source = result.trajectory.posted.path.source.rsplit("/", 1)[-1]
        title = f"{machine.name}: what {source} asks of the drives"
        figure.text(0.03, 1.0 - 0.35 / height, title, color=INK, fontsize=13, weight="bold", parse_math=False)

    return render_figure((_WIDTH, height), draw, add_heading, suffix)


def _draw_panel(axes: Axes, times: Array, curves: dict[str, tuple[str, Array]]) -> None:
    """Draw curves with their colours, by their names."""
    edges = np.unique(np.linspace(0, len(times), min(_STRETCHES, len(times)) + 1).astype(np.int64))[:-1]
    for name, (colour, values) in curves.items():
        low, high = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
        line = np.column_stack([low, high]).ravel()
        axes.plot(np.repeat(times[edges], 2), line, color=colour, linewidth=0.8, label=name)
    axes.grid(color=FAINT, linewidth=0.6)
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
