"""A map of a number over two translations of a machine, all else as at home."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import PoseError
from .colours import FAINT, INK

if TYPE_CHECKING:
    from ..arrays import Array
    from ..machine import Machine

_CELLS = 120
_COLOURED = 98.0  # percent of the positions that have colours of their own: near a singularity numbers grow without end


class MapText(NamedTuple):
    """What a map says.

    colours : name of matplotlib's colour map
    """

    title: str
    subtitle: str
    label: str
    colours: str


def render_position_map(machine: Machine, around: Array, compute: Callable[[Array], Array], text: MapText) -> bytes:
    """Render a number over the first two translations as a PNG.

    around : (N, axes) poses that tell how far the map goes
    compute : from poses (n, axes) inside all limits to numbers (n,)

    Raises :class:`PoseError` for a machine of fewer translations.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"][:2]
    if len(columns) < 2:
        raise PoseError(f"{machine.name}: a map needs two translations")
    low, high = around[:, columns].min(0), around[:, columns].max(0)
    margin = 0.1 * (high - low)
    lines = [np.linspace(a, b, _CELLS) for a, b in zip(low - margin, high + margin, strict=True)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 2)
    poses = np.broadcast_to(machine.home, (len(grid), len(machine.axes))).copy()
    poses[:, columns] = grid
    allowed = machine.check(poses) == 0
    values = np.full(len(grid), np.nan)
    values[allowed] = compute(poses[allowed])
    figure = Figure(figsize=(7.2, 6.0), dpi=150, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.12, 0.11, 0.82, 0.74))
    most = float(np.nanpercentile(values, _COLOURED)) if np.isfinite(values).any() else 1.0
    picture = axes.pcolormesh(
        *lines, values.reshape(_CELLS, _CELLS).T, cmap=text.colours, shading="nearest", vmax=most, rasterized=True
    )
    figure.colorbar(picture, ax=axes).set_label(text.label, color=INK, fontsize=9)
    axes.set_aspect("equal")
    axes.grid(color=FAINT, linewidth=0.6)
    names = [machine.axes[i] for i in columns]
    axes.set_xlabel(f"{names[0]} [mm]", color=INK, fontsize=9)
    axes.set_ylabel(f"{names[1]} [mm]", color=INK, fontsize=9)
    figure.text(0.03, 0.945, text.title, color=INK, fontsize=13, weight="bold", parse_math=False)
    figure.text(0.03, 0.905, f"{text.subtitle}; all else as at home", color=INK, fontsize=9, parse_math=False)
    data = BytesIO()
    canvas.print_png(data)  # type: ignore[no-untyped-call]
    return data.getvalue()
