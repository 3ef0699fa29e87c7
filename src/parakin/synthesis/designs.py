"""Designs: the winners of a search, each proved all over its box, and the front of two objectives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..algebra import Scalar, dot
from ..arguments import check_arguments
from ..arrays import Array, AxisRange, Progress
from ..budget import SECONDS, Budget
from ..errors import DescriptionError, PoseError
from ..machine import Machine
from ..performance.certified.proofs import Proof, make_pose_box, prove_amplification
from ..workspaces.certified.constraints import Constraint
from ..workspaces.certified.containment import prove_boxes
from ..workspaces.certified.region import Region, make_region
from .measures import DesignEvaluator
from .problem import DesignProblem
from .search import SLACK, Candidate, DesignSearch

TOLERANCE = 1e-6  # relative, within which bounds are kept
_KEPT = 1e-8  # by which a search may break a want, relative
_ALIKE = 1e-7  # relative: objectives closer than that are one
_BOXES = 200_000  # of a proof
_SEARCHING = 0.7  # of the time; the rest is for proofs
MOST_DESIGNS = 50


@dataclass(frozen=True, eq=False)
class ProvedDesign:
    """A machine that is proved to keep all wants at every pose of its box.

    sizes : its free numbers and shifts, mm and rad
    values : what it is worth: the objectives and the bounded quantities, amplification or mm
    box : low and high of each axis
    ranges : of the legs' drives
    boxes : how many parts of the box the proofs examined
    amplification : the proof of its bound, where one was wanted
    """

    machine: Machine
    sizes: Mapping[str, float]
    values: Mapping[str, float]
    box: Mapping[str, AxisRange]
    ranges: Mapping[str, AxisRange]
    boxes: int
    amplification: Proof | None = None

    def __repr__(self) -> str:
        return f"<parakin design of {self.machine.name}: {len(self.sizes)} sizes, proved with {self.boxes} boxes>"


@dataclass(frozen=True, eq=False)
class UnprovedDesign:
    """What the search found, but no proof confirmed: its numbers, and why."""

    sizes: Mapping[str, float]
    reason: str

    def __repr__(self) -> str:
        return f"<parakin design not proved: {len(self.sizes)} sizes>"


@dataclass(frozen=True, eq=False)
class Designs:
    """The answer to a design problem.

    front : proved designs none of which is better than another in all objectives, the best by the first one first
    unproved : those found without a proof
    shortfall : where no design keeps the wants, the want that the nearest one breaks, in a line
    """

    problem: DesignProblem
    front: tuple[ProvedDesign, ...]
    unproved: tuple[UnprovedDesign, ...] = field(default=())
    shortfall: str = ""

    def __repr__(self) -> str:
        return f"<parakin designs of {self.problem.machine.name}: {len(self.front)} proved>"


@check_arguments
def find_designs(
    problem: DesignProblem, count: int = 7, seconds: float | None = SECONDS, progress: Progress | None = None
) -> Designs:
    """Find the design of the least objective, or ``count`` designs of the Pareto front of two, and prove each.

    Found by differential evolution, refined by the exchange method for semi-infinite programs, proved by intervals. The
    front's designs have the least first objective under evenly spaced bounds of the second one. A proved design keeps
    the wants; that there is no better one is not proved. ``seconds`` bounds the time of all.

    Raises :class:`PoseError` for an invalid count or time.
    """
    if not 1 <= count <= MOST_DESIGNS:
        raise PoseError(f"count: 1 to {MOST_DESIGNS} designs expected, not {count}")
    budget = Budget(seconds)
    evaluator = DesignEvaluator(problem)
    candidates = _search_front(evaluator, count, budget.take_fraction(_SEARCHING), progress)
    if isinstance(candidates, str):
        return Designs(problem, (), (), candidates)
    proved, unproved = list[ProvedDesign](), list[UnprovedDesign]()
    for number, candidate in enumerate(candidates):
        design = _prove_design(evaluator, candidate, budget.take_fraction(1.0 / (len(candidates) - number)))
        if isinstance(design, ProvedDesign):
            proved.append(design)
        else:
            unproved.append(design)
        if progress:
            progress(_SEARCHING + (1.0 - _SEARCHING) * (number + 1) / len(candidates))
    return Designs(problem, _keep_best(problem, proved), tuple(unproved))


def _search_front(
    evaluator: DesignEvaluator, count: int, budget: Budget, progress: Progress | None
) -> list[Candidate] | str:
    """Search the front's designs by bounds of the second objective; a line on the want that is broken if none is."""
    problem = evaluator.problem
    runs, done = count + 2 if len(problem.minimise) > 1 and count > 1 else 1, 0

    def run(objective: str, bounds: Mapping[str, float], seeds: list[Array]) -> Candidate:
        nonlocal done
        begin = _SEARCHING * done / runs
        report = (lambda f: progress(begin + _SEARCHING / runs * f)) if progress else None
        candidate = DesignSearch(evaluator, objective, bounds).run(
            budget.take_fraction(1.0 / (runs - done)), seeds, report
        )
        done += 1
        return candidate

    first = problem.minimise[0]
    best = run(first, problem.bounds, [])
    if best.broken > _KEPT:
        return _describe_shortfall(problem, best)
    if runs == 1:
        return [best]
    second = problem.minimise[1]
    other = run(second, problem.bounds, [best.x])
    if other.broken > _KEPT:
        return [best]
    end = run(second, _tighten(problem.bounds, first, best.value * (1.0 + TOLERANCE)), [best.x])
    far = end if end.broken <= _KEPT else best
    front = [far]
    highest = far.value if far is end else _measure_value(evaluator, far, second)
    for step in np.linspace(highest, other.value, count)[1:]:
        bound = float(step) * (1.0 + 1e-9)
        candidate = run(first, _tighten(problem.bounds, second, bound), [front[-1].x, other.x])
        if candidate.broken <= _KEPT:
            front.append(candidate)
    return front


def _tighten(bounds: Mapping[str, float], name: str, bound: float) -> dict[str, float]:
    return {**bounds, name: min(bound, bounds.get(name, np.inf))}


def _measure_value(evaluator: DesignEvaluator, candidate: Candidate, name: str) -> float:
    """Measure a quantity of a design at the poses that matter."""
    problem = evaluator.problem
    if name in problem.variables:
        return float(candidate.x[problem.variables.index(name)])
    m = evaluator.measure(candidate.x[None], candidate.points)
    if name == "stroke":
        return float((m.joints[0].max(0) - m.joints[0].min(0)).max())
    values = {"amplification": m.psi, "greatest_amplification": m.psi[..., 0], "footprint": m.feet}
    return float(values[name].max())


def _describe_shortfall(problem: DesignProblem, nearest: Candidate) -> str:
    sizes = ", ".join(f"{name} {value:.6g}" for name, value in zip(problem.variables, nearest.x, strict=True))
    return f"no design found that keeps every want; the nearest one ({sizes}) breaks {nearest.want}"


def _prove_design(evaluator: DesignEvaluator, candidate: Candidate, budget: Budget) -> ProvedDesign | UnprovedDesign:
    """Make a design's machine, and prove its limits, footprint and amplification all over its box."""
    problem, n = evaluator.problem, len(evaluator.problem.family.names)
    sizes = dict(zip(problem.variables, candidate.x.tolist(), strict=True))
    ranges = _fit_ranges(evaluator, candidate) if problem.fit_strokes else {}
    home = problem.place_poses(candidate.x, np.full(len(problem.wide_axes), 0.5)).tolist()
    try:
        numbers = dict(zip(problem.family.names, candidate.x[:n].tolist(), strict=True))
        axes = dict(zip(problem.machine.axes, home, strict=True))
        machine = problem.machine.replace_parameters(numbers, ranges, axes)
    except DescriptionError as error:
        return UnprovedDesign(sizes, str(error))
    box = problem.place_box(candidate.x)
    named = [*problem.minimise, *(name for name in problem.bounds if name not in problem.minimise)]
    values = {name: _measure_value(evaluator, candidate, name) for name in named}
    for name, bound in problem.bounds.items():
        if values[name] > bound * (1.0 + TOLERANCE):
            return UnprovedDesign(sizes, f"{name} is {values[name]:.9g}")
    turning = {axis: ends for axis, ends in box.items() if axis not in "XYZ" and ends[0] < ends[1]}
    fixed = {axis: ends[0] for axis, ends in box.items() if ends[0] == ends[1]}
    region = make_region(machine, at=fixed, every=turning)
    footprint = values.get("footprint")
    more = [] if footprint is None else _bound_footprint(region, footprint * (1.0 + TOLERANCE))
    low, high = np.array([box[axis] for axis in region.free_axes]).T
    containment = prove_boxes(region, low[None], high[None], more, _BOXES, budget.take_fraction(0.5))
    if not containment.proved[0]:
        limit = int(containment.limit[0])
        return UnprovedDesign(
            sizes, f"{containment.names[limit]} is broken in the box" if limit >= 0 else "left undecided"
        )
    proof = _prove_amplification(evaluator, region, box, values, budget)
    if proof is not None and proof.verdict != "proved":
        return UnprovedDesign(sizes, f"{proof.claim} is {proof.verdict}: {proof.reason}")
    drives = {drive.name: (drive.low, drive.high) for drive in machine.drives[: machine.leg_count]}
    boxes = int(containment.boxes[0]) + (proof.boxes if proof else 0)
    return ProvedDesign(machine, sizes, values, box, drives, boxes, proof)


def _prove_amplification(
    evaluator: DesignEvaluator,
    region: Region,
    box: Mapping[str, AxisRange],
    values: Mapping[str, float],
    budget: Budget,
) -> Proof | None:
    """Prove the bounds of the amplification that a problem names; None where it names none."""
    bounds = {
        name: min(evaluator.problem.bounds.get(name, np.inf), values[name] * (1.0 + TOLERANCE))
        for name in ("amplification", "greatest_amplification")
        if name in values
    }
    if not bounds:
        return None
    wide = {axis: ends for axis, ends in box.items() if ends[0] < ends[1]}
    poses = make_pose_box(region, wide, evaluator.length.value)
    least = 1.0 / bounds["amplification"] if "amplification" in bounds else 0.0
    seconds = None if budget.seconds_left == np.inf else max(budget.seconds_left, 1e-3)
    return prove_amplification(poses, least, min(bounds.values()), TOLERANCE, _BOXES, seconds)


def _fit_ranges(evaluator: DesignEvaluator, candidate: Candidate) -> dict[str, AxisRange]:
    """Fit the legs' drives to what they take at the poses that matter, some 1e-8 of the machine's size wider."""
    machine = evaluator.problem.machine
    joints = evaluator.measure(candidate.x[None], candidate.points).joints[0]
    units = machine.joint_units[: machine.leg_count]
    slack = [SLACK * (evaluator.size if unit == "mm" else 1.0) for unit in units]
    ends = zip(joints.min(0).tolist(), joints.max(0).tolist(), slack, strict=True)
    names = [drive.name for drive in machine.drives[: machine.leg_count]]
    return {name: (low - by, high + by) for name, (low, high, by) in zip(names, ends, strict=True)}


def _bound_footprint(region: Region, diameter: float) -> list[Constraint]:
    """Bound the struts' joints at the base: margins that are ≥ 0 within a circle about the machine's Z axis."""
    traced, d = region.traced_pose, len(region.free_axes)
    feet = region.machine.trace_equations({}).list_feet(traced.pose, region.mode)
    position, orientation = traced.inputs[:d], traced.inputs[d:]
    margins: list[Scalar] = [1.0 - dot(foot[:2], foot[:2]) * (4.0 / diameter**2) for foot in feet]
    return [Constraint("footprint", margin, position, orientation) for margin in margins]


def _keep_best(problem: DesignProblem, designs: list[ProvedDesign]) -> tuple[ProvedDesign, ...]:
    """Keep the designs that no other one is as good as in all objectives, the best by the first one first."""
    values = np.array([[design.values[name] for name in problem.minimise] for design in designs])
    order: list[int] = np.lexsort(values.T[::-1]).tolist() if len(designs) else []
    kept = list[int]()
    for number in order:
        if not any((values[other] <= values[number] * (1.0 + _ALIKE)).all() for other in kept):
            kept.append(number)
    return tuple(designs[number] for number in kept)
