"""Triangles in pixels: which of them is in front at each pixel, by a depth buffer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import Array, Indices

_AT_ONCE = 4_000_000  # pixels of triangles' boxes


class FrontFaces(NamedTuple):
    """What is in front at the pixels that any triangle covers.

    row, column : (P,) of the pixel
    face : (P,) index of the triangle
    depth : (P,)
    weights : (P, 3) of the triangle's corners at the pixel's middle
    """

    row: Indices
    column: Indices
    face: Indices
    depth: Array
    weights: Array


def find_front_faces(corners: Array, width: int, height: int) -> FrontFaces:
    """Find the triangle in front at each pixel of a window.

    corners : (F, 3, 3) x and y in pixels, the middle of the first at 0.5, and a depth that grows away from the viewer
    """
    planes = _solve_planes(corners)
    depth, face = np.full(width * height, np.inf), np.full(width * height, -1)
    for number, column, row in _list_pixels(corners, width, height):
        at = _evaluate_planes(planes[number], column, row)
        within = (at[:, :2] >= 0.0).all(1) & (at[:, 0] + at[:, 1] <= 1.0)
        pixel, number, z = (row * width + column)[within], number[within], at[within, 2]
        np.minimum.at(depth, pixel, z)
        nearest = z <= depth[pixel]
        face[pixel[nearest]] = number[nearest]
    covered = np.flatnonzero(face >= 0)
    row, column = np.divmod(covered, width)
    at = _evaluate_planes(planes[face[covered]], column, row)
    weights = np.column_stack([1.0 - at[:, 0] - at[:, 1], at[:, :2]])
    return FrontFaces(row, column, face[covered], depth[covered], weights)


def _solve_planes(corners: Array) -> Array:
    """Solve for the planes over the window of the second and third corner's weight and of the depth, (F, 3, 3)."""
    (x, y, z), (a, b, c), (u, v, w) = corners[:, 0].T, *(corners[:, 1:] - corners[:, :1]).transpose(1, 2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):  # a triangle on its edge covers nothing: not finite
        double = a * v - b * u
        second = np.array([v, -u, u * y - v * x]) / double
        third = np.array([-b, a, b * x - a * y]) / double
        depth = second * c + third * w
        depth[2] += z
    planes: Array = np.array([second, third, depth]).transpose(2, 0, 1)
    return planes


def _evaluate_planes(planes: Array, column: Indices, row: Indices) -> Array:
    with np.errstate(invalid="ignore"):
        values: Array = planes[:, :, 0] * (column + 0.5)[:, None] + planes[:, :, 1] * (row + 0.5)[:, None]
        return values + planes[:, :, 2]


def _list_pixels(corners: Array, width: int, height: int) -> Iterator[tuple[Indices, Indices, Indices]]:
    """Yield the pixels of the triangles' boxes, some millions at a time: triangle, column and row of each."""
    most = np.array([width, height]) - 1
    first = np.clip(np.ceil(corners[:, :, :2].min(1) - 0.5), 0, most + 1).astype(np.int64)
    last = np.clip(np.floor(corners[:, :, :2].max(1) - 0.5), -1, most).astype(np.int64)
    spans = np.maximum(last - first + 1, 0)
    counts = spans.prod(1)
    ends = np.cumsum(counts)
    begin = 0
    while begin < len(counts):
        before = ends[begin] - counts[begin]
        stop = max(begin + 1, int(np.searchsorted(ends, before + _AT_ONCE, side="right")))
        number = np.repeat(np.arange(begin, stop), counts[begin:stop])
        place = np.arange(len(number)) - np.repeat(ends[begin:stop] - counts[begin:stop] - before, counts[begin:stop])
        down, across = np.divmod(place, spans[number, 0])
        yield number, first[number, 0] + across, first[number, 1] + down
        begin = stop
