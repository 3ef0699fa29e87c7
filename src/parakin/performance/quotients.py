"""Quotients A⁻¹W of many matrices, of tall ones by least squares."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, find_finite_matrices
from ..kernels.small_matrices import solve_quotients
from ..kinematics.tall_matrices import invert_from_left


def compute_quotients(divisors: Array, dividends: Array) -> Array:
    """Compute A⁻¹W for matrices A (N, m, n) and W (N, m, k); infinite where A is singular, NaN where A or W is.

    Of a tall A it is (AᵀVA)⁻¹AᵀVW with V = (WWᵀ)⁻¹, of all inverses from the left that by which it is least. Of a
    square W that is the pseudo-inverse of W⁻¹A.
    """
    if divisors.shape[1] <= divisors.shape[2]:
        return solve_quotients(divisors, dividends)
    result = invert_from_left(divisors, dividends) @ dividends
    known = find_finite_matrices(divisors, dividends)
    result[known & np.isnan(result).any((1, 2))] = np.inf
    return np.asarray(result)
