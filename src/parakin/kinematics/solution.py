"""Answers of the direct problem: poses with residual and verdict, and why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Flags, Indices

# Why there is no answer.
ANSWERED, OPEN, ON_ANOTHER_SIDE, OTHER_MODE, SINGULAR_START = range(5)
REASONS = (
    "",
    "the legs do not close near the start",
    "a parallel singularity lies between the start and the joints",
    "the legs close in another working mode only",
    "the start is a parallel singularity, so it lies on no side",
)


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged; C of an upright tool is the near pose's, else 0
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close, in the working mode asked for and the start's assembly mode
    steps : (...,) Newton's steps; 0 in closed form
    why : (...,) why there is no answer, an index of :data:`REASONS`; 0 where there is one
    """

    poses: Array
    residual: Array
    converged: Any
    steps: Any
    why: Any

    def __repr__(self) -> str:
        return f"<parakin solution: {np.count_nonzero(self.converged)} of {np.size(self.converged)} poses found>"


def take_rows(solution: Solution, rows: Indices | Flags) -> Solution:
    return Solution(
        solution.poses[rows], solution.residual[rows], solution.converged[rows], solution.steps[rows],
        solution.why[rows],
    )  # fmt: skip


def put_rows(solution: Solution, rows: Indices, other: Solution) -> None:
    """Put another solution in place of some rows of one."""
    for name in ("poses", "residual", "steps", "why"):
        getattr(solution, name)[rows] = getattr(other, name)
