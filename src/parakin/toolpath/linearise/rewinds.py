"""Rapid motions that turn back by whole turns, as records along the way."""

from __future__ import annotations

import numpy as np

from ..posting.posted import Posted
from ..posting.turn_steps import TURN_STEP
from .interpolation import axis_of_turns, denser, pointed
from .pole_passes import posted_again


def spelled_out(posted: Posted) -> Posted:
    """A posted path whose own tool axes tell how it turns back, with records in small steps of C.

    A path whose program gives the turns is left as it is: they can't be told otherwise.
    """
    if not posted.rewinds or posted.path.turns is not None or not posted.machine.has_direction:
        return posted
    record = np.array(posted.rewinds, np.int64)
    begin, way = posted.poses[record - 1, 3:], posted.poses[record, 3:] - posted.poses[record - 1, 3:]
    parts = np.maximum(1, np.ceil(np.abs(way[:, 1]) / TURN_STEP)).astype(np.int64)
    motion, of = np.repeat(record, parts - 1), np.repeat(np.arange(len(record)), parts - 1)
    number = np.arange(len(of)) - np.repeat(np.cumsum(parts - 1) - (parts - 1), parts - 1) + 1
    share = number / parts[of]
    turns = np.zeros((len(of), 3))
    turns[:, 1:] = begin[of] + share[:, None] * way[of]
    axes = axis_of_turns(turns) @ posted.frame[:, :3]
    path = denser(posted.path, motion, share)
    return posted_again(posted, pointed(path, motion + np.arange(len(motion)), axes))
