"""Designs: the winners of a search, each proved at all wanted poses, and the front of several objectives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..arguments import check_arguments
from ..arrays import Array, AxisRange, Progress
from ..budget import SECONDS, Budget
from ..errors import DescriptionError, PoseError
from ..machine import Machine
from ..toolpath.job import Job
from .design_proof import TOLERANCE, DesignProof
from .front import search_front
from .problem import DesignProblem
from .reserves import measure_reserve
from .search import KEPT, SLACK, Candidate
from .wants import WANTS, MarginProof, NormProof

_ALIKE = 1e-7  # relative: objectives closer than that are one
_SPARE = 1.0 + 1e-3  # by which estimates that were too short are longer: jobs come within some 0.1 % of the quickest
_ROUNDS = 5  # of searches with estimated times, each corrected by the jobs of the one before
_SEARCHING = 0.7  # of the time; the rest is for proofs
MOST_DESIGNS = 50


@dataclass(frozen=True, eq=False)
class ProvedDesign:
    """A machine that is proved to keep all wants at every wanted pose.

    machine : of its sizes and ranges
    sizes : its free numbers and shifts, mm and rad
    values : what it is worth: the objectives and the bounded quantities, each in the unit of its kind
    box : low and high of each axis, of the first wanted poses, mm and rad
    ranges : low and high of the legs' drives, mm and rad
    boxes : how many parts of the poses the proofs examined
    proved : of each of these quantities a value that is proved to be worse nowhere; None where it is only sampled, as
        objectives without a bound are where time is short
    job : of the problem's part, which keeps all limits too
    """

    machine: Machine
    sizes: Mapping[str, float]
    values: Mapping[str, float]
    box: Mapping[str, AxisRange]
    ranges: Mapping[str, AxisRange]
    boxes: int
    proved: Mapping[str, float | None] = field(default_factory=dict)
    job: Job | None = None

    def __repr__(self) -> str:
        return f"<parakin design of {self.machine.name}: {len(self.sizes)} sizes, proved with {self.boxes} boxes>"


@dataclass(frozen=True, eq=False)
class UnprovedDesign:
    """What the search found, but no proof confirmed.

    sizes : its free numbers by name, mm and rad
    reason : what was not proved
    """

    sizes: Mapping[str, float]
    reason: str

    def __repr__(self) -> str:
        return f"<parakin design not proved: {len(self.sizes)} sizes>"


@dataclass(frozen=True, eq=False)
class Designs:
    """The answer to a design problem.

    problem : the one that is answered
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
    """Find the best design by one objective, or ``count`` designs of the Pareto front of several, and prove each.

    Found by differential evolution, refined by the exchange method for semi-infinite programs, proved by intervals. The
    front's designs of two objectives have the best first one under evenly spaced bounds of the second one; of more, the
    least greatest distance from the ideal under evenly spaced weights. A proved design keeps the wants; that there is
    no better one is not proved.

    With tolerances (``within``) a proof is one for all machines within them. The search is repeated with what the
    nominal machine has to keep in hand for that, to the first order, until it is enough.

    A part's cycle time is estimated in the search, without jerks and forces, and told by its job where a design is
    proved. Where its bound is broken there, the search is repeated with estimates that are longer by as much.

    A workspace's volume is estimated in the search, and a lower bound of it is proved of a winner.

    problem : what is free, wanted, and to be least or greatest; its lengths are mm, angles rad
    count : of designs of a front
    seconds : of all the work; None for no end
    progress : called now and then with the fraction done

    Raises :class:`PoseError` for an invalid count or time.
    """
    if not 1 <= count <= MOST_DESIGNS:
        raise PoseError(f"count: 1 to {MOST_DESIGNS} designs expected, not {count}")
    budget = Budget(seconds)
    search = (lambda f: progress(_SEARCHING * f)) if progress else None
    rounds = _ROUNDS if "cycle_time" in problem.bounds or problem.within is not None else 1
    for left in range(rounds, 0, -1):
        candidates = search_front(problem, count, budget.take_fraction(_SEARCHING / left), search)
        if candidates[0].broken > KEPT:
            return Designs(problem, (), (), _describe_shortfall(problem, candidates[0]))
        made = [_make_design(problem, candidate) for candidate in candidates]
        corrected = [correct(problem, candidates, made) for correct in (_correct_estimates, _grow_reserve)]
        if left == 1 or not any(corrected):
            break
    proved, unproved = list[ProvedDesign](), list[UnprovedDesign]()
    for number, own in enumerate(made):
        share = budget.take_fraction(1.0 / (len(made) - number))
        design = own if isinstance(own, UnprovedDesign) else _prove_design(problem, own, share)
        if isinstance(design, ProvedDesign):
            proved.append(design)
        else:
            unproved.append(design)
        if progress:
            progress(_SEARCHING + (1.0 - _SEARCHING) * (number + 1) / len(candidates))
    return Designs(problem, _keep_best(problem, proved), tuple(unproved))


def _correct_estimates(
    problem: DesignProblem, candidates: list[Candidate], made: list[_MadeDesign | UnprovedDesign]
) -> bool:
    """Scale the estimates of cycle times up where a job breaks the bound that its estimate keeps; tell whether."""
    timer, bound, excess = problem.timer, problem.bounds.get("cycle_time"), 1.0
    if timer is None or bound is None:
        return False
    for candidate, design in zip(candidates, made, strict=True):
        if not isinstance(design, UnprovedDesign) and design.values["cycle_time"] > bound * (1.0 + TOLERANCE):
            estimate = _measure_value(problem, candidate, "cycle_time")
            excess = max(excess, design.values["cycle_time"] / estimate)
    timer.factor *= excess * _SPARE if excess > 1.0 else 1.0
    return excess > 1.0


def _grow_reserve(
    problem: DesignProblem, candidates: list[Candidate], made: list[_MadeDesign | UnprovedDesign]
) -> bool:
    """Grow what designs keep in hand to what their tolerances need; tell whether they need more."""
    needed = [
        measure_reserve(problem, design.machine, candidate.x, candidate.points)
        for candidate, design in zip(candidates, made, strict=True)
        if problem.within is not None and not isinstance(design, UnprovedDesign)
    ]
    grown = [problem.reserve.grow(reserve) for reserve in needed]
    return any(grown)


def _measure_value(problem: DesignProblem, candidate: Candidate, name: str) -> float:
    """Measure a quantity of a design at the poses that matter."""
    x = candidate.x[None]
    return problem.get_sign(name) * float(problem.list_losses(name, x, problem.measure(x, candidate.points)).max())


def _describe_shortfall(problem: DesignProblem, nearest: Candidate) -> str:
    sizes = problem.format_variables(dict(zip(problem.variables, nearest.x.tolist(), strict=True)), ".6g")
    want = nearest.want
    if want in problem.bounds:
        own, reserve = WANTS[want], problem.reserve.losses.get(want, 0.0)
        values = _measure_value(problem, nearest, want), problem.bounds[want], reserve
        value, bound, kept = (own.format_value(number, ".6g") for number in values)
        want += f": {value} where at {'least' if own.more else 'most'} {bound} is wanted"
        want += f" and {kept} kept in hand for tolerances" if reserve else ""
    return f"no design found that keeps every want; the nearest one ({sizes}) breaks {want}"


class _MadeDesign(NamedTuple):
    """A design as a machine, with the job of the part."""

    machine: Machine
    x: Array
    sizes: dict[str, float]
    values: dict[str, float]
    job: Job | None


def _make_design(problem: DesignProblem, candidate: Candidate) -> _MadeDesign | UnprovedDesign:
    """Make a design's machine and run the part on it; ranges that are fitted are what it needs between rows too."""
    sizes = dict(zip(problem.variables, candidate.x.tolist(), strict=True))
    ranges = _fit_ranges(problem, candidate) if problem.fit_strokes else {}
    home = problem.place_poses(candidate.x, problem.middle)[0].tolist()
    numbers = {name: sizes[name] for name in problem.family.names}
    axes = dict(zip(problem.machine.axes, home, strict=True))
    job = None
    try:
        machine = problem.machine.replace_parameters(numbers, ranges, axes)
        if problem.timer is not None:
            shift = problem.list_shifts(candidate.x)
            job = problem.timer.prepare_job(machine, shift)
            if _widen_ranges(problem, ranges, job):
                machine = problem.machine.replace_parameters(numbers, ranges, axes)
                job = problem.timer.prepare_job(machine, shift)
    except DescriptionError as error:
        return UnprovedDesign(sizes, str(error))
    named = dict.fromkeys((*problem.objectives, *problem.bounds))
    values = {name: _measure_value(problem, candidate, name) for name in named}
    if job is not None:
        if job.seconds is None or not job.runs:
            why = job.unplanned if job.posted.first is None else job.posted.first.text
            return UnprovedDesign(sizes, f"the part does not run: {why}")
        if "cycle_time" in values:
            values["cycle_time"] = job.seconds
    return _MadeDesign(machine, candidate.x, sizes, values, job)


def _prove_design(problem: DesignProblem, made: _MadeDesign, budget: Budget) -> ProvedDesign | UnprovedDesign:
    """Prove a design's limits and bounds at all wanted poses."""
    machine, sizes, values = made.machine, made.sizes, made.values
    numbers = {name: sizes[name] for name in problem.family.names}
    for name, bound in problem.bounds.items():
        sign = WANTS[name].sign
        if sign * values[name] > sign * bound + TOLERANCE * abs(bound):
            return UnprovedDesign(sizes, f"{name} is {WANTS[name].format_value(values[name], '.9g')}")
    proof = DesignProof(problem, machine, problem.move_sets(made.x), numbers, budget)
    wanted = {name: _find_wanted(problem, name, values[name]) for name in problem.wants}
    margins = {name: bound for name, bound in wanted.items() if isinstance(WANTS[name].proof, MarginProof)}
    reason = proof.prove_margins(margins)
    if reason:
        return UnprovedDesign(sizes, reason)
    proved: dict[str, float | None] = {
        name: values[name] if WANTS[name].whole else bound for name, bound in wanted.items()
    }
    norms = [name for name in wanted if isinstance(WANTS[name].proof, NormProof)]
    for number, name in enumerate(norms):
        seconds = budget.seconds_left / (len(norms) - number)
        worst = proof.bound_norm(name, wanted[name], seconds)
        proved[name] = worst
        if name in problem.bounds and not _is_kept(name, worst, problem.bounds[name]):
            limit = "nothing" if worst is None else WANTS[name].format_value(worst, ".9g")
            seen = WANTS[name].format_value(values[name], ".9g")
            return UnprovedDesign(sizes, f"{name} is {seen} where it was looked at, and {limit} is proved")
    if problem.gauge is not None:
        values["workspace"] = proved["workspace"] = problem.gauge.prove(machine, budget.seconds_left)
    drives = {drive.name: (drive.low, drive.high) for drive in machine.drives[: machine.leg_count]}
    return ProvedDesign(machine, sizes, values, proof.sets[0].ends, drives, proof.boxes, proved, made.job)


def _find_wanted(problem: DesignProblem, name: str, value: float) -> float:
    """Find what of a quantity is to be proved: its bound, or of an objective its value and what tolerances take."""
    sign = WANTS[name].sign
    bound = value + sign * problem.reserve.losses.get(name, 0.0) if name in problem.objectives else problem.bounds[name]
    return bound * (1.0 + sign * TOLERANCE)


def _is_kept(name: str, worst: float | None, bound: float) -> bool:
    sign = WANTS[name].sign
    return worst is not None and sign * worst <= sign * bound * (1.0 + sign * 1.01 * TOLERANCE)


def _fit_ranges(problem: DesignProblem, candidate: Candidate) -> dict[str, AxisRange]:
    """Fit the legs' drives to what they take at the poses that matter, some 1e-8 of the machine's size wider."""
    machine = problem.machine
    joints = problem.measure(candidate.x[None], candidate.points).travel[0]
    units = machine.joint_units[: machine.leg_count]
    slack = [SLACK * (problem.tapes.size if unit == "mm" else 1.0) for unit in units]
    bottom, top = joints.min(0) - problem.reserve.low, joints.max(0) + problem.reserve.high
    ends = zip(bottom.tolist(), top.tolist(), slack, strict=True)
    names = [drive.name for drive in machine.drives[: machine.leg_count]]
    return {name: (low - by, high + by) for name, (low, high, by) in zip(names, ends, strict=True)}


def _widen_ranges(problem: DesignProblem, ranges: dict[str, AxisRange], job: Job) -> bool:
    """Widen fitted ranges to where a job breaks them, and by the slack; tell whether there is one."""
    widened = False
    for offence in job.posted.offences:
        name, _, end = offence.limit.rpartition(".")
        if name in ranges and end in ("min", "max"):
            low, high = ranges[name]
            slack = SLACK * (problem.tapes.size if offence.unit == "mm" else 1.0)
            ranges[name] = (min(low, offence.value - slack), max(high, offence.value + slack))
            widened = True
    return widened


def _keep_best(problem: DesignProblem, designs: list[ProvedDesign]) -> tuple[ProvedDesign, ...]:
    """Keep the designs that no other one is as good as in all objectives, the best by the first one first."""
    signs = [problem.get_sign(name) for name in problem.objectives]
    values = np.array([[design.values[name] for name in problem.objectives] for design in designs]) * signs
    order: list[int] = np.lexsort(values.T[::-1]).tolist() if len(designs) else []
    kept = list[int]()
    for number in order:
        if not any((values[other] <= values[number] + _ALIKE * np.abs(values[number])).all() for other in kept):
            kept.append(number)
    return tuple(designs[number] for number in kept)
