"""Proofs of many motions at once: runs of them are bounded in one box, and halved where that proves too little."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist.pole_crossing import EITHER, OTHER, OWN
from .margin_bounds import MotionProver

RUN = 64  # motions bounded at once
BLOCK = 1 << 15  # motions whose records are looked up together


def split_into_blocks(count: int) -> Iterator[Indices]:
    """Split the records of a path of ``count`` into blocks; the last record of one is the first of the next."""
    for start in range(0, count - 1, BLOCK):
        yield np.arange(start, min(count, start + BLOCK + 1))


def find_unproved_motions(prover: MotionProver, records: Indices, floor: Array, whole: bool) -> Indices:
    """Find the motions between consecutive records that are not proved to keep the limits, by bisection of runs.

    records : (n,) of a posted path
    floor : (limits,) what each margin has to reach; -inf for a limit that does not count
    whole : prove also that turns are counted right and that no parallel singularity is passed
    """
    motions, n = prover.motions, len(records)
    poses, joints = motions.posted.poses[records], motions.posted.joints[records]
    unusable = np.asarray(~np.isfinite(joints).all(1))
    if whole:  # a record off limits is no use for a proof
        broken = motions.posted.broken[records]
        unusable |= (broken > 0) & (broken <= len(floor))
    wrist_modes = motions.find_wrist_modes(poses, joints)
    mode_counts = {mode: _count_before(np.asarray(wrist_modes == mode, bool)) for mode in (OWN, OTHER)}
    unusable_counts = _count_before(unusable)
    first = np.arange(0, n - 1, RUN)
    last = np.minimum(first + RUN, n - 1)
    unproved = []
    while len(first):
        proved = np.zeros(len(first), bool)
        usable = np.flatnonzero(unusable_counts[last + 1] == unusable_counts[first])
        if len(usable):
            begin, end = first[usable], last[usable]
            has = {mode: counts[end + 1] > counts[begin] for mode, counts in mode_counts.items()}
            run_modes = np.where(has[OTHER], np.where(has[OWN], EITHER, OTHER), OWN).astype(np.int8)
            low, high = _find_ranges(poses, begin, end)
            middle = motions.get_record_points(records[(begin + end) // 2])
            bounds = prover.bound_runs(middle, run_modes, (low, high), _find_ranges(joints, begin, end))
            kept = ((bounds.least >= floor) | np.isneginf(floor)).all(1)
            if whole:
                kept &= bounds.counted
                rows = np.flatnonzero(kept)
                kept[rows] = prover.prove_regular_boxes(low[rows], high[rows], run_modes[rows])
            proved[usable] = kept
        first, last = first[~proved], last[~proved]
        short = last - first <= 2
        unproved += [last[short], (last - 1)[short & (last - first == 2)]]
        first, last = first[~short], last[~short]
        half = (first + last) // 2
        first, last = np.concatenate([first, half]), np.concatenate([half, last])
    return records[np.sort(np.concatenate(unproved))] if unproved else np.empty(0, np.int64)


def _count_before(flags: Flags) -> Indices:
    """Count how many flags (n,) are set before each place, (n + 1,)."""
    return np.concatenate([[0], np.cumsum(flags)])


def _find_ranges(rows: Array, first: Indices, last: Indices) -> tuple[Array, Array]:
    """Find the least and the greatest of rows first to last of each run, column by column."""
    padded = np.concatenate([rows, rows[-1:]])
    index = np.stack([first, last + 1], 1).reshape(-1)
    return np.minimum.reduceat(padded, index)[::2], np.maximum.reduceat(padded, index)[::2]
