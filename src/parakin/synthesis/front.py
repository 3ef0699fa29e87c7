"""The Pareto front of several objectives, each of its designs a search of its own."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations, pairwise

import numpy as np

from ..arrays import Array, Progress
from ..budget import Budget
from .problem import DesignProblem
from .search import KEPT, Candidate, DesignSearch, Goal

TOLERANCE = 1e-6
_EVEN = 1e-9  # relative, by which bounds along a front are wider than the numbers they come from
_LEAST_WEIGHT = 1e-2  # of an objective, so that a front's design is best in all of them


def search_front(problem: DesignProblem, count: int, budget: Budget, progress: Progress | None) -> list[Candidate]:
    """Search for designs of the front; the one that breaks its wants least alone, where none keeps them."""
    return _FrontSearch(problem, count, budget, progress).run()


class _FrontSearch:
    def __init__(self, problem: DesignProblem, count: int, budget: Budget, progress: Progress | None):
        self.problem, self.count, self.budget, self.progress = problem, count, budget, progress
        self.names = problem.objectives
        several = len(self.names)
        self.weights = _spread_weights(several, count) if several > 2 and count > 1 else np.empty((0, several))
        self.runs = 1 if several == 1 or count == 1 else count + 2 if several == 2 else several + len(self.weights)
        self.done = 0
        self.bounds = {name: problem.get_sign(name) * bound for name, bound in problem.bounds.items()}

    def _search(self, goal: Goal, bounds: Mapping[str, float], seeds: list[Array]) -> Candidate:
        begin = self.done / self.runs
        report = self.progress
        step = (lambda f: report(begin + f / self.runs)) if report else None
        share = self.budget.take_fraction(1.0 / (self.runs - self.done))
        candidate = DesignSearch(self.problem, goal, bounds).run(share, seeds, step)
        self.done += 1
        return candidate

    def run(self) -> list[Candidate]:
        best = self._search(Goal(self.names[:1]), self.bounds, [])
        if best.broken > KEPT or self.runs == 1:
            return [best]
        return self._run_two(best) if len(self.names) == 2 else self._run_several(best)

    def _run_two(self, best: Candidate) -> list[Candidate]:
        """Search the front of two objectives by evenly spaced bounds of the second one."""
        first, second = self.names
        other = self._search(Goal((second,)), self.bounds, [best.x])
        if other.broken > KEPT:
            return [best]
        end = self._search(Goal((second,)), self._tighten(first, best.value + TOLERANCE * abs(best.value)), [best.x])
        far = end if end.broken <= KEPT else best
        front = [far]
        highest = far.value if far is end else self._measure_loss(far, second)
        for step in np.linspace(highest, other.value, self.count)[1:].tolist():
            bounds = self._tighten(second, step + _EVEN * abs(step))
            candidate = self._search(Goal((first,)), bounds, [front[-1].x, other.x])
            if candidate.broken <= KEPT:
                front.append(candidate)
        return front

    def _run_several(self, best: Candidate) -> list[Candidate]:
        """Search the front of more objectives: of each weighing the least greatest distance from the ideal.

        The ideal has the best value of each objective, the distances are in parts of the worst among those designs.
        """
        ends = [best]
        for name in self.names[1:]:
            ends.append(self._search(Goal((name,)), self.bounds, [ends[-1].x]))
        ends = [end for end in ends if end.broken <= KEPT]
        losses = np.array([[self._measure_loss(end, name) for name in self.names] for end in ends])
        ideal, widths = losses.min(0), np.maximum(np.ptp(losses, axis=0), 1e-9 * np.abs(losses).max(0) + 1e-300)
        front = list(ends)
        for weight in self.weights:
            scales = widths / np.maximum(weight, _LEAST_WEIGHT)
            goal = Goal(self.names, tuple(ideal.tolist()), tuple(scales.tolist()))
            candidate = self._search(goal, self.bounds, [end.x for end in ends])
            if candidate.broken <= KEPT:
                front.append(candidate)
        return front

    def _tighten(self, name: str, bound: float) -> dict[str, float]:
        return {**self.bounds, name: min(bound, self.bounds.get(name, np.inf))}

    def _measure_loss(self, candidate: Candidate, name: str) -> float:
        x = candidate.x[None]
        return float(self.problem.list_losses(name, x, self.problem.measure(x, candidate.points)).max())


def _spread_weights(count: int, designs: int) -> Array:
    """Spread weights evenly over a simplex (Das and Dennis), as many as are wanted beside its corners, or fewer."""
    steps = 1
    while len(_list_weights(count, steps + 1)) <= designs:
        steps += 1
    inner = [w for w in _list_weights(count, steps) if max(w) < 1.0]
    return np.array(inner or [(1.0 / count,) * count])


def _list_weights(count: int, steps: int) -> list[tuple[float, ...]]:
    bars = combinations(range(steps + count - 1), count - 1)
    edges = [(-1, *bar, steps + count - 1) for bar in bars]
    return [tuple((b - a - 1) / steps for a, b in pairwise(edge)) for edge in edges]
