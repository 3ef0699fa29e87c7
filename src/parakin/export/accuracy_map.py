"""A map of the tip's error over two axes of the workspace."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from ..errors import PoseError
from .machine.figures import FAINT, INK

if TYPE_CHECKING:
    from ..accuracy.accuracy import Accuracy

_CELLS = 120
_COLOURED = 98.0  # percent of the positions that have colours of their own: near a singularity errors grow without end


def render_accuracy_png(accuracy: Accuracy) -> bytes:
    """Render the tip's root mean square error over the first two translations, all else as at home.

    Raises :class:`PoseError` for a machine of fewer translations.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from ..accuracy.accuracy import analyse_accuracy

    machine = accuracy.machine
    columns = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"][:2]
    if len(columns) < 2:
        raise PoseError(f"{machine.name}: a map needs two translations")
    low, high = accuracy.poses[:, columns].min(0), accuracy.poses[:, columns].max(0)
    margin = 0.1 * (high - low)
    lines = [np.linspace(a, b, _CELLS) for a, b in zip(low - margin, high + margin, strict=True)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 2)
    poses = np.broadcast_to(machine.home, (len(grid), len(machine.axes))).copy()
    poses[:, columns] = grid
    allowed = machine.check(poses) == 0
    stated = [(t.name, f"{t.value!r} {t.unit}") for t in accuracy.tolerances.tolerances]
    values = np.full(len(grid), np.nan)
    values[allowed] = 1e3 * analyse_accuracy(machine, stated, poses[allowed]).deviations
    figure = Figure(figsize=(7.2, 6.0), dpi=150, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.12, 0.11, 0.82, 0.74))
    most = float(np.nanpercentile(values, _COLOURED)) if np.isfinite(values).any() else 1.0
    picture = axes.pcolormesh(
        *lines, values.reshape(_CELLS, _CELLS).T, cmap="viridis_r", shading="nearest", vmax=most, rasterized=True
    )
    figure.colorbar(picture, ax=axes).set_label("tip's error, root mean square [µm]", color=INK, fontsize=9)
    axes.set_aspect("equal")
    axes.grid(color=FAINT, linewidth=0.6)
    names = [machine.axes[i] for i in columns]
    axes.set_xlabel(f"{names[0]} [mm]", color=INK, fontsize=9)
    axes.set_ylabel(f"{names[1]} [mm]", color=INK, fontsize=9)
    figure.text(0.03, 0.945, f"{machine.name}: accuracy", color=INK, fontsize=13, weight="bold", parse_math=False)
    shown = ", ".join(f"{t.name} ±{t.value:.6g} {t.unit}" for t in accuracy.tolerances.tolerances)
    figure.text(0.03, 0.905, f"{shown}; all else as at home", color=INK, fontsize=9, parse_math=False)
    data = BytesIO()
    canvas.print_png(data)  # type: ignore[no-untyped-call]
    return data.getvalue()
