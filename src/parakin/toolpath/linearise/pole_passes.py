"""A posted path led through the poles it passes within tolerance, and notes on the other passes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...kinematics.wrist import PRINTED, REPORTED, TRAVEL, VICINITY, wrap_angle
from ..path import Floats, Note, ToolPath
from ..posting.post import post_path
from ..posting.posted import Posted
from .cuts import Places, parts_of
from .deviation import FOUND, SHARES, Tube
from .interpolation import Indices, Programmed, denser, pointed
from .pole_steps import Pass, Steps, passes, steps_near
from .poles import Pole, poles_of

_MOVED = 0.99  # of the angle tolerance: what leading through poles may take between records
_TRIES = 8
_OFTEN = 0.25  # of the angle tolerance: for less the way to the pole begins with the motion


@dataclass(frozen=True, eq=False)
class _Led:
    """A pass through a pole: rad by which the programmed axis misses it, where it begins and ends, and its line."""

    pole: Pole
    miss: float
    begin: float
    end: float
    line: int

    @property
    def name(self) -> tuple[str, float]:
        return self.pole.text, self.begin


@dataclass
class Through:
    """A posted path that passes poles as it should.

    posted, places : the path, and where its records stand on the programmed one
    led : the passes led through a pole
    notes : on those that swing
    """

    posted: Posted
    places: Places
    led: list[_Led] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)


def posted_again(posted: Posted, path: ToolPath) -> Posted:
    """Another path in the same frame and mode."""
    return post_path(posted.machine, replace(path, frame=None), workpiece=posted.frame, mode=posted.mode)


def through_the_poles(tube: Tube, posted: Posted, motion: Indices) -> Through:
    """A path led through the poles that some of its motions pass within the tube's angle.

    The axes of records about such a pass are moved, by less than the tolerance, so that the path crosses the pole
    itself; where a single long motion does that, a record is put there. A pass is left as it is where that takes the
    axis out of tolerance between two records.
    """
    refused: set[tuple[str, float]] = set()
    for _ in range(_TRIES):
        result = _led_through(tube, posted, motion, refused)
        astray = _astray(tube, result)
        if not astray:
            break
        refused |= astray
    return result


def _astray(tube: Tube, result: Through) -> set[tuple[str, float]]:
    """The passes about which the path now leaves the programmed one by more than it may."""
    found: set[tuple[str, float]] = set()
    if result.posted.path is tube.programmed.path:
        return found
    path, places = Programmed(result.posted.path, result.posted.frame), result.places
    gone = places.record - 1 + places.end
    for led in result.led:
        first, last = np.searchsorted(gone, [led.begin - 1.0, led.end + 1.0])
        motion = np.arange(max(int(first), 1), min(int(last) + 1, len(gone))).repeat(len(SHARES))
        share = np.resize(SHARES, len(motion))
        there = places.begin[motion] + share * (places.end - places.begin)[motion]
        off = path.at(motion, share)[1] - tube.programmed.at(places.record[motion], there)[1]
        if np.sqrt((off * off).sum(1).max(initial=0.0)) > _MOVED * tube.angle:
            found.add(led.name)
    return found


def _led_through(tube: Tube, posted: Posted, motion: Indices, refused: set[tuple[str, float]]) -> Through:
    result = Through(posted, Places.of(len(posted.path)))
    axis = tube.programmed.axis.copy()
    crossings: list[tuple[Pole, Steps, Pass]] = []
    inclined = posted.path.turns is not None and bool(posted.path.turns[:, 0].any())  # no turns are found for axes
    for pole in poles_of(posted.machine, tube.under, posted.path.turns is not None):
        steps = steps_near(pole, tube.programmed, posted, motion)
        kept = []
        for found in passes(pole, tube.programmed, steps, tube.angle):
            if (axis[found.record] != tube.programmed.axis[found.record]).any():
                continue  # led through another pole already
            led = _led(pole, posted.path, steps, found)
            if led.name in refused or (inclined and (len(found.record) or found.miss > PRINTED)):
                continue
            axis[found.record] = found.axis
            kept.append(found)
            result.led.append(led)
        crossings += [(pole, steps, found) for found in kept if found.crossing >= 0]
        result.notes += _swings(pole, posted.path, steps, kept)
    moved = np.flatnonzero((axis != tube.programmed.axis).any(1)) if result.led else np.empty(0, np.int64)
    if len(moved):
        result.posted = posted_again(posted, pointed(posted.path, moved, axis[moved] @ tube.programmed.rotation))
    _cross(tube, result, crossings)
    return result


def _led(pole: Pole, path: ToolPath, steps: Steps, found: Pass) -> _Led:
    first, last = found.steps
    nearest = first + int(steps.nearest[first : last + 1].argmin())
    begin, end = steps.record[first] - 1 + steps.begin[first], steps.record[last] - 1 + steps.end[last]
    return _Led(pole, found.miss, float(begin), float(end), int(path.line[steps.record[nearest]]))


def _cross(tube: Tube, result: Through, crossings: list[tuple[Pole, Steps, Pass]]) -> None:
    """Put records on the poles where motions cross them, but where the interpolation passes there by itself."""
    if not crossings:
        return
    posted = result.posted
    between = Programmed(posted.path, posted.frame)
    added: list[tuple[int, float, Floats]] = []
    for pole, steps, found in crossings:
        motion = steps.record[found.crossing : found.crossing + 1]
        tip, axis = between.at(motion, np.array([found.share]))
        miss = float(np.hypot(*pole.beside(tip, axis)[0]))
        if miss <= PRINTED or _passes(tube, result, pole, motion):
            continue
        added.append((int(motion[0]), found.share, pole.pointing(tip, axis, np.zeros((1, 2)))[0]))
        if miss > _OFTEN * tube.angle:
            for share in found.ends:
                added.append((int(motion[0]), share, between.at(motion, np.array([share]))[1][0]))
    if added:
        added.sort(key=lambda new: new[:2])
        motions, shares = np.array([new[0] for new in added]), np.array([new[1] for new in added])
        axes = np.array([new[2] for new in added]) @ between.rotation
        result.places = result.places.cut(motions, shares)
        path = denser(posted.path, motions, shares)
        result.posted = posted_again(posted, pointed(path, motions + np.arange(len(motions)), axes))


def _passes(tube: Tube, result: Through, pole: Pole, motion: Indices) -> bool:
    """Whether what goes evenly is the angle that the pole frees, and the motion is within tolerance as it is."""
    if tube.under == "pose" and not pole.upright:
        return False
    angle = pole.angles(result.posted)
    swing = abs(float(angle[motion[0]] - angle[motion[0] - 1]))
    return swing < REPORTED and bool(tube.worst(parts_of(result.posted, result.places, motion), SHARES)[0] <= FOUND)


def _swings(pole: Pole, path: ToolPath, steps: Steps, led: list[Pass]) -> list[Note]:
    """Notes on the passes that are not led through the pole."""
    if not len(steps.record):
        return []
    with np.errstate(invalid="ignore"):
        way, turn = np.hypot(*(steps.x1 - steps.x0).T), _turns(steps)
    near = np.isfinite(way) & (way < 1.0)
    turn, way = np.where(near, turn, 0.0), np.where(near, way, 1.0)
    for found in led:
        turn[found.steps[0] : found.steps[1] + 1] = 0.0
    gone = np.cumsum(way + np.where(steps.joined, 0.0, 4.0 * TRAVEL))
    angle = np.concatenate([[0.0], np.cumsum(turn)])
    at = np.concatenate([[gone[0] - way[0]], gone])
    middle = gone - 0.5 * way
    to_and_fro = np.concatenate([[0.0], np.cumsum(np.abs(turn))])
    swing, turned = (
        np.abs(np.interp(middle + TRAVEL, at, total) - np.interp(middle - TRAVEL, at, total))
        for total in (angle, to_and_fro)
    )
    swinging = np.flatnonzero((turned > REPORTED) & (steps.nearest < VICINITY))
    notes = []
    for group in np.split(swinging, np.flatnonzero((np.diff(swinging) > 1) | ~steps.joined[swinging[1:]]) + 1):
        if len(group):
            nearest = group[steps.nearest[group].argmin()]
            window = slice(*np.searchsorted(at, [middle[nearest] - TRAVEL, middle[nearest] + TRAVEL]))
            most = max(float(swing[group].max()), float(np.ptp(angle[window])))
            if most > REPORTED:
                line = int(path.line[steps.record[nearest]])
                notes.append(_note(pole, line, float(steps.nearest[nearest]), most))
    return notes


def _turns(steps: Steps) -> Floats:
    """By how much the free angle turns on each step; what a path turns on the pole itself is the next step's."""
    begin, end = (np.arctan2(x[:, 1], x[:, 0]) for x in (steps.x0, steps.x1))
    on = [np.hypot(*x.T) < PRINTED for x in (steps.x0, steps.x1)]
    number, stretch = np.arange(len(begin)), np.cumsum(~steps.joined)
    last = np.maximum.accumulate(np.where(on[1], 0, number))  # the last step to end off the pole
    last = np.concatenate([[0], last[:-1]])
    known = ~on[0] | ((stretch[last] == stretch) & (last < number) & ~on[1][last])
    begin = np.where(on[0], end[last], begin)
    turns: Floats = np.where(known & ~on[1], wrap_angle(end - begin), 0.0)
    return turns


def notes_of(through: Through, posted: Posted, places: Places) -> list[Note]:
    """Notes on all passes that swing in the end; ``posted`` is the path with all its records."""
    notes, gone = list(through.notes), places.record - 1 + places.end
    for led in through.led:
        rows = np.flatnonzero((gone >= led.begin - 1e-9) & (gone <= led.end + 1e-9))
        if len(rows) < 3:
            first, last = np.searchsorted(gone, [led.begin, led.end])
            rows = np.arange(max(first - 1, 0), min(last + 1, len(gone)))
        angle = led.pole.angles(posted)[rows]
        swing = float(np.fmax.reduce(angle, initial=-np.inf) - np.fmin.reduce(angle, initial=np.inf))
        if swing > REPORTED:
            notes.append(_note(led.pole, led.line, led.miss, swing))
    return notes


def _note(pole: Pole, line: int, miss: float, swing: float) -> Note:
    off = f"{np.degrees(miss):.2g}°" if miss > PRINTED else "0°"
    return Note(line, f"the tool axis passes {off} beside {pole.text}: {pole.angle} swings {np.degrees(swing):.0f}°")
