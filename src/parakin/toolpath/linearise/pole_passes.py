"""Passes of the tool axis over a pole: a posted path is led through the poles that it passes within the tolerance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags, Indices
from ...kinematics.wrist.pole_thresholds import EXACT, PRINTED, REPORTED, is_upright
from ..path import Note
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath
from .crossed_poles import HeldPath, keep_on_crossed_pole
from .deviation import ALLOWED, SHARES, Deviation
from .path_cuts import PathPositions, select_spans
from .path_records import AddedRecord, divide_motions, insert_axes, replace_axes, repost_path
from .pole_holds import PoleHold, Stretches, find_pole_holds, find_steps_on, note_holds
from .pole_routing import PolePass, PoleRoute, find_pole_routes, locate_pass
from .pole_steps import PoleSteps, find_pole_steps
from .pole_swings import note_swings
from .poles import Pole, find_poles

# Shares of the angle tolerance.
_MOST_BETWEEN = 0.99  # what an axis may be moved between records, for the farthest point may lie between SHARES
_LARGE_MISS = 0.25  # for a smaller miss the way to the pole begins with the motion, and no further record is needed
_TRIES = 8
_UNTURNED = 1e-4  # rad of C: a tool that turns by less goes straight


@dataclass
class PolePasses:
    """A posted path led through poles.

    posted, positions : the path, and where its records stand on the programmed one
    passes : those led through a pole
    holds : stretches held beside a pole
    notes : on the passes beside a pole on which the free angle swings, and on the holds on which it turns
    """

    posted: Posted
    positions: PathPositions
    passes: list[PolePass] = field(default_factory=list)
    holds: list[PoleHold] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)


class _Crossings(NamedTuple):
    """The routes on which a path crosses a pole."""

    pole: Pole
    steps: PoleSteps
    routes: list[PoleRoute]


def lead_through_poles(deviation: Deviation, posted: Posted, motion: Indices) -> PolePasses:
    """Lead a path through the poles that some of its motions pass within the angle tolerance.

    The axes of records about such a pass are moved, by less than the tolerance, so that the path crosses the pole
    itself; where a single long motion does that, a record is put there. Where the path turns another way on the pole,
    starts, ends or jitters there, its axis is held beside the pole: see :mod:`~.pole_holds`. A pass is left as it is
    where that takes the axis out of tolerance between two records.
    """
    poles = find_poles(posted.machine, deviation.interpolation, posted.path.turns is not None)
    held_path = keep_on_crossed_pole(deviation, poles, posted, motion)
    if held_path is not None:
        led = _lead_held_path(deviation, poles, held_path, motion)
        if not _find_moved_too_far(deviation, led):
            return led
    return _lead_within_tolerance(deviation, posted, [(pole, motion) for pole in poles])


def _lead_held_path(deviation: Deviation, poles: list[Pole], path: HeldPath, motion: Indices) -> PolePasses:
    """Lead a path that is held on Z through the wrist's pole, and through Z where it is not path."""
    on_held = replace(deviation, programmed=ProgrammedPath(path.posted.path, path.posted.frame))
    sound = np.isin(path.positions.record, motion)
    near = [(poles[0], np.flatnonzero(sound)), (poles[1], np.flatnonzero(sound & ~path.find_held_motions()))]
    led = _lead_within_tolerance(on_held, path.posted, near)
    passes = [path.locate_on_programmed(pole_pass) for pole_pass in led.passes]
    holds = [replace(hold, located=path.locate_on_programmed(hold.located)) for hold in led.holds]
    positions = path.positions.compose(led.positions)
    return PolePasses(led.posted, positions, passes, [*path.holds, *holds], [*path.notes, *led.notes])


# The motions on which each pole is looked for.
_MotionsNear = list[tuple[Pole, Indices]]


def _lead_within_tolerance(deviation: Deviation, posted: Posted, near: _MotionsNear) -> PolePasses:
    """Lead a path through poles on all passes on which it keeps within the angle tolerance."""
    refused: set[tuple[str, float]] = set()
    for _ in range(_TRIES):
        led = _lead_unless_refused(deviation, posted, near, refused)
        too_far = _find_moved_too_far(deviation, led)
        if not too_far:
            break
        refused |= too_far
    return led


def _find_moved_too_far(deviation: Deviation, led: PolePasses) -> set[tuple[str, float]]:
    """Find the passes and holds about which the path now leaves the programmed one by more than it may.

    Between two of them it is the nearer one's doing.
    """
    if led.posted.path is deviation.programmed.path:
        return set()
    path, positions = ProgrammedPath(led.posted.path, led.posted.frame), led.positions
    passed, count = positions.passed, len(SHARES)
    keys = [pole_pass.key for pole_pass in led.passes] + [hold.key for hold in led.holds]
    nearest = np.full(len(passed) * count, np.inf)  # of each place that is too far off: how far the next of them is
    places: list[tuple[Indices, Array]] = []
    for pole_pass in (*led.passes, *(hold.located for hold in led.holds)):
        first, last = np.searchsorted(passed, [pole_pass.begin - 1.0, pole_pass.end + 1.0])
        motion = np.arange(max(int(first), 1), min(int(last) + 1, len(passed))).repeat(count)
        share = np.resize(SHARES, len(motion))
        span = (positions.end - positions.begin)[motion]
        programmed_share = positions.begin[motion] + share * span
        programmed_axis = deviation.programmed.interpolate(positions.record[motion], programmed_share)[1]
        off = path.interpolate(motion, share)[1] - programmed_axis
        far = np.flatnonzero(np.sqrt((off * off).sum(1)) > _MOST_BETWEEN * deviation.angle)
        at = (positions.record[motion] - 1 + programmed_share)[far]
        apart = np.maximum(np.maximum(pole_pass.begin - at, at - pole_pass.end), 0.0)
        place = (motion[0] * count if len(motion) else 0) + far
        nearest[place] = np.minimum(nearest[place], apart)
        places.append((place, apart))
    return {key for key, (place, apart) in zip(keys, places, strict=True) if (apart <= nearest[place]).any()}


def _lead_unless_refused(
    deviation: Deviation, posted: Posted, near: _MotionsNear, refused: set[tuple[str, float]]
) -> PolePasses:
    """Lead a path through its poles on all passes but the refused ones; note the passes on which an angle swings."""
    led = PolePasses(posted, PathPositions.at_records(len(posted.path)))
    programmed, turns = deviation.programmed, posted.path.turns
    axis = programmed.axis.copy()
    crossings: list[_Crossings] = []
    inclined = turns is not None and bool(turns[:, 0].any())  # with A no turns are found for other axes
    for pole, motion in near:
        steps = find_pole_steps(pole, programmed, posted, motion)
        routes = []
        candidates = find_pole_routes(pole, programmed, steps, deviation.angle, deviation.interpolation == "pose")
        shared = _find_shared_routes(deviation, steps, candidates, led.passes)
        for route, is_shared in zip(candidates, shared, strict=True):
            if is_shared or (axis[route.record] != programmed.axis[route.record]).any():
                continue  # led through another pole already
            pole_pass = locate_pass(pole, posted.path, steps, route)
            if pole_pass.key in refused or (inclined and (len(route.record) or route.miss > PRINTED)):
                continue
            axis[route.record] = route.axis
            routes.append(route)
            led.passes.append(pole_pass)
        crossings.append(_Crossings(pole, steps, [route for route in routes if route.crossing >= 0 or route.rays]))
        holds: list[PoleHold] = []
        if not inclined:
            passes = [*led.passes, *(hold.located for hold in led.holds)]
            stretches, is_moved = Stretches(passes), (axis != programmed.axis).any(1)
            led_steps = find_steps_on(steps, passes)
            for hold in find_pole_holds(pole, posted, programmed, steps, led_steps, is_moved, deviation.angle):
                if hold.key not in refused and stretches.is_apart(hold.located):
                    axis[hold.record] = hold.axis
                    holds.append(hold)
        led.holds += holds
        shared_steps = [route.steps for route, is_shared in zip(candidates, shared, strict=True) if is_shared]
        routed_steps = [
            *(route.steps for route in routes),
            *shared_steps,
            *find_steps_on(steps, [hold.located for hold in led.holds]),
        ]
        led.notes += [*note_swings(pole, posted.path, steps, routed_steps), *note_holds(holds)]
    moved = np.flatnonzero((axis != programmed.axis).any(1))
    if len(moved):
        led.posted = repost_path(posted, replace_axes(posted.path, moved, axis[moved] @ programmed.rotation))
    _insert_records_at_poles(deviation, led, crossings)
    if deviation.interpolation == "pose" and turns is None:
        _turn_upright_tools(led)
    return led


def _find_shared_routes(
    deviation: Deviation, steps: PoleSteps, routes: list[PoleRoute], passes: list[PolePass]
) -> list[bool]:
    """Find the routes that lie on passes through other poles which are one with theirs there.

    Two ways through one place that differ by little would make the path zigzag between their records.
    """
    if not passes or not routes:
        return [False] * len(routes)
    nearest = np.array(
        [first + int(steps.nearest[first : last + 1].argmin()) for first, last in (route.steps for route in routes)]
    )
    tip, axis = deviation.programmed.interpolate(steps.record[nearest], steps.share[nearest])
    at = steps.record[nearest] - 1 + steps.share[nearest]
    shared = np.zeros(len(routes), np.bool_)
    for pole in {id(located.pole): located.pole for located in passes}.values():
        own = [located for located in passes if located.pole is pole]
        begins, ends = (np.array([getattr(located, name) for located in own]) for name in ("begin", "end"))
        number = np.searchsorted(begins, at, "right") - 1
        is_on_pass = (number >= 0) & (at <= ends[number])
        shared |= is_on_pass & (np.hypot(*pole.project_axes(tip, axis).T) < deviation.angle)
    return [bool(flag) for flag in shared]


def _insert_records_at_poles(deviation: Deviation, led: PolePasses, crossings: list[_Crossings]) -> None:
    """Insert the records of holds, and those on the poles where motions cross them.

    None is inserted where the interpolation passes over the pole by itself.
    """
    if not any(crossing.routes for crossing in crossings) and not led.holds:
        return
    posted = led.posted
    path = ProgrammedPath(posted.path, posted.frame)
    added = [record for hold in led.holds for record in hold.list_added()]
    for crossing in crossings:
        added += _list_crossing_records(deviation, led, path, crossing)
    led.posted, led.positions = insert_axes(posted, led.positions, added)


def _turn_upright_tools(led: PolePasses) -> None:
    """Repeat the records on routes and holds at which an upright tool leaves with another C than it comes with.

    C turns between the two, where nothing depends on it: from the record on it would turn the tool's axis on its way
    out, and the free joint with it.
    """
    direction, poses = led.posted.machine.direction, led.posted.poses
    if direction is None or not (led.passes or led.holds) or len(poses) < 3:
        return
    upright, turn = is_upright(poses[:, direction.b]), np.abs(np.diff(poses[:, direction.c]))
    alone = upright[1:-1] & ~upright[:-2] & ~upright[2:]
    motion = np.flatnonzero(alone & (turn[1:] > _UNTURNED)) + 2  # those that lead away
    if len(motion):
        share = np.zeros(len(motion))
        led.positions = led.positions.insert(motion, share)
        led.posted = repost_path(led.posted, divide_motions(led.posted.path, motion, share))


def _list_crossing_records(
    deviation: Deviation, led: PolePasses, path: ProgrammedPath, crossings: _Crossings
) -> list[AddedRecord]:
    """List the records that the routes through a pole need: motion, share, and axis (3,)."""
    pole = crossings.pole
    rays = [ray for route in crossings.routes for ray in route.rays]
    routes = [route for route in crossings.routes if route.crossing >= 0]
    motion = crossings.steps.record[np.array([route.crossing for route in routes], np.int64)]
    share = np.array([route.share for route in routes])
    miss = np.hypot(*pole.project_axes(*path.interpolate(motion, share)).T)
    needed = miss > np.array([EXACT if route.rays else PRINTED for route in routes])
    needed[needed] = ~_cross_by_themselves(deviation, led, pole, motion[needed])
    ends = [
        (int(at), end)
        for at, route, is_far in zip(motion, routes, needed & (miss > _LARGE_MISS * deviation.angle), strict=True)
        if is_far
        for end in route.ends
    ]
    at = np.array([ray[0] for ray in rays] + motion[needed].tolist(), np.int64)
    shares = np.array([ray[1] for ray in rays] + share[needed].tolist())
    projected = np.array([ray[2] for ray in rays] + [np.zeros(2)] * int(needed.sum())).reshape(-1, 2)
    axes = pole.find_axes(*path.interpolate(at, shares), projected, path.interpolate_extension(at, shares))
    added = list(zip(at.tolist(), shares.tolist(), axes, strict=True))
    end_motion, end_share = np.array([end[0] for end in ends], np.int64), np.array([end[1] for end in ends])
    end_axes = path.interpolate(end_motion, end_share)[1]
    return added + list(zip(end_motion.tolist(), end_share.tolist(), end_axes, strict=True))


def _cross_by_themselves(deviation: Deviation, led: PolePasses, pole: Pole, motion: Indices) -> Flags:
    """Tell of which motions (m,) the angle that the pole frees goes evenly, and that keep the tolerance as they are."""
    if deviation.interpolation == "pose" and not pole.is_upright:
        return np.zeros(len(motion), np.bool_)
    angle = pole.get_angles(led.posted)
    swing = np.abs(angle[motion] - angle[motion - 1])
    spans = select_spans(led.posted, led.positions, motion)
    return np.asarray((swing < REPORTED) & (deviation.measure_spans(spans, SHARES) <= ALLOWED))
