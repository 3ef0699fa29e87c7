"""Seeds of the largest box: large boxes of a coarse grid of cells, proved inside a region."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Flags, Indices
from ...budget import Budget
from ...errors import PoseError
from ..certified.containment import prove_boxes
from ..certified.region import Region
from ..certified.subdivision import Cells
from .mask_boxes import find_blocks, find_corner_boxes, find_largest_boxes

GRID = 32  # cells along the longest edge
COUNT = 4  # seeds; half as many where the best orientation must be searched for
_GAP = 0.5  # the region is first subdivided to this relative gap
_SHRUNK = (1.0, 1.0 - 1e-6, 0.99, 0.9, 0.5, 0.2, 0.05)  # sizes of a box, of which the first proved one is taken
_SMALL = 0.5 ** np.arange(1, 24)  # sizes of a box, as fractions of the room about its centre
_LEAST = 0.02  # seeds smaller than this fraction of the largest one's volume are dropped


def find_outline_cells(region: Region, budget: Budget) -> Cells:
    """Find cells that hold the whole region, to a coarse gap.

    Raises :class:`PoseError` for an empty one.
    """
    extent = region.find_extent(budget)
    cells = None if extent is None else refuse_interrupted(region.subdivide(*extent).run(_GAP, budget=budget))
    if cells is None or not len(cells.low):
        raise PoseError("the region is empty")
    return cells


def refuse_interrupted(cells: Cells) -> Cells:
    """Raise KeyboardInterrupt for cells of a subdivision that was interrupted: they are not the whole region."""
    if cells.stopped == "interrupted":
        raise KeyboardInterrupt
    return cells


def find_seeds(
    region: Region, outline: Cells, shape: Array | None, centre: Array | None, budget: Budget
) -> Iterator[tuple[Array, Array]]:
    """Find boxes proved inside, that differ: of the given ``shape`` and about the ``centre`` where these are given.

    A budget that is spent ends it.
    """
    low, high = outline.low.min(0), (outline.low + outline.size).max(0)
    if centre is None:
        boxes = np.concatenate([_find_grid_boxes(region, low, high, shape, budget), _list_largest_cells(outline)])
    else:
        boxes = _find_centred_boxes(region, centre, np.minimum(centre - low, high - centre), budget)
    middle, edges = boxes.mean(1), boxes[:, 1] - boxes[:, 0]
    if shape is not None:
        edges = (edges / shape).min(1, keepdims=True) * shape
    volume = edges.prod(1)
    count = 0
    for which in np.argsort(-volume, kind="stable"):
        if volume[which] < _LEAST * volume.max() and count:
            return
        half = 0.5 * np.multiply.outer(_SHRUNK, edges[which])
        proved = prove_boxes(region, middle[which] - half, middle[which] + half, budget=budget).proved
        if proved.any():
            best = half[proved.argmax()]
            yield middle[which] - best, middle[which] + best
            count += 1
        if count == (COUNT if region.every_orientation else COUNT // 2):
            return


def _prove_grid(region: Region, low: Array, high: Array, budget: Budget) -> tuple[Flags, Array]:
    """Find which cells of a grid over [low, high] are proved inside; returns the mask, and the cells' edges."""
    edge = float((high - low).max()) / GRID
    cells = refuse_interrupted(region.subdivide(low, high).run(_GAP, edge, budget.take_fraction(0.5)))
    if not len(cells.low):
        return np.zeros((1,) * len(low), np.bool_), high - low
    size = cells.size.min(0)
    mask = np.zeros(np.rint((high - low) / size).astype(int), np.bool_)
    inside = cells.take(cells.inside)
    ends = (np.rint((corner - low) / size).astype(int).tolist() for corner in (inside.low, inside.low + inside.size))
    for first, last in zip(*ends, strict=True):
        mask[tuple(slice(a, b) for a, b in zip(first, last, strict=True))] = True
    return mask, size


def _find_grid_boxes(region: Region, low: Array, high: Array, shape: Array | None, budget: Budget) -> Array:
    mask, size = _prove_grid(region, low, high, budget)
    boxes = _find_any_boxes(mask) if shape is None else _find_shaped_boxes(mask, shape / size)
    return np.asarray(low + boxes * size)


def _find_any_boxes(mask: Flags) -> Indices:
    d = mask.ndim
    return find_largest_boxes(mask.reshape(mask.shape + (1,) * (3 - d)), COUNT)[:, :, :d]


def _find_shaped_boxes(mask: Flags, shape: Array) -> Indices:
    """Find, by bisection of the size, the largest blocks that are no smaller than a box of a shape, given in cells."""
    scales = np.unique(np.concatenate([np.arange(1, n + 1) / edge for n, edge in zip(mask.shape, shape, strict=True)]))
    largest = np.zeros((0, 2, mask.ndim), np.int64)
    low, high = 0, len(scales)
    while low < high:
        middle = (low + high) // 2
        blocks = find_blocks(mask, np.maximum((scales[middle] * shape + 1e-9).astype(np.int64), 1), COUNT)
        if len(blocks):
            largest, low = blocks, middle + 1
        else:
            high = middle
    return largest


def _list_largest_cells(outline: Cells) -> Array:
    """List the largest cells themselves as boxes, for a region too thin for the grid."""
    inside = outline.take(outline.inside)
    inside = inside.take(np.argsort(-inside.volumes, kind="stable")[:COUNT])
    return np.stack([inside.low, inside.low + inside.size], 1)


def _find_centred_boxes(region: Region, centre: Array, half: Array, budget: Budget) -> Array:
    """Find boxes about a centre: of a grid that is the same on both sides, and ever smaller ones."""
    small = np.multiply.outer(_SMALL, half)
    mask, size = _prove_grid(region, centre - half, centre + half, budget)
    for axis in range(mask.ndim):
        mask = mask & np.flip(mask, axis)
    middle = np.array(mask.shape) // 2
    last = find_corner_boxes(mask[tuple(slice(n, None) for n in middle)], COUNT)[:, 1]
    large = (last - 0.5 * (np.array(mask.shape) % 2)) * size
    halves = np.concatenate([large, small])
    return np.stack([centre - halves, centre + halves], 1)
