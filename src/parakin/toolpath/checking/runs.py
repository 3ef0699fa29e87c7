"""Which motions of a path are not proved to keep the limits when many of them are bounded at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..path import Floats
from .motions import EITHER, ONE, OTHER, Indices
from .sections import Prover

RUN = 64  # motions bounded at once
BLOCK = 1 << 15  # motions looked at together


def blocks(count: int) -> Iterator[Indices]:
    """The records of a path of ``count``, block by block; the last of one is the first of the next."""
    for start in range(0, count - 1, BLOCK):
        yield np.arange(start, min(count, start + BLOCK + 1))


def unproved(prover: Prover, records: Indices, floor: Floats, whole: bool) -> Indices:
    """Motions between consecutive ``records`` that are not proved to keep every margin at ``floor`` (limits,) or above.

    With ``whole`` they are to keep their turns counted and off the parallel singularities, too.
    """
    motions, n = prover.motions, len(records)
    poses, joints = motions.posted.poses[records], motions.posted.joints[records]
    lost = np.asarray(~np.isfinite(joints).all(1))
    if whole:  # a record off limits is no use for a proof
        broken = motions.posted.broken[records]
        lost |= (broken > 0) & (broken <= len(floor))
    sign = motions.signs(poses, joints)
    sums = {kind: _sums(np.asarray(sign == kind, bool)) for kind in (ONE, OTHER)}
    lost_before = _sums(lost)
    first = np.arange(0, n - 1, RUN)
    last = np.minimum(first + RUN, n - 1)
    left = []
    while len(first):
        shown = np.zeros(len(first), bool)
        good = np.flatnonzero(lost_before[last + 1] == lost_before[first])
        if len(good):
            begin, end = first[good], last[good]
            has = {kind: total[end + 1] > total[begin] for kind, total in sums.items()}
            mode = np.where(has[OTHER], np.where(has[ONE], EITHER, OTHER), ONE).astype(np.int8)
            low, high = _ends(poses, begin, end)
            at = motions.at_records(records[(begin + end) // 2])
            bounds = prover.over_runs(at, mode, low, high, _ends(joints, begin, end))
            fine = ((bounds.least >= floor) | np.isneginf(floor)).all(1)
            if whole:
                fine &= bounds.counted
                rows = np.flatnonzero(fine)
                fine[rows] = prover.regular_in(low[rows], high[rows], mode[rows])
            shown[good] = fine
        first, last = first[~shown], last[~shown]
        short = last - first <= 2
        left += [last[short], (last - 1)[short & (last - first == 2)]]
        first, last = first[~short], last[~short]
        middle = (first + last) // 2
        first, last = np.concatenate([first, middle]), np.concatenate([middle, last])
    return records[np.sort(np.concatenate(left))] if left else np.empty(0, np.int64)


def _sums(flags: NDArray[np.bool_]) -> Indices:
    """How many flags stand before each place."""
    return np.concatenate([[0], np.cumsum(flags)])


def _ends(rows: Floats, first: Indices, last: Indices) -> tuple[Floats, Floats]:
    """The least and the greatest of the rows first to last, column by column, of each run."""
    padded = np.concatenate([rows, rows[-1:]])
    index = np.stack([first, last + 1], 1).reshape(-1)
    return np.minimum.reduceat(padded, index)[::2], np.maximum.reduceat(padded, index)[::2]
