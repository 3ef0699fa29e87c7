"""Notes on pole passes on which the free angle swings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...kinematics.turns import wrap_angle
from ...kinematics.wrist.pole_thresholds import PRINTED, REPORTED, TRAVEL, VICINITY
from ..path import Note, ToolPath
from ..posting.posted import Posted
from .path_cuts import PathPositions
from .pole_routing import PolePass
from .pole_steps import FARTHEST_STEP, PoleSteps
from .poles import Pole

_APART = 4.0 * TRAVEL  # travel put between stretches of steps, so that no swing is measured over two of them
_SAME_PLACE = 1e-9  # of a motion: what is rounding


def note_swings(pole: Pole, path: ToolPath, steps: PoleSteps, led: Sequence[tuple[int, int]]) -> list[Note]:
    """Note the passes that are not led through a pole nor held, and on which the free angle swings.

    led : first and last of the steps of each pass that is
    The swing is measured over the axis's travel by TRAVEL before and behind each step.
    """
    if not len(steps.record):
        return []
    with np.errstate(invalid="ignore"):
        way, turn = np.hypot(*(steps.last - steps.first).T), _measure_free_turns(steps)
    near = np.isfinite(way) & (way < FARTHEST_STEP)
    turn, way = np.where(near, turn, 0.0), np.where(near, way, FARTHEST_STEP)
    apart = np.ones(len(turn), np.bool_)
    for first, last in led:
        turn[first : last + 1] = 0.0
        apart[first : last + 1] = False
    travel = np.cumsum(way + np.where(steps.joined, 0.0, _APART))
    angle = np.concatenate([[0.0], np.cumsum(turn)])
    at = np.concatenate([[travel[0] - way[0]], travel])
    middle = travel - 0.5 * way
    to_and_fro = np.concatenate([[0.0], np.cumsum(np.abs(turn))])
    swing, turned = (
        np.abs(np.interp(middle + TRAVEL, at, total) - np.interp(middle - TRAVEL, at, total))
        for total in (angle, to_and_fro)
    )
    swinging = np.flatnonzero((turned > REPORTED) & (steps.nearest < VICINITY) & apart)
    notes = []
    for group in np.split(swinging, np.flatnonzero((np.diff(swinging) > 1) | ~steps.joined[swinging[1:]]) + 1):
        if len(group):
            nearest = group[steps.nearest[group].argmin()]
            first, last = np.searchsorted(at, [middle[nearest] - TRAVEL, middle[nearest] + TRAVEL])
            most = float(swing[group].max())
            if first < last:  # a single step may be longer
                most = max(most, float(np.ptp(angle[first:last])))
            if most > REPORTED:
                line = int(path.line[steps.record[nearest]])
                notes.append(_describe_swing(pole, line, float(steps.nearest[nearest]), most))
    return notes


def _measure_free_turns(steps: PoleSteps) -> Array:
    """Measure by how much the free angle turns on each step, rad; what it turns on the pole is the next step's."""
    begin, end = (np.arctan2(x[:, 1], x[:, 0]) for x in (steps.first, steps.last))
    on_pole = [np.hypot(*x.T) < PRINTED for x in (steps.first, steps.last)]
    number, stretch = np.arange(len(begin)), np.cumsum(~steps.joined)
    last = np.maximum.accumulate(np.where(on_pole[1], 0, number))  # the last step to end off the pole
    last = np.concatenate([[0], last[:-1]])
    known = ~on_pole[0] | ((stretch[last] == stretch) & (last < number) & ~on_pole[1][last])
    begin = np.where(on_pole[0], end[last], begin)
    turns: Array = np.where(known & ~on_pole[1], wrap_angle(end - begin), 0.0)
    return turns


def note_swings_of_passes(passes: Sequence[PolePass], posted: Posted, positions: PathPositions) -> list[Note]:
    """Note the passes led through a pole on which the free angle swings all the same.

    posted, positions : the path with all its records, and where these stand on the programmed one
    """
    notes, passed = [], positions.passed
    for pole_pass in passes:
        begin, end = pole_pass.begin, pole_pass.end
        rows = np.arange(*np.searchsorted(passed, [begin - _SAME_PLACE, np.nextafter(end + _SAME_PLACE, np.inf)]))
        if len(rows) < 3:
            first, last = np.searchsorted(passed, [begin, end])
            rows = np.arange(max(first - 1, 0), min(last + 1, len(passed)))
        angle = pole_pass.pole.get_angles(posted)[rows]
        swing = float(np.fmax.reduce(angle, initial=-np.inf) - np.fmin.reduce(angle, initial=np.inf))
        if swing > REPORTED:
            notes.append(_describe_swing(pole_pass.pole, pole_pass.line, pole_pass.miss, swing))
    return notes


def _describe_swing(pole: Pole, line: int, miss: float, swing: float) -> Note:
    off = f"{np.degrees(miss):.2g}°" if miss > PRINTED else "0°"
    return Note(line, f"the tool axis passes {off} beside {pole.text}: {pole.angle} swings {np.degrees(swing):.0f}°")
