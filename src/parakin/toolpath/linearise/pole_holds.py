"""Holds beside a pole: the tool axis keeps its azimuth about the pole, and turns to another one at a single place.

A path that comes to a pole in one direction and leaves it in another, that starts or ends there, or that jitters about
it can't be led straight through. The free angle has to stand still or to turn, and a controller that is given poses
turns it only as fast as the poses say. So within the angle tolerance of the pole the axis is held on a small circle
about it, in the direction from which the path comes; at the record nearest to the pole it goes on along that circle, or
straight over the pole, to the direction in which the path leaves, while the tip stands still.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.turns import wrap_angle
from ...kinematics.wrist.pole_thresholds import EXACT, NEAR_HOLD, PRINTED, REPORTED, SWING
from ...kinematics.wrist.pose_angles import find_nearest_direction, flip_azimuth
from ..path import Note
from ..posting.frames import compute_poses
from ..posting.posted import Posted
from ..posting.working_mode import HELD
from ..programmed_path import ProgrammedPath, compute_tool_axes
from .continuation import MACHINE_FRAME
from .path_records import AddedRecord
from .pole_routing import PolePass
from .pole_steps import PoleSteps, meet_circle
from .poles import Pole

# Share of the angle tolerance. The sum of this and HELD is what an axis may be moved; the rest is for rounding.
_OFF_POLE = 0.12  # off the pole, where it is held
_ARC = np.radians(15.0)  # a turn beside the pole is divided into arcs no longer
_STRAIGHT = np.radians(1.0)  # what turns less needs no record of its own
_WANDER = 0.3  # fraction of the circle: what even poses may leave it by between two records
_MOST_BETWEEN = 64  # records into which a motion is divided for that
_CLOSE = 0.1  # fraction of the circle: records so close keep the way over the pole straight
_STILL = 0.95  # of the circle: the middle of an arc comes no nearer
_OPPOSITE = 1.0 - 1e-6  # cosine between the ways to the pole and from it
_EDGE = 1e-9  # of a motion, of the circle: what is rounding


@dataclass(frozen=True, eq=False)
class PoleHold:
    """A stretch of a path held beside a pole.

    located : the pole, and where the stretch is on the path
    record, axis : (k,) records whose tool axes are moved, and where to, (k, 3) in M; none where it is held already
    motion, share, added : (m,) motions and shares where records are inserted, in order, and their axes, (m, 3) in M
    turn : rad by which the free angle turns there
    aside : rad off the pole at which the axis is held
    """

    located: PolePass
    record: Indices
    axis: Array
    motion: Indices
    share: Array
    added: Array
    turn: float
    aside: float

    @property
    def key(self) -> tuple[str, float]:
        """What tells it from other holds, and from passes."""
        return f"beside {self.located.pole.text}", self.located.begin

    def list_added(self) -> list[AddedRecord]:
        """List the records that are inserted."""
        return list(zip(self.motion.tolist(), self.share.tolist(), self.added, strict=True))

    def describe(self) -> Note:
        """Describe the turn as a note of the path."""
        pole, tilt = self.located.pole, np.degrees(self.aside)
        where = f", the tool held {tilt:.2g}° beside it; the tip stands still" if self.aside else ""
        return Note(self.located.line, f"{pole.angle} turns by {np.degrees(self.turn):.0f}° at {pole.text}{where}")


@dataclass(frozen=True, eq=False)
class _Points:
    """m points of a path to be moved, by motion and share, and where they go in the projection about a pole, (m, 2)."""

    motion: Indices
    share: Array
    projected: Array


def find_pole_holds(
    pole: Pole,
    posted: Posted,
    programmed: ProgrammedPath,
    steps: PoleSteps,
    led_steps: list[tuple[int, int]],
    moved: Flags,
    angle: float,
) -> list[PoleHold]:
    """Find where a path comes within the angle tolerance of a pole without a route through it, and hold it there.

    led_steps : first and last of the steps that are led through a pole or held beside one already
    moved : (n,) records whose axes are moved already
    """
    aside = 0.0 if pole.joint is None else _OFF_POLE * angle
    if pole.joint is not None and aside < NEAR_HOLD:
        return []
    radius = HELD * angle
    is_led = np.zeros(len(steps.record), np.bool_)
    for first, last in led_steps:
        is_led[first : last + 1] = True
    near = steps.nearest < (1.0 - _EDGE) * radius  # a record on the circle is where a hold begins or ends
    runs = _find_runs(steps, near & ~is_led, radius)
    builder = _HoldBuilder(pole, posted, programmed, steps, moved, radius, aside)
    return [hold for run in runs if (hold := builder.build(run)) is not None]


def _find_runs(steps: PoleSteps, near: Flags, radius: float) -> list[tuple[int, int]]:
    """Find the first and the last of the steps of each stretch that stays within a circle about the pole."""
    inside = np.hypot(*steps.first.T) < radius
    follows = near & np.append(False, near[:-1]) & steps.joined & inside
    starts = np.flatnonzero(near & ~follows)
    ends = np.flatnonzero(near & ~np.append(follows[1:], False))
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


_NOTHING = _Points(np.empty(0, np.int64), np.empty(0), np.empty((0, 2)))


@dataclass(frozen=True, eq=False)
class _HoldBuilder:
    """Builds the holds of a path beside a pole: within ``radius`` of it the axis is held ``aside`` of it, rad.

    moved : (n,) records that stay where they have been moved to
    """

    pole: Pole
    posted: Posted
    programmed: ProgrammedPath
    steps: PoleSteps
    moved: Flags
    radius: float
    aside: float

    def build(self, run: tuple[int, int]) -> PoleHold | None:
        """Build the hold of a run of steps; None where nothing is to be moved."""
        steps, (first, last) = self.steps, run
        entry = meet_circle(steps.first[first], steps.last[first], self.radius)
        leave = meet_circle(steps.last[last], steps.first[last], self.radius)
        record, number, distance = self._list_records(run)
        if entry is None and leave is None and (not len(record) or distance.max() < 0.5 * EXACT):
            return None
        if self._is_held_already(run, distance):
            nothing, nowhere = np.empty(0, np.int64), np.empty((0, 3))
            return PoleHold(self._locate(run), nothing, nowhere, nothing, np.empty(0), nowhere, 0.0, self.aside)
        come, go = self._find_azimuths(entry, leave, record)
        if len(record):
            nearest = number[distance.argmin()]
            place, before = (int(steps.record[nearest]), float(steps.end[nearest])), number < nearest
        else:
            nearest = first + int(steps.nearest[first : last + 1].argmin())
            place, before = (int(steps.record[nearest]), float(steps.share[nearest])), np.zeros(0, np.bool_)
        moved = self.aside * np.where(before[:, None], _point_towards(come), _point_towards(go))
        turned, turn = self._turn(place, come, go)
        if len(record) and len(turned.motion):  # the last of them is the record itself
            turned = _Points(turned.motion[:-1], turned.share[:-1], turned.projected[:-1])
        if len(record) > 1 and not self.aside:
            turned = _NOTHING
        between = self._keep_between(record, moved)
        points = _join(_place_end(steps, first, entry), between, turned, _place_end(steps, last, leave))
        if not len(record) and not len(points.motion):
            return None
        tip, axis = self.programmed.interpolate(points.motion, points.share)
        extension = self.programmed.interpolate_extension(points.motion, points.share)
        added = self.pole.find_axes(tip, axis, points.projected, extension)
        axes = self._find_axes_at(record, moved)
        located = self._locate(run)
        return PoleHold(located, record, axes, points.motion, points.share, added, abs(turn), self.aside)

    def _keep_between(self, record: Indices, moved: Array) -> _Points:
        """Place records between those held beside a pole that moves, where even poses would come nearer to it.

        The way by which even poses leave the straight one falls with the square of a motion's length.

        record, moved : (k,) held, and where to in the projection, (k, 2)
        """
        after = np.flatnonzero(np.diff(record) == 1) + 1
        points = moved[after - 1]  # also on the way to the record at which the axis turns
        if not (self.pole.moves and self.aside and len(after)):
            return _NOTHING
        motion, ends = record[after], []
        turns = np.zeros((len(after), 3))
        for at in (motion - 1, motion):
            axis, extension = self._find_axes_at(at, points), self.programmed.get_extension(at)
            tip = self.programmed.tip[at] + extension[:, None] * (axis - self.programmed.axis[at])
            turns = find_nearest_direction(axis, turns)
            ends.append((tip, turns))
        tip, turns = (0.5 * (first + last) for first, last in zip(*ends, strict=True))
        off = self.pole.project_axes(tip, compute_tool_axes(turns)) - points
        counts = np.ceil(np.sqrt(np.hypot(*off.T) / (_WANDER * self.aside))).astype(np.int64).clip(1, _MOST_BETWEEN)
        at, row = np.repeat(motion, counts - 1), np.repeat(np.arange(len(motion)), counts - 1)
        number = np.arange(len(row)) - np.repeat(np.cumsum(counts - 1) - (counts - 1), counts - 1) + 1
        return _Points(at, number / counts[row], points[row])

    def _find_axes_at(self, record: Indices, projected: Array) -> Array:
        """Find the axes (k, 3) of records (k,) at points (k, 2) of the projection."""
        programmed = self.programmed
        extension = programmed.get_extension(record)
        return self.pole.find_axes(programmed.tip[record], programmed.axis[record], projected, extension)

    def _is_held_already(self, run: tuple[int, int], distance: Array) -> bool:
        """Tell whether a run stands on the circle of a hold, and where it does not, goes straight over the pole.

        distance : (k,) of its records off the pole
        """
        steps, (first, last) = self.steps, run
        on_circle = np.abs(distance - self.aside) < (1.0 - _STILL) * self.aside
        at_end = np.zeros(len(distance), np.bool_)
        at_end[[0, -1][: len(distance)]] = True
        at_end &= distance > _STILL * self.radius
        if not self.aside or not (on_circle | (distance < PRINTED) | at_end).all():
            return False
        near = first + np.flatnonzero(steps.nearest[first : last + 1] < _STILL * self.aside)
        ends_there = np.hypot(*steps.last[near].T) < PRINTED
        before, behind = near[ends_there], near[~ends_there]
        if not np.array_equal(before + 1, behind) or (len(behind) and behind[-1] > last):
            return False
        a, b = steps.first[before], steps.last[behind]
        return bool(((a * b).sum(1) <= -_OPPOSITE * np.hypot(*a.T) * np.hypot(*b.T)).all())

    def _locate(self, run: tuple[int, int]) -> PolePass:
        steps, (first, last) = self.steps, run
        nearest = first + int(steps.nearest[first : last + 1].argmin())
        begin, end = steps.record[first] - 1 + steps.begin[first], steps.record[last] - 1 + steps.end[last]
        line = int(self.programmed.path.line[steps.record[nearest]])
        return PolePass(self.pole, float(steps.nearest[nearest]), float(begin), float(end), line)

    def _find_azimuths(self, entry: Array | None, leave: Array | None, record: Indices) -> tuple[float, float]:
        """Find the directions from the pole in which the axis is held before the turn and behind it."""
        come, go = (None if end is None else float(np.arctan2(end[1], end[0])) for end in (entry, leave))
        if come is None and go is None:
            go = self._find_azimuth_of_home(int(record[0])) if self.aside else 0.0
        before, behind = (go if come is None else come), (come if go is None else go)
        assert before is not None and behind is not None
        return before, behind

    def _find_azimuth_of_home(self, record: int) -> float:
        """Find the direction in which the free joint stands as at home, for a path that never leaves the pole."""
        machine = self.posted.machine
        assert machine.wrist is not None
        records = np.array([record, record])
        axes = self._find_axes_at(records, self.aside * np.eye(2))
        poses = compute_poses(machine, self.programmed.tip[records], axes, MACHINE_FRAME)[0]
        first = machine.inverse(poses, self.posted.mode)[:, machine.wrist.first]
        at_home = machine.inverse(machine.home)[machine.wrist.first]
        sense = 1.0 if wrap_angle(first[1] - first[0]) > 0.0 else -1.0
        return sense * float(at_home - first[0])

    def _list_records(self, run: tuple[int, int]) -> tuple[Indices, Indices, Array]:
        """List the records in a run, the step that ends at each (-1 before the first), and the distances off the pole.

        (k,) each
        """
        steps, (first, last) = self.steps, run
        number = np.arange(first, last + 1)
        number = number[(steps.end[number] == 1.0) & (np.hypot(*steps.last[number].T) < self.radius)]
        record, distance = steps.record[number], np.hypot(*steps.last[number].T)
        start = float(np.hypot(*steps.first[first]))
        if start < self.radius and steps.begin[first] == 0.0:
            record, number = np.append(steps.record[first] - 1, record), np.append(-1, number)
            distance = np.append(start, distance)
        free = ~self.moved[record]
        return record[free], number[free], distance[free]

    def _turn(self, place: tuple[int, float], come: float, go: float) -> tuple[_Points, float]:
        """Turn the axis about the pole from one direction to another at a place, and measure the free angle's turn.

        Behind the pole the free angle is the same in the opposite direction, in the other mode. On the pole itself C
        turns between any two records.
        """
        aside, turn = self.aside, float(wrap_angle(np.array(go - come)))
        over = abs(turn) > SWING and (not aside or self._can_change_mode)
        if over:
            come, turn = flip_azimuth(come), float(wrap_angle(np.array(flip_azimuth(turn, -1.0))))
        count = int(np.ceil(abs(turn) / _ARC)) if abs(turn) > _STRAIGHT else 0
        if not aside:
            points = [np.zeros(2)] * (2 if count else 0)
        else:
            points = [aside * _point_towards(come + turn * k / count) for k in range(count + 1)] if count else []
            if over:
                inner = self.pole.list_inner_radii(self._get_axis(place), 0.5 * aside) or [_CLOSE * aside]
                back, ahead = _point_towards(flip_azimuth(come, -1.0)), _point_towards(come)
                way = [radius * back for radius in [aside, *inner, 0.0]] + [radius * ahead for radius in inner[::-1]]
                points = [*way, *(points or [aside * _point_towards(go)])]
        motion, share = place
        projected = np.array(points).reshape(-1, 2)
        return _Points(np.full(len(points), motion, np.int64), np.full(len(points), share), projected), turn

    def _get_axis(self, place: tuple[int, float]) -> Array:
        """Return the programmed axis (3,) in M at a motion and a share of it."""
        motion, share = max(place[0], 1), place[1] if place[0] else 0.0
        axis: Array = self.programmed.interpolate(np.array([motion]), np.array([share]))[1][0]
        return axis

    @cached_property
    def _can_change_mode(self) -> bool:
        """Whether the second joint may go as far to the other side of the pole as it goes on the path."""
        posted, wrist = self.posted, self.posted.machine.wrist
        if wrist is None or not len(posted.poses):
            return True
        return wrist.has_both_modes(posted.poses, posted.mode)


def _point_towards(azimuth: float) -> Array:
    return np.array([np.cos(azimuth), np.sin(azimuth)])


def _place_end(steps: PoleSteps, step: int, point: Array | None) -> _Points:
    """Place the record at which a path comes within the circle, or leaves it; none where a record is there already."""
    count = 0
    share = 0.0
    if point is not None:
        begin, end = steps.first[step], steps.last[step]
        fraction = float(np.hypot(*(point - begin)) / np.hypot(*(end - begin)))
        share = steps.locate(step, fraction)
        count = int(_EDGE < share < 1.0 - _EDGE)
    motion = np.full(count, steps.record[step], np.int64)
    projected = np.zeros((count, 2)) if point is None else np.tile(point, (count, 1))
    return _Points(motion, np.full(count, share), projected)


def _join(*pieces: _Points) -> _Points:
    motion, share = (np.concatenate([getattr(points, name) for points in pieces]) for name in ("motion", "share"))
    return _Points(motion, share, np.concatenate([points.projected for points in pieces]))


def find_steps_on(steps: PoleSteps, stretches: list[PolePass]) -> list[tuple[int, int]]:
    """Find the first and the last of the steps on each of some stretches, also those about another pole."""
    begins, ends = steps.record - 1 + steps.begin, steps.record - 1 + steps.end  # both rise
    first = np.searchsorted(ends, [located.begin for located in stretches], side="right")
    last = np.searchsorted(begins, [located.end for located in stretches]) - 1
    return [(a, b) for a, b in zip(first.tolist(), last.tolist(), strict=True) if a <= b]


class Stretches:
    """Stretches of a path, and which of them others meet."""

    def __init__(self, passes: list[PolePass]):
        ends = sorted((located.begin, located.end) for located in passes)
        self.begins = np.array([begin for begin, _ in ends])
        self.latest_ends = np.maximum.accumulate([end for _, end in ends]) if ends else self.begins

    def is_apart(self, located: PolePass) -> bool:
        """Tell whether a stretch shares nothing with any of these."""
        before = int(np.searchsorted(self.begins, located.end))  # those begin before it ends
        return before == 0 or bool(self.latest_ends[before - 1] <= located.begin)


def note_holds(holds: list[PoleHold]) -> list[Note]:
    """Note the holds on which a joint turns, or C by much."""
    return [hold.describe() for hold in holds if hold.turn > (_STRAIGHT if hold.aside else REPORTED)]
