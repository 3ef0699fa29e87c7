"""Boxes in a mask of cells, and the step by which a box in a region grows: plain numbers, for the largest box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Corners = NDArray[np.int64]

WORD = 64  # cells along a mask's first axis: the bits of a word
_LOOKED_AT = 20_000  # boxes of a mask, the greatest ones
_ALIKE = 0.6  # share of the smaller of two boxes that both have, from which on they are one start


def largest_in_mask(mask: Mask, count: int) -> Corners:
    """Up to ``count`` great boxes of cells of a mask (≤ 64, n, n), all true, that differ: (k, 2, 3) first, last + 1.

    A line of cells along the first axis is a word. Words are joined by "and" over every rectangle of the other two
    axes, and the longest run of ones of each is found by shifts, all at once.
    """
    bits = np.uint64(1) << np.arange(len(mask), dtype=np.uint64)
    words = (mask * bits[:, None, None]).sum(0, dtype=np.uint64)
    left, shape = [], []
    for k in range(words.shape[1]):
        layers = np.bitwise_and.accumulate(words[:, k:], 1)
        for j in range(words.shape[0]):
            both = np.bitwise_and.accumulate(layers[j:], 0)
            at, to = np.nonzero(both)
            left.append(both[at, to])
            shape.append(np.column_stack([np.full(len(at), j), np.full(len(at), k), j + at + 1, k + to + 1]))
    word, rest = np.concatenate(left), np.concatenate(shape)
    run = np.zeros(len(word), np.int64)
    ends = word.copy()  # where the longest runs begin
    while len(word) and word.any():
        run += word != 0
        ends = np.where(word != 0, word, ends)
        word = word & (word >> np.uint64(1))
    first = np.log2((ends & (~ends + np.uint64(1))).astype(float)).astype(np.int64) if len(ends) else run
    low = np.column_stack([first, rest[:, :2]])
    high = np.column_stack([first + run, rest[:, 2:]])
    order = np.argsort(-(high - low).prod(1), kind="stable")[:_LOOKED_AT]
    return _different(np.stack([low[order], high[order]], 1), count)


def blocks_in_mask(mask: Mask, size: Corners, count: int) -> Corners:
    """Up to ``count`` blocks of ``size`` cells of a mask, all true, that differ, as :func:`largest_in_mask`."""
    if (size > mask.shape).any():
        return np.zeros((0, 2, mask.ndim), np.int64)
    sums = np.pad(mask.astype(np.int64), [(1, 0)] * mask.ndim)
    for axis, width in enumerate(size):
        sums = sums.cumsum(axis)
        n = sums.shape[axis]
        sums = sums.take(range(int(width), n), axis) - sums.take(range(n - int(width)), axis)
    low = np.argwhere(sums == size.prod())
    return _different(np.stack([low, low + size], 1)[:_LOOKED_AT], count)


def largest_about_corner(mask: Mask, count: int) -> Corners:
    """Up to ``count`` great boxes from a mask's first cell on, all true, that differ, as :func:`largest_in_mask`."""
    for axis in range(mask.ndim):
        mask = np.logical_and.accumulate(mask, axis)
    high = np.argwhere(mask) + 1
    high = high[np.argsort(-high.prod(1), kind="stable")][:_LOOKED_AT]
    return _different(np.stack([np.zeros_like(high), high], 1), count)


def _different(boxes: Corners, count: int) -> Corners:
    """The first ones, each far from those before it."""
    found: list[Corners] = []
    while len(boxes) and len(found) < count:
        best = boxes[0]
        found.append(best)
        common = np.minimum(boxes[:, 1], best[1]) - np.maximum(boxes[:, 0], best[0])
        least = np.minimum((boxes[:, 1] - boxes[:, 0]).prod(1), (best[1] - best[0]).prod())
        boxes = boxes[np.maximum(common, 0).prod(1) < _ALIKE * least]
    return np.array(found, np.int64).reshape(-1, 2, boxes.shape[2])


def ascent(edges: Array, by: Array, rows: Array, slack: Array, reach: Array) -> Array:
    """The step z (k,) that makes the product of ``edges`` + ``by``·z greatest, by Newton's method with barriers.

    It keeps ``rows``·z + ``slack`` ≥ 0 and |z| ≤ ``reach``. ``edges`` (d,) > 0, ``by`` (d, k), ``rows`` (m, k),
    ``slack`` (m,) ≥ 0.
    """
    near = np.abs(rows) @ reach > slack
    rows = np.concatenate([by, rows[near]])
    slack = np.concatenate([edges, np.maximum(slack[near], 1e-9 * edges.min())])
    z = np.zeros(len(reach))

    def value(z: Array, weight: Array, barrier: float) -> float:
        inside = rows @ z + slack
        room = reach**2 - z**2
        if not ((inside > 0.0).all() and (room > 0.0).all()):
            return -np.inf
        return float(weight @ np.log(inside) + barrier * np.log(room).sum())

    for barrier in 0.2 ** np.arange(1, 13):
        weight = np.full(len(rows), barrier)
        weight[: len(by)] = 1.0
        for _ in range(8):
            inside, room = rows @ z + slack, reach**2 - z**2
            slope = rows.T @ (weight / inside) - 2.0 * barrier * z / room
            bend = (rows.T * (weight / inside**2)) @ rows
            bend += np.diag(barrier * 2.0 * (reach**2 + z**2) / room**2)
            step = np.linalg.solve(bend, slope)
            gain = float(slope @ step)
            if gain < 1e-3 * barrier:
                break
            now, share = value(z, weight, barrier), 1.0
            while share > 1e-6 and not value(z + share * step, weight, barrier) > now + 0.1 * share * gain:
                share *= 0.5
            z = z + (share if share > 1e-6 else 0.0) * step
    return z
