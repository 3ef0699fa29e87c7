"""Large boxes of true cells in a mask, from which the search for the largest box in a region starts."""

from __future__ import annotations

import numpy as np

from ...arrays import Flags, Indices

_EXAMINED = 20_000  # boxes of a mask, the largest ones
_ALIKE = 0.6  # fraction of the smaller of two boxes that both have, from which on they count as one


def find_largest_boxes(mask: Flags, count: int) -> Indices:
    """Find up to ``count`` large boxes of true cells of a mask (≤ 64, n, n), that differ: (k, 2, 3) first, last + 1.

    A line of cells along the first axis is a word. Words are joined by "and" over every rectangle of the other two
    axes, and the longest run of ones of each is found by shifts, all at once.
    """
    bits = np.uint64(1) << np.arange(len(mask), dtype=np.uint64)
    words = (mask * bits[:, None, None]).sum(0, dtype=np.uint64)
    common, rectangles = [], []
    for k in range(words.shape[1]):
        layers = np.bitwise_and.accumulate(words[:, k:], 1)
        for j in range(words.shape[0]):
            joined = np.bitwise_and.accumulate(layers[j:], 0)
            rows, columns = np.nonzero(joined)
            common.append(joined[rows, columns])
            n = len(rows)
            rectangles.append(np.column_stack([np.full(n, j), np.full(n, k), j + rows + 1, k + columns + 1]))
    word, rectangle = np.concatenate(common), np.concatenate(rectangles)
    run = np.zeros(len(word), np.int64)
    starts = word.copy()  # a bit where each longest run begins
    while len(word) and word.any():
        run += word != 0
        starts = np.where(word != 0, word, starts)
        word = word & (word >> np.uint64(1))
    first = np.log2((starts & (~starts + np.uint64(1))).astype(float)).astype(np.int64) if len(starts) else run
    low = np.column_stack([first, rectangle[:, :2]])
    high = np.column_stack([first + run, rectangle[:, 2:]])
    order = np.argsort(-(high - low).prod(1), kind="stable")[:_EXAMINED]
    return _drop_similar(np.stack([low[order], high[order]], 1), count)


def find_blocks(mask: Flags, size: Indices, count: int) -> Indices:
    """Find up to ``count`` blocks of ``size`` true cells of a mask, that differ, as :func:`find_largest_boxes`."""
    if (size > mask.shape).any():
        return np.zeros((0, 2, mask.ndim), np.int64)
    sums = np.pad(mask.astype(np.int64), [(1, 0)] * mask.ndim)
    for axis, width in enumerate(size):
        sums = sums.cumsum(axis)
        n = sums.shape[axis]
        sums = sums.take(range(int(width), n), axis) - sums.take(range(n - int(width)), axis)
    low = np.argwhere(sums == size.prod())
    return _drop_similar(np.stack([low, low + size], 1)[:_EXAMINED], count)


def find_corner_boxes(mask: Flags, count: int) -> Indices:
    """Find up to ``count`` large boxes of true cells from a mask's first cell on, as :func:`find_largest_boxes`."""
    for axis in range(mask.ndim):
        mask = np.logical_and.accumulate(mask, axis)
    high = np.argwhere(mask) + 1
    high = high[np.argsort(-high.prod(1), kind="stable")][:_EXAMINED]
    return _drop_similar(np.stack([np.zeros_like(high), high], 1), count)


def _drop_similar(boxes: Indices, count: int) -> Indices:
    """Keep the first boxes, each far from those before it."""
    kept: list[Indices] = []
    while len(boxes) and len(kept) < count:
        best = boxes[0]
        kept.append(best)
        common = np.minimum(boxes[:, 1], best[1]) - np.maximum(boxes[:, 0], best[0])
        least = np.minimum((boxes[:, 1] - boxes[:, 0]).prod(1), (best[1] - best[0]).prod())
        boxes = boxes[np.maximum(common, 0).prod(1) < _ALIKE * least]
    return np.array(kept, np.int64).reshape(-1, 2, boxes.shape[2])
