"""Which lines make LinuxCNC take much longer than the trajectory, and why."""

from __future__ import annotations

import numpy as np

from ...toolpath.path import Note
from ...toolpath.timing.trajectory import Trajectory
from .straight_motions import StraightMotions

_MUCH = 1.5  # times the trajectory: what takes longer is explained
_MOST_NOTES = 3
_NAMED = 0.1  # of what is lost in all: but for the worst, lines that lose less are not named


def note_lost_time(trajectory: Trajectory, motions: StraightMotions) -> list[Note]:
    """Note the lines that lose most, with what LinuxCNC takes, what the trajectory does, and what holds it up.

    There are none where all motions together take no more than 1.5 times the trajectory.
    """
    if not motions.total_seconds > _MUCH * trajectory.seconds:
        return []
    path, rows, pieces = trajectory.posted.path, trajectory.joint_path.segment, len(trajectory.curve.length)
    first = np.append(np.searchsorted(rows, np.arange(pieces)), len(rows) - 1)
    planned = np.diff(trajectory.profile.row_times[first])
    taken = np.bincount(motions.piece, motions.seconds, pieces)
    lines, line_of_piece = np.unique(path.line[trajectory.curve.record_of_piece], return_inverse=True)
    planned_by_line, taken_by_line = (np.bincount(line_of_piece, values, len(lines)) for values in (planned, taken))
    lost = taken_by_line - planned_by_line
    notes = list[Note]()
    for line in np.argsort(-lost, kind="stable")[:_MOST_NOTES].tolist():
        if notes and lost[line] < _NAMED * lost.clip(0.0).sum():
            break
        held = np.bincount(
            motions.held_up_by, motions.seconds * (line_of_piece[motions.piece] == line), len(motions.reasons)
        )
        reason = motions.reasons[int(held[1:].argmax()) + 1]
        text = (
            f"LinuxCNC takes {taken_by_line[line]:.3g} s here, the trajectory {planned_by_line[line]:.3g} s: {reason}"
        )
        notes.append(Note(int(lines[line]), text))
    return notes
