"""What is proved of a machine over a whole box of poses: no singularity, amplification within bounds.

Everything is computed in intervals rounded outward; the small matrices' inverses and singular values are padded by
1e-12 of their size. Legs must close all over the box; the machine's other limits are not looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf, isfinite
from typing import Literal

import numpy as np

from ...arrays import Array
from ...errors import PoseError
from ...machine import Machine
from ..characteristic_length import characteristic_length
from ..extremes import SIDES
from .amplification import UNBOUNDED, Bracket, bracket
from .bisection import Budget, left_over, nowhere_negative, regular
from .counterexamples import Kind, singular_pose
from .interval_matrices import Box, Over

Span = tuple[float, float]
Verdict = Literal["proved", "refuted", "undecided"]


@dataclass(frozen=True, eq=False)
class Proof:
    """A claim on all poses of a box, and what came of it.

    counterexample : (axes,) of a claim that is refuted a pose at which it fails, of one undecided the middle of a part
        that was left open
    reason : why it is not proved, in a line
    brackets : of the least and the greatest amplification, where they were asked for
    boxes : how many parts of the box were looked at
    tolerance : relative; a bound is kept if it is not exceeded by more
    """

    claim: str
    verdict: Verdict
    counterexample: Array | None = None
    reason: str = ""
    brackets: tuple[Bracket, ...] = ()
    boxes: int = 0
    tolerance: float = 0.0


def box_of(
    machine: Machine,
    spans: Mapping[str, Span],
    at: Mapping[str, float] | None = None,
    length: float | None = None,
    mode: str | None = None,
) -> Box:
    """A box of poses: the axes in ``spans`` from low to high, those in ``at`` held, all others as at home; mm and rad.

    Raises :class:`PoseError` for a box that is none.
    """
    held = dict(zip(machine.axes, machine.home.tolist(), strict=True))
    for axis in (*spans, *(at or {})):
        if axis not in machine.axes:
            raise PoseError(f"unknown axis {axis}, {machine.name} has {' '.join(machine.axes)}")
    for axis, value in (at or {}).items():
        if axis in spans:
            raise PoseError(f"{axis} is held and a side of the box")
        if not isfinite(value):
            raise PoseError(f"{axis}: {value} is no place to hold it")
        held[axis] = float(value)
    for axis, (low, high) in spans.items():
        if not (isfinite(low) and isfinite(high) and low <= high):
            raise PoseError(f"the box's side along {axis} is empty: {low:g} to {high:g}")
        held[axis] = float(low)
    wide = {axis: (float(spans[axis][0]), float(spans[axis][1])) for axis in machine.axes if axis in spans}
    wide = {axis: span for axis, span in wide.items() if span[0] < span[1]}
    return Box(machine, wide, held, machine.checked_mode(mode), characteristic_length(machine, length))


def no_singularity(
    box: Box,
    kind: Kind,
    boxes: int = 200_000,
    seconds: float | None = 60.0,
) -> Proof:
    """Whether a box of poses (see :func:`box_of`) is free of parallel or of serial singularities.

    Proved by interval regularity of A (of the diagonal of B) in parts of the box, each as large as it may be; refuted
    by a pose whose margin is 0, met on the way between two poses with margins of opposite signs, or by a search.
    Undecided when ``boxes`` or ``seconds`` are spent.
    """
    claim, budget = f"no {kind} singularity", Budget(boxes, seconds)
    missed = _reached(box, claim, budget)
    if missed is not None:
        return missed
    singular = singular_pose(box, kind)
    if singular is not None:
        pose, name = singular
        return Proof(claim, "refuted", pose, f"{name} is singular there", boxes=budget.used)
    matrix = box.parallel if kind == "parallel" else box.serial
    left = left_over(regular(Over(matrix, box.inputs, box.trace), box.high - box.low), box.low, box.high, budget)
    if left is None:
        return Proof(claim, "proved", boxes=budget.used)
    return Proof(claim, "undecided", box.poses(left[None])[0], "a part is left open about there", boxes=budget.used)


def amplification(
    box: Box,
    low: float,
    high: float,
    tolerance: float = 1e-6,
    boxes: int = 200_000,
    seconds: float | None = 60.0,
    progress: Callable[[float], None] | None = None,
) -> Proof:
    """Whether low ≤ psi ≤ high for every velocity amplification psi all over a box of poses (see :func:`box_of`).

    The least and the greatest psi are bracketed to the relative ``tolerance`` by branch and bound on intervals. The
    claim is proved if the brackets exceed its bounds by no more than that share, refuted if a pose does.

    Raises :class:`PoseError` for bounds or a tolerance that are none.
    """
    if not (isfinite(low) and isfinite(high) and 0.0 <= low <= high):
        raise PoseError(f"amplification: bounds 0 <= low <= high expected, not {low:g} and {high:g}")
    if not 0.0 < tolerance < 1.0:
        raise PoseError(f"tolerance: a share between 0 and 1 expected, not {tolerance:g}")
    claim, budget = f"{low:.9g} <= psi <= {high:.9g}", Budget(boxes, seconds)
    missed = _reached(box, claim, budget)
    if missed is not None:
        return missed
    low, high = low * (1.0 - tolerance), high * (1.0 + tolerance)
    found = amplification_brackets(box, 0.25 * tolerance, boxes, seconds, progress, (low, high))
    verdict, pose, reason = _judged(*found.brackets, low, high)
    return Proof(claim, verdict, pose, reason, found.brackets, budget.used + found.boxes, tolerance)


@dataclass(frozen=True, eq=False)
class Brackets:
    """The least and the greatest amplification over a box, each between two numbers, from ``boxes`` parts of it."""

    brackets: tuple[Bracket, Bracket]
    boxes: int


def amplification_brackets(
    box: Box,
    tolerance: float = 1e-6,
    boxes: int = 200_000,
    seconds: float | None = 60.0,
    progress: Callable[[float], None] | None = None,
    bounds: tuple[float, float] = (0.0, inf),
) -> Brackets:
    """The least and the greatest velocity amplification over a box of poses that the legs reach all over.

    ``boxes`` and ``seconds`` are shared evenly by the two; little is spent on one that is beyond its ``bounds``.
    """
    part = progress or (lambda fraction: None)
    found: list[Bracket] = []
    used = 0
    for number, (side, bound) in enumerate(zip(SIDES, bounds, strict=True)):
        singular = singular_pose(box, "serial" if side == "least" else "parallel")
        if singular is not None:  # psi has no bound there, and no bisection would ever end
            value = 0.0 if side == "least" else inf
            found.append(Bracket(side, value, value, singular[0], True))
            continue
        budget = Budget(boxes // 2, None if seconds is None else 0.5 * seconds)
        told = partial(_part, part, 0.5 * number)
        found.append(bracket(box, side, tolerance, budget, bound, told))
        used += budget.used
    return Brackets((found[0], found[1]), used)


def _part(progress: Callable[[float], None], begin: float, fraction: float) -> None:
    progress(begin + 0.5 * fraction)


def _judged(least: Bracket, greatest: Bracket, low: float, high: float) -> tuple[Verdict, Array | None, str]:
    if greatest.found > high:
        value = f"{greatest.found:.9g}" if greatest.found < UNBOUNDED else "infinite, a parallel singularity"
        return "refuted", greatest.pose, f"the greatest psi there is {value}"
    if least.found < low:
        value = f"{least.found:.9g}" if least.found > 1.0 / UNBOUNDED else "0, a serial singularity"
        return "refuted", least.pose, f"the least psi there is {value}"
    if greatest.high <= high and least.low >= low:
        return "proved", None, ""
    open_ = greatest if greatest.high > high else least
    return "undecided", open_.pose, f"the {open_.side} psi lies between {open_.low:.9g} and {open_.high:.9g}"


def _reached(box: Box, claim: str, budget: Budget) -> Proof | None:
    """A refutation by a pose where a leg does not close, or None if all of them are proved to close everywhere."""
    points = box.samples
    poses = box.poses(points)
    lost = ~np.isfinite(box.machine.inverse(poses, box.mode)).all(1)
    if lost.any():
        pose = poses[int(lost.argmax())]
        broken = int(box.machine.check(pose, mode=box.mode))
        subject = box.machine.limit_parts[broken - 1].subject if broken else "the machine"
        return Proof(claim, "refuted", pose, f"{subject} does not reach it", boxes=budget.used)
    if not box.reach:
        return None
    decide = nowhere_negative(Over([box.reach], box.inputs, box.trace), box.high - box.low)
    left = left_over(decide, box.low, box.high, budget)
    if left is None:
        return None
    pose = box.poses(left[None])[0]
    if not np.isfinite(box.machine.inverse(pose, box.mode)).all():
        return Proof(claim, "refuted", pose, "a leg does not reach it", boxes=budget.used)
    return Proof(claim, "undecided", pose, "whether the legs reach all of it is left open there", boxes=budget.used)
