"""The search for a design: differential evolution over a lattice of poses, then the exchange method over all of them.

What must hold at every pose of a set is a semi-infinite program. The exchange method (Blankenship and Falk, 1976)
solves it for finitely many poses by sequential quadratic programming, adds those at which the answer is worst, and goes
on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution, minimize

from ..arrays import Array, Indices, Progress
from ..budget import Budget
from ..performance.search import search_maxima
from .measures import LOST, Measures
from .problem import DesignProblem
from .wants import WANTS

SLACK = 1e-8  # in parts of the machine's size, or rad: by which limits are kept, so that this can be proved
_LEAST_SIDE = 1e-3  # of det A in the middle of the wanted poses
_INFEASIBLE = 1e9  # added to what an infeasible design is worth
_POPULATION = 12  # a variable
_GENERATIONS = 100
_ROUNDS = 12  # of the exchange
_ROWS = 160  # constraints that a quadratic program sees
_WORST = 4  # poses for a constraint to begin from
_FINEST = 1e-5  # last step of the search for the worst, of its first: inner maxima are flat, sides are tried exactly
_STEP = 1e-6  # of a variable's range, for derivatives
_NEAR = 0.1  # of a variable's range, that a round of the exchange may go
_KEPT = 1e-9  # by which a constraint may be broken in the end
KEPT = 1e-8  # by which a search may break a want, relative


@dataclass(frozen=True, eq=False)
class Candidate:
    """A design x (variables,), what it is worth, and by how much it breaks which want; not proved.

    points : (P, width) the poses that matter
    """

    x: Array
    value: float
    broken: float
    want: str
    points: Array


@dataclass(frozen=True, eq=False)
class Goal:
    """What is minimised: of some quantities the greatest of (loss - reference)/scale, less is better."""

    names: tuple[str, ...]
    references: tuple[float, ...] = (0.0,)
    scales: tuple[float, ...] = (1.0,)

    @property
    def terms(self) -> list[tuple[str, float, float]]:
        return list(zip(self.names, self.references, self.scales, strict=True))


class DesignSearch:
    """Minimises a goal while quantities are bounded."""

    def __init__(self, problem: DesignProblem, goal: Goal, bounds: Mapping[str, float]):
        """Take bounds of losses, the greatest ones, by names of quantities and of free numbers."""
        self.problem, self.goal = problem, goal
        self.bounds = {name: bound - problem.reserve.losses.get(name, 0.0) for name, bound in bounds.items()}
        self.low, self.width = problem.ranges[:, 0], np.ptp(problem.ranges, axis=1)
        self.lattice = problem.lattice
        self.wants = [*problem.tapes.limits, "parallel singularity", *bounds]
        self.columns = [WANTS[name] for name in dict.fromkeys((*bounds, *goal.names)) if name in WANTS]

    def run(self, budget: Budget, seeds: Sequence[Array] = (), progress: Progress | None = None) -> Candidate:
        """Search for the best design; where none keeps all wants, for the one that breaks them least."""
        x = self._evolve(budget.take_fraction(0.6), seeds, progress)
        return self._exchange(x, budget)

    # Values and violations, for batches of designs.

    def _measure(self, x: Array, points: Array) -> Measures:
        return self.problem.measure(self.low + self.width * x, points)

    def _list_losses(self, name: str, x: Array, m: Measures) -> Array:
        return self.problem.list_losses(name, self.low + self.width * x, m)

    def _list_margins(self, m: Measures) -> Array:
        """List margins of limits and of singularities, (S, P, k), ≥ 0 where they are kept with some slack."""
        return np.concatenate([m.margins - SLACK - self.problem.reserve.margins, m.side - _LEAST_SIDE], -1)

    def _list_all_margins(self, m: Measures) -> Array:
        """List those at the part's poses too, (S, P', k)."""
        return np.concatenate([self._list_margins(at) for at in (m, m.at_part) if at is not None], 1)

    def _measure_goal(self, x: Array, m: Measures) -> Array:
        """Measure what designs are worth, (S,)."""
        each = [(self._list_losses(name, x, m).max(1) - low) / scale for name, low, scale in self.goal.terms]
        return np.asarray(np.max(each, axis=0))

    def _measure_violations(self, x: Array, m: Measures) -> Array:
        """Measure by how much each want is broken, (S, wants)."""
        lost = np.nan_to_num(np.maximum(-self._list_all_margins(m), 0.0), nan=LOST, posinf=LOST)
        over = [
            _limit_excess((self._list_losses(name, x, m) - bound) / _scale_bound(bound))
            for name, bound in self.bounds.items()
        ]
        each = [lost.max(1) + lost.mean(1), *((o.max(1) + o.mean(1))[:, None] for o in over)]
        return np.concatenate(each, 1)

    # Differential evolution; a feasible design is better than one that is not (Deb, 2000).

    def _evolve(self, budget: Budget, seeds: Sequence[Array], progress: Progress | None) -> Array:
        generation = 0

        def evaluate(columns: Array) -> Array:
            x = np.ascontiguousarray(np.atleast_2d(columns.T))
            m = self._measure(x, self.lattice)
            violation = self._measure_violations(x, m).sum(1)
            value = np.nan_to_num(self._measure_goal(x, m), nan=_INFEASIBLE, posinf=_INFEASIBLE)
            return np.asarray(np.where(violation > 0.0, _INFEASIBLE * (1.0 + violation), value))

        def report(intermediate_result: OptimizeResult) -> bool:
            nonlocal generation
            generation += 1
            if progress:
                progress(min(1.0, generation / _GENERATIONS))
            return budget.is_spent()

        n = len(self.width)
        rng = np.random.default_rng(1)
        start = rng.random((max(_POPULATION * n, 20), n))
        for row, seed in enumerate(seeds):
            start[row] = np.clip((seed - self.low) / self.width, 0.0, 1.0)
        result = differential_evolution(
            evaluate, [(0.0, 1.0)] * n, maxiter=_GENERATIONS, init=start, tol=1e-3, polish=False,
            vectorized=True, updating="deferred", seed=1, callback=report,
        )  # fmt: skip
        return np.asarray(result.x)

    # The exchange method.

    def _exchange(self, x: Array, budget: Budget) -> Candidate:
        points = self._find_worst(x, self.lattice)
        best = self._judge(x, points)
        for _ in range(_ROUNDS):
            if budget.is_spent():
                break
            moved = self._solve_for_points(x, points)
            points = np.unique(np.concatenate([points, self._find_worst(moved, self.lattice)]), axis=0)
            new = self._judge(moved, points)
            settled = np.abs(moved - x).max() < 1e-9
            x = moved
            if new.broken <= _KEPT or new.broken < best.broken:
                best = new
            if settled:
                break
        return best

    def _judge(self, x: Array, points: Array) -> Candidate:
        m = self._measure(x[None], points)
        violations = self._measure_violations(x[None], m)[0]
        value = float(self._measure_goal(x[None], m)[0])
        want = self.wants[int(violations.argmax())]
        return Candidate(self.low + self.width * x, value, float(violations.max()), want, points)

    def _list_columns(self, m: Measures) -> Array:
        """List everything of poses that has a worst one, (S, P, k): the least are sought."""
        columns = [self._list_margins(m)]
        columns += [-want.sign * want.measure(m) for want in self.columns if not (want.spread or want.whole)]
        if self.problem.fit_strokes or any(want.spread for want in self.columns):
            columns += [m.joints, -m.joints]
        return np.concatenate(columns, -1)

    def _find_worst(self, x: Array, points: Array) -> Array:
        """Find the poses (P, width) at which each constraint, joint and quantity is worst, by search from a lattice."""
        columns = np.nan_to_num(self._list_columns(self._measure(x[None], points))[0], nan=-LOST)
        count = columns.shape[1]
        starts = np.argpartition(columns, min(_WORST, len(points) - 1), axis=0)[:_WORST]
        owners = np.tile(np.arange(count), len(starts))
        begin = points[starts.reshape(-1)]
        sets = begin[:, :1]

        def place(tries: Array, search: Indices) -> Array:
            return np.concatenate([sets[search], np.clip(tries, 0.0, 1.0)], 1)

        def evaluate(tries: Array, search: Indices) -> Array:
            at = self._list_columns(self._measure(x[None], place(tries, search)))[0]
            return np.asarray(-at[np.arange(len(tries)), owners[search]])

        step = np.full(points.shape[1] - 1, 0.25)
        worst, _ = search_maxima(evaluate, begin[:, 1:], step, _FINEST)
        return np.unique(np.round(place(worst, np.arange(len(worst))), 9), axis=0)

    def _solve_for_points(self, x: Array, points: Array) -> Array:
        """Minimise over finitely many poses, near x, by sequential quadratic programming with an epigraph variable."""
        m = self._measure(x[None], points)
        value = float(self._measure_goal(x[None], m)[0])
        if not np.isfinite(value) or not np.isfinite(self._list_all_margins(m)).all():
            return x
        size = max(abs(value), 1e-9) if len(self.goal.names) == 1 else 1.0
        ends = np.stack([m.travel[0].argsort(0)[:6], (-m.travel[0]).argsort(0)[:6]])  # (2, 6, joints)

        def list_rows(z: Array) -> Array:
            """List constraints (S, R) of designs with their epigraph variable (S, n + 1)."""
            own, t = z[:, :-1], size * z[:, -1:]
            at = self._measure(own, points)
            rows = [self._list_all_margins(at).reshape(len(z), -1)]
            ceilings = [(name, np.full_like(t, bound), _scale_bound(bound)) for name, bound in self.bounds.items()]
            ceilings += [(name, low + scale * t, scale * size) for name, low, scale in self.goal.terms]
            for name, ceiling, scale in ceilings:
                if name in WANTS and WANTS[name].spread:
                    values = WANTS[name].measure(at)
                    columns = np.arange(values.shape[2])
                    least, most = (values[:, ends[side], columns] for side in (0, 1))
                    losses = (most[:, :, None] - least[:, None]).reshape(len(z), -1)
                else:
                    losses = self._list_losses(name, own, at)
                rows.append((ceiling - losses) / scale)
            return np.concatenate(rows, 1)

        start = np.append(x, value / size)
        chosen = np.argsort(list_rows(start[None])[0], kind="stable")[:_ROWS]
        steps = _STEP * np.eye(len(start))

        def constrain(z: Array) -> Array:
            return np.asarray(np.nan_to_num(list_rows(z[None])[0, chosen], nan=-LOST))

        def differentiate(z: Array) -> Array:
            rows = np.nan_to_num(list_rows(np.concatenate([z + steps, z - steps]))[:, chosen], nan=-LOST)
            up, down = np.split(rows, 2)
            return np.asarray((up - down).T / (2.0 * _STEP))

        gradient = np.append(np.zeros(len(x)), 1.0)
        near = [(max(0.0, c - _NEAR), min(1.0, c + _NEAR)) for c in x.tolist()]
        optimum = minimize(
            lambda z: z[-1], start, jac=lambda z: gradient, bounds=[*near, (-10.0, 10.0)], method="SLSQP",
            constraints={"type": "ineq", "fun": constrain, "jac": differentiate},
            options={"ftol": 1e-14, "maxiter": 60},
        )  # fmt: skip
        return np.clip(optimum.x[:-1], 0.0, 1.0) if np.isfinite(optimum.x).all() else x


def _limit_excess(excess: Array) -> Array:
    """Limit what bounds are broken by to less than what a pose out of reach counts, which is worse than any value."""
    return np.nan_to_num(LOST - LOST**2 / (LOST + np.maximum(excess, 0.0)), nan=LOST)


def _scale_bound(bound: float) -> float:
    """Scale by which breaking a bound counts: its size."""
    return max(abs(bound), 1e-9)
