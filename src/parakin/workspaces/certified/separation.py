"""Separate the cells of a subdivision that no path joins to a position, on a coarse image of them."""

from __future__ import annotations

from itertools import product

import numpy as np

from ...arrays import Array, Flags, Indices
from .subdivision import Cells

_LONGEST = {1: 4096, 2: 512, 3: 64}  # voxels along the longest edge, by dimension


def find_joined_cells(cells: Cells, position: Array) -> Flags | None:
    """Find the cells (N,) that may hang together with the one at a position (d,); None where there is none.

    Cells are painted into an image of voxels, larger than the smallest of them, and the image is flooded from the
    position. Two cells that touch are joined, and some that nearly do: the others are proved to be apart.
    """
    if not len(cells.low):
        return None
    top = cells.low + cells.size
    if not ((cells.low <= position) & (position <= top)).all(1).any():
        return None
    d, origin = cells.low.shape[1], cells.low.min(0)
    voxel = float((top.max(0) - origin).max()) / _LONGEST[d]
    first = np.floor((cells.low - origin) / voxel - 1e-9).astype(np.int64).clip(0)
    last = np.floor((top - origin) / voxel + 1e-9).astype(np.int64)
    occupied = _paint_ranges(first, last)
    flooded = np.zeros_like(occupied)
    flooded[tuple(np.floor((position - origin) / voxel).astype(np.int64).clip(0))] = True
    flooded &= occupied
    count = 0
    while count != (count := int(flooded.sum())):
        flooded = _expand_image(flooded) & occupied
    return np.asarray(flooded[tuple(first.T)])


def _paint_ranges(first: Indices, last: Indices) -> Flags:
    """Paint boxes of voxels, each from its first to its last one: sums of differences at their corners."""
    d = first.shape[1]
    shape = tuple(last.max(0) + 2)
    sums = np.zeros(shape, np.int64)
    for corner in product((0, 1), repeat=d):
        index = [(last[:, k] + 1) if above else first[:, k] for k, above in enumerate(corner)]
        counts = np.bincount(np.ravel_multi_index(index, shape), minlength=sums.size)
        sums += (-1) ** sum(corner) * counts.reshape(shape)
    for axis in range(d):
        sums = sums.cumsum(axis)
    return np.asarray(sums > 0)


def _expand_image(image: Flags) -> Flags:
    """Add to an image all voxels that touch it."""
    for axis in range(image.ndim):
        wider = image.copy()
        ahead, behind = [slice(None)] * image.ndim, [slice(None)] * image.ndim
        ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
        wider[tuple(ahead)] |= image[tuple(behind)]
        wider[tuple(behind)] |= image[tuple(ahead)]
        image = wider
    return image
