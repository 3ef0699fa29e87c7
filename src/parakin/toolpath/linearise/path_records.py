"""Change the records of a tool path: insert records, replace tool axes, and post the changed path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist import find_nearest_direction
from ..path import ToolPath
from ..posting.post import post_path
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath


def insert_records(path: ToolPath, motion: Indices, share: Array) -> ToolPath:
    """Insert records into motions of a path, each with the line, the feed and the rest of its motion's record.

    Parameters
    ----------
    path : n records; ``frame`` and ``notes`` are kept
    motion, share : (m,) where: motions in ascending order, by the record they lead to, and shares of them in ascending
        order within each

    The time of a motion is divided in proportion; a part of no length has none. Events keep their place before the
    motion.
    """
    if not len(motion):
        return path
    programmed = ProgrammedPath(path)
    tip, axis = programmed.interpolate(motion, share)
    turns = programmed.interpolate_turns(motion, share)
    source = np.insert(np.arange(len(path)), motion, motion)
    added = np.insert(np.zeros(len(path), bool), motion, True)
    before = np.cumsum(np.bincount(motion, minlength=len(path) + 1))  # new records ahead of each old one
    first = np.arange(len(path) + 1) + np.concatenate([[0], before[:-1]])  # where the motion to a record begins
    seconds = path.seconds
    if seconds is not None:
        end = np.insert(np.ones(len(path)), motion, share)
        begin = np.where(np.append(False, source[1:] == source[:-1]), np.append(0.0, end[:-1]), 0.0)
        seconds = np.where(end > begin, seconds[source] * (end - begin), np.nan)
    return replace(
        path,
        tip=_insert_rows(path.tip, source, added, tip),
        axis=_insert_rows(path.axis, source, added, axis),
        line=path.line[source],
        rapid=path.rapid[source],
        feed=path.feed[source],
        spindle=path.spindle[source],
        events=tuple(event._replace(record=int(first[event.record])) for event in path.events),
        turns=None if path.turns is None or turns is None else _insert_rows(path.turns, source, added, turns),
        seconds=seconds,
        tools=tuple(use._replace(record=int(first[use.record])) for use in path.tools),
        extension=_insert_extension(programmed, motion, share, source, added),
    )


def replace_axes(path: ToolPath, record: Indices, axis: Array) -> ToolPath:
    """Replace the tool axes of some records by others (m, 3) in W.

    Turns that the path gives change with them: B and C become the nearest that point there; A has to be 0.
    """
    axes, turns, tip = path.axis.copy(), path.turns, path.tip
    axes[record] = axis
    if path.extension is not None:  # the tip of the longer tool stays
        tip = tip.copy()
        tip[record] += path.extension[record][:, None] * (axis - path.axis[record])
    if turns is not None:
        turns = turns.copy()
        turns[record] = find_nearest_direction(axis, turns[record])
    return replace(path, tip=tip, axis=axes, turns=turns)


def repost_path(posted: Posted, path: ToolPath) -> Posted:
    """Post another path in the frame and mode of a posted one."""
    return post_path(posted.machine, replace(path, frame=None), workpiece=posted.frame, mode=posted.mode)


def _insert_extension(
    programmed: ProgrammedPath, motion: Indices, share: Array, source: Indices, added: Flags
) -> Array | None:
    if programmed.extension is None:
        return None
    spread = programmed.extension[source]
    spread[added] = programmed.interpolate_extension(motion, share)
    return spread


def _insert_rows(rows: Array, source: Indices, added: Flags, new: Array) -> Array:
    """Spread rows as ``source`` says, with the new ones where records are added."""
    spread = rows[source]
    spread[added] = new
    return spread
