"""A map of a number over two translations of a machine, all else as at home."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..arrays import make_lattice
from ..errors import PoseError
from ..performance.extremes import compute_slack
from ..workspaces.certified.region import make_region
from .colours import FAINT, INK
from .figure_file import render_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import Figure

    from ..arrays import Array, Flags
    from ..machine import Machine
    from ..workspaces.certified.region import Region

_CELLS = 120
_INCHES = (7.2, 6.0)
_OUTLINED = 600  # places along a side by which the outline is drawn, unless the map itself has more
LEVELS = 24  # areas between the ends of a scale
_NUMBERS = 12.0  # of a scale, one above the other, in as much as a printed map is wide
_BORDER = 0.05  # of what is allowed, beside it
_ROUNDING = 1e-12
_OUTLINE = "#37474f"
COLOURED = 98.0  # percent of the positions that have colours of their own: near a singularity numbers grow without end


class MapText(NamedTuple):
    """What a map says.

    colours : name of matplotlib's colour map
    """

    title: str
    subtitle: str
    label: str
    colours: str


def render_position_map(
    machine: Machine, around: Array, compute: Callable[[Array], Array], text: MapText, suffix: str
) -> bytes:
    """Render a number over the first two translations as a picture of a kind, by its file's suffix.

    around : (N, axes) poses that tell how far the map goes
    compute : from poses (n, axes) inside all limits to numbers (n,)

    Raises :class:`PoseError` for a machine of fewer translations.
    """
    shown = [axis for axis in machine.axes if axis in "XYZ"][:2]
    if len(shown) < 2:
        raise PoseError(f"{machine.name}: a map needs two translations")
    columns = [machine.axes.index(axis) for axis in shown]
    low, high = around[:, columns].min(0), around[:, columns].max(0)
    margin = 0.1 * (high - low)
    grid = [np.linspace(a, b, _CELLS) for a, b in zip(low - margin, high + margin, strict=True)]
    positions = make_lattice(grid)
    home = zip(machine.axes, machine.home.tolist(), strict=True)
    region = make_region(machine, at={axis: value for axis, value in home if axis not in shown})
    room = compute_slack(region, positions).reshape(_CELLS, _CELLS)
    values = np.full(room.shape, np.nan)
    values[room >= 0.0] = compute(region.poses(positions[room.ravel() >= 0.0]))

    def draw(figure: Figure) -> None:
        axes = figure.add_axes((0.12, 0.11, 0.72, 0.74))
        axes.set_aspect("equal")
        axes.grid(color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.set_xlabel(f"{shown[0]} [mm]", color=INK, fontsize=9)
        axes.set_ylabel(f"{shown[1]} [mm]", color=INK, fontsize=9)
        known = values[np.isfinite(values)]
        if not len(known):
            return
        fit_to_allowed(axes, grid, room >= 0.0)
        levels = np.linspace(*separate_ends(float(known.min()), float(np.percentile(known, COLOURED))), LEVELS + 1)
        filled = fill_map(axes, grid, values, region, levels, "max", cmap=text.colours)
        bar = figure.colorbar(filled, cax=axes.inset_axes((1.04, 0.0, 0.045, 1.0)))
        set_bar_ticks(bar, axes, levels)
        axes.set_title(text.label, color=INK, fontsize=9, loc="left")  # beside a flat map's scale there is no room

    def add_heading(figure: Figure) -> None:
        figure.text(0.03, 0.945, text.title, color=INK, fontsize=13, weight="bold", parse_math=False)
        figure.text(0.03, 0.905, f"{text.subtitle}; all else as at home", color=INK, fontsize=9, parse_math=False)

    return render_figure(_INCHES, draw, add_heading, suffix)


def separate_ends(low: float, high: float) -> tuple[float, float]:
    """Give a map's levels ends that differ, also where all values are one."""
    if high > low:
        return low, high
    return low - 0.5 * abs(low) - 1e-6, high + 0.5 * abs(high) + 1e-6


def fit_to_allowed(axes: Axes, grid: Sequence[Array], allowed: Flags) -> None:
    """Fit the ends of a map's axes to what is allowed, (x, y), with a border."""
    for set_ends, line, across in ((axes.set_xlim, grid[0], 1), (axes.set_ylim, grid[1], 0)):
        inside = line[allowed.any(across)]
        border = line[1] - line[0] + _BORDER * float(np.ptp(inside))
        set_ends(max(line[0], inside[0] - border), min(line[-1], inside[-1] + border))


def set_bar_ticks(bar: Colorbar, axes: Axes, levels: Array) -> None:
    """Set numbers beside as many of a scale's levels, evenly, as the height of its map has room for."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    room = _NUMBERS * (high - low) / (right - left)
    step = next((step for step in (4, 6, 8, 12) if LEVELS // step < room), LEVELS)
    ticks = levels[::step].tolist()
    bar.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks], minor=False)
    bar.minorticks_off()


def fill_map(
    axes: Axes, grid: Sequence[Array], values: Array, region: Region, levels: Array, extend: str, **colours: Any
) -> QuadContourSet:
    """Fill the areas between levels of values (x, y) inside a region, and draw its outline.

    NaN is where they are not known; values beyond the ends of the levels have the ends' colours.
    """
    known = np.where(np.isfinite(values), values, extend_grid(values))
    shown = np.ma.masked_invalid(np.clip(known, levels[0], levels[-1]).T)
    filled = axes.contourf(*grid, shown, levels=levels, extend=extend, **colours)
    (x, y), room = _compute_room(region, grid)
    if room.min() < 0.0:
        axes.contourf(x, y, room, levels=[room.min() - 1.0, 0.0], colors="white")
        axes.contour(x, y, room, levels=[0.0], colors=_OUTLINE, linewidths=1.2)
    return filled


def _compute_room(region: Region, grid: Sequence[Array]) -> tuple[list[Array], Array]:
    """Compute where there is room, (y, x), on a finer grid: where legs end to close it jumps, and the outline too."""
    finer = max(1, _OUTLINED // max(map(len, grid)))
    lines = [np.linspace(line[0], line[-1], finer * (len(line) - 1) + 1) for line in grid]
    slack = compute_slack(region, make_lattice(lines))
    room = slack.reshape(len(lines[0]), -1)
    outside = np.fmin(extend_grid(room), -_ROUNDING)  # where no leg closes
    return lines, np.nan_to_num(np.where(np.isfinite(room), room, outside), nan=-1.0).T


def extend_grid(values: Array) -> Array:
    """Extend values (x, y) by two places beyond those that are known, evenly along the axes: the mean of all ways.

    NaN farther away. A contour then ends where the values lead, and not at the last place that is known.
    """
    for _ in range(2):
        padded = np.pad(values, 2, constant_values=np.nan)
        ways = []
        for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
            near, far = (np.roll(padded, way * places, axis)[2:-2, 2:-2] for places in (1, 2))
            ways.append(2.0 * near - far)
        count = np.isfinite(ways).sum(0)
        mean = np.where(np.isfinite(ways), ways, 0.0).sum(0) / np.maximum(count, 1)
        values = np.where(np.isnan(values) & (count > 0), mean, values)
    return values
