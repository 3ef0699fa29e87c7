"""The greatest and the least velocity amplification over a box of poses, between two numbers, by branch and bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Progress
from ...budget import Budget
from ..extremes import ExtremeSide
from ..indices import compute_performance
from .interval_matrices import PoseBox
from .quotient_norms import NormSearch, Quotient


@dataclass(frozen=True, eq=False)
class Bracket:
    """The greatest velocity amplification psi over a box of poses (or the least one) is proved to lie in [low, high].

    ``pose`` (axes,) attains ``low`` of the greatest, ``high`` of the least. ``closed`` tells that the bracket is as
    narrow as wanted.
    """

    side: ExtremeSide
    low: float
    high: float
    pose: Array
    closed: bool

    @property
    def attained(self) -> float:
        """The value of psi at ``pose``."""
        return self.low if self.side == "greatest" else self.high


def bracket_amplification(
    box: PoseBox,
    side: ExtremeSide,
    tolerance: float,
    budget: Budget,
    bound: float,
    progress: Progress | None = None,
) -> Bracket:
    """Bracket one amplification by branch and bound until high ≤ low·(1 + tolerance), or until the budget is spent.

    Only a small part of the budget is spent once psi is known to exceed ``bound``.

    The least psi is the reciprocal of the greatest singular value of J⁻¹, so both are the greatest one of a matrix.
    """
    forward = side == "greatest"

    def evaluate(points: Array) -> Array:
        performance = compute_performance(box.machine, box.poses(points), box.length.value, box.mode)
        with np.errstate(divide="ignore"):
            return performance.greatest if forward else 1.0 / performance.least

    most = bound if forward else (1.0 / bound if bound > 0.0 else np.inf)
    search = NormSearch(box, [Quotient(box.a, box.b) if forward else Quotient(box.b, box.a)], evaluate)
    norm = search.bracket(tolerance, budget, most, progress)
    pose = box.poses(norm.point[None])[0]
    if forward:
        return Bracket(side, norm.low, norm.high, pose, norm.closed)
    return Bracket(side, 1.0 / norm.high, 1.0 / norm.low, pose, norm.closed)
