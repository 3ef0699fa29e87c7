"""Great boxes of a coarse grid of cells proved inside a region, from which to look for the largest box."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ..certified.containment import verdicts
from ..certified.region import Region
from ..certified.subdivision import Cells
from .mask_boxes import Corners, Mask, blocks_in_mask, largest_about_corner, largest_in_mask

GRID = 32  # cells along the longest edge
COUNT = 4  # starts; half as many where turns are looked for
_GAP = 0.5  # to which the region is known before
_SECONDS = 30.0
_SHRUNK = (1.0, 1.0 - 1e-6, 0.99, 0.9, 0.5, 0.2, 0.05)
_SMALL = 0.5 ** np.arange(1, 24)  # of what is free about a centre
_LEAST = 0.02  # of the greatest start's volume: smaller ones are none


def outline(region: Region) -> Cells:
    """Cells that hold the whole region, roughly.

    Raises :class:`PoseError` for an empty one.
    """
    extent = region.extent
    cells = None if extent is None else whole(region.subdivide(*extent).run(_GAP, seconds=_SECONDS))
    if cells is None or not len(cells.low):
        raise PoseError("the region is empty")
    return cells


def whole(cells: Cells) -> Cells:
    """Cells of which the work was not broken off: what follows from some of them is no answer."""
    if cells.stopped == "interrupted":
        raise KeyboardInterrupt
    return cells


def starts(region: Region, rough: Cells, shape: Array | None, centre: Array | None) -> Iterator[tuple[Array, Array]]:
    """Boxes proved inside, that differ: of the given ``shape`` and about the ``centre`` where these are given."""
    low, high = rough.low.min(0), (rough.low + rough.size).max(0)
    if centre is None:
        boxes = np.concatenate([_in_grid(region, low, high, shape), _in_cells(rough)])
    else:
        boxes = _about(region, centre, np.minimum(centre - low, high - centre))
    middle, edges = boxes.mean(1), boxes[:, 1] - boxes[:, 0]
    if shape is not None:
        edges = (edges / shape).min(1, keepdims=True) * shape
    volume = edges.prod(1)
    count = 0
    for which in np.argsort(-volume, kind="stable"):
        if volume[which] < _LEAST * volume.max() and count:
            return
        half = 0.5 * np.multiply.outer(_SHRUNK, edges[which])
        proved = verdicts(region, middle[which] - half, middle[which] + half).proved
        if proved.any():
            best = half[proved.argmax()]
            yield middle[which] - best, middle[which] + best
            count += 1
        if count == (COUNT if region.every_orientation else COUNT // 2):
            return


def _grid(region: Region, low: Array, high: Array) -> tuple[Mask, Array]:
    """Which cells of a grid over [low, high] are proved inside, and the cells' edges."""
    cells = whole(region.subdivide(low, high).run(_GAP, float((high - low).max()) / GRID, _SECONDS))
    if not len(cells.low):
        return np.zeros((1,) * len(low), np.bool_), high - low
    size = cells.size.min(0)
    mask = np.zeros(np.rint((high - low) / size).astype(int), np.bool_)
    inside = cells.take(cells.inside)
    ends = (np.rint((corner - low) / size).astype(int).tolist() for corner in (inside.low, inside.low + inside.size))
    for first, last in zip(*ends, strict=True):
        mask[tuple(slice(a, b) for a, b in zip(first, last, strict=True))] = True
    return mask, size


def _in_grid(region: Region, low: Array, high: Array, shape: Array | None) -> Array:
    mask, size = _grid(region, low, high)
    found = _any_shape(mask) if shape is None else _of_shape(mask, shape / size)
    return np.asarray(low + found * size)


def _any_shape(mask: Mask) -> Corners:
    d = mask.ndim
    return largest_in_mask(mask.reshape(mask.shape + (1,) * (3 - d)), COUNT)[:, :, :d]


def _of_shape(mask: Mask, shape: Array) -> Corners:
    """Blocks as large as can be that are no smaller than a box of the shape, which is given in cells."""
    scales = np.unique(np.concatenate([np.arange(1, n + 1) / part for n, part in zip(mask.shape, shape, strict=True)]))
    found = np.zeros((0, 2, mask.ndim), np.int64)
    low, high = 0, len(scales)
    while low < high:
        middle = (low + high) // 2
        blocks = blocks_in_mask(mask, np.maximum((scales[middle] * shape + 1e-9).astype(np.int64), 1), COUNT)
        if len(blocks):
            found, low = blocks, middle + 1
        else:
            high = middle
    return found


def _in_cells(rough: Cells) -> Array:
    """The greatest cells themselves, for a region too thin for the grid."""
    inside = rough.take(rough.inside)
    inside = inside.take(np.argsort(-inside.volumes, kind="stable")[:COUNT])
    return np.stack([inside.low, inside.low + inside.size], 1)


def _about(region: Region, centre: Array, half: Array) -> Array:
    """Boxes about a centre: of a grid that is the same on both sides, and ever smaller ones."""
    small = np.multiply.outer(_SMALL, half)
    mask, size = _grid(region, centre - half, centre + half)
    for axis in range(mask.ndim):
        mask = mask & np.flip(mask, axis)
    middle = np.array(mask.shape) // 2
    found = largest_about_corner(mask[tuple(slice(n, None) for n in middle)], COUNT)[:, 1]
    large = (found - 0.5 * (np.array(mask.shape) % 2)) * size
    halves = np.concatenate([large, small])
    return np.stack([centre - halves, centre + halves], 1)
