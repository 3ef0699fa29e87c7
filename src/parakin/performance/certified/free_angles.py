"""Prove that the first angle of head or table is free at some position: the tool lies along the first axis there.

Its singularity margin then only touches zero, so that no change of sign tells it.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ...algebra import Scalar, Term, derivative, dot
from ...arrays import Array
from ...kernels.intervals import IntervalProgram
from ...workspaces.certified.containment import prove_boxes
from ...workspaces.certified.region import Region

_STEPS = 30  # of Newton's method
_HALF_WIDTHS = (1.0, 0.1, 0.01)  # mm, of the squares in which a common root is proved
_ROUNDING = 1e-9  # relative


def prove_free_angle(region: Region, starts: Array) -> Array | None:
    """Find a position (d,) of the region beside one, at most 1 mm away, where the first wrist angle is proved free.

    Newton's method leads from the starts (N, d) to candidates. About one of them the two components of the tool's axis
    across the first axis, combined so that each changes with one coordinate only, have opposite signs on opposite sides
    of a square; by the theorem of Poincaré and Miranda they vanish together in it. The square is proved to lie in the
    region. None where that fails.
    """
    components = _trace_components(region)
    if components is None or len(region.free_axes) < 2:
        return None
    inputs = region.traced_pose.inputs
    slopes = [derivative(component, x) for component in components for x in inputs]
    program = IntervalProgram(inputs[0].trace, [*components, *slopes])
    for position in _find_roots(program, starts):
        for half in _HALF_WIDTHS:
            if _prove_root(region, program, position, half):
                return np.asarray(position)
    return None


def _trace_components(region: Region) -> list[Scalar] | None:
    """Trace the two components of the tool's axis across the wrist's first axis; None where they do not vary."""
    machine, traced = region.machine, region.traced_pose
    if machine.wrist is None:
        return None
    with np.errstate(all="ignore"):  # a pose out of reach gives NaN
        off_axis = machine.trace_inverse(traced.pose, region.mode)[1].off_axis
    if off_axis is None:
        return None
    across = np.linalg.svd(machine.wrist.first_axis[None])[2][1:]
    components = [dot(way.tolist(), off_axis) for way in across]
    return components if all(isinstance(component, Term) for component in components) else None


def _evaluate(program: IntervalProgram, low: Array, high: Array) -> tuple[Array, Array, Array, Array]:
    """Evaluate components (N, 2) and slopes (N, 2, d) over boxes: middles and half widths of their intervals."""
    n, d = low.shape
    bottom, top = program(low, high)
    with np.errstate(invalid="ignore"):  # intervals without bounds
        middle, half = 0.5 * (bottom + top), 0.5 * (top - bottom)
    shape = (n, 2, d)
    return middle[:, :2], half[:, :2], middle[:, 2:].reshape(shape), half[:, 2:].reshape(shape)


def _find_roots(program: IntervalProgram, starts: Array) -> Array:
    """Find common roots of both components by Newton's method, the shortest step each time."""
    points = np.array(starts)
    for _ in range(_STEPS):
        value, _, slopes, _ = _evaluate(program, points, points)
        known = np.isfinite(value).all(1) & np.isfinite(slopes).all((1, 2))
        points, value, slopes = points[known], value[known], slopes[known]
        points = points - np.einsum("ndk,nk->nd", np.linalg.pinv(slopes), value)
    value = _evaluate(program, points, points)[0]
    residual = np.abs(value).max(1)
    order = np.argsort(np.where(np.isfinite(residual), residual, np.inf), kind="stable")
    return np.asarray(points[order[residual[order] < _ROUNDING]])


def _prove_root(region: Region, program: IntervalProgram, position: Array, half: float) -> bool:
    """Prove that both components vanish together in a square about a position, and that it is in the region."""
    slopes = _evaluate(program, position[None], position[None])[2][0]
    axes = list(max(combinations(range(len(position)), 2), key=lambda pair: abs(np.linalg.det(slopes[:, pair]))))
    if not abs(np.linalg.det(slopes[:, axes])) > 0.0:
        return False
    combine = np.linalg.inv(slopes[:, axes])
    reach = np.zeros(len(position))
    reach[axes] = half
    low, high = position - reach, position + reach
    _, _, middle, spread = _evaluate(program, low[None], high[None])
    # How much each combined component changes with each coordinate of the square, at least (own) and at most (other).
    changes = combine @ middle[0][:, axes]
    off = np.abs(changes - np.eye(2)) + np.abs(combine) @ spread[0][:, axes]
    value, error, _, _ = _evaluate(program, position[None], position[None])
    in_middle = np.abs(combine @ value[0]) + np.abs(combine) @ error[0]
    if not (in_middle + off.sum(1) * half < half * (1.0 - _ROUNDING)).all():
        return False
    return bool(prove_boxes(region, low[None], high[None]).proved[0])
