"""Labels beside bodies: each as near its point as there is room, off the bodies and off each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array, Flags
from ..rasterising import find_front_faces
from ..shaded_bodies import ShadedBody, project

_CELL = 2.0  # dots of a figure that are one of the map of what is covered
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)  # around the point, the right side first
_DISTANCES = np.array([1.0, 1.4, 1.9, 2.5, 3.2, 4.0, 5.0])  # of the text's nearest edge, in heights of half a line
_COVERING = 1000.0  # heights that a label would go farther for not lying on anything at all
_GAP = 2.0  # dots around a label


class BodyLabel(NamedTuple):
    """A text beside a point (3,) mm, in points, red, green and blue by matplotlib's names."""

    text: str
    point: Array
    colour: str
    size: float


def add_labels(axes: Any, labels: Sequence[BodyLabel], bodies: Sequence[ShadedBody], lines: Sequence[Array]) -> None:
    """Add labels to axes in space, off ``bodies`` and off ``lines``, (2, 3) mm each."""
    from matplotlib.artist import Artist
    from matplotlib.transforms import IdentityTransform

    texts = [
        axes.text2D(0.0, 0.0, label.text, transform=IdentityTransform(), color=label.colour, fontsize=label.size,
                    ha="center", va="center", zorder=1000, parse_math=False)
        for label in labels
    ]  # fmt: skip

    class LabelPlacing(Artist):
        """Places the texts before they are drawn, for only then their sizes are known."""

        def draw(self, renderer: Any) -> None:
            covered = _map_cover(axes, bodies, lines)
            points = project(axes, np.array([label.point for label in labels]))[:, :2]
            for text, point in zip(texts, points, strict=True):
                box = text.get_window_extent(renderer)
                text.set_position(_find_place(covered, point, np.array([box.width, box.height])))

    placing = LabelPlacing()
    placing.set_zorder(-1.0)
    placing.set_in_layout(False)
    axes.add_artist(placing)


def _map_cover(axes: Any, bodies: Sequence[ShadedBody], lines: Sequence[Array]) -> Flags:
    """Map what bodies and lines cover of the figure, a cell for some dots."""
    width, height = np.ceil(axes.figure.bbox.size / _CELL).astype(int).tolist()
    corners = np.concatenate([body.corners for body in bodies])
    screen = project(axes, corners.reshape(-1, 3)).reshape(-1, 3, 3) / [_CELL, _CELL, 1.0]
    front = find_front_faces(screen, width, height)
    covered = np.zeros((height, width), np.bool_)
    covered[front.row, front.column] = True
    steps = np.linspace(0.0, 1.0, 200)[:, None]
    for line in lines:
        column, row = (project(axes, line[0] + steps * (line[1] - line[0]))[:, :2] / _CELL).astype(int).T
        kept = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        covered[row[kept], column[kept]] = True
    return covered


def _find_place(covered: Flags, point: Array, size: Array) -> Array:
    """Find the middle of a text's box beside a point, in dots, and take it."""
    half, line = 0.5 * size + _GAP, 0.5 * size[1]
    away = np.array([np.cos(_ANGLES), np.sin(_ANGLES)]).T
    # How far the box's edge is from its middle along each way.
    reach = np.min(half / np.maximum(np.abs(away), 1e-9), axis=1)
    distances = reach[:, None] + (_DISTANCES - 1.0) * line
    places = (point + distances[:, :, None] * away[:, None]).reshape(-1, 2)
    sums = np.pad(covered, ((1, 0), (1, 0))).astype(np.int64).cumsum(0).cumsum(1)
    most = np.array(covered.shape[::-1])
    low = np.clip(np.floor((places - half) / _CELL).astype(int), 0, most)
    high = np.clip(np.ceil((places + half) / _CELL).astype(int), 0, most)
    under = sums[high[:, 1], high[:, 0]] - sums[low[:, 1], high[:, 0]] - sums[high[:, 1], low[:, 0]]
    under = under + sums[low[:, 1], low[:, 0]]
    whole = np.prod(size / _CELL)
    outside = whole - np.minimum(np.prod(high - low, axis=1), whole)
    cost = np.tile(_DISTANCES, len(away)) + _COVERING * (under + outside) / whole
    best = int(cost.argmin())
    covered[low[best, 1] : high[best, 1], low[best, 0] : high[best, 0]] = True
    place: Array = places[best]
    return place
