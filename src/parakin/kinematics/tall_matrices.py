"""Matrices of machines with more drives than freedoms, which have more rows than columns: volumes, inverses."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Flags, find_finite_matrices

_RANK = 1e-13  # a least singular value below this fraction of the greatest counts as zero


def compute_determinants(matrices: Array) -> Array:
    """Compute the determinants of matrices (..., m, n), (...,); where m > n their volumes.

    The volume √det(AᵀA), the product of the singular values, has no sign. It is zero where the rank is less than n.
    """
    rows, columns = matrices.shape[-2:]
    if rows == columns:
        return np.asarray(np.linalg.det(matrices))
    known: Flags = np.asarray(np.isfinite(matrices).all((-2, -1)))
    values = np.linalg.svd(np.where(known[..., None, None], matrices, 0.0), compute_uv=False).prod(-1)
    return np.asarray(np.where(known, values, np.nan))


def invert_from_left(matrices: Array, metric: Array) -> Array:
    """Invert tall matrices A (N, m, n) from the left by least squares, (N, n, m); NaN where there is no inverse.

    metric : (N, m, k) M with a regular MMᵀ; the inverse is (AᵀWA)⁻¹AᵀW with W = (MMᵀ)⁻¹
    """
    result: Array = np.full(matrices.swapaxes(1, 2).shape, np.nan)
    good = np.flatnonzero(find_finite_matrices(matrices, metric))
    u, s, _ = np.linalg.svd(metric[good], full_matrices=False)
    regular = s[:, -1] > _RANK * s[:, 0]
    good, white = good[regular], u[regular].swapaxes(1, 2) / s[regular, :, None]
    tall = white @ matrices[good]
    sizes = np.linalg.norm(tall, axis=1)
    tall /= np.where(sizes > 0.0, sizes, 1.0)[:, None]
    regular = np.linalg.svd(tall, compute_uv=False)[:, -1] > _RANK
    result[good[regular]] = np.linalg.pinv(tall[regular]) / sizes[regular, :, None] @ white[regular]
    return result
