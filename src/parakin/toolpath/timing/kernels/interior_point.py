"""Kernels that shorten a jerk-limited speed profile by an interior point method, to the quickest but for little.

The unknowns are x = ṡ² and a = s̈ at the rows. The cycle time plus a logarithmic barrier for every limit is minimised by
Newton's method. A barrier is infinite at its limit, and each iterate is measured as it will run: every iterate keeps
all limits, and the work may end after any. The Hessian is block tridiagonal, of 2 x 2 blocks.

A long stretch is cut into windows whose ends stay as they are; from one sweep to the next the cuts move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit
from .barriers import Derivatives, allocate_derivatives, expand_step
from .step_limits import StepLimits, measure_step

_HALVINGS = 7  # of Newton's step, before none is taken
_ARMIJO = 0.05  # least fraction of the gain that the slope foretells
_RIDGE = 1e-10  # relative, on the diagonal of the Hessian
_DAMPED, _STIFF = 1e-2, 1e3  # of Newton's step, relative to the Hessian's diagonal: at first, and where it is given up
_GAIN = 0.01  # Newton's method ends where it foretells a gain below this fraction of the barriers' weight
_NEAR = 1.001  # times the least time: a window is as quick as it need be


class Sweep(NamedTuple):
    """What a sweep over windows works on.

    limits : the problem; x, a : (rows,) the profile, which is shortened
    gains : (steps,) the fraction of time that the last sweep saved around each step, overwritten
    weight : of the barriers; steps : of Newton's in each window, at most
    worth : a window is left as it is where no gain is as much
    """

    limits: StepLimits
    x: Array
    a: Array
    gains: Array
    weight: float
    steps: int
    worth: float


class Newton(NamedTuple):
    """Scratch of a window of n rows.

    gradient, direction : (n, 2) by x and a; diagonal : (n, 3) of each block xx, xa, aa
    beside : (n, 4) the blocks xx, xa, ax, aa between a row and the next
    weight : (n,) of the barriers of each step
    time, room : (n,) of each step, and the logarithm of what all limits leave it
    x, a, tried_time, tried_room : (n,) the iterate tried
    derivatives : of one step
    """

    gradient: Array
    direction: Array
    diagonal: Array
    beside: Array
    weight: Array
    time: Array
    room: Array
    x: Array
    a: Array
    tried_time: Array
    tried_room: Array
    derivatives: Derivatives


@njit(nogil=True, cache=True)
def allocate_newton(n):
    """Allocate the scratch of a window of n rows."""
    gradient, direction, diagonal, beside = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 3)), np.empty((n, 4))
    weight, time, room, x, a = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    tried = np.empty(n), np.empty(n)
    return Newton(gradient, direction, diagonal, beside, weight, time, room, x, a, *tried, allocate_derivatives())


@njit(nogil=True, cache=True, error_model="numpy")
def _expand_window(first, last, limits, x, a, newton):
    """Expand the window of rows ``first`` to ``last``; both ends are fixed."""
    newton.gradient[: last - first + 1] = 0.0
    newton.diagonal[: last - first + 1] = 0.0
    derivatives = newton.derivatives
    gradient, hessian = derivatives.gradient, derivatives.hessian
    for i in range(first, last):
        k = i - first
        expand_step(i, limits, newton.weight[k], x[i], a[i], x[i + 1], a[i + 1], derivatives)
        for side in range(2):
            newton.gradient[k + side, 0] += gradient[2 * side]
            newton.gradient[k + side, 1] += gradient[2 * side + 1]
            newton.diagonal[k + side, 0] += hessian[2 * side, 2 * side]
            newton.diagonal[k + side, 1] += hessian[2 * side, 2 * side + 1]
            newton.diagonal[k + side, 2] += hessian[2 * side + 1, 2 * side + 1]
        newton.beside[k, 0], newton.beside[k, 1] = hessian[0, 2], hessian[0, 3]
        newton.beside[k, 2], newton.beside[k, 3] = hessian[1, 2], hessian[1, 3]


@njit(nogil=True, cache=True, error_model="numpy")
def _solve_window(count, damping, newton):
    """Solve the block tridiagonal system for Newton's direction; returns the slope along it."""
    diagonal, beside, gradient, direction = newton.diagonal, newton.beside, newton.gradient, newton.direction
    direction[0], direction[count] = 0.0, 0.0
    for k in range(1, count):
        diagonal[k, 0] *= 1.0 + damping
        diagonal[k, 2] *= 1.0 + damping
        direction[k, 0], direction[k, 1] = -gradient[k, 0], -gradient[k, 1]
        if k > 1:
            p, q, r = diagonal[k - 1, 0], diagonal[k - 1, 1], diagonal[k - 1, 2]
            det = 1.0 / (p * r - q * q)
            b = beside[k - 1]
            # rows of (inverse block)·beside
            c00, c01 = (r * b[0] - q * b[2]) * det, (r * b[1] - q * b[3]) * det
            c10, c11 = (p * b[2] - q * b[0]) * det, (p * b[3] - q * b[1]) * det
            diagonal[k, 0] -= b[0] * c00 + b[2] * c10
            diagonal[k, 1] -= b[0] * c01 + b[2] * c11
            diagonal[k, 2] -= b[1] * c01 + b[3] * c11
            direction[k, 0] -= c00 * direction[k - 1, 0] + c10 * direction[k - 1, 1]
            direction[k, 1] -= c01 * direction[k - 1, 0] + c11 * direction[k - 1, 1]
    slope = 0.0
    for k in range(count - 1, 0, -1):
        y, z = direction[k, 0], direction[k, 1]
        if k < count - 1:
            b = beside[k]
            y -= b[0] * direction[k + 1, 0] + b[1] * direction[k + 1, 1]
            z -= b[2] * direction[k + 1, 0] + b[3] * direction[k + 1, 1]
        p, q, r = diagonal[k, 0], diagonal[k, 1], diagonal[k, 2]
        det = p * r - q * q
        direction[k, 0], direction[k, 1] = (r * y - q * z) / det, (p * z - q * y) / det
        slope += gradient[k, 0] * direction[k, 0] + gradient[k, 1] * direction[k, 1]
    return slope


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_window(first, limits, x, a, time, room):
    """Measure each step's time and the logarithm of its room; returns whether no limit breaks. x and a are its rows."""
    for k in range(len(x) - 1):
        time[k], product = measure_step(first + k, limits, x[k], a[k], x[k + 1], a[k + 1])
        if not product > 0.0:
            return False
        room[k] = np.log(product)
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def _sum_cost(count, time, room, weight):
    """Sum time and barriers of a window's steps."""
    total, barrier = 0.0, 0.0
    for k in range(count):
        total += time[k]
        barrier -= weight[k] * room[k]
    return total + barrier


@njit(nogil=True, cache=True, error_model="numpy")
def _search_line(first, last, limits, x, a, now, slope, newton):
    """Take as much of Newton's step as lowers time and barriers; returns how much, 0 for none."""
    fraction, count = 1.0, last - first
    tried = newton.x[: count + 1], newton.a[: count + 1]
    for _ in range(_HALVINGS):
        fits = True
        for k in range(count + 1):
            newton.x[k] = x[first + k] + fraction * newton.direction[k, 0]
            newton.a[k] = a[first + k] + fraction * newton.direction[k, 1]
            fits &= newton.x[k] > 0.0 or k == 0 or k == count
        if fits and _measure_window(first, limits, *tried, newton.tried_time, newton.tried_room):
            cost = _sum_cost(count, newton.tried_time, newton.tried_room, newton.weight)
            if cost <= now + _ARMIJO * fraction * slope:
                x[first : last + 1], a[first : last + 1] = tried
                newton.time[:count], newton.room[:count] = newton.tried_time[:count], newton.tried_room[:count]
                return fraction
        fraction *= 0.5
    return 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _take_step(first, last, limits, x, a, mu, damping, newton):
    """Take one of Newton's steps; returns whether it is worth it, and the damping of the next."""
    count, total = last - first, 0.0
    for k in range(count):
        newton.weight[k] = mu * newton.time[k]
        total += newton.time[k]
    now, worth = _sum_cost(count, newton.time, newton.room, newton.weight), _GAIN * mu * total
    while damping < _STIFF:
        _expand_window(first, last, limits, x, a, newton)
        slope = _solve_window(count, damping, newton)
        if not -slope > worth:
            break
        fraction = _search_line(first, last, limits, x, a, now, slope, newton)
        if fraction > 0.3:
            return True, max(_RIDGE, 0.1 * damping)
        if fraction > 0.0:
            return True, damping
        damping = max(10.0 * damping, _DAMPED)
    return False, _RIDGE


@njit(nogil=True, cache=True, error_model="numpy")
def _bound_time(first, last, limits):
    """Bound the time of a window from below, by its ceilings."""
    time = 0.0
    for i in range(first, last):
        time += limits.step[i] / np.sqrt(max(limits.ceiling_start[i], limits.ceiling_end[i]))
    return time


@njit(nogil=True, cache=True, error_model="numpy")
def shorten_windows(windows, sweep, newton):
    """Shorten the time of windows (k, 2) of first and last row, whose ends stay; returns the steps expanded."""
    limits, x, a, gains = sweep.limits, sweep.x, sweep.a, sweep.gains
    work = 0
    for k in range(len(windows)):
        first, last = windows[k, 0], windows[k, 1]
        rows = slice(first, last + 1)
        if gains[first:last].max() < sweep.worth or not _measure_window(
            first, limits, x[rows], a[rows], newton.time, newton.room
        ):
            continue
        time = newton.time[: last - first].sum()
        if time <= _NEAR * _bound_time(first, last, limits):
            continue
        damping = _RIDGE
        for _ in range(sweep.steps):
            advanced, damping = _take_step(first, last, limits, x, a, sweep.weight, damping, newton)
            work += last - first
            if not advanced:
                break
        gains[first:last] = abs(1.0 - newton.time[: last - first].sum() / time)
    return work
