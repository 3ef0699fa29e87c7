"""Paths of a linear homotopy between systems of quadrics in complex projective space.

A system is n - 1 quadrics xᵀQx = 0 in n homogeneous coordinates. From the roots of a first system the paths of
(1 - t)·xᵀQ₀x + t·xᵀQ₁x = 0 lead to those of a last one. A step expands the path in a Taylor series at right angles to
the point, goes as far as its last terms allow, and comes back to the path by Newton's method; the point is scaled to
length one after each (Shub and Smale's projective Newton), so that no path leaves for infinity.

Paths of a system are tracked in lanes, each at its own t, and a lane whose path has ended takes up the next one. A
complex number stands as two rows, its parts. Products with a quadric are sums over its entries other than zero: of the
last system, which is real, and of the change on the way to it, which is what depends on the joints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiling import njit
from .complex_lanes import (
    factor_in_lanes,
    get_number,
    measure_numbers,
    multiply_numbers,
    put_number,
    solve_in_lanes,
)
from .numba_lanes import ALL, LANES, choose, is_greater, load, repeat, store, take_root
from .numba_turns import FAST, use_widest_vectors

ORDER = 8  # of the Taylor series
MOST_ROUNDS = 1000  # of one path: steps, and those that are tried again shorter
LEAST_STEP = 1e-10  # of t: a path that asks for less ends at a singular root, or has none
FIRST_CORRECTION = 1e-3  # greatest first Newton step after a prediction; the second then is below its square
CONVERGED = 1e-11  # what Newton's method leaves
TOO_FAR = 1e-6  # greatest second Newton step
_CORRECTIONS = 3
_HALF = ORDER // 2  # products of a quadric with the series' later terms are those of the earlier ones, transposed


class Entries(NamedTuple):
    """The entries other than zero of systems (systems, n - 1, n, n), row by row: real parts, then imaginary ones.

    starts : (2, (n - 1)·n + 1) of each row's entries
    columns : (entries,) of each
    values : (systems, entries)
    filled : the rows that have entries
    begins : (n,) of each quadric's among these
    """

    starts: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    filled: np.ndarray
    begins: np.ndarray


class _Work(NamedTuple):
    """The working arrays of paths in n coordinates; each complex number is two rows of LANES, its parts.

    series : (ORDER + 1)·n numbers, the coefficients of the paths' Taylor series
    products, changes : (_HALF + 1)·(n - 1)·n numbers, quadrics and their derivative by t, times the coefficients
    matrix : n·n numbers
    swaps : (n, n) the lanes in which two rows changed places
    right, point : n numbers
    rest : a row, 1 - t
    sizes : two rows
    """

    series: np.ndarray
    products: np.ndarray
    changes: np.ndarray
    matrix: np.ndarray
    swaps: np.ndarray
    right: np.ndarray
    point: np.ndarray
    rest: np.ndarray
    sizes: np.ndarray


class _Steps(NamedTuple):
    """Where the lanes' paths are, (LANES,) each: the path's number, -1 where a lane is idle."""

    path: np.ndarray
    t: np.ndarray
    ahead: np.ndarray
    cap: np.ndarray
    rounds: np.ndarray


def list_entries(systems: np.ndarray) -> Entries:
    """List the entries of systems (systems, n - 1, n, n) that are not zero in all of them."""
    count, m, n = systems.shape[0], systems.shape[1], systems.shape[2]
    both = [numbers.reshape(count, m * n, n) for numbers in (systems.real, systems.imag)]
    places = [np.nonzero((numbers != 0.0).any(0)) for numbers in both]
    starts = np.array([np.searchsorted(rows, np.arange(m * n + 1)) for rows, _ in places])
    starts[1] += len(places[0][0])
    columns = np.concatenate([own for _, own in places])
    values = np.concatenate([numbers[:, rows, own] for numbers, (rows, own) in zip(both, places, strict=True)], 1)
    filled = np.flatnonzero((np.diff(starts, axis=1) > 0).any(0))
    return Entries(starts, columns, np.ascontiguousarray(values), filled, np.searchsorted(filled, n * np.arange(n)))


@njit(inline="always")
def _allocate_work(n):
    m = n - 1
    count = (_HALF + 1) * m * n
    return _Work(
        np.zeros((2 * (ORDER + 1) * n, LANES)), np.zeros((2 * count, LANES)), np.zeros((2 * count, LANES)),
        np.zeros((2 * n * n, LANES)), np.zeros((n, n), np.int64), np.zeros((2 * n, LANES)), np.zeros((2 * n, LANES)),
        np.zeros((1, LANES)), np.zeros((2, LANES)),
    )  # fmt: skip


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _multiply_row(starts, columns, values, system, row, x, first):
    """Multiply a row of a quadric by the numbers of x from the ``first`` on."""
    re, im = repeat(0.0), repeat(0.0)
    for e in range(starts[0, row], starts[0, row + 1]):
        value = repeat(values[system, e])
        u, v = get_number(x, first + columns[e])
        re = re + value * u
        im = im + value * v
    for e in range(starts[1, row], starts[1, row + 1]):
        value = repeat(values[system, e])
        u, v = get_number(x, first + columns[e])
        re = re - value * v
        im = im + value * u
    return re, im


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _apply_quadrics(work, last, change, system, x, first, k):
    """Compute Q·x for every quadric at t, and Q'·x, for the numbers of x from the ``first`` on, as products ``k``."""
    starts, columns, values = last.starts, last.columns, last.values
    products, changes = work.products, work.changes
    count = starts.shape[1] - 1
    for row in range(count):
        re, im = _multiply_row(starts, columns, values, system, row, x, first)
        put_number(products, k * count + row, re, im)
    starts, columns, values, filled = change.starts, change.columns, change.values, change.filled
    rest = load(work.rest, 0)
    for row in filled:
        re, im = _multiply_row(starts, columns, values, system, row, x, first)
        put_number(changes, k * count + row, re, im)
        u, v = get_number(products, k * count + row)
        put_number(products, k * count + row, u - rest * re, v - rest * im)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _write_matrix(work, n):
    """Write the slopes of the quadrics at the first products, and the point's conjugate as the last row."""
    products, matrix, series = work.products, work.matrix, work.series
    for row in range(2 * (n - 1) * n):
        value = load(products, row)
        store(matrix, row, value + value)
    for i in range(n):
        re, im = get_number(series, i)
        put_number(matrix, (n - 1) * n + i, re, repeat(0.0) - im)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _sum_products(series, products, n, r, k):
    """Sum what the series' earlier terms add to the coefficient of tᵏ of quadric r."""
    count = (n - 1) * n
    re, im = repeat(0.0), repeat(0.0)
    for i in range(1, (k + 1) // 2):
        u, v = multiply_numbers(series, (k - i) * n, products, i * count + r * n, n)
        re, im = re + u, im + v
    re, im = re + re, im + im
    if k % 2 == 0:
        u, v = multiply_numbers(series, k // 2 * n, products, k // 2 * count + r * n, n)
        re, im = re + u, im + v
    return re, im


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _sum_changes(series, changes, filled, n, r, k):
    """Sum what the change of quadric r, in its filled rows, adds to its coefficient of tᵏ⁺¹."""
    count = (n - 1) * n
    re, im = repeat(0.0), repeat(0.0)
    for i in range((k + 1) // 2):
        for row in filled:
            a, b = get_number(series, (k - i) * n + row - r * n)
            u, v = get_number(changes, i * count + row)
            re = re + a * u - b * v
            im = im + a * v + b * u
    re, im = re + re, im + im
    if k % 2 == 0:
        for row in filled:
            a, b = get_number(series, k // 2 * n + row - r * n)
            u, v = get_number(changes, k // 2 * count + row)
            re = re + a * u - b * v
            im = im + a * v + b * u
    return re, im


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _expand_paths(work, last, change, system, n):
    """Expand the paths through the points in Taylor series, all of whose coefficients are at right angles to these.

    The coefficients of tᵏ in Σ xᵢᵀ(Q + t·Q')xⱼ vanish; one factored matrix serves them all.
    """
    m = n - 1
    series, products, changes, right = work.series, work.products, work.changes, work.right
    matrix, swaps, filled, begins = work.matrix, work.swaps, change.filled, change.begins
    _apply_quadrics(work, last, change, system, series, 0, 0)
    _write_matrix(work, n)
    factor_in_lanes(matrix, swaps)
    for k in range(1, ORDER + 1):
        for r in range(m):
            re, im = _sum_products(series, products, n, r, k)
            if begins[r] < begins[r + 1]:
                u, v = _sum_changes(series, changes, filled[begins[r] : begins[r + 1]], n, r, k - 1)
                re, im = re + u, im + v
            put_number(right, r, repeat(0.0) - re, repeat(0.0) - im)
        put_number(right, m, repeat(0.0), repeat(0.0))
        solve_in_lanes(matrix, swaps, right)
        for i in range(n):
            re, im = get_number(right, i)
            put_number(series, k * n + i, re, im)
        if k <= _HALF:
            _apply_quadrics(work, last, change, system, series, k * n, k)
    store(work.sizes, 0, measure_numbers(series, (ORDER - 1) * n, n))
    store(work.sizes, 1, measure_numbers(series, ORDER * n, n))


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _predict_points(series, point, length):
    """Go ahead along the series."""
    count = len(point)
    for row in range(count):
        total = load(series, ORDER * count + row)
        for k in range(ORDER - 1, -1, -1):
            total = total * length + load(series, k * count + row)
        store(point, row, total)


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _correct_points(work, last, change, system, n):
    """Bring predicted points back to the paths by Newton's method, at right angles to the series; in place.

    Returns the lanes in which that went well; in the others the point is too far to tell which path it belongs to.
    """
    m = n - 1
    point, right, products, matrix, swaps = work.point, work.right, work.products, work.matrix, work.swaps
    good, open_lanes = 0, ALL
    before, limit = repeat(0.0), repeat(FIRST_CORRECTION**2)
    for _ in range(_CORRECTIONS):
        _apply_quadrics(work, last, change, system, point, 0, 0)
        _write_matrix(work, n)
        for r in range(m):
            re, im = multiply_numbers(point, 0, products, r * n, n)
            put_number(right, r, repeat(0.0) - re, repeat(0.0) - im)
        put_number(right, m, repeat(0.0), repeat(0.0))
        factor_in_lanes(matrix, swaps)
        solve_in_lanes(matrix, swaps, right)
        for row in range(2 * n):
            x = load(point, row)
            store(point, row, choose(open_lanes, x + load(right, row), x))
        size = measure_numbers(right, 0, n)
        # A step leaves no more of the distance than its own share of the step before.
        converged = is_greater(repeat(CONVERGED**2), size) | is_greater(repeat(CONVERGED**2) * before, size * size)
        near = is_greater(limit, size)
        good |= open_lanes & near & converged
        open_lanes &= near & ~converged
        if open_lanes == 0:
            break
        before, limit = size, repeat(TOO_FAR**2)
    return good


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _take_up(work, steps, lane, path, point):
    """Take up a path in a lane at its start."""
    total = 0.0
    for i in range(len(point)):
        total += point[i].real ** 2 + point[i].imag ** 2
    scale = 1.0 / np.sqrt(total)
    for i in range(len(point)):
        work.series[2 * i, lane] = point[i].real * scale
        work.series[2 * i + 1, lane] = point[i].imag * scale
    steps.path[lane], steps.t[lane], steps.cap[lane], steps.rounds[lane] = path, 0.0, np.inf, 0


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _choose_steps(work, steps, tolerance):
    """Choose how far each lane goes: where the greater of the series' last two terms is within a tolerance.

    Returns the lanes whose paths end, for they ask for less than any step.
    """
    ended = 0
    for lane in range(LANES):
        steps.rounds[lane] += 1
        left = 1.0 - steps.t[lane]
        step = min(
            (tolerance / np.sqrt(work.sizes[1, lane])) ** (1.0 / ORDER),
            (tolerance / np.sqrt(work.sizes[0, lane])) ** (1.0 / (ORDER - 1)),
        )
        step = min(step, steps.cap[lane], left)
        if not step >= min(LEAST_STEP, left) or steps.rounds[lane] > MOST_ROUNDS:
            ended |= 1 << lane
        steps.ahead[lane] = 1.0 if step >= left else steps.t[lane] + step
        work.sizes[0, lane] = steps.ahead[lane] - steps.t[lane]
        work.rest[0, lane] = 1.0 - steps.ahead[lane]
    return ended


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _go_ahead(series, point, good, n):
    """Take the corrected points, of length one, as the paths' in the lanes where they are good."""
    scale = repeat(1.0) / take_root(measure_numbers(point, 0, n))
    for row in range(2 * n):
        store(series, row, choose(good, load(point, row) * scale, load(series, row)))


@njit(nogil=True, cache=True, fastmath=FAST, error_model="numpy")
def _track_system(work, last, change, system, tolerance, ends, begin, end):
    """Track the paths ``begin`` to ``end`` of one system."""
    use_widest_vectors()
    n = ends.points.shape[2]
    steps = _Steps(np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES, np.int64))
    following, busy = begin, 0
    for lane in range(LANES):
        _take_up(work, steps, lane, -1, ends.points[system, begin])
        if following < end:
            _take_up(work, steps, lane, following, ends.points[system, following])
            following += 1
            busy += 1
    while busy:
        for lane in range(LANES):
            work.rest[0, lane] = 1.0 - steps.t[lane]
        _expand_paths(work, last, change, system, n)
        ended = _choose_steps(work, steps, tolerance)
        _predict_points(work.series, work.point, load(work.sizes, 0))
        good = _correct_points(work, last, change, system, n) & ~ended
        _go_ahead(work.series, work.point, good, n)
        for lane in range(LANES):
            path, bit = steps.path[lane], 1 << lane
            if path < 0:
                continue
            if good & bit:
                steps.t[lane], steps.cap[lane] = steps.ahead[lane], np.inf
            else:
                steps.cap[lane] = 0.5 * (steps.ahead[lane] - steps.t[lane])
            if not ended & bit and steps.t[lane] < 1.0:
                continue
            for i in range(n):
                ends.points[system, path, i] = work.series[2 * i, lane] + 1j * work.series[2 * i + 1, lane]
            ends.reached[system, path] = steps.t[lane]
            steps.path[lane] = -1
            busy -= 1
            if following < end:
                _take_up(work, steps, lane, following, ends.points[system, following])
                following += 1
                busy += 1


@njit(nogil=True, cache=True, error_model="numpy")
def track_paths(last, change, tolerance, ends, begin, end):
    """Track the paths ``begin`` to ``end`` of all systems' paths, those of a system side by side.

    last, change : entries of the last systems, and of what these are more than the first ones
    tolerance : of the series' last terms
    ends : ``points`` (systems, paths, n) hold the starts, then the ends; ``reached`` (systems, paths) the last t
    """
    count = ends.points.shape[1]
    work = _allocate_work(ends.points.shape[2])
    path = begin
    while path < end:
        system = path // count
        stop = min(end, (system + 1) * count)
        _track_system(work, last, change, system, tolerance, ends, path - system * count, stop - system * count)
        path = stop
