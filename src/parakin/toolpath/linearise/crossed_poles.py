"""Keep a tool on Z, where C is free, along stretches on which the wrist's pole comes by.

A central leg carries the wrist's pole about, so that a tool which stays on Z is passed by it. Two poles can't be led
through at once, but where they are farther apart than this, the tool has been on Z already. So it is held there first,
and led through the wrist's pole as a path that is exactly on Z.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Flags, Indices
from ..path import Note
from ..posting.posted import Posted
from .deviation import Deviation
from .path_cuts import PathPositions
from .path_records import AddedRecord, insert_axes, replace_axes, repost_path
from .pole_holds import PoleHold, find_pole_holds, find_steps_on, note_holds
from .pole_routing import PolePass
from .pole_steps import PoleSteps, find_pole_steps
from .poles import Pole

_ROUNDING = 1e-9  # of a motion
_TOGETHER = 4.0  # angle tolerances: two poles that are nearer to each other are one


class HeldPath(NamedTuple):
    """A posted path held on Z, where its records stand on the programmed one, and its holds there, with notes."""

    posted: Posted
    positions: PathPositions
    holds: list[PoleHold]
    notes: list[Note]

    def find_held_motions(self) -> Flags:
        """Find the motions (n,) that lie on a hold."""
        passed = self.positions.passed
        is_on_hold = np.zeros(len(passed), np.bool_)
        for hold in self.holds:
            first, last = np.searchsorted(passed, [hold.located.begin - _ROUNDING, hold.located.end + _ROUNDING])
            is_on_hold[first + 1 : last] = True
        return is_on_hold

    def locate_on_programmed(self, located: PolePass) -> PolePass:
        """Tell where a stretch of this path is on the programmed one."""
        begin, end = self.positions.find_passed(located.begin), self.positions.find_passed(located.end)
        return replace(located, begin=begin, end=end)


def keep_on_crossed_pole(deviation: Deviation, poles: list[Pole], posted: Posted, motion: Indices) -> HeldPath | None:
    """Keep a path on Z along the stretches that the wrist's pole crosses; None where there are none.

    poles : of the wrist and of B = 0, as from :func:`~.poles.find_poles`
    """
    if len(poles) < 2 or not poles[0].moves:
        return None
    wrist, upright = poles
    programmed = deviation.programmed
    steps = find_pole_steps(upright, programmed, posted, motion)
    moved = np.zeros(len(posted.path), np.bool_)
    holds = find_pole_holds(upright, posted, programmed, steps, [], moved, deviation.angle)
    holds = [hold for hold in holds if len(hold.record) > 1 and _is_crossed(deviation, wrist, steps, hold)]
    if not holds:
        return None
    axis = programmed.axis.copy()
    added: list[AddedRecord] = []
    for hold in holds:
        axis[hold.record] = hold.axis
        added += hold.list_added()
    record = np.concatenate([hold.record for hold in holds])
    path = replace_axes(posted.path, record, axis[record] @ programmed.rotation)
    reposted = repost_path(posted, path)
    return HeldPath(*insert_axes(reposted, PathPositions.at_records(len(path)), added), holds, note_holds(holds))


def _is_crossed(deviation: Deviation, wrist: Pole, steps: PoleSteps, hold: PoleHold) -> bool:
    """Tell whether the wrist's pole comes to the tool on a hold, but is not there all along."""
    stretches = find_steps_on(steps, [hold.located])
    if not stretches:
        return False
    at = np.arange(stretches[0][0], stretches[0][1] + 1)
    tip, axis = deviation.programmed.interpolate(
        np.repeat(steps.record[at], 2), np.ravel(np.column_stack([steps.begin[at], steps.end[at]]))
    )
    ends = wrist.project_axes(tip, axis).reshape(-1, 2, 2)
    begin, way = ends[:, 0], ends[:, 1] - ends[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(np.clip(-(begin * way).sum(1) / (way * way).sum(1), 0.0, 1.0))
    nearest = np.hypot(*(begin + share[:, None] * way).T).min()
    return bool(nearest <= _TOGETHER * deviation.angle < np.hypot(*ends.reshape(-1, 2).T).max())
