"""Short steps of a programmed path near a pole, in the gnomonic projection about it, and how near each comes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Flags, Indices, count_repeats
from ...kinematics.wrist.pole_thresholds import VICINITY
from ..posting.posted import Posted
from ..programmed_path import ProgrammedPath
from .poles import Pole

FARTHEST_STEP = 1.0  # in the projection: a step that goes farther does not lie near the pole
_STEP = 0.02  # rad: motions that turn the axis farther are divided into steps
_MOST_STEPS, _MOST_IN_ALL = 2000, 4_000_000  # of a motion, and of a path whose motions are kilometres long
_POLE_TURN = 1.2  # rad that tool axis and a pole on a central leg part by, at most, when the axis turns by one


@dataclass(frozen=True, eq=False)
class PoleSteps:
    """m short steps of the programmed path near a pole, in order.

    record, begin, end : (m,) the motion by the record it leads to, and shares of it
    first, last : (m, 2) the tool axis at both ends, as :meth:`Pole.project_axes` has it
    joined : (m,) whether a step begins where the one before ends
    nearest, share : (m,) rad from the pole where a step is nearest to it, and the share there
    """

    record: Indices
    begin: Array
    end: Array
    first: Array
    last: Array
    joined: Flags
    nearest: Array
    share: Array

    def locate(self, step: int, fraction: float) -> float:
        """Locate a fraction of a step: the share of its motion."""
        return float(self.begin[step] + fraction * (self.end[step] - self.begin[step]))


def find_pole_steps(pole: Pole, programmed: ProgrammedPath, posted: Posted, motion: Indices) -> PoleSteps:
    """Divide the motions that may come near to a pole into steps, and measure how near each comes."""
    motion, turn = _find_motions_near(pole, programmed, posted, motion)
    counts = np.ceil(np.clip(turn / _STEP, 1.0, _MOST_STEPS)).astype(np.int64)
    if counts.sum() > _MOST_IN_ALL:
        counts = np.minimum(counts, max(1, _MOST_IN_ALL // len(counts)))
    record = np.repeat(motion, counts)
    number = count_repeats(counts)
    begin, end = number / counts.repeat(counts), (number + 1) / counts.repeat(counts)
    first, last = (pole.project_axes(*programmed.interpolate(record, share)) for share in (begin, end))
    way = last - first
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = np.clip(-(first * way).sum(1) / (way * way).sum(1), 0.0, 1.0)
    fraction = np.where(np.isfinite(fraction), fraction, 0.0)
    nearest = np.hypot(*(first + fraction[:, None] * way).T)
    nearest = np.where(np.isfinite(nearest) & (np.hypot(*way.T) < FARTHEST_STEP), nearest, np.inf)
    joined = np.concatenate([[False], np.where(record[1:] == record[:-1], True, record[1:] == record[:-1] + 1)])
    return PoleSteps(record, begin, end, first, last, joined[: len(record)], nearest, begin + fraction * (end - begin))


def _find_motions_near(
    pole: Pole, programmed: ProgrammedPath, posted: Posted, motion: Indices
) -> tuple[Indices, Array]:
    """Find motions that may come within VICINITY of a pole, and by how many rad they may turn the axis against it."""
    machine = posted.machine
    if pole.joint is None or machine.wrist is None:
        freedom = 1.0 - programmed.axis[:, 2] ** 2
    else:
        freedom = machine.wrist.measure_freedom(posted.poses)
    off_pole = np.arcsin(np.sqrt(np.clip(freedom, 0.0, 1.0)))
    length, turn = programmed.measure_motions(motion)
    if pole.moves:
        turn = _POLE_TURN * turn + 2.0 * length / min(machine.leg_sizes)
    near = 0.5 * (off_pole[motion] + off_pole[motion - 1] - turn) < VICINITY
    return motion[near], turn[near]


def meet_circle(outside: Array, inside: Array, radius: float) -> Array | None:
    """Find where a step from outside enters a circle about the pole, at whatever point it leaves it; None if inside."""
    if np.hypot(*outside) < radius:
        return None
    way = inside - outside
    p, q, r = float(way @ way), float(outside @ way), float(outside @ outside) - radius * radius
    fraction = (-q - math.sqrt(max(q * q - p * r, 0.0))) / p
    return outside + min(1.0, max(0.0, fraction)) * way
