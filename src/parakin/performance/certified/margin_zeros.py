"""Prove that a singularity margin is zero at some position of a region, by a straight way from a position inside.

The way follows the margin's gradient, or that of a leg's reach, or leads to where a search finds the margin least; so
it finds what the cells of a subdivision miss.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...algebra import Scalar
from ...arrays import Array, Indices
from ...budget import Budget
from ...kernels.intervals import IntervalProgram
from ...workspaces.certified.constraints import Constraint
from ...workspaces.certified.containment import prove_boxes
from ...workspaces.certified.region import Region
from ..extremes import compute_slack
from ..search import search_maxima

_STEPS = 20  # of Newton's method
_HALF_WIDTHS = (0.5, 0.05, 0.005)  # mm, by which a way goes beyond a zero and stays before it
_NEAR = 1e-3  # of the least half width, within which Newton's method has found a zero
_PIECES = 24  # of a way, each half as long as the one before
_FINEST = 1e-6  # last step of a search for the least margin, of its first
_BISECTIONS = 50


def prove_sign_change(region: Region, margin: Constraint, starts: Array, budget: Budget) -> Array | None:
    """Find a position (d,) with a margin proved to be below zero, on a way from a start proved to be in the region.

    starts : (N, d) positions in the region at which the margin is positive
    """
    ends, kept = _find_zeros(margin, starts)
    for start, end in zip(starts[kept], ends, strict=True):
        if budget.is_spent():
            break
        for half in _HALF_WIDTHS:
            beyond = end + half * _point_along(start, end)
            if margin.point_program(beyond[None], beyond[None])[1][0, 0] < 0.0 and _prove_way(
                region, start, beyond, budget
            ):
                return np.asarray(beyond)
    return None


def search_sign_change(region: Region, margin: Constraint, starts: Array, step: float, budget: Budget) -> Array | None:
    """Find a position (d,) with a margin proved to be below zero, where a search for its least value leads.

    In a corner of the region the margin may change its sign so near the ends of several legs' reach, where its gradient
    is not bounded, that Newton's method leads out of the region. The least place lies on the boundary; the way ends
    half-way between the zero on the straight line to it and the place itself.

    starts : (N, d) positions in the region at which the margin is positive
    step : the search's first, mm
    """

    def evaluate(points: Array, _: Indices) -> Array:
        return np.where(compute_slack(region, points) >= 0.0, -_evaluate(margin, points)[0], np.nan)

    if not len(starts):
        return None
    least, depth = search_maxima(evaluate, starts, np.full(starts.shape[1], step), _FINEST, budget)
    for number in np.argsort(-depth, kind="stable"):
        if not depth[number] > 0.0 or budget.is_spent():
            break
        start, end = starts[number], least[number]
        below = 0.5 * (_bisect_sign(margin, start, end) + end)
        if margin.point_program(below[None], below[None])[1][0, 0] < 0.0 and _prove_way(region, start, below, budget):
            return np.asarray(below)
    return None


def prove_stretched_leg(
    region: Region, margins: Sequence[Scalar], number: int, starts: Array, budget: Budget
) -> Array | None:
    """Find a position (d,) of the region at most 1 mm beside one where a leg's serial margin is proved to be zero.

    Where the reach of a leg ends, two of its inverses meet. Its closures are smooth, so by the theorem of implicit
    functions their derivatives by the joints, the serial margins, can't all differ from zero there. Such a margin only
    touches zero, on the region's boundary. A way leads from a start to the end of the reach: up to a small cube it is
    proved to be in the region. All over the cube every other limit is proved to hold, and the other margins of the leg
    to differ from zero; the reach has both signs there.

    margins : of all legs' closures, traced, of which ``number`` is judged
    starts : (N, d) positions in the region
    """
    machine = region.machine
    drives = [machine.drives[joint] for joint in machine.closure_joints]
    leg = next(leg for leg in machine.legs if drives[number] in leg.drives)
    names = [f"{drive.name}.reach" for drive in leg.drives]
    own = [margins[i] for i, drive in enumerate(drives) if drive in leg.drives and i != number]
    for reach in region.constraints:
        if reach.name in names and not reach.implied and reach.is_smooth:
            position = _prove_stretched(region, reach, own, starts, budget)
            if position is not None:
                return position
    return None


def _prove_stretched(
    region: Region, reach: Constraint, nonzero: Sequence[Scalar], starts: Array, budget: Budget
) -> Array | None:
    """Prove that a reach ends inside all other limits, where some margins are not zero, on a way from a start."""
    kept = [
        constraint.margin for constraint in region.constraints if constraint is not reach and not constraint.implied
    ]
    program = IntervalProgram(region.traced_pose.inputs[0].trace, [*kept, *nonzero])
    ends, which = _find_zeros(reach, starts)
    for start, end in zip(starts[which], ends, strict=True):
        if budget.is_spent():
            break
        along = _point_along(start, end)
        for half in reversed(_HALF_WIDTHS):
            down, up = (bound[0] for bound in program((end - half)[None], (end + half)[None]))
            if not ((down[: len(kept)] > 0.0).all() and ((down > 0.0) | (up < 0.0)).all()):
                continue
            inside, outside = end - half * along, end + half * along
            if reach.point_program(outside[None], outside[None])[1][0, 0] < 0.0 and _prove_way(
                region, start, inside, budget
            ):
                return np.asarray(inside)
    return None


def _find_zeros(constraint: Constraint, starts: Array) -> tuple[Array, Indices]:
    """Follow a constraint's gradient to where it is zero, by Newton's method.

    Returns positions (n, d), and the numbers (n,) of their starts, the nearest pairs first.
    """
    points = np.array(starts)
    for _ in range(_STEPS):
        value, slopes = _evaluate(constraint, points)
        with np.errstate(all="ignore"):
            points = points - (value / (slopes**2).sum(1))[:, None] * slopes
    value, slopes = _evaluate(constraint, points)
    with np.errstate(all="ignore"):
        near = np.flatnonzero(np.abs(value) / np.linalg.norm(slopes, axis=1) < _NEAR * _HALF_WIDTHS[-1])
    order = near[np.argsort(np.linalg.norm(points[near] - starts[near], axis=1), kind="stable")]
    return points[order], order


def _bisect_sign(constraint: Constraint, above: Array, below: Array) -> Array:
    """Bisect the straight line between two positions for a change of sign of a constraint; return the end below."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (above + below)
        if _evaluate(constraint, middle[None])[0][0] < 0.0:
            below = middle
        else:
            above = middle
    return below


def _evaluate(constraint: Constraint, points: Array) -> tuple[Array, Array]:
    """Evaluate a constraint (N,) and, of a smooth one, its gradient (N, d) at points."""
    bottom, top = constraint.point_program(points, points)
    with np.errstate(invalid="ignore"):  # intervals without bounds
        middle = 0.5 * (bottom + top)
    return middle[:, 0], middle[:, 1:]


def _point_along(start: Array, end: Array) -> Array:
    """Return the unit vector from one position to another."""
    return np.asarray((end - start) / max(float(np.linalg.norm(end - start)), 1e-300))


def _prove_way(region: Region, start: Array, end: Array, budget: Budget) -> bool:
    """Prove that the straight way between two positions is in the region, by boxes that shrink towards the end."""
    left = np.append(0.5 ** np.arange(_PIECES), 0.0)
    points = end + left[:, None] * (start - end)
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    return bool(prove_boxes(region, low, high, budget=budget).proved.all())
