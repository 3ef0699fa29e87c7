"""Change a tool path between posts: divide its motions, replace tool axes, and post the changed path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist.pose_angles import find_nearest_direction
from ..path import ToolPath, insert_records
from ..posting.post import post_path
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath
from .path_cuts import PathPositions

# A motion, a share of it, and the tool axis (3,) in M of a record that is inserted there.
AddedRecord = tuple[int, float, Array]


def divide_motions(path: ToolPath, motion: Indices, share: Array) -> ToolPath:
    """Divide motions of a path by records, each with the line, the feed and the rest of its motion's record.

    Parameters
    ----------
    path : n records; ``frame`` and ``notes`` are kept
    motion, share : (m,) where: motions in ascending order, by the record they lead to, and shares of them in ascending
        order within each

    The time of a motion is divided in proportion; a section of no length has none. Events keep their place before the
    motion.
    """
    if not len(motion):
        return path
    programmed = ProgrammedPath(path)
    tip, axis = programmed.interpolate(motion, share)
    extension = programmed.interpolate_extension(motion, share)
    turns = programmed.interpolate_turns(motion, share)
    values: dict[str, Array | Flags | None] = {"tip": tip, "axis": axis, "turns": turns, "extension": extension}
    if path.exact is not None:
        values["exact"] = path.exact[motion] & path.exact[motion - 1]
    ahead = np.searchsorted(motion, np.arange(len(path) + 1))
    divided = insert_records(path, motion, values, ahead)
    return divided if path.seconds is None else replace(divided, seconds=_divide_seconds(path.seconds, motion, share))


def _divide_seconds(seconds: Array, motion: Indices, share: Array) -> Array:
    source = np.insert(np.arange(len(seconds)), motion, motion)
    end = np.insert(np.ones(len(seconds)), motion, share)
    begin = np.where(np.append(False, source[1:] == source[:-1]), np.append(0.0, end[:-1]), 0.0)
    return np.where(end > begin, seconds[source] * (end - begin), np.nan)


def replace_axes(path: ToolPath, record: Indices, axis: Array) -> ToolPath:
    """Replace the tool axes of some records by others (m, 3) in W.

    The new axes are exact. Turns that the path gives change with them: B and C become the nearest that point there; A
    has to be 0.
    """
    axes, turns, tip = path.axis.copy(), path.turns, path.tip
    exact = np.zeros(len(path), np.bool_) if path.exact is None else path.exact.copy()
    axes[record], exact[record] = axis, True
    if path.extension is not None:  # the tip of the longer tool stays
        tip = tip.copy()
        tip[record] += path.extension[record][:, None] * (axis - path.axis[record])
    if turns is not None:
        turns = turns.copy()
        turns[record] = find_nearest_direction(axis, turns[record])
    return replace(path, tip=tip, axis=axes, turns=turns, exact=exact)


def insert_axes(posted: Posted, positions: PathPositions, added: list[AddedRecord]) -> tuple[Posted, PathPositions]:
    """Insert records with their own tool axes into a posted path, and post it again."""
    if not added:
        return posted, positions
    added = sorted(added, key=lambda record: record[:2])
    motions, shares = np.array([record[0] for record in added]), np.array([record[1] for record in added])
    axes = np.array([record[2] for record in added]) @ posted.frame[:, :3]
    path = divide_motions(posted.path, motions, shares)
    path = replace_axes(path, motions + np.arange(len(motions)), axes)
    return repost_path(posted, path), positions.insert(motions, shares)


def repost_path(posted: Posted, path: ToolPath) -> Posted:
    """Post another path in the frame and mode of a posted one, which holds the path's own frame already."""
    result = post_path(posted.machine, replace(path, frame=None), workpiece=posted.frame, mode=posted.mode)
    return replace(result, path=replace(result.path, frame=path.frame))
