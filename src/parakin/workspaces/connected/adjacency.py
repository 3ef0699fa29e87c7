"""Which of the cells of a subdivision touch, and which of them hang together."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import PoseError

Indices = NDArray[np.int64]

MOST = 1 << 26  # of the finest cells, in all of the box that holds them


def touching(low: Array, size: Array) -> tuple[Indices, Indices]:
    """Pairs (m, 2) of cells that share a face, and of those that share at least a point.

    low, size : (N, d) of cells that are parts of one grid, halved any number of times

    Raises :class:`PoseError` where the finest ones are too many to be counted one by one.
    """
    image = _image(low, size)
    d = image.ndim
    steps = [step for step in product((-1, 0, 1), repeat=d) if step > (0,) * d]
    found: dict[bool, list[Indices]] = {True: [], False: []}
    for step in steps:
        one = image[tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, image.shape, strict=True))]
        other = image[tuple(slice(max(0, s), n - max(0, -s)) for s, n in zip(step, image.shape, strict=True))]
        which = (one != other) & (one >= 0) & (other >= 0)
        a, b = one[which].astype(np.int64), other[which].astype(np.int64)
        found[sum(map(abs, step)) == 1].append(np.unique(np.minimum(a, b) * len(low) + np.maximum(a, b)))
    faces, points = np.concatenate(found[True]), np.concatenate([*found[True], *found[False]])
    return _pairs(faces, len(low)), _pairs(points, len(low))


def not_too_many(counts: NDArray[Any], cell: float) -> None:
    """Refuses a box of so many cells along its edges, each of the size ``cell``, mm."""
    if counts.prod() > MOST:
        raise PoseError(f"cell: {cell:g} mm is too fine here, {MOST:,} cells at most fill the region's box")


def _pairs(key: Indices, count: int) -> Indices:
    return np.column_stack([key // max(count, 1), key % max(count, 1)])


def _image(low: Array, size: Array) -> NDArray[np.int32]:
    """The number of the cell that covers each place of the finest grid; -1 for none."""
    d = low.shape[1]
    if not len(low):
        return np.full((1,) * d, -1, np.int32)
    finest = size.min(0)
    first = np.rint((low - low.min(0)) / finest).astype(np.int64)
    span = np.rint(size[:, 0] / finest[0]).astype(np.int64)
    shape = (first + span[:, None]).max(0)
    not_too_many(shape, float(finest.max()))
    image = np.full(shape, -1, np.int32)
    for width in np.unique(span):
        own = np.flatnonzero(span == width)
        within = np.array(list(product(range(width), repeat=d)))
        at = first[own][:, None] + within
        image[tuple(np.moveaxis(at, -1, 0))] = own[:, None]
    return image


def labelled(count: int, pairs: Indices) -> Indices:
    """Numbers (count,) from 0 on, equal for all that pairs join, directly or not."""
    label = np.arange(count)
    while True:
        ends = np.sort(label[pairs], 1)
        if (ends[:, 0] == ends[:, 1]).all():
            return np.unique(label, return_inverse=True)[1].astype(np.int64)
        np.minimum.at(label, ends[:, 1], ends[:, 0])
        while (label[label] != label).any():
            label = label[label]
