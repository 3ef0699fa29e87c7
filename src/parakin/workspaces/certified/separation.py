"""Separate the cells of a subdivision that no path joins to a position, on a coarse image of them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags
from ...kernels.compiling import njit
from .subdivision import Cells

_LONGEST = {1: 4096, 2: 512, 3: 64}  # voxels along the longest edge, by dimension
_SLACK = 1e-9  # of a voxel, by which cells reach into the next one
_EMPTY, _OCCUPIED, _FLOODED = range(3)


def find_joined_cells(cells: Cells, position: Array) -> Flags | None:
    """Find the cells (N,) that may hang together with the one at a position (d,); None where there is none.

    Cells are painted into an image of voxels, larger than the smallest of them, and the image is flooded from the
    position. Two cells that touch are joined, and some that nearly do: the others are proved to be apart.
    """
    if not len(cells.low):
        return None
    low, high = cells.corners
    d, voxel = len(low), float((high - low).max()) / _LONGEST[len(low)]
    image = np.zeros([int(edge / voxel + _SLACK) + 1 for edge in high - low] + [1] * (3 - d), np.int8)
    first = np.zeros((len(cells.low), 3), np.int32)
    if not _paint_boxes((cells.low - low) / voxel, cells.size / voxel, (position - low) / voxel, first, image):
        return None
    start = np.zeros(3, np.int64)
    start[:d] = np.floor((position - low) / voxel).clip(0)
    _fill_joined(image, start)
    return np.asarray(image[tuple(first.T)] == _FLOODED)


@njit(nogil=True, cache=True)
def _paint_boxes(low, size, position, first, image):
    """Paint boxes into an image of unit voxels; returns whether the position is in one of them.

    low, size : (N, d); position : (d,)
    first : (N, 3) filled with each box's first voxel
    image : of three dimensions, some of length 1
    """
    d = low.shape[1]
    last = np.zeros(3, np.int64)
    is_inside = False
    for i in range(len(low)):
        is_own = True
        for k in range(d):
            top = low[i, k] + size[i, k]
            first[i, k] = max(int(np.floor(low[i, k] - _SLACK)), 0)
            last[k] = min(int(np.floor(top + _SLACK)), image.shape[k] - 1)
            is_own &= (low[i, k] - _SLACK <= position[k]) & (position[k] <= top + _SLACK)
        is_inside |= is_own
        for x in range(first[i, 0], last[0] + 1):
            for y in range(first[i, 1], last[1] + 1):
                for z in range(first[i, 2], last[2] + 1):
                    image[x, y, z] = _OCCUPIED
    return is_inside


@njit(nogil=True, cache=True)
def _fill_joined(image, start):
    """Fill in the occupied voxels that hang together with one voxel, also across edges and corners."""
    stack = np.empty((image.size, 3), np.int16)
    image[start[0], start[1], start[2]] = _FLOODED
    for k in range(3):
        stack[0, k] = start[k]
    count = 1
    while count:
        count -= 1
        x, y, z = stack[count, 0], stack[count, 1], stack[count, 2]
        for i in range(max(x - 1, 0), min(x + 2, image.shape[0])):
            for j in range(max(y - 1, 0), min(y + 2, image.shape[1])):
                for k in range(max(z - 1, 0), min(z + 2, image.shape[2])):
                    if image[i, j, k] == _OCCUPIED:
                        image[i, j, k] = _FLOODED
                        stack[count, 0], stack[count, 1], stack[count, 2] = i, j, k
                        count += 1
