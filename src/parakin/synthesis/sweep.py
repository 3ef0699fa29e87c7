"""A sweep: designs drawn all over a problem's free numbers, each at the same poses of its box, a chunk at a time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..arguments import check_constructor
from ..arrays import Array, Flags, Indices, make_lattice, split_rows
from ..errors import PoseError
from ..kernels.batch import find_first_negative
from ..version import __version__
from .pose_sets import PoseSet
from .problem import DesignProblem
from .wants import JACOBIANS, WANTS

_ROWS = 1 << 22  # designs times poses of a chunk
_AT_ONCE = 1 << 16  # of them at a time: they stay in the cache
_REPEATS = 3  # of a measured time, of which the least counts
_MOST_POSES = 1 << 20
_MOST_CHUNKS = 100_000


@check_constructor
@dataclass(frozen=True, eq=False)
class SweepPlan:
    """What a sweep looks at; each of its chunks is the same whoever evaluates it, and whenever.

    problem : whose free numbers are drawn, evenly over their ranges
    designs, poses : how many of each; the poses are the corners of the sets and places drawn evenly in them
    seed : of what is drawn

    Raises :class:`PoseError` for numbers that make no sense.
    """

    problem: DesignProblem
    designs: int
    poses: int
    seed: int = 0

    def __post_init__(self) -> None:
        if self.designs < 1:
            raise PoseError(f"designs: one or more expected, not {self.designs}")
        corners = self._corner_count
        if not corners <= self.poses <= _MOST_POSES:
            raise PoseError(f"poses: {corners:,} (the corners) to {_MOST_POSES:,} expected, not {self.poses:,}")
        if self.chunk_count > _MOST_CHUNKS:
            raise PoseError(
                f"designs: at most {_MOST_CHUNKS * self.chunk_size:,} at so many poses, not {self.designs:,}"
            )
        if self.seed < 0:
            raise PoseError(f"seed: 0 or more expected, not {self.seed}")

    def __repr__(self) -> str:
        return f"<parakin sweep of {self.problem.machine.name}: {self.designs:,} designs at {self.poses:,} poses>"

    @property
    def chunk_size(self) -> int:
        """How many designs a chunk has; the last one may have fewer."""
        return max(1, _ROWS // self.poses)

    @property
    def chunk_count(self) -> int:
        """How many chunks there are."""
        return -(-self.designs // self.chunk_size)

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities that the problem bounds or minimises."""
        return self.problem.wants

    @cached_property
    def points(self) -> Array:
        """Points (poses, width) of the problem: the corners of each set, then some drawn evenly in each by turns."""
        sets = self.problem.pose_sets
        drawn = np.random.default_rng([self.seed, 0]).random((self.poses - self._corner_count, self.problem.width - 1))
        groups = []
        for number, poses in enumerate(sets):
            inside = np.concatenate([_list_corners(poses), drawn[number :: len(sets), : len(poses.coordinates)]])
            groups.append(self.problem.make_points(number, inside))
        return np.concatenate(groups)

    @property
    def _corner_count(self) -> int:
        return sum(len(_list_corners(poses)) for poses in self.problem.pose_sets)

    def draw_designs(self, chunk: int) -> Array:
        """Draw the designs of a ``chunk``, by its number from 0: (S, variables), mm and rad."""
        count = min(self.chunk_size, self.designs - chunk * self.chunk_size)
        low, high = self.problem.ranges.T
        drawn = np.random.default_rng([self.seed, 1, chunk]).random((count, len(low)))
        return np.asarray(low + (high - low) * drawn)

    @cached_property
    def digest(self) -> str:
        """A text that two plans have in common only if all of their answers are the same."""
        problem = self.problem
        said = (
            __version__,
            problem.machine.format_yaml(), sorted(problem.free.items()),
            [(sorted(poses.ends.items()), poses.across, poses.diameter) for poses in problem.pose_sets],
            sorted(problem.shift.items()), sorted(problem.bounds.items()), problem.objectives,
            problem.drives, problem.struts, problem.tolerances, _list_bytes(problem),
            problem.fit_strokes, self.designs, self.poses, self.seed,
        )  # fmt: skip
        return sha256(repr(said).encode()).hexdigest()


class SweepChunk(NamedTuple):
    """Designs of a sweep, S of them.

    designs : (S, variables) mm and rad
    allowed : (S,) at what share of the poses the limits are kept
    limit : (S,) which of the limits that count is the first broken at most of the others; -1 where none is
    values : (S, quantities) the worst at any pose: infinite, or zero, where one is out of reach or singular
    keeps : (S,) whether all limits and bounds are kept at these poses
    """

    designs: Array
    allowed: Array
    limit: Indices
    values: Array
    keeps: Flags


class SweepEvaluator:
    """Evaluates the chunks of a plan; makes its tapes once."""

    def __init__(self, plan: SweepPlan):
        self.plan, self.problem = plan, plan.problem
        self.limits = self.problem.tapes.limits
        self._tape = self.problem.family.make_check_tape(self.problem.tapes.counted)

    def evaluate(self, chunk: int) -> SweepChunk:
        """Evaluate one of the plan's chunks."""
        designs = self.plan.draw_designs(chunk)
        blocks = split_rows(len(designs), self._block_size)
        made = [self._evaluate_block(designs[block]) for block in blocks]
        return SweepChunk(*(np.concatenate(columns) for columns in zip(*made, strict=True)))

    def _evaluate_block(self, x: Array) -> SweepChunk:
        first = self.find_broken(x)
        count = len(self.limits)
        numbered = first + (count + 1) * np.arange(len(x))[:, None]
        broken = np.bincount(numbered.ravel(), minlength=len(x) * (count + 1)).reshape(len(x), count + 1)
        allowed = broken[:, 0] / self.plan.poses
        limit = np.where(broken[:, 0] < self.plan.poses, broken[:, 1:].argmax(1), -1)
        values = self._measure_quantities(x)
        keeps = (limit < 0) & self._find_kept(values)
        return SweepChunk(x, allowed, limit, values, keeps)

    def find_broken(self, x: Array) -> Indices:
        """Find the first limit that designs x (S, variables) break at each pose, (S, poses): 1 + its number, or 0."""
        first = find_first_negative(self._tape, self._list_poses(x), self._list_sizes(x))
        return first.reshape(len(x), self.plan.poses)

    def _list_poses(self, x: Array) -> Array:
        """List the poses of designs, (S * poses, axes)."""
        axes = len(self.problem.machine.axes)
        if self.problem.shift:
            return self.problem.place_poses(x, self.plan.points).reshape(-1, axes)
        return self._same_poses[: len(x) * self.plan.poses]

    @cached_property
    def _same_poses(self) -> Array:
        """Those of as many designs as are evaluated at a time, where the box is not moved."""
        poses = self.problem.place_poses(self.plan.draw_designs(0)[0], self.plan.points)
        return np.tile(poses, (self._block_size, 1))

    def _list_sizes(self, x: Array) -> Array:
        return np.repeat(x[:, : len(self.problem.family.names)], self.plan.poses, 0)

    @property
    def _block_size(self) -> int:
        return max(1, _AT_ONCE // self.plan.poses)

    def measure_kernel(self) -> float:
        """Measure what a design costs at a pose (s), the limits alone, by the bare kernel on rows that are ready."""
        x = self.plan.draw_designs(0)[: self._block_size]
        poses, sizes = self._list_poses(x), self._list_sizes(x)
        times = []
        for _ in range(_REPEATS):
            begin = perf_counter()
            find_first_negative(self._tape, poses, sizes)
            times.append(perf_counter() - begin)
        return min(times) / len(poses)

    def _measure_quantities(self, x: Array) -> Array:
        names = self.plan.quantities
        if not names:
            return np.empty((len(x), 0))
        m = self.problem.measure(x, self.plan.points)
        signs = np.array([WANTS[name].sign for name in names])
        losses = np.stack([self.problem.list_losses(name, x, m).max(1) for name in names], 1)
        if any(name in JACOBIANS for name in names):  # beyond a singularity no bound is kept
            losses[~(m.side > 0.0).all((1, 2))] = np.nan
        worst = np.where(signs > 0.0, np.inf, 0.0)
        return np.where(np.isfinite(losses), signs * losses, worst)

    def _find_kept(self, values: Array) -> Flags:
        """Tell which designs keep all bounds, (S,)."""
        kept: Flags = np.ones(len(values), np.bool_)
        for name, column in zip(self.plan.quantities, values.T, strict=True):
            want = WANTS[name]
            kept &= np.isfinite(column) & (
                want.sign * column <= want.sign * self.problem.bounds.get(name, np.inf * want.sign)
            )
            if want.more:
                kept &= column > 0.0
        return kept


def _list_bytes(problem: DesignProblem) -> list[bytes | str]:
    """List what makes two parts different."""
    path = problem.path
    if path is None:
        return []
    arrays = (path.tip, path.axis, path.rapid, path.feed, path.turns, path.seconds, path.frame, problem.workpiece)
    return [*(b"" if array is None else array.tobytes() for array in arrays), repr(path.events), repr(path.tools)]


def _list_corners(poses: PoseSet) -> Array:
    """List the corners of a set's box of edges 1, (corners, coordinates)."""
    ends = [[0.0, 1.0] if low < high else [0.5] for low, high in poses.coordinates.values()]
    return make_lattice(ends)
