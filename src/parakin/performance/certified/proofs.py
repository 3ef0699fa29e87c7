"""Proofs over a whole box of poses: no singularity, velocity amplification within bounds.

Everything is computed in intervals rounded outward; the small matrices' inverses and singular values are padded by
1e-12 of their size. Legs must close all over the box; the machine's other limits are not checked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import inf, isfinite
from typing import Literal

import numpy as np

from ...arrays import Array, AxisRange, Progress
from ...budget import SECONDS, Budget
from ...errors import PoseError
from ...workspaces.certified.matrix_bounds import MatrixBounds
from ...workspaces.certified.region import Region
from ..characteristic_length import choose_characteristic_length
from ..extremes import SIDES
from .amplification import Bracket, bracket_amplification
from .bisection import Undecided, decide_nonnegative, decide_regular, find_undecided_boxes
from .counterexamples import SingularityKind, find_singular_pose
from .interval_matrices import PoseBox
from .quotient_norms import UNBOUNDED

Verdict = Literal["proved", "refuted", "undecided"]


@dataclass(frozen=True, eq=False)
class Proof:
    """A claim on all poses of a box, with the verdict.

    counterexample : (axes,) a pose at which a refuted claim fails; of an undecided one the middle of an undecided box
    reason : why it is not proved, in a line
    brackets : of the least and the greatest amplification, if the claim is on them
    boxes : how many sub-boxes of the box were examined
    undecided : the fraction of the box that bisection left open
    tolerance : relative; a bound is kept if it is not exceeded by more
    """

    claim: str
    verdict: Verdict
    counterexample: Array | None = None
    reason: str = ""
    brackets: tuple[Bracket, ...] = ()
    boxes: int = 0
    tolerance: float = 0.0
    undecided: float = 0.0


def make_pose_box(region: Region, ranges: Mapping[str, AxisRange], length: float | None = None) -> PoseBox:
    """Make a box of poses in a region's mode: axes in ``ranges`` from low to high, others as fixed, or as at home.

    ranges : mm and rad
    length : the characteristic length, mm; by default the machine's own

    Raises :class:`PoseError` for an invalid box.
    """
    machine = region.machine
    fixed = dict(zip(machine.axes, machine.home.tolist(), strict=True)) | dict(region.fixed_axes)
    for axis in ranges:
        if axis not in machine.axes:
            raise PoseError(f"unknown axis {axis}, {machine.name} has {' '.join(machine.axes)}")
        if axis in region.stated_axes:
            raise PoseError(f"{axis} is fixed and a side of the box")
    for axis, (low, high) in ranges.items():
        if not (isfinite(low) and isfinite(high) and low <= high):
            raise PoseError(f"the box's side along {axis} is empty: {low:g} to {high:g}")
        fixed[axis] = float(low)
    wide = {axis: (float(ranges[axis][0]), float(ranges[axis][1])) for axis in machine.axes if axis in ranges}
    wide = {axis: ends for axis, ends in wide.items() if ends[0] < ends[1]}
    return PoseBox(machine, wide, fixed, region.mode, choose_characteristic_length(machine, length))


def prove_no_singularity(
    box: PoseBox,
    kind: SingularityKind,
    boxes: int = 200_000,
    seconds: float | None = SECONDS,
) -> Proof:
    """Prove that a box of poses (see :func:`make_pose_box`) has no parallel, serial or constraint singularities.

    Proved by interval regularity of A (of the diagonal of B, of the constraints' rates) in parts of the box, each as
    large as possible; refuted by a pose whose margin is zero, found by bisection between two poses with margins of
    opposite signs, or by a search.
    Undecided when ``boxes`` or ``seconds`` are spent.
    """
    claim, budget = f"no {kind} singularity", Budget(seconds, boxes)
    failure = _prove_reach(box, claim, budget)
    if failure is not None:
        return failure
    singular = find_singular_pose(box, kind)
    if singular is not None:
        pose, name = singular
        return Proof(claim, "refuted", pose, f"{name} is singular there", boxes=budget.used)
    matrices = {"parallel": lambda: box.parallel, "serial": lambda: box.serial, "constraint": lambda: box.constraint}
    matrix = matrices[kind]()
    decide = decide_regular(MatrixBounds(matrix, box.inputs, box.trace), box.high - box.low)
    undecided = find_undecided_boxes(decide, box.low, box.high, budget)
    if undecided is None:
        return Proof(claim, "proved", boxes=budget.used)
    return _leave_open(box, claim, undecided, "", budget)


def prove_amplification(
    box: PoseBox,
    low: float,
    high: float,
    tolerance: float = 1e-6,
    boxes: int = 200_000,
    seconds: float | None = SECONDS,
    progress: Progress | None = None,
) -> Proof:
    """Prove low ≤ psi ≤ high for every velocity amplification psi over a box of poses (see :func:`make_pose_box`).

    The least and the greatest psi are bracketed to the relative ``tolerance`` by branch and bound on intervals. The
    claim is proved if the brackets exceed its bounds by no more than that, refuted if a pose does.

    Raises :class:`PoseError` for invalid bounds or tolerance.
    """
    if not (isfinite(low) and isfinite(high) and 0.0 <= low <= high):
        raise PoseError(f"amplification: bounds 0 <= low <= high expected, not {low:g} and {high:g}")
    if not 0.0 < tolerance < 1.0:
        raise PoseError(f"tolerance: a share between 0 and 1 expected, not {tolerance:g}")
    claim, budget = f"{low:.9g} <= psi <= {high:.9g}", Budget(seconds, boxes)
    failure = _prove_reach(box, claim, budget)
    if failure is not None:
        return failure
    low, high = low * (1.0 - tolerance), high * (1.0 + tolerance)
    both = _share_brackets(box, 0.25 * tolerance, budget, progress, (low, high))
    verdict, pose, reason = _judge_brackets(*both.brackets, low, high)
    return Proof(claim, verdict, pose, reason, both.brackets, budget.used, tolerance)


@dataclass(frozen=True, eq=False)
class AmplificationBrackets:
    """The least and the greatest amplification over a box, each between two numbers, from ``boxes`` parts of it."""

    brackets: tuple[Bracket, Bracket]
    boxes: int


def bracket_extremes(
    box: PoseBox,
    tolerance: float = 1e-6,
    boxes: int = 200_000,
    seconds: float | None = SECONDS,
    progress: Progress | None = None,
    bounds: tuple[float, float] = (0.0, inf),
) -> AmplificationBrackets:
    """Bracket the least and the greatest velocity amplification over a box of poses that the legs reach all over.

    ``boxes`` and ``seconds`` are shared evenly by the two; little is spent on one that is beyond its ``bounds``.
    """
    return _share_brackets(box, tolerance, Budget(seconds, boxes), progress, bounds)


def _share_brackets(
    box: PoseBox, tolerance: float, budget: Budget, progress: Progress | None, bounds: tuple[float, float]
) -> AmplificationBrackets:
    """Bracket both extremes, each within half of the budget."""
    report = progress or (lambda fraction: None)
    brackets: list[Bracket] = []
    used = 0
    for number, (side, bound) in enumerate(zip(SIDES, bounds, strict=True)):
        singular = find_singular_pose(box, "serial" if side == "least" else "parallel")
        if singular is not None:  # psi has no bound there, and bisection would not end
            value = 0.0 if side == "least" else inf
            brackets.append(Bracket(side, value, value, singular[0], True))
            continue
        half = budget.take_fraction(1.0 / (len(SIDES) - number))
        report_half = partial(_report_half, report, 0.5 * number)
        brackets.append(bracket_amplification(box, side, tolerance, half, bound, report_half))
        budget.used += half.used
        used += half.used
    return AmplificationBrackets((brackets[0], brackets[1]), used)


def _report_half(progress: Progress, begin: float, fraction: float) -> None:
    progress(begin + 0.5 * fraction)


def _judge_brackets(least: Bracket, greatest: Bracket, low: float, high: float) -> tuple[Verdict, Array | None, str]:
    if greatest.attained > high:
        value = f"{greatest.attained:.9g}" if greatest.attained < UNBOUNDED else "infinite, a parallel singularity"
        return "refuted", greatest.pose, f"the greatest psi there is {value}"
    if least.attained < low:
        value = f"{least.attained:.9g}" if least.attained > 1.0 / UNBOUNDED else "0, a serial singularity"
        return "refuted", least.pose, f"the least psi there is {value}"
    if greatest.high <= high and least.low >= low:
        return "proved", None, ""
    wide = greatest if greatest.high > high else least
    return "undecided", wide.pose, f"the {wide.side} psi lies between {wide.low:.9g} and {wide.high:.9g}"


def _prove_reach(box: PoseBox, claim: str, budget: Budget) -> Proof | None:
    """Prove that all legs close all over the box: None, else a proof that is refuted or undecided."""
    points = box.samples
    poses = box.poses(points)
    lost = ~np.isfinite(box.machine.inverse(poses, box.mode)).all(1)
    if lost.any():
        pose = poses[int(lost.argmax())]
        broken = int(box.machine.check(pose, mode=box.mode))
        subject = box.machine.limit_definitions[broken - 1].subject if broken else "the machine"
        return Proof(claim, "refuted", pose, f"{subject} does not reach it", boxes=budget.used)
    if not box.reach:
        return None
    decide = decide_nonnegative(MatrixBounds([box.reach], box.inputs, box.trace), box.high - box.low)
    undecided = find_undecided_boxes(decide, box.low, box.high, budget)
    if undecided is None:
        return None
    pose = box.poses(undecided.middle[None])[0]
    if not np.isfinite(box.machine.inverse(pose, box.mode)).all():
        return Proof(claim, "refuted", pose, "a leg does not reach it", boxes=budget.used)
    return _leave_open(box, claim, undecided, "whether the legs reach it, ", budget)


def _leave_open(box: PoseBox, claim: str, undecided: Undecided, what: str, budget: Budget) -> Proof:
    """Make the proof of a claim that bisection left open, at one place and in a fraction of the box."""
    reason = f"{what}left open about there, in {100.0 * undecided.fraction:.3g} % of the box"
    pose = box.poses(undecided.middle[None])[0]
    return Proof(claim, "undecided", pose, reason, boxes=budget.used, undecided=undecided.fraction)
