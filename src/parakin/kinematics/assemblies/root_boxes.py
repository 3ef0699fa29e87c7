"""Boxes about roots of quadrics that hold one root each, by Krawczyk's test with bounds for all rounding."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Flags

_UNIT = 2.0**-53  # of rounding
_COEFFICIENTS = 64.0 * _UNIT  # by how much a quadric's entries may be off, of their size: what their making rounds
_WIDEST = 1e-3  # half a box's width beyond which a root is not called isolated


def prove_roots(systems: Array, points: Array) -> Array:
    """Prove roots of systems (k, n - 1, n, n) of quadrics next to points (k, n) of length one.

    Returns half the width of a box about each point, (k,), measured in the plane at right angles to the point: it holds
    one root and no other. NaN where the test fails, as at a double root. The quadrics' entries may be wrong by a few
    roundings.

    For quadrics the derivative is linear, so that K(X) = x - Y·f(x) + (I - Y·f'(X))·(X - x) lies inside X where
    β + (μ + κ·ρ)·ρ < ρ; Krawczyk, 1969.
    """
    count, m, n = systems.shape[0], systems.shape[1], systems.shape[2]
    if not count:
        return np.empty(0)
    slopes = np.empty((count, n, n))
    halves = np.einsum("krij,kj->kri", systems, points)
    slopes[:, :m] = 2.0 * halves
    slopes[:, m] = points
    values = np.zeros((count, n))
    values[:, :m] = np.einsum("kri,ki->kr", halves, points)
    sizes = np.abs(systems)
    bulk = np.einsum("krij,kj->kri", sizes, np.abs(points))
    off = _COEFFICIENTS + 2.0 * (n + 3) * _UNIT
    value_errors, slope_errors = np.zeros_like(values), np.zeros_like(slopes)
    value_errors[:, :m] = off * np.einsum("kri,ki->kr", bulk, np.abs(points))
    slope_errors[:, :m] = 2.0 * off * bulk
    inverse, regular = _invert_matrices(slopes)
    absolute = np.abs(inverse)
    beta = np.einsum("kij,kj->ki", absolute, np.abs(values) + value_errors).max(1) * (1.0 + 2.0 * n * _UNIT)
    rest = np.abs(np.eye(n) - inverse @ slopes)
    rest += (n + 2.0) * _UNIT * (absolute @ np.abs(slopes) + 1.0) + absolute @ slope_errors
    mu = rest.sum(2).max(1)
    bends = 2.0 * (1.0 + off) * sizes.sum((2, 3))
    kappa = np.einsum("kir,kr->ki", absolute[:, :, :m], bends).max(1)
    radius = np.maximum(2.0 * beta, 1e-300)
    proved = regular & (radius <= _WIDEST) & (beta + (mu + kappa * radius) * radius < radius)
    return np.where(proved, radius, np.nan)


def _invert_matrices(matrices: Array) -> tuple[Array, Flags]:
    """Invert matrices (k, n, n), and tell which were regular; the others' inverses are zero."""
    regular = np.ones(len(matrices), np.bool_)
    try:
        inverses: Array = np.linalg.inv(matrices).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        regular = np.asarray(np.linalg.matrix_rank(matrices) == matrices.shape[1])
        inverses = np.zeros_like(matrices)
        inverses[regular] = np.linalg.inv(matrices[regular])
    return inverses, regular
