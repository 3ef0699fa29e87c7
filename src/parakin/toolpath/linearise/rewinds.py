"""Rapid motions that turn back by whole turns, as records in small steps along the way."""

from __future__ import annotations

import numpy as np

from ..posting.posted import Posted
from ..posting.turn_steps import TURN_STEP
from ..programmed_path import compute_tool_axes
from .path_records import insert_records, replace_axes, repost_path


def insert_rewind_records(posted: Posted) -> Posted:
    """Insert records in small steps of C into rapid motions that turn back, so that tool axes alone tell how they turn.

    A path whose program gives the turns is left as it is: its turns can't say that a joint turns back.
    """
    direction = posted.machine.direction
    if not posted.rewinds or posted.path.turns is not None or direction is None:
        return posted
    record = np.array(posted.rewinds, np.int64)
    begin, end = (posted.poses[row, direction.pair] for row in (record - 1, record))
    way = end - begin
    counts = np.maximum(1, np.ceil(np.abs(way[:, 1]) / TURN_STEP)).astype(np.int64)
    motion, row = np.repeat(record, counts - 1), np.repeat(np.arange(len(record)), counts - 1)
    number = np.arange(len(row)) - np.repeat(np.cumsum(counts - 1) - (counts - 1), counts - 1) + 1
    share = number / counts[row]
    turns = np.zeros((len(row), 3))
    turns[:, 1:] = begin[row] + share[:, None] * way[row]
    axes = compute_tool_axes(turns) @ posted.frame[:, :3]
    path = insert_records(posted.path, motion, share)
    return repost_path(posted, replace_axes(path, motion + np.arange(len(motion)), axes))
