"""Maps of performance: a PNG of a slice's numbers, and a CSV of all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..performance.atlas import PerformanceMap
from ..performance.singularities import PARALLEL
from .machine.figures import FAINT, INK
from .workspace.summary import asked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

_GREY, _OUTLINE = "#607d8b", "#37474f"
_LEVELS = 24
_SHARE = 98.0  # percent of the places that the colours tell apart: a singularity's numbers have no end


@dataclass(frozen=True, eq=False)
class _Panel:
    title: str
    values: Floats
    colours: str
    endless: bool = False  # it grows without end near a singularity: the greatest values are not told apart


def maps_png(found: PerformanceMap, marks: Floats) -> bytes:
    """A PNG of a map over one or two axes: condition number, greatest and least amplification, parallel margin.

    ``marks`` (k, axes) are poses to mark by a cross. Outside the region's outline nothing is drawn.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, 9.2), dpi=150, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2)
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.06, top=0.86, hspace=0.24, wspace=0.16)
    for axes, panel in zip(panels.flat, _panels(found), strict=True):
        axes.set_title(panel.title, color=INK, fontsize=11, loc="left")
        axes.tick_params(labelsize=8, colors=_GREY)
        axes.grid(color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.set_xlabel(f"{found.axes[0]} [mm]", color=_GREY, fontsize=9)
        if len(found.axes) == 1:
            values = np.where(found.allowed & np.isfinite(panel.values), panel.values, np.nan)
            axes.plot(found.grid[0], values, color="#1565c0")
            continue
        axes.set_ylabel(f"{found.axes[1]} [mm]", color=_GREY, fontsize=9)
        _drawn(figure, axes, found, panel)
        columns = [found.region.machine.axes.index(axis) for axis in found.axes]
        axes.plot(*marks[:, columns].T, "+", color="#d50000", markersize=9, markeredgewidth=1.6, linestyle="none")
    machine = found.region.machine
    figure.text(
        0.03, 0.955, machine.spec.title or machine.name, color=INK, fontsize=15, weight="bold", parse_math=False
    )
    what = f"{machine.name}: performance, {asked(found.region)}"
    if found.performance.length.value is not None:
        what += f"; characteristic length {found.performance.length.value:.6g} mm"
    figure.text(0.03, 0.92, what, color=_GREY, fontsize=10.5, parse_math=False)
    data = BytesIO()
    canvas.print_png(data)  # type: ignore[no-untyped-call]
    return data.getvalue()


def _panels(found: PerformanceMap) -> list[_Panel]:
    told = found.performance
    margin = told.margins[..., told.margin_names.index(PARALLEL)]
    return [
        _Panel("condition number", told.condition, "viridis_r", endless=True),
        _Panel("greatest amplification", told.greatest, "viridis_r", endless=True),
        _Panel("least amplification", told.least, "viridis"),
        _Panel("parallel margin", margin, "viridis"),
    ]


def _drawn(figure: Figure, axes: Any, found: PerformanceMap, panel: _Panel) -> None:
    from matplotlib.colors import TwoSlopeNorm

    x, y = found.grid
    inside = panel.values[found.allowed & np.isfinite(panel.values)]
    axes.set_aspect("equal")
    if len(x) < 2 or len(y) < 2 or not len(inside):
        return
    low, high = float(inside.min()), float(np.percentile(inside, _SHARE) if panel.endless else inside.max())
    if not high > low:
        low, high = low - 0.5 * abs(low) - 1e-6, high + 0.5 * abs(high) + 1e-6
    crossed = low < 0.0 < high
    colours: dict[str, Any] = {"cmap": panel.colours}
    if crossed:
        colours = {"cmap": "RdYlGn", "norm": TwoSlopeNorm(0.0, low, high)}
    levels = np.linspace(low, high, _LEVELS + 1)
    values = np.ma.masked_invalid(np.where(np.isinf(panel.values), high, panel.values).T)
    filled = axes.contourf(x, y, values, levels=levels, extend="max" if panel.endless else "neither", **colours)
    room = np.nan_to_num(found.slack, nan=-1.0).T
    if room.min() < 0.0:
        axes.contourf(x, y, room, levels=[room.min() - 1.0, 0.0], colors="white")
        axes.contour(x, y, room, levels=[0.0], colors=_OUTLINE, linewidths=1.2)
    if crossed:
        axes.contour(x, y, np.ma.masked_where(room < 0.0, values), levels=[0.0], colors="#b71c1c", linewidths=1.2)
    bar = figure.colorbar(filled, ax=axes, shrink=0.9, pad=0.02)
    bar.ax.tick_params(labelsize=8, colors=_GREY)


def maps_csv(maps: Sequence[PerformanceMap]) -> Callable[[BinaryIO], None]:
    """What writes all places of the maps that can be reached: pose (mm, degrees), whether allowed, all numbers."""

    def write(file: BinaryIO) -> None:
        machine = maps[0].region.machine
        units = ["deg" if unit == "rad" else "mm" for unit in machine.axis_units]
        head = [f"{axis} [{unit}]" for axis, unit in zip(machine.axes, units, strict=True)]
        head += ["allowed", "condition number", "greatest psi", "least psi", "manipulability"]
        names = maps[0].performance.margin_names
        file.write((",".join([*head, *names]) + "\n").encode())
        factors = np.where(np.array(units) == "deg", np.degrees(1.0), 1.0)
        for found in maps:
            for line in _lines(found, factors):
                file.write(line.encode())

    return write


def _lines(found: PerformanceMap, factors: Floats) -> Iterator[str]:
    told, n = found.performance, len(factors)
    columns = [told.poses * factors, found.allowed[..., None]]
    columns += [getattr(told, name)[..., None] for name in ("condition", "greatest", "least", "manipulability")]
    columns.append(told.margins)
    for part in zip(*(column.reshape(-1, 1, column.shape[-1]) for column in columns), strict=True):
        row = np.concatenate(part, 1)[0].tolist()
        if row[n + 2] == row[n + 2]:
            yield ",".join(f"{value + 0.0:.9g}" for value in row) + "\n"
