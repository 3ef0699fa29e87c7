"""Maps of performance: a picture of a slice's numbers, and a CSV of all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..arrays import Array, Writer
from ..performance.atlas import PerformanceMap
from ..performance.singularities import PARALLEL
from .colours import FAINT, INK
from .figure_file import render_figure
from .position_map import COLOURED, LEVELS, fill_map, fit_to_allowed, separate_ends, set_bar_ticks
from .workspace.describe import describe_region

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GREY = "#607d8b"


@dataclass(frozen=True, eq=False)
class _MapPanel:
    title: str
    values: Array
    colours: str
    endless: bool = False  # it grows without end near a singularity: on a log scale, the greatest values of one colour


def render_map(map_: PerformanceMap, marks: Array, suffix: str) -> bytes:
    """Render a map over one or two axes: condition number, greatest and least amplification, parallel margin.

    ``marks`` (k, axes) are poses to mark by a cross. Outside the region's outline nothing is drawn.
    """
    return render_figure(
        (10.4, 9.2), lambda figure: _draw_map(figure, map_, marks), lambda figure: _add_heading(figure, map_), suffix
    )


def _draw_map(figure: Figure, map_: PerformanceMap, marks: Array) -> None:
    panels = figure.subplots(2, 2)
    figure.subplots_adjust(left=0.08, right=0.90, bottom=0.06, top=0.86, hspace=0.28, wspace=0.48)
    for axes in panels.flat:
        axes.set_anchor("S" if axes in panels[0] else "N")  # a flat workspace leaves its room outside
    for axes, panel in zip(panels.flat, _list_panels(map_), strict=True):
        axes.set_title(panel.title, color=INK, fontsize=11, loc="left")
        axes.tick_params(labelsize=8, colors=_GREY)
        axes.grid(color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.locator_params(axis="x", nbins=6)
        axes.set_xlabel(f"{map_.axes[0]} [mm]", color=_GREY, fontsize=9)
        if len(map_.axes) == 1:
            values = np.where(map_.allowed & np.isfinite(panel.values), panel.values, np.nan)
            axes.plot(map_.grid[0], values, color="#1565c0")
            if panel.endless:
                axes.set_yscale("log")
            continue
        axes.set_ylabel(f"{map_.axes[1]} [mm]", color=_GREY, fontsize=9)
        _draw_panel(figure, axes, map_, panel)
        columns = [map_.region.machine.axes.index(axis) for axis in map_.axes]
        axes.plot(*marks[:, columns].T, "+", color="#d50000", markersize=9, markeredgewidth=1.6, linestyle="none")


def describe_map(map_: PerformanceMap) -> str:
    """Describe what a map shows, in a line: its machine, its slice, and the length by which angles count."""
    text = f"{map_.region.machine.name}: performance, {describe_region(map_.region)}"
    if map_.performance.length.value is not None:
        text += f"; characteristic length {map_.performance.length.value:.6g} mm"
    return text


def _add_heading(figure: Figure, map_: PerformanceMap) -> None:
    machine = map_.region.machine
    figure.text(
        0.03, 0.955, machine.spec.title or machine.name, color=INK, fontsize=15, weight="bold", parse_math=False
    )
    figure.text(0.03, 0.92, describe_map(map_), color=_GREY, fontsize=10.5, parse_math=False)


def _list_panels(map_: PerformanceMap) -> list[_MapPanel]:
    performance = map_.performance
    margin = performance.margins[..., performance.margin_names.index(PARALLEL)]
    return [
        _MapPanel("condition number", performance.condition, "viridis_r", endless=True),
        _MapPanel("greatest amplification", performance.greatest, "viridis_r", endless=True),
        _MapPanel("least amplification", performance.least, "viridis"),
        _MapPanel("parallel margin", margin, "viridis"),
    ]


def _draw_panel(figure: Figure, axes: Any, map_: PerformanceMap, panel: _MapPanel) -> None:
    from matplotlib.colors import LogNorm, TwoSlopeNorm

    x, y = map_.grid
    inside = panel.values[map_.allowed & np.isfinite(panel.values)]
    axes.set_aspect("equal")
    if len(x) < 2 or len(y) < 2 or not len(inside):
        return
    fit_to_allowed(axes, map_.grid, map_.allowed)
    highest = np.percentile(inside, COLOURED) if panel.endless else inside.max()
    low, high = separate_ends(float(inside.min()), float(highest))
    crossed = low < 0.0 < high
    colours: dict[str, Any] = {"cmap": panel.colours}
    levels = np.linspace(low, high, LEVELS + 1)
    if crossed:
        colours = {"cmap": "PuOr", "norm": TwoSlopeNorm(0.0, low, high)}
    elif panel.endless:
        colours["norm"], levels = LogNorm(low, high), np.geomspace(low, high, LEVELS + 1)
    known = np.where(np.isinf(panel.values), high, panel.values)
    filled = fill_map(axes, map_.grid, known, map_.region, levels, "max" if panel.endless else "neither", **colours)
    if crossed:
        axes.contour(x, y, np.where(map_.slack >= 0.0, known, np.nan).T, levels=[0.0], colors="#b71c1c", linewidths=1.2)
    bar = figure.colorbar(filled, cax=axes.inset_axes((1.03, 0.0, 0.045, 1.0)))
    set_bar_ticks(bar, axes, levels)
    bar.ax.tick_params(labelsize=8, colors=_GREY)


def make_map_csv(maps: Sequence[PerformanceMap]) -> Writer:
    """Make the writer of all reachable positions: pose (mm, degrees), whether it is allowed, and all numbers."""

    def write(file: BinaryIO) -> None:
        machine = maps[0].region.machine
        units = ["deg" if unit == "rad" else "mm" for unit in machine.axis_units]
        head = [f"{axis} [{unit}]" for axis, unit in zip(machine.axes, units, strict=True)]
        head += ["allowed", "condition number", "greatest psi", "least psi", "manipulability"]
        names = maps[0].performance.margin_names
        file.write((",".join([*head, *names]) + "\n").encode())
        factors = np.where(np.array(units) == "deg", np.degrees(1.0), 1.0)
        for map_ in maps:
            for line in _format_lines(map_, factors):
                file.write(line.encode())

    return write


def _format_lines(map_: PerformanceMap, factors: Array) -> Iterator[str]:
    performance, n = map_.performance, len(factors)
    columns = [performance.poses * factors, map_.allowed[..., None]]
    columns += [getattr(performance, name)[..., None] for name in ("condition", "greatest", "least", "manipulability")]
    columns.append(performance.margins)
    for columns_of_row in zip(*(column.reshape(-1, 1, column.shape[-1]) for column in columns), strict=True):
        row = np.concatenate(columns_of_row, 1)[0].tolist()
        if row[n + 2] == row[n + 2]:
            yield ",".join(f"{value + 0.0:.9g}" for value in row) + "\n"
