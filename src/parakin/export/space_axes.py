"""Axes in space: their look, and a zoom at which all of them fits their room of a figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from ..arrays import Array
from .shaded_bodies import project

GREY = "#607d8b"
Room = tuple[float, float, float, float]  # left, bottom, right, top in fractions of a figure

_MOVE, _FARTHEST = 3.0, 25.0  # points, by which a name moves off the numbers at a time, and in all
_ROUNDS = 3  # names and numbers keep their size, so one round does not fit all


def add_space_axes(figure: Any, middle: Array, half: Array, names: Sequence[str]) -> Any:
    """Add axes in space to a figure, as :func:`set_space_axes` sets them."""
    from mpl_toolkits import mplot3d  # noqa: F401  it brings the projection

    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
    set_space_axes(axes, middle, half, names)
    return axes


def set_space_axes(axes: Any, middle: Array, half: Array, names: Sequence[str]) -> None:
    """Set equal scales over a box of half the edges ``half`` (3,) about ``middle`` (3,), mm, names and look."""
    for letter, name, m, h in zip("xyz", names, middle, half, strict=True):
        getattr(axes, f"set_{letter}lim")(m - h, m + h)
        axis = getattr(axes, f"{letter}axis")
        axis.set_pane_color((0.975, 0.98, 0.985, 1.0))
        axis._axinfo["grid"].update(color="#dfe5ea", linewidth=0.6)
        axis.line.set_color("#b0bec5")
        getattr(axes, f"set_{letter}label")(f"{name} [mm]", color=GREY, fontsize=9, labelpad=7)
    axes.set_box_aspect(half)
    axes.tick_params(labelsize=8, colors=GREY)
    axes.zaxis.set_tick_params(pad=6)  # clear of the ticks, which stand slanted
    set_tick_counts(axes, 5)


def set_tick_counts(axes: Any, most: int) -> None:
    """Give the longest axis with numbers about so many, the others as many as have room beside each other."""
    lengths = {letter: abs(float(np.ptp(getattr(axes, f"get_{letter}lim")()))) for letter in "xyz"}
    longest = max(lengths.values())
    for letter, length in lengths.items():
        if not len(getattr(axes, f"{letter}axis").get_ticklocs()):
            continue
        axes.locator_params(axis=letter, nbins=math.ceil(most * length / longest), min_n_ticks=1)


def fit_to_room(axes: Any, half: Array, room: Room) -> None:
    """Fit axes to their room, names and numbers within, by zoom and place; before bodies are added."""
    zoom, low, high = 1.0, np.array(room[:2]), np.array(room[2:])
    for _ in range(_ROUNDS):
        _clear_names(axes)
        first, last = _measure(axes)
        zoom *= float(np.min((high - low) / (last - first)))
        axes.set_box_aspect(half, zoom=zoom)
        first, last = _measure(axes)
        place = axes.get_position()
        axes.set_position((*(place.min + 0.5 * (low + high - first - last)), *place.size))


def _clear_names(axes: Any) -> None:
    """Move the axes' names outward until each is clear of its axis' numbers."""
    near = [axes.xaxis, axes.yaxis, axes.zaxis]
    while near:
        axes.figure.draw_without_rendering()
        near = [axis for axis in near if axis.labelpad + _MOVE <= _FARTHEST and _crosses_numbers(axis)]
        for axis in near:
            axis.labelpad += _MOVE


def _crosses_numbers(axis: Any) -> bool:
    name = axis.label.get_window_extent()
    return any(name.overlaps(tick.label1.get_window_extent()) for tick in axis.get_major_ticks() if tick.get_visible())


def _measure(axes: Any) -> tuple[Array, Array]:
    """Measure what is drawn of axes and their names: two corners, in fractions of the figure."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.transforms import Bbox

    figure: Any = axes.figure
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    figure.draw_without_rendering()
    limits = [getattr(axes, f"get_{letter}lim")() for letter in "xyz"]
    corners = project(axes, np.array(list(product(*limits))))[:, :2]
    drawn = [axis.get_tightbbox(renderer) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    box = Bbox.union([Bbox([corners.min(0), corners.max(0)]), *(axis for axis in drawn if axis is not None)])
    size = figure.bbox.size
    return box.min / size, box.max / size
