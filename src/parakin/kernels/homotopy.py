"""Paths of a linear homotopy between systems of quadrics in complex projective space.

A system is n - 1 quadrics xᵀQx = 0 in n homogeneous coordinates. From the roots of a first system the paths of
(1 - t)·xᵀQ₀x + t·xᵀQ₁x = 0 lead to those of a last one. A step expands the path in a Taylor series at right angles to
the point, goes as far as its last terms allow, and comes back to the path by Newton's method; the point is scaled to
length one after each (Shub and Smale's projective Newton), so that no path leaves for infinity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiling import njit
from .numba_turns import FAST

_FAST = {*FAST, "reassoc"}  # sums in any order; NaN and infinity keep their meaning

ORDER = 8  # of the Taylor series
MOST_STEPS = 1000  # of one path
LEAST_STEP = 1e-10  # of t: a path that asks for less ends at a singular root, or has none
FIRST_CORRECTION = 1e-3  # greatest first Newton step after a prediction; the second then is below its square
CONVERGED = 1e-11  # a Newton step so small is the last
TOO_FAR = 1e-6  # greatest second Newton step


class _Work(NamedTuple):
    """The working arrays of one path in n coordinates.

    quadrics : (n - 1, n, n) of the homotopy at t
    series : (ORDER + 1, n) coefficients of the path's Taylor series
    products, changes : (ORDER, n - 1, n) quadrics, and their derivative by t, times the coefficients
    matrix, pivots, right : a linear system
    point : (n,)
    """

    quadrics: np.ndarray
    series: np.ndarray
    products: np.ndarray
    changes: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    right: np.ndarray
    point: np.ndarray


@njit(inline="always")
def _allocate_work(n):
    c = np.complex128
    return _Work(
        np.empty((n - 1, n, n), c), np.empty((ORDER + 1, n), c), np.empty((ORDER, n - 1, n), c),
        np.empty((ORDER, n - 1, n), c), np.empty((n, n), c), np.empty(n, np.int64), np.empty(n, c), np.empty(n, c),
    )  # fmt: skip


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _square(z):
    """Square the modulus."""
    return z.real * z.real + z.imag * z.imag


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _factor_matrix(a, pivots):
    """Factor by rows with partial pivoting, in place; reciprocal pivots on the diagonal. False where it is singular."""
    n = len(a)
    for k in range(n):
        best, at = _square(a[k, k]), k
        for i in range(k + 1, n):
            size = _square(a[i, k])
            if size > best:
                best, at = size, i
        pivots[k] = at
        if not best > 0.0:
            return False
        if at != k:
            for j in range(n):
                a[k, j], a[at, j] = a[at, j], a[k, j]
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            a[i, k] = factor
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
    return True


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _solve_factored(a, pivots, b):
    """Solve by the factors, in place."""
    n = len(a)
    for k in range(n):
        at = pivots[k]
        b[k], b[at] = b[at], b[k]
    for i in range(1, n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total * a[i, i]


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _apply_quadrics(quadrics, x, out):
    """Compute Q·x for every quadric Q."""
    m, n = out.shape
    for r in range(m):
        for i in range(n):
            total = 0j
            for j in range(n):
                total += quadrics[r, i, j] * x[j]
            out[r, i] = total


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _blend_quadrics(first, last, t, out):
    """Compute the quadrics of the homotopy at t."""
    m, n = out.shape[0], out.shape[1]
    for r in range(m):
        for i in range(n):
            for j in range(n):
                out[r, i, j] = (1.0 - t) * first[r, i, j] + t * last[r, i, j]


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _expand_path(work, change, x):
    """Expand the path through x in a Taylor series, all of whose coefficients are at right angles to x.

    The coefficients of tᵏ in Σ xᵢᵀ(Q + t·Q')xⱼ vanish; one factored matrix serves them all. False where the point is
    singular.
    """
    m, n = work.products.shape[1], work.products.shape[2]
    series, products, changes, right = work.series, work.products, work.changes, work.right
    series[0, :] = x
    _apply_quadrics(work.quadrics, x, products[0])
    _apply_quadrics(change, x, changes[0])
    for i in range(n):
        for r in range(m):
            work.matrix[r, i] = 2.0 * products[0, r, i]
        work.matrix[m, i] = np.conj(x[i])
    if not _factor_matrix(work.matrix, work.pivots):
        return False
    for k in range(1, ORDER + 1):
        for r in range(m):
            total = 0j
            for i in range(1, k):
                for j in range(n):
                    total += series[k - i, j] * products[i, r, j]
            for i in range(k):
                for j in range(n):
                    total += series[k - 1 - i, j] * changes[i, r, j]
            right[r] = -total
        right[m] = 0j
        _solve_factored(work.matrix, work.pivots, right)
        series[k, :] = right
        if k < ORDER:
            _apply_quadrics(work.quadrics, right, products[k])
            _apply_quadrics(change, right, changes[k])
    return True


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _choose_step(series, tolerance):
    """Choose the step at which the greater of the series' last two terms is within a tolerance."""
    last, before = 1e-300, 1e-300
    for j in range(series.shape[1]):
        last += _square(series[ORDER, j])
        before += _square(series[ORDER - 1, j])
    return min((tolerance / np.sqrt(last)) ** (1.0 / ORDER), (tolerance / np.sqrt(before)) ** (1.0 / (ORDER - 1)))


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _correct_point(work, x, y):
    """Bring a predicted point y back to the path by Newton's method, at right angles to x; in place.

    False where it is too far from it to tell which path it belongs to.
    """
    m, n = work.products.shape[1], work.products.shape[2]
    products, right = work.products[0], work.right
    greatest = FIRST_CORRECTION
    for _ in range(3):
        _apply_quadrics(work.quadrics, y, products)
        for r in range(m):
            value = 0j
            for i in range(n):
                work.matrix[r, i] = 2.0 * products[r, i]
                value += products[r, i] * y[i]
            right[r] = -value
        for i in range(n):
            work.matrix[m, i] = np.conj(x[i])
        right[m] = 0j
        if not _factor_matrix(work.matrix, work.pivots):
            return False
        _solve_factored(work.matrix, work.pivots, right)
        size = 0.0
        for i in range(n):
            y[i] += right[i]
            size += _square(right[i])
        if size < CONVERGED**2:
            return True
        if not size < greatest**2:
            return False
        greatest = TOO_FAR
    return size < (1e-9) ** 2


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _scale_to_one(x):
    total = 0.0
    for i in range(len(x)):
        total += _square(x[i])
    scale = 1.0 / np.sqrt(total)
    for i in range(len(x)):
        x[i] *= scale


@njit(nogil=True, cache=True, fastmath=_FAST, error_model="numpy")
def _track_path(work, first, last, change, x, tolerance):
    """Track one path from a root of the first system, in place; return the last t."""
    t = 0.0
    for _ in range(MOST_STEPS):
        _scale_to_one(x)
        _blend_quadrics(first, last, t, work.quadrics)
        if not _expand_path(work, change, x):
            return t
        step = min(_choose_step(work.series, tolerance), 1.0 - t)
        while True:
            if not step >= min(LEAST_STEP, 1.0 - t):
                return t
            ahead = 1.0 if step >= 1.0 - t else t + step
            for i in range(len(x)):
                total = work.series[ORDER, i]
                for k in range(ORDER - 1, -1, -1):
                    total = total * (ahead - t) + work.series[k, i]
                work.point[i] = total
            _blend_quadrics(first, last, ahead, work.quadrics)
            if _correct_point(work, x, work.point):
                break
            step = 0.5 * min(step, 1.0 - t)
        x[:] = work.point
        t = ahead
        if t >= 1.0:
            _scale_to_one(x)
            return 1.0
    return t


@njit(nogil=True, cache=True, error_model="numpy")
def track_paths(first, last, tolerance, ends, begin, end):
    """Track the paths ``begin`` to ``end`` of all systems' paths, one after the other, from where ``ends`` has them.

    first, last : (systems, n - 1, n, n) symmetric, complex
    tolerance : of the series' last terms
    ends : ``points`` (systems, paths, n) hold the starts, then the ends; ``reached`` (systems, paths) the last t
    """
    count = ends.points.shape[1]
    work = _allocate_work(first.shape[3])
    change, current = np.empty_like(first[0]), -1
    for path in range(begin, end):
        system, row = path // count, path % count
        if system != current:
            current = system
            change[:] = last[system] - first[system]
        ends.reached[system, row] = _track_path(
            work, first[system], last[system], change, ends.points[system, row], tolerance
        )
