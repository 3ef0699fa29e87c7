"""Quotients and singular values of many small matrices, a block of LANES at a time, one to a lane.

A register is a row of LANES numbers, so that every step of the elimination and of Jacobi's rotations is a loop that
vectorises. LAPACK takes one matrix after the other, at some microseconds each.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .batch import run_in_threads
from .compiling import njit
from .enclosures import FAST, MASK
from .intervals import freeze_rows
from .numba_turns import use_widest_vectors

LANES = 64  # matrices of a block: six rows and columns of them stay in the first-level cache
_SWEEPS = 30  # of rotations; some six converge
_SLANTED = 1e-16  # squared cosine of two rows; what is less is its own square after the next rotation
_FEW = 1024  # matrices that are worth a thread


def solve_quotients(divisors: Array, dividends: Array) -> Array:
    """Solve A X = B for matrices (N, n, n) and (N, n, m), by elimination with row pivots; infinite where A is singular.

    NaN where A or B is.
    """
    count, n, m = dividends.shape
    result = np.empty((count, n, m))
    if count and n and m:
        args = (freeze_rows(divisors.reshape(count, -1)), freeze_rows(dividends.reshape(count, -1)))
        out = result.reshape(count, -1)
        run_in_threads(count, lambda start, stop: _solve_lanes(*args, n, m, out, start, stop), _FEW)
    return result


def compute_singular_values(matrices: Array) -> Array:
    """Compute the singular values of matrices (..., n, m), n ≤ m, the greatest first, (..., n).

    By one-sided Jacobi rotations of the rows (Hestenes, 1958), which keep the small ones to the last digits. NaN where
    an entry is not finite.
    """
    *lead, n, m = matrices.shape
    rows = freeze_rows(matrices.reshape(-1, n * m))
    result = np.empty((len(rows), n))
    if result.size and m:
        run_in_threads(len(rows), lambda start, stop: _rotate_lanes(rows, n, m, result, start, stop), _FEW)
    return result.reshape(*lead, n)


def compute_volumes(matrices: Array) -> Array:
    """Compute the determinants of matrices (..., m, n), (...,); where m > n √det(AᵀA), which has no sign."""
    rows, columns = matrices.shape[-2:]
    if rows == columns:
        return np.asarray(np.linalg.det(matrices))
    return np.asarray(compute_singular_values(matrices.swapaxes(-2, -1)).prod(-1))


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _solve_lanes(divisors, dividends, n, m, out, start, stop):
    """Solve for the matrices start ≤ i < stop, by Gauss and Jordan."""
    use_widest_vectors()
    width = n + m
    r, best, pivot = np.zeros(n * width * LANES), np.empty(LANES), np.empty(LANES)
    for row in range(start, stop, LANES):
        count = min(LANES, stop - row)
        for j in range(count):
            for i in range(n):
                for k in range(n):
                    r[(i * width + k) * LANES + j] = divisors[row + j, i * n + k]
                for k in range(m):
                    r[(i * width + n + k) * LANES + j] = dividends[row + j, i * m + k]
        for k in range(n):
            d = ((k * width + k) & MASK) * LANES
            for j in range(LANES):
                best[j], pivot[j] = abs(r[d + j]), k
            for i in range(k + 1, n):
                e = ((i * width + k) & MASK) * LANES
                for j in range(LANES):
                    size = abs(r[e + j])
                    pivot[j] = i if size > best[j] else pivot[j]
                    best[j] = size if size > best[j] else best[j]
            for i in range(k + 1, n):
                for c in range(k, width):
                    d, e = ((k * width + c) & MASK) * LANES, ((i * width + c) & MASK) * LANES
                    for j in range(LANES):
                        x, y = r[d + j], r[e + j]
                        r[d + j] = y if pivot[j] == i else x
                        r[e + j] = x if pivot[j] == i else y
            d = ((k * width + k) & MASK) * LANES
            for c in range(k + 1, width):
                e = ((k * width + c) & MASK) * LANES
                for j in range(LANES):
                    r[e + j] /= r[d + j]
            for i in range(n):
                if i != k:
                    f = ((i * width + k) & MASK) * LANES
                    for c in range(k + 1, width):
                        d, e = ((i * width + c) & MASK) * LANES, ((k * width + c) & MASK) * LANES
                        for j in range(LANES):
                            r[d + j] -= r[f + j] * r[e + j]
        for j in range(count):
            broken, singular = False, False
            for e in range(n * n):
                broken |= divisors[row + j, e] != divisors[row + j, e]
            for e in range(n * m):
                broken |= dividends[row + j, e] != dividends[row + j, e]
            for i in range(n):
                for k in range(m):
                    singular |= not np.isfinite(r[(i * width + n + k) * LANES + j])
            for i in range(n):
                for k in range(m):
                    value = np.inf if singular else r[(i * width + n + k) * LANES + j]
                    out[row + j, i * m + k] = np.nan if broken else value


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _rotate_lanes(rows, n, m, out, start, stop):
    """Rotate rows against each other until they are orthogonal; their lengths are the singular values."""
    use_widest_vectors()
    r = np.zeros((n * m + n + 4) * LANES)  # the rows, their squares, and four registers
    squares = ((n * m) & MASK) * LANES
    product = ((n * m + n) & MASK) * LANES
    cosine, sine, turning = product + LANES, product + 2 * LANES, product + 3 * LANES
    for row in range(start, stop, LANES):
        count = min(LANES, stop - row)
        for i in range(n * m):
            for j in range(count):
                r[i * LANES + j] = rows[row + j, i]
            for j in range(count, LANES):
                r[i * LANES + j] = 0.0
        for _ in range(_SWEEPS):
            r[squares:product], r[turning : turning + LANES] = 0.0, 0.0
            for i in range(n):
                a = squares + (i & MASK) * LANES
                for k in range(m):
                    d = ((i * m + k) & MASK) * LANES
                    for j in range(LANES):
                        r[a + j] += r[d + j] * r[d + j]
            for p in range(n):
                for q in range(p + 1, n):
                    a, b = squares + (p & MASK) * LANES, squares + (q & MASK) * LANES
                    for j in range(LANES):
                        r[product + j] = 0.0
                    for k in range(m):
                        d, e = ((p * m + k) & MASK) * LANES, ((q * m + k) & MASK) * LANES
                        for j in range(LANES):
                            r[product + j] += r[d + j] * r[e + j]
                    for j in range(LANES):
                        g, one, two = r[product + j], r[a + j], r[b + j]
                        slanted = g * g > _SLANTED * (one * two)
                        far, twice = two - one, 2.0 * g
                        far = far if abs(far) + abs(twice) > 0.0 else 1.0
                        size = abs(far) + np.sqrt(far * far + twice * twice)
                        t = (twice if far >= 0.0 else -twice) / size
                        c = 1.0 / np.sqrt(1.0 + t * t)
                        r[turning + j] = 1.0 if slanted else r[turning + j]
                        r[cosine + j], r[sine + j] = c, c * t
                        r[a + j], r[b + j] = one - t * g, two + t * g
                    for k in range(m):
                        d, e = ((p * m + k) & MASK) * LANES, ((q * m + k) & MASK) * LANES
                        for j in range(LANES):
                            c, s, x, y = r[cosine + j], r[sine + j], r[d + j], r[e + j]
                            r[d + j] = c * x - s * y
                            r[e + j] = s * x + c * y
            if r[turning : turning + LANES].max() == 0.0:
                break
        for j in range(count):
            for i in range(n):
                size = 0.0
                for k in range(m):
                    size += r[(i * m + k) * LANES + j] ** 2
                place = i
                while place > 0 and out[row + j, place - 1] < size:
                    out[row + j, place] = out[row + j, place - 1]
                    place -= 1
                out[row + j, place] = size
            for i in range(n):
                out[row + j, i] = np.sqrt(out[row + j, i])
