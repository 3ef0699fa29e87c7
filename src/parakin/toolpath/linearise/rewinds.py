"""Rewinds: whole turns of a wrist's first joint taken back on a path, where it comes to an end of its range.

A tool that is inclined sweeps a cone while it turns. So it turns where that is stated to be clear: above a plane in
rapid motions, or retracted along its own axis by a clearance, from where it returns to the path. Both are records of
the path like any other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Flags, Indices
from ...errors import PoseError
from ...kinematics.rotations import collect_turns
from ...kinematics.turns import TURN, fill_free
from ...kinematics.wrist.pole_thresholds import NEAR_TURN
from ...kinematics.wrist.pose_angles import continue_turns, find_nearest_direction
from ...machine import Machine
from ..path import Note, ToolPath, insert_records
from ..posting.post import post_path
from ..posting.posted import Posted
from ..posting.tool_lengths import fit_tool_lengths
from ..posting.wrist_poses import find_pose_with_wrist
from ..programmed_path import ProgrammedPath, compute_tool_axes
from .deviation import Deviation
from .linearise import find_sound_motions
from .pole_passes import lead_through_poles

_STEP = math.radians(15.0)  # of the joint, from record to record
_TRIED = 64  # places for one rewind
_MOST_TURNS = 64  # either way
_ROUNDING = 1e-9  # of a motion
_INSIDE = 1e-6  # rad that the joint keeps off the ends of its range


class Clearance(NamedTuple):
    """Where turns may be taken back.

    retract : mm along the tool's axis by which it is clear of the part; None: it is not retracted
    plane : mm, Z of the workpiece frame above which rapid motions are clear; None: nowhere
    """

    retract: float | None = None
    plane: float | None = None

    def check(self) -> None:
        """Raise :class:`PoseError` for what is no clearance."""
        if self.retract is not None and not 0.0 < self.retract < math.inf:
            raise PoseError(f"retract: more than 0 mm expected, not {self.retract!r}")
        if self.plane is not None and not math.isfinite(self.plane):
            raise PoseError(f"plane: a number of mm expected, not {self.plane!r}")


@dataclass(frozen=True)
class Rewind:
    """Turns of a joint taken back at a record of a path.

    record, line : 0-based, and the source line of the motion that follows
    joint : its name
    turns : how many, signed
    retract : mm along the tool's axis; 0 where it turns above the plane
    """

    record: int
    line: int
    joint: str
    turns: int
    retract: float

    def describe(self) -> Note:
        """Describe it as a note of the path."""
        way = f"retracted by {self.retract:g} mm along its axis" if self.retract else "above the clearance plane"
        return Note(self.line, f"rewind: {self.joint} turns by {360 * self.turns}°, the tool {way}")


@dataclass(frozen=True, eq=False)
class RewoundPath:
    """A path with rewinds.

    path : with their records and notes
    rewinds : in order
    mode : the working mode for which they are
    """

    path: ToolPath
    rewinds: tuple[Rewind, ...]
    mode: str

    def __repr__(self) -> str:
        return f"<parakin rewound path: {len(self.path)} records, {len(self.rewinds)} rewinds>"


class _Records(NamedTuple):
    """m records to insert before one record of a path: tips and axes in W, and whether they are come to in rapid."""

    tip: Array
    axis: Array
    rapid: Flags


@check_arguments
def rewind_path(
    machine: Machine,
    path: ToolPath,
    clearance: Clearance,
    *,
    workpiece: Array | None = None,
    mode: str | None = None,
    angle: float = 5e-4,
) -> RewoundPath:
    """Insert the fewest rewinds into a path that keep the wrist's first joint in its range.

    machine, path, workpiece, mode : as for :func:`parakin.prepare`; lengths of tools are fitted first
    clearance : where the tool can be turned freely
    angle : rad off a pole, within which the path will be led through it or held beside it: so the joint is counted

    Every stretch between two rewinds is as long as can be (greedy, which is optimal for their number). Of the places
    at which the next stretch may begin, records above the plane come first, then those between rapid motions, then
    those between a rapid and a cut, then those in a cut; of these the ones from where the path can go on farthest. The
    first place at which the machine can retract and turn within its limits is taken. Where there is none, the path
    goes on without, and has a note.

    Raises :class:`PoseError` for an invalid clearance, and as :func:`parakin.prepare` does.
    """
    clearance.check()
    path = fit_tool_lengths(machine, path)
    posted = post_path(machine, path, workpiece=workpiece, mode=mode)
    if not is_wound_up(posted):
        return RewoundPath(path, (), posted.mode)
    led = _lead_through_poles(posted, angle)
    return _RewindBuilder(led, clearance).build() if is_wound_up(led.posted) else RewoundPath(path, (), posted.mode)


class _LedPath(NamedTuple):
    """A path led through its poles: as ``posted``, and the record (n,) of that at which each programmed one stands."""

    programmed: ToolPath
    posted: Posted
    record: Indices


def _lead_through_poles(posted: Posted, angle: float) -> _LedPath:
    """Lead a posted path through its poles, or hold it beside them, as the controller will run it."""
    deviation = Deviation(posted.machine, ProgrammedPath(posted.path, posted.frame), "pose", 1.0, angle)
    try:
        led = lead_through_poles(deviation, posted, np.flatnonzero(find_sound_motions(posted)))
    except PoseError:  # no path leads from one record to the next, which the check will tell
        return _LedPath(posted.path, posted, np.arange(len(posted.path)))
    record = np.searchsorted(led.positions.passed, np.arange(len(posted.path)) + _ROUNDING) - 1
    return _LedPath(posted.path, led.posted, record)


def has_room_for_rewind(posted: Posted) -> bool:
    """Tell whether a rewind might help a path that has none: it leaves a range that is a whole turn wide."""
    wrist = posted.machine.wrist
    if wrist is None or not is_wound_up(posted):
        return False
    drive, angles = posted.machine.drives[wrist.first], posted.joints[:, wrist.first]
    tried = any("rewind" in note.text for note in posted.path.notes)
    within = (angles >= drive.low) & (angles <= drive.high)
    return not tried and bool(drive.high - drive.low >= TURN and within.any())


def is_wound_up(posted: Posted) -> bool:
    """Tell whether a path turns the wrist's first joint beyond its range."""
    wrist = posted.machine.wrist
    if wrist is None:
        return False
    drive, angles = posted.machine.drives[wrist.first], posted.joints[:, wrist.first]
    finite = angles[np.isfinite(angles)]
    return bool(len(finite)) and not drive.low <= finite.min() <= finite.max() <= drive.high


class _RewindBuilder:
    """Builds the rewinds of a posted path; places are records, after which the turn is made."""

    def __init__(self, led: _LedPath, clearance: Clearance):
        posted, wrist = led.posted, led.posted.machine.wrist
        assert wrist is not None
        self.clearance, self.wrist, self.frame, self.mode = clearance, wrist, posted.frame, posted.mode
        self.machine, self.path = posted.machine, led.programmed
        self.poses, self.joints = posted.poses[led.record], posted.joints[led.record]
        self.drive = self.machine.drives[wrist.first]
        angles = posted.joints[:, wrist.first]
        angles = fill_free(angles, ~np.isfinite(angles))
        after = np.append(0, led.record[:-1] + 1)  # the records on the way to each programmed one
        self.least, self.greatest = np.minimum.reduceat(angles, after), np.maximum.reduceat(angles, after)
        self.counts = self._list_counts()
        self.ends = np.stack([self._find_ends(int(count)) for count in self.counts])
        self.rank = self._rank_places()

    def _list_counts(self) -> Indices:
        """List the counts of turns that bring any record into the range."""
        low = math.floor((self.drive.low - self.greatest.max()) / TURN)
        high = math.ceil((self.drive.high - self.least.min()) / TURN)
        return np.arange(max(low, -_MOST_TURNS), min(high, _MOST_TURNS) + 1)

    def _find_ends(self, count: int) -> Indices:
        """Find for each record the first one from there on that a count of turns does not keep in the range, (n,)."""
        least, greatest = self.least + count * TURN, self.greatest + count * TURN
        kept = (least >= self.drive.low + _INSIDE) & (greatest <= self.drive.high - _INSIDE)
        lost = np.where(kept, len(kept), np.arange(len(kept)))
        return np.minimum.accumulate(lost[::-1])[::-1]

    def _rank_places(self) -> Indices:
        """Rank the records as places for a rewind, (n,): 0 above the plane, the best; -1 where there may be none."""
        rapid, count = self.path.rapid, len(self.path)
        before, behind = rapid, np.append(rapid[1:], False)
        rank = np.full(count, -1, np.int64)
        if self.clearance.retract is not None:
            rank[:] = 3 - before.astype(np.int64) - behind
        if self.clearance.plane is not None:
            rank[before & (self.path.tip[:, 2] >= self.clearance.plane)] = 0
        rank[-1:] = -1
        return rank

    def build(self) -> RewoundPath:
        """Build all rewinds, and the path with them."""
        added: list[tuple[int, _Records]] = []
        rewinds, notes = [], []
        start = -1  # the last place
        end = int(self.ends[:, 0].max())
        before = int(self.counts[self.ends[:, 0].argmax()])
        while end < len(self.path):
            choice = self._find_rewind(start, end, before)
            if choice is None:
                line = int(self.path.line[end])
                notes.append(Note(line, f"no place for a rewind of {self.drive.name} before this line"))
                break
            rewind, records, after = choice
            rewinds.append(rewind)
            added.append((rewind.record + 1, records))
            start, before = rewind.record, after
            end = int(self.ends[after - int(self.counts[0]), start])
        notes = [*(rewind.describe() for rewind in rewinds), *notes]
        path = replace(_insert_rewinds(self.path, added), notes=(*self.path.notes, *notes))
        return RewoundPath(path, tuple(rewinds), self.mode)

    def _find_rewind(self, start: int, end: int, before: int) -> tuple[Rewind, _Records, int] | None:
        """Find the rewind that ends a stretch from ``start``, which can't go on to ``end``, and the turns behind it."""
        places = np.arange(start + 1, end)
        places = places[self.rank[places] >= 0]
        reach = self.ends[:, places]
        best = reach.argmax(axis=0) if len(places) else np.empty(0, np.int64)
        farthest = reach[best, np.arange(len(places))]
        order = np.lexsort((-places, -farthest, self.rank[places]))
        order = order[farthest[order] > end]
        for index in order[:: max(1, len(order) // _TRIED)][:_TRIED].tolist():
            place, after = int(places[index]), int(self.counts[best[index]])
            retract = self.clearance.retract if self.rank[place] > 0 and self.clearance.retract else 0.0
            records = self._retract_and_turn(place, before, after, retract)
            if records is not None:
                line = int(self.path.line[place + 1])
                return Rewind(place, line, self.drive.name, after - before, retract), records, after
        return None

    def _retract_and_turn(self, place: int, before: int, after: int, retract: float) -> _Records | None:
        """Retract the tool at a record, turn it, and return; None where the machine can't do that within its limits."""
        path, axis = self.path, self.path.axis[place]
        tip = path.tip[place] + retract * axis
        axes = self._turn(place, tip, before, after)
        if axes is None:
            return None
        if not retract:
            return _Records(np.tile(tip, (len(axes), 1)), axes, np.ones(len(axes), np.bool_))
        tips = np.vstack([np.tile(tip, (len(axes) + 2, 1)), path.tip[place]])
        rapid = np.append(np.ones(len(axes) + 2, np.bool_), path.rapid[place + 1])
        return _Records(tips, np.vstack([axis, axes, axis, axis]), rapid)

    def _turn(self, place: int, tip: Array, before: int, after: int) -> Array | None:
        """Turn the first joint at a tip in W, the second one as at a record; return the axes (k, 3) in W, or None."""
        wrist, frame = self.wrist, self.frame
        joints, pose = self.joints[place].copy(), self.poses[place].copy()
        if not np.isfinite(joints).all():
            return None
        mode = wrist.find_mode(pose, joints, self.mode)
        is_upright = wrist.find_free(pose[None], NEAR_TURN)[0]
        wanted = wrist.tilt(joints, mode, NEAR_TURN) if is_upright else joints
        pose[:3] = frame[:, :3] @ tip + frame[:, 3]
        steps = math.ceil(abs(after - before) * TURN / _STEP)
        poses, rows = [], []
        for count in before + (after - before) * np.arange(steps + 1) / steps:
            row = wanted.copy()
            row[wrist.first] += TURN * count
            turned = find_pose_with_wrist(self.machine, pose, row, mode)
            if turned is None:
                return None
            pose = turned
            legs = self.machine.inverse(pose, mode)
            legs[wrist.pair] = row[wrist.pair]
            poses.append(pose)
            rows.append(legs)
        if self.machine.check(np.array(poses), np.array(rows), mode).any():
            return None
        axes: Array = compute_tool_axes(collect_turns(self.machine.axes, np.array(poses))) @ frame[:, :3]
        return axes


def _insert_rewinds(path: ToolPath, added: list[tuple[int, _Records]]) -> ToolPath:
    """Insert records into a path, each with the line, the feed and the spindle of the record that it stands before.

    Turns that the path gives go on from those of the record before, and what follows goes on from them.
    """
    if not added:
        return path
    at = np.concatenate([np.full(len(records.rapid), record) for record, records in added])
    tip, axis, rapid = (np.concatenate(rows) for rows in zip(*(records for _, records in added), strict=True))
    feed = path.feed if path.seconds is None else _fill_feeds(path)
    values = {
        "tip": tip,
        "axis": axis,
        "rapid": rapid,
        "feed": np.where(rapid, path.feed[at], feed[at]),
        "extension": None if path.extension is None else path.extension[at - 1],
    }
    if path.turns is None:
        return insert_records(path, at, values)
    turns = _insert_turns(path.turns, at, axis)
    return replace(insert_records(path, at, values), turns=turns)


def _fill_feeds(path: ToolPath) -> Array:
    """Compute feeds, mm/min, also for the records that give a time."""
    assert path.seconds is not None
    length = np.linalg.norm(np.diff(path.tip, axis=0, prepend=path.tip[:1]), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed: Array = np.where(np.isnan(path.seconds), path.feed, 60.0 * length / path.seconds)
    return feed


def _insert_turns(turns: Array, at: Indices, axis: Array) -> Array:
    """Insert A = 0, B and C (n, 3) that point along axes; C of what follows goes on by the whole turns made."""
    inserted = np.insert(turns, at, np.nan, axis=0)
    new = np.flatnonzero(np.isnan(inserted[:, 0]))
    for row, direction in zip(new.tolist(), axis, strict=True):
        inserted[row] = find_nearest_direction(direction[None], inserted[row - 1 : row])[0]
        if row + 1 < len(inserted) and not np.isnan(inserted[row + 1, 0]):
            continue_turns(inserted, row)
    return inserted
