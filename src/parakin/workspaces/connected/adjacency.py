"""Adjacency of the cells of a subdivision, and the components that adjacent cells form."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, Indices
from ...errors import PoseError

MOST = 1 << 26  # greatest number of finest cells in the box that holds all cells


def find_adjacent_cells(low: Array, size: Array) -> tuple[Indices, Indices]:
    """Find pairs (m, 2) of cells that share a face, and pairs that share at least a point.

    The cells are painted into an image of the finest ones, whose shifts by one are compared.

    low, size : (N, d) mm, of cells that are parts of one grid, halved any number of times

    Raises :class:`PoseError` where the finest ones are too many for the image.
    """
    image = _paint_cells(low, size)
    d = image.ndim
    steps = [step for step in product((-1, 0, 1), repeat=d) if step > (0,) * d]
    keys: dict[bool, list[Indices]] = {True: [], False: []}
    for step in steps:
        one = image[tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, image.shape, strict=True))]
        other = image[tuple(slice(max(0, s), n - max(0, -s)) for s, n in zip(step, image.shape, strict=True))]
        differ = (one != other) & (one >= 0) & (other >= 0)
        a, b = one[differ].astype(np.int64), other[differ].astype(np.int64)
        keys[sum(map(abs, step)) == 1].append(np.unique(np.minimum(a, b) * len(low) + np.maximum(a, b)))
    faces, points = np.concatenate(keys[True]), np.concatenate([*keys[True], *keys[False]])
    return _split_keys(faces, len(low)), _split_keys(points, len(low))


def refuse_too_many_cells(counts: NDArray[Any], cell: float) -> None:
    """Raise :class:`PoseError` for a box of too many cells along its edges, each of the size ``cell``, mm."""
    if counts.prod() > MOST:
        raise PoseError(f"cell: {cell:g} mm is too fine here, {MOST:,} cells at most fill the region's box")


def _split_keys(key: Indices, count: int) -> Indices:
    return np.column_stack([key // max(count, 1), key % max(count, 1)])


def _paint_cells(low: Array, size: Array) -> NDArray[np.int32]:
    """Write the number of the cell that covers each cell of the finest grid; -1 for none."""
    d = low.shape[1]
    if not len(low):
        return np.full((1,) * d, -1, np.int32)
    finest = size.min(0)
    first = np.rint((low - low.min(0)) / finest).astype(np.int64)
    span = np.rint(size[:, 0] / finest[0]).astype(np.int64)
    shape = (first + span[:, None]).max(0)
    refuse_too_many_cells(shape, float(finest.max()))
    image = np.full(shape, -1, np.int32)
    for width in np.unique(span):
        own = np.flatnonzero(span == width)
        offsets = np.array(list(product(range(width), repeat=d)))
        index = first[own][:, None] + offsets
        image[tuple(np.moveaxis(index, -1, 0))] = own[:, None]
    return image


def label_components(count: int, pairs: Indices) -> Indices:
    """Label the connected components of a graph by passing on least indices: (count,) numbers from 0 on."""
    label = np.arange(count)
    while True:
        ends = np.sort(label[pairs], 1)
        if (ends[:, 0] == ends[:, 1]).all():
            return np.unique(label, return_inverse=True)[1].astype(np.int64)
        np.minimum.at(label, ends[:, 1], ends[:, 0])
        while (label[label] != label).any():
            label = label[label]
