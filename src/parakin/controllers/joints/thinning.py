"""Fewer motions where records lie closer than a control can take blocks."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags, Indices

_APART = 5e-4  # mm or degrees that joints may be off: what IS-B rounds by, far within the tolerance of the tip


def thin_rows(rows: Array, times: Array, fixed: Flags, shortest: float) -> Indices:
    """Find the rows to keep (ascending) so that few motions are shorter than a control takes.

    A row between two motions of which one is shorter goes where all rows gone there stay within 0.0005 of the
    even motion that replaces them. Every second row is tried, then those between, until none goes.

    rows : (k, joints) mm and degrees, not rounded; times : (k,) s; fixed : (k,) rows that stay; shortest : s
    """
    kept = np.arange(len(rows))
    off = np.zeros(len(rows))  # by which the rows gone before each kept one may be off
    idle = 0
    parity = 0
    while idle < 2 and len(kept) > 2:
        middle = np.arange(1 + parity, len(kept) - 1, 2)
        parity = 1 - parity
        before, here, after = kept[middle - 1], kept[middle], kept[middle + 1]
        spans = times[after] - times[before]
        share = ((times[here] - times[before]) / np.maximum(spans, 1e-300))[:, None]
        distance = np.abs(rows[here] - rows[before] - share * (rows[after] - rows[before])).max(axis=1, initial=0.0)
        total = np.maximum(off[here], off[after]) + distance
        short = np.minimum(times[here] - times[before], times[after] - times[here]) < shortest
        gone = short & (total <= _APART) & ~fixed[here]
        off[after[gone]] = total[gone]
        kept = np.delete(kept, middle[gone])
        idle = 0 if gone.any() else idle + 1
    return kept
