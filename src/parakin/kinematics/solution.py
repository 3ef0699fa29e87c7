"""Answers of the direct problem: poses with residual and verdict, and why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Flags, Indices

# Why there is no answer.
ANSWERED, OPEN, ON_ANOTHER_SIDE, OTHER_MODE, SINGULAR_START, SINGULAR_ANSWER, IN_DISAGREEMENT, SINGULAR_WAY = range(8)
REASONS = (
    "",
    "the legs do not close near the start",
    "a parallel singularity lies between the start and the joints",
    "the legs close in another working mode only",
    "the start is a parallel singularity, so it lies on no side",
    "the legs close in a parallel singularity, where they leave the platform free to move",
    "the joints do not agree with each other near the start, as those of more drives than freedoms must",
    "on the way from the start to the joints the legs come to a parallel singularity",
)


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged; C of an upright tool is the near pose's, else 0
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close, in the working mode asked for and the start's assembly mode, or home's
    steps : (...,) Newton's steps; 0 in closed form
    why : (...,) why there is no answer, by its number; 0 where there is one. :attr:`reasons` tells it in words
    in_other_mode : (...,) True where no mode was asked for and the legs stand in another one than the machine's, as the
        near pose tells
    """

    poses: Array
    residual: Array
    converged: Any
    steps: Any
    why: Any
    in_other_mode: Any

    @property
    def reasons(self) -> Any:
        """Why there is no answer, in words: texts (...,), "" where there is one."""
        return np.array(REASONS)[self.why]

    def __repr__(self) -> str:
        others = np.count_nonzero(self.in_other_mode)
        remark = f", {others} of them in another working mode" if others else ""
        return (
            f"<parakin solution: {np.count_nonzero(self.converged)} of {np.size(self.converged)} poses found{remark}>"
        )


class Answers(NamedTuple):
    """Rows of a solution while it is sought.

    settled : (N,) where a row is answered and needs no second look, see :mod:`.settling`
    """

    poses: Array
    residual: Array
    steps: NDArray[np.int32]
    why: NDArray[np.int8]
    settled: Flags


def take_rows(answers: Answers, rows: Indices | Flags) -> Answers:
    """Copy some rows."""
    return Answers._make(field[rows] for field in answers)


def put_rows(answers: Answers, rows: Indices, others: Answers) -> None:
    """Put other answers in place of some rows."""
    for name in Answers._fields:
        getattr(answers, name)[rows] = getattr(others, name)
