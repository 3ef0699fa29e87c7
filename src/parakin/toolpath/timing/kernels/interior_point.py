"""Kernels that shorten a jerk-limited speed profile by an interior point method, to the quickest but for little.

The unknowns are x = ṡ² and a = s̈ at the rows; over each step two pieces of constant s⃛, each half of its time, lead
from one row to the next. The cycle time plus a logarithmic barrier for every limit is minimised by Newton's method. A
barrier is infinite at its limit, and each iterate is measured as it will run: every iterate keeps all limits, and the
work may end after any. The Hessian of the barriers is taken from the limits' gradients alone (Gauss and Newton) and is
block tridiagonal, of 2 x 2 blocks.

A long stretch is cut into windows whose ends stay as they are; from one sweep to the next the cuts move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit

_HALVINGS = 7  # of Newton's step, before none is taken
_ARMIJO = 0.05  # least fraction of the gain that the slope foretells
_RIDGE = 1e-10  # relative, on the diagonal of the Hessian
_DAMPED, _STIFF = 1e-2, 1e3  # of Newton's step, relative to the Hessian's diagonal: at first, and where it is given up
_GAIN = 0.01  # Newton's method ends where it foretells a gain below this fraction of the barriers' weight
_ROOM = 0.99  # fraction of the speed that just keeps all limits, to which a stretch is slowed down
_NEAR = 1.001  # times the least time: a window is as quick as it need be
_STILL = 1e-9  # of ṡ: below 0 by less is rounding
_DIP = 0.9  # of s̈ with which ṡ would come to 0 between two rows
_LEVEL = 0.35  # of s̈ with which a step can be passed at all; twice as much beside a stop


class StepLimits(NamedTuple):
    """The joints over each step and what bounds them: the problem that the interior point method solves.

    step : (steps,) mm; slope : (steps, joints) q' at each step's start; curvature : (rows, joints) q''
    ceiling_start, ceiling_end : (steps,) of x; between them it goes straight
    per_acceleration, per_jerk : (joints,) the reciprocals of the limits
    """

    step: Array
    slope: Array
    curvature: Array
    ceiling_start: Array
    ceiling_end: Array
    per_acceleration: Array
    per_jerk: Array


class Derivatives(NamedTuple):
    """Derivatives by x and a at a step's start and end, (4,) each.

    time, way : of the step, and (3, 4) of the way from its start to its start, middle and end
    square, speed, rise : (3, 4) of ṡ², ṡ and s̈ at start, middle and end
    jerk : (2, 4) of s⃛ in both pieces; form : (3, 4) is scratch; hessian : (4, 4); gradient : (4,)
    state : (3, 4) mm, ṡ and s̈ at the three places, and s⃛ of both pieces in the last column
    """

    time: Array
    way: Array
    square: Array
    speed: Array
    rise: Array
    jerk: Array
    form: Array
    gradient: Array
    hessian: Array
    state: Array


class Newton(NamedTuple):
    """Scratch of a window of n rows.

    gradient, direction : (n, 2) by x and a; diagonal : (n, 3) of each block xx, xa, aa
    beside : (n, 4) the blocks xx, xa, ax, aa between a row and the next
    weight : (n,) of the barriers of each step
    x, a : (n,) the iterate tried
    derivatives : of one step
    """

    gradient: Array
    direction: Array
    diagonal: Array
    beside: Array
    weight: Array
    x: Array
    a: Array
    derivatives: Derivatives


@njit(nogil=True, cache=True)
def _allocate_derivatives():
    """Allocate the derivatives of a step."""
    return Derivatives(
        np.empty(4), np.zeros((3, 4)),
        np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4)), np.empty((2, 4)), np.empty((3, 4)),
        np.empty(4), np.empty((4, 4)), np.empty((3, 4)),
    )  # fmt: skip


@njit(nogil=True, cache=True)
def allocate_newton(n):
    """Allocate the scratch of a window of n rows."""
    gradient, direction, diagonal, beside = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 3)), np.empty((n, 4))
    weight, x, a = np.empty(n), np.empty(n), np.empty(n)
    return Newton(gradient, direction, diagonal, beside, weight, x, a, _allocate_derivatives())


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _join(h, x0, a0, x1, a1):
    """Join two rows by two pieces of equal time: the time of both, ṡ and s̈ between them, s⃛ of both, mm to the middle.

    The time is negative where they can't be joined.
    """
    v0, v1, more = np.sqrt(x0), np.sqrt(x1), a1 - a0
    mean = 0.5 * (v0 + v1)
    root = mean * mean - more * h / 3.0
    if not root > 0.0:
        return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t = 2.0 * h / (mean + np.sqrt(root))
    v, a = mean - 0.125 * more * t, 2.0 * (v1 - v0) / t - 0.5 * (a0 + a1)
    e0, e1 = 2.0 * (a - a0) / t, 2.0 * (a1 - a) / t
    middle = 0.5 * t * (v0 + 0.25 * t * (a0 + t * e0 / 6.0))
    least = min(v0 + 0.25 * t * a0, v1 - 0.25 * t * a1)
    if not (v > 0.0 and 0.0 < middle < h and least >= -_STILL * v):
        return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return t, v, a, e0, e1, middle


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _use_limits(i, limits, x0, a0, x1, a1):
    """Measure a step: its time, the greatest fraction c of a ceiling, of an acceleration and of a jerk, and a product.

    The product is that of 1 - c² for all of them. The time is negative where the rows can't be joined.
    """
    h = limits.step[i]
    t, v, a, e0, e1, o = _join(h, x0, a0, x1, a1)
    if t < 0.0:
        return -1.0, np.inf, np.inf, np.inf, 0.0
    v0, v1, x = np.sqrt(x0), np.sqrt(x1), v * v
    c0, c2 = x0 / limits.ceiling_start[i], x1 / limits.ceiling_end[i]
    c1 = x / (limits.ceiling_start[i] + (limits.ceiling_end[i] - limits.ceiling_start[i]) * o / h)
    product = (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2)
    # Between the rows ṡ lies within its Bernstein coefficients
    early, late, mean = v0 + 0.25 * t * a0, v1 - 0.25 * t * a1, 0.5 * (v0 + v1)
    flow = 2.0 * h / (t * mean) - 1.0  # 0 where the rows can just be joined; ṡ does not fall to 0 on the way
    if x0 > 0.0:
        flow *= early / mean
    if x1 > 0.0:
        flow *= late / mean
    early *= early / (0.75 * limits.ceiling_start[i] + 0.25 * limits.ceiling_end[i])
    late *= late / (0.25 * limits.ceiling_start[i] + 0.75 * limits.ceiling_end[i])
    product *= (1.0 - early) * (1.0 - late) * max(flow, 0.0)
    of_ceiling, of_acceleration, of_jerk = max(max(c0, c1, c2), max(early, late)), 0.0, 0.0
    for j in range(len(limits.per_jerk)):
        bend0, bend1, slope0 = limits.curvature[i, j], limits.curvature[i + 1, j], limits.slope[i, j]
        third = (bend1 - bend0) / h
        slope, bend, slope1 = (
            slope0 + o * (bend0 + 0.5 * third * o),
            bend0 + third * o,
            slope0 + 0.5 * h * (bend0 + bend1),
        )
        w = limits.per_acceleration[j]
        c0, c1 = abs(slope0 * a0 + bend0 * x0) * w, abs(slope * a + bend * x) * w
        c2 = abs(slope1 * a1 + bend1 * x1) * w
        of_acceleration = max(of_acceleration, c0, c1, c2)
        product *= (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2)
        w = limits.per_jerk[j]
        if w > 0.0:
            c0 = abs(slope0 * e0 + v0 * (3.0 * bend0 * a0 + third * x0)) * w
            both = v * (3.0 * bend * a + third * x)
            c1, c2 = abs(slope * e0 + both) * w, abs(slope * e1 + both) * w
            c3 = abs(slope1 * e1 + v1 * (3.0 * bend1 * a1 + third * x1)) * w
            of_jerk = max(of_jerk, max(c0, c1), max(c2, c3))
            product *= (1.0 - c0 * c0) * (1.0 - c1 * c1) * (1.0 - c2 * c2) * (1.0 - c3 * c3)
    return t, of_ceiling, of_acceleration, of_jerk, product


@njit(nogil=True, cache=True, error_model="numpy")
def measure_step(i, limits, x0, a0, x1, a1):
    """Measure a step: its time, and the product of 1 - c² for all limits, each taken by c; 0 where one is broken."""
    t, of_ceiling, of_acceleration, of_jerk, product = _use_limits(i, limits, x0, a0, x1, a1)
    return t, product if of_ceiling < 1.0 and of_acceleration < 1.0 and of_jerk < 1.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def measure_excess(i, limits, x0, a0, x1, a1):
    """Measure the factor by which a step would have to be stretched in time to keep every limit just so."""
    _, of_ceiling, of_acceleration, of_jerk, _ = _use_limits(i, limits, x0, a0, x1, a1)
    return max(np.sqrt(of_ceiling), np.sqrt(of_acceleration), np.cbrt(of_jerk))


@njit(nogil=True, cache=True, error_model="numpy")
def _expand_joining(h, x0, a0, x1, a1, d):
    """Derive what :func:`_join` computes by x0, a0, x1 and a1: rows of ``d``, see :class:`Derivatives`."""
    t, v, _, e0, e1, _ = _join(h, x0, a0, x1, a1)
    v0, v1 = np.sqrt(x0), np.sqrt(x1)
    more, rate = a1 - a0, 2.0 * (v1 - v0) / t
    scale = 1.0 / (0.5 * (v0 + v1) - more * t / 6.0)
    d.speed[0, :] = d.speed[2, :] = d.rise[0, :] = d.rise[2, :] = 0.0
    d.speed[0, 0] = 0.5 / v0 if v0 > 0.0 else 0.0
    d.speed[2, 2] = 0.5 / v1 if v1 > 0.0 else 0.0
    d.square[0, :] = d.square[2, :] = 0.0
    d.rise[0, 1] = d.rise[2, 3] = d.square[0, 0] = d.square[2, 2] = 1.0
    for p in range(4):
        change = d.rise[2, p] - d.rise[0, p]
        mean = 0.5 * (d.speed[0, p] + d.speed[2, p])
        dt = (t * t / 12.0 * change - t * mean) * scale
        d.time[p] = dt
        d.speed[1, p] = mean - 0.125 * (t * change + more * dt)
        rising = (2.0 * (d.speed[2, p] - d.speed[0, p]) - rate * dt) / t
        da = rising - 0.5 * (d.rise[0, p] + d.rise[2, p])
        d.rise[1, p] = da
        d.jerk[0, p] = (2.0 * (da - d.rise[0, p]) - e0 * dt) / t
        d.jerk[1, p] = (2.0 * (d.rise[2, p] - da) - e1 * dt) / t
        d.square[1, p] = 2.0 * v * d.speed[1, p]
        way = 0.5 * d.speed[0, p] + t * (0.125 * d.rise[0, p] + t / 48.0 * d.jerk[0, p])
        d.way[1, p] = 0.5 * v * dt + t * way


@njit(nogil=True, cache=True, error_model="numpy")
def _add_form(weight, f, s, d):
    """Add a place's barriers by the rows of ``d.form``: their first and second derivatives ``f`` (3), ``s`` (6)."""
    gradient, hessian, form = d.gradient, d.hessian, d.form
    for p in range(4):
        u, v, w = form[0, p], form[1, p], form[2, p]
        gradient[p] += weight * (f[0] * u + f[1] * v + f[2] * w)
        k0 = weight * (s[0] * u + s[1] * v + s[3] * w)
        k1 = weight * (s[1] * u + s[2] * v + s[4] * w)
        k2 = weight * (s[3] * u + s[4] * v + s[5] * w)
        for q in range(p, 4):
            hessian[p, q] += k0 * form[0, q] + k1 * form[1, q] + k2 * form[2, q]


@njit(nogil=True, cache=True, error_model="numpy")
def _add_accelerations(i, limits, k, weight, d):
    """Add the barriers of the joints' accelerations at place k of step i: its start, its middle or its end."""
    at, rise = d.state[k, 0], d.state[k, 2]
    square = d.state[k, 1] ** 2
    dsquare, drise, dat = d.square[k], d.rise[k], d.way[k]
    h, f0, f1, f2, s0, s1, s2, s3, s4, s5 = limits.step[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(limits.per_acceleration)):
        bend0, w = limits.curvature[i, j], limits.per_acceleration[j]
        third = (limits.curvature[i + 1, j] - bend0) / h
        p = (limits.slope[i, j] + at * (bend0 + 0.5 * third * at)) * w
        q, r = (bend0 + third * at) * w, third * w
        c = p * rise + q * square
        rest = 2.0 / (1.0 - c * c)
        first, second = c * rest, 0.5 * (1.0 + c * c) * rest * rest
        f0, f1, f2 = f0 + first * p, f1 + first * q, f2 + first * r
        s0, s1, s2 = s0 + second * p * p, s1 + second * p * q, s2 + second * q * q
        s3, s4, s5 = s3 + second * p * r, s4 + second * q * r, s5 + second * r * r
    for p in range(4):
        d.form[0, p], d.form[1, p], d.form[2, p] = drise[p], dsquare[p] + rise * dat[p], square * dat[p]
    _add_form(weight, (f0, f1, f2), (s0, s1, s2, s3, s4, s5), d)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_jerks(i, limits, k, piece, weight, d):
    """Add the barriers of the joints' jerks at place k of step i, its start, middle or end, with a piece's s⃛."""
    at, speed, rise, jerk = d.state[k, 0], d.state[k, 1], d.state[k, 2], d.state[piece, 3]
    dspeed, drise, djerk, dat = d.speed[k], d.rise[k], d.jerk[piece], d.way[k]
    h, f0, f1, f2, s0, s1, s2, s3, s4, s5 = limits.step[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(limits.per_jerk)):
        bend0, w = limits.curvature[i, j], limits.per_jerk[j]
        third = (limits.curvature[i + 1, j] - bend0) / h
        p = (limits.slope[i, j] + at * (bend0 + 0.5 * third * at)) * w
        q, r = 3.0 * (bend0 + third * at) * w, third * w
        c = p * jerk + speed * (q * rise + r * speed * speed)
        rest = 2.0 / (1.0 - c * c)
        first, second = c * rest, 0.5 * (1.0 + c * c) * rest * rest
        f0, f1, f2 = f0 + first * p, f1 + first * q, f2 + first * r
        s0, s1, s2 = s0 + second * p * p, s1 + second * p * q, s2 + second * q * q
        s3, s4, s5 = s3 + second * p * r, s4 + second * q * r, s5 + second * r * r
    for p in range(4):
        d.form[0, p] = djerk[p]
        d.form[1, p] = speed * drise[p] + rise * dspeed[p] + jerk * dat[p] / 3.0
        d.form[2, p] = 3.0 * speed * (speed * dspeed[p] + rise * dat[p])
    _add_form(weight, (f0, f1, f2), (s0, s1, s2, s3, s4, s5), d)


@njit(nogil=True, cache=True, error_model="numpy")
def _add_ceilings(i, limits, t, weight, d):
    """Add the barriers of the ceilings of x at a step's start, middle and end."""
    o = d.state[1, 0]
    gradient, hessian = d.gradient, d.hessian
    start, end = limits.ceiling_start[i], limits.ceiling_end[i]
    for k in range(3):
        top = start if k == 0 else start + (end - start) * o / limits.step[i] if k == 1 else end
        c = d.state[k, 1] ** 2 / top
        rest = 2.0 / (1.0 - c * c)
        first, second = weight * c * rest / top, weight * 0.5 * (1.0 + c * c) * rest * rest / (top * top)
        if k == 1:
            form, rise = d.form[0], c * (end - start) / limits.step[i]
            for p in range(4):
                form[p] = d.square[1, p] - rise * d.way[1, p]
            for p in range(4):
                gradient[p] += first * form[p]
                for q in range(p, 4):
                    hessian[p, q] += second * form[p] * form[q]
        else:
            gradient[k] += first
            hessian[k, k] += second
    for k in range(0, 3, 2):  # the coefficients of ṡ beside the middle
        side = 0.25 if k == 0 else -0.25
        v, rise = d.state[k, 1], d.state[k, 2]
        top = 1.0 / np.sqrt((0.5 + side) * start + (0.5 - side) * end)
        c = (v + side * t * rise) * top
        rest, form = 2.0 / (1.0 - c * c), d.form[0]
        first, second = weight * c * rest, weight * 0.5 * (1.0 + c * c) * rest * rest
        for p in range(4):
            form[p] = (d.speed[k, p] + side * (t * d.rise[k, p] + rise * d.time[p])) * top
        for p in range(4):
            gradient[p] += first * form[p]
            for q in range(p, 4):
                hessian[p, q] += second * form[p] * form[q]


@njit(nogil=True, cache=True, error_model="numpy")
def _add_flow(h, t, x0, a0, x1, a1, weight, d):
    """Add the barriers that keep ṡ above 0 on the way, and two rows so near that they can be joined."""
    v0, v1, form = np.sqrt(x0), np.sqrt(x1), d.form
    mean = 0.5 * (v0 + v1)
    values = v0 + 0.25 * t * a0, v1 - 0.25 * t * a1, 2.0 * h / t - mean
    for p in range(4):
        form[0, p] = d.speed[0, p] + 0.25 * (t * d.rise[0, p] + a0 * d.time[p])
        form[1, p] = d.speed[2, p] - 0.25 * (t * d.rise[2, p] + a1 * d.time[p])
        form[2, p] = -2.0 * h / (t * t) * d.time[p] - 0.5 * (d.speed[0, p] + d.speed[2, p])
    for k in range(3):
        if (k == 0 and x0 == 0.0) or (k == 1 and x1 == 0.0):
            continue
        for p in range(4):
            along = form[k, p] / values[k]
            d.gradient[p] += weight * (0.5 * (d.speed[0, p] + d.speed[2, p]) / mean - along)
            for q in range(p, 4):
                d.hessian[p, q] += weight * along * form[k, q] / values[k]


@njit(nogil=True, cache=True, error_model="numpy")
def expand_step(i, limits, weight, x0, a0, x1, a1, d):
    """Expand a step's time and barriers to the second order: ``d.gradient``, and the upper half of ``d.hessian``."""
    h = limits.step[i]
    t, v, a, e0, e1, o = _join(h, x0, a0, x1, a1)
    v0, v1, x = np.sqrt(x0), np.sqrt(x1), v * v
    _expand_joining(h, x0, a0, x1, a1, d)
    for p in range(4):
        d.gradient[p] = d.time[p]
        for q in range(p, 4):
            d.hessian[p, q] = 0.5 * h / (x * x * v) * d.square[1, p] * d.square[1, q]
    if v0 > 0.0:
        d.hessian[0, 0] += 0.125 * h / (x0 * x0 * v0)
    if v1 > 0.0:
        d.hessian[2, 2] += 0.125 * h / (x1 * x1 * v1)
    for k in range(3):
        d.state[k, 0] = 0.0 if k == 0 else o if k == 1 else h
        d.state[k, 1] = v0 if k == 0 else v if k == 1 else v1
        d.state[k, 2] = a0 if k == 0 else a if k == 1 else a1
        d.state[k, 3] = e0 if k == 0 else e1
        _add_accelerations(i, limits, k, weight, d)
    _add_ceilings(i, limits, t, weight, d)
    _add_flow(h, t, x0, a0, x1, a1, weight, d)
    _add_jerks(i, limits, 0, 0, weight, d)
    _add_jerks(i, limits, 1, 0, weight, d)
    _add_jerks(i, limits, 1, 1, weight, d)
    _add_jerks(i, limits, 2, 1, weight, d)


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
def _measure_window(first, last, limits, x, a, at, weight):
    """Measure a window's time and barriers, infinite where a limit breaks; x and a begin with row ``at``."""
    time, barrier = 0.0, 0.0
    for i in range(first, last):
        k = i - at
        t, product = measure_step(i, limits, x[k], a[k], x[k + 1], a[k + 1])
        if not product > 0.0:
            return np.inf, np.inf
        time += t
        barrier -= weight[i - first] * np.log(product)
    return time, barrier


@njit(nogil=True, cache=True, error_model="numpy")
def _search_line(first, last, limits, x, a, now, slope, newton):
    """Take as much of Newton's step as lowers time and barriers; returns how much, 0 for none."""
    part = 1.0
    for _ in range(_HALVINGS):
        fits = True
        for k in range(last - first + 1):
            newton.x[k] = x[first + k] + part * newton.direction[k, 0]
            newton.a[k] = a[first + k] + part * newton.direction[k, 1]
            fits &= newton.x[k] > 0.0 or k == 0 or k == last - first
        if fits:
            time, barrier = _measure_window(first, last, limits, newton.x, newton.a, first, newton.weight)
            if time + barrier <= now + _ARMIJO * part * slope:
                for k in range(last - first + 1):
                    x[first + k], a[first + k] = newton.x[k], newton.a[k]
                return part
        part *= 0.5
    return 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _take_step(first, last, limits, x, a, mu, damping, newton):
    """Take one of Newton's steps; returns whether it is worth it, and the damping of the next."""
    total = 0.0
    for i in range(first, last):
        t = measure_step(i, limits, x[i], a[i], x[i + 1], a[i + 1])[0]
        newton.weight[i - first] = mu * t
        total += t
    time, barrier = _measure_window(first, last, limits, x, a, 0, newton.weight)
    worth = _GAIN * mu * total
    while damping < _STIFF:
        _expand_window(first, last, limits, x, a, newton)
        slope = _solve_window(last - first, damping, newton)
        if not -slope > worth:
            break
        part = _search_line(first, last, limits, x, a, time + barrier, slope, newton)
        if part > 0.3:
            return True, max(_RIDGE, 0.1 * damping)
        if part > 0.0:
            return True, damping
        damping = max(10.0 * damping, _DAMPED)
    return False, _RIDGE


@njit(nogil=True, cache=True, error_model="numpy")
def _clip_acceleration(start, stop, step, x, a):
    """Clip s̈ at the rows of a stretch so that every step can be passed at the mean speed of its ends."""
    x[start] = x[stop] = a[start] = a[stop] = 0.0
    for i in range(start + 1, stop):
        most = np.inf
        for n in range(i - 1, i + 1):
            part = 2.0 * _LEVEL if n == start or n == stop - 1 else _LEVEL
            both = np.sqrt(x[n]) + np.sqrt(x[n + 1])
            most = min(most, part * both * both / step[n], _DIP * np.sqrt(x[i]) * both / step[n])
        a[i] = min(max(a[i], -most), most)


@njit(nogil=True, cache=True, error_model="numpy")
def lower_speeds(edges, limits, x, a):
    """Lower all speeds of each stretch, of rows ``edges`` (k, 2), that breaks a limit; it can be passed then."""
    for k in range(len(edges)):
        first, last, worst = edges[k, 0], edges[k, 1], 0.0
        for i in range(first, last):
            worst = max(worst, measure_excess(i, limits, x[i], a[i], x[i + 1], a[i + 1]))
        if worst == np.inf:
            _clip_acceleration(first, last, limits.step, x, a)
            worst = 0.0
            for i in range(first, last):
                worst = max(worst, measure_excess(i, limits, x[i], a[i], x[i + 1], a[i + 1]))
        if worst >= 1.0:
            for i in range(first, last + 1):
                x[i], a[i] = x[i] * (_ROOM / worst) ** 2, a[i] * (_ROOM / worst) ** 2


@njit(nogil=True, cache=True, error_model="numpy")
def shorten_windows(windows, limits, x, a, least, barriers, most, newton):
    """Shorten the time of windows, whose ends' x and a stay.

    windows : (k, 2) of the first and last row
    least : (steps,) s that each step takes at least; a window that is near that is left as it is
    barriers : the weights of the barriers, one after another, falling; most : Newton's steps for each
    """
    for k in range(len(windows)):
        first, last = windows[k, 0], windows[k, 1]
        time, bound = 0.0, 0.0
        for i in range(first, last):
            time, bound = time + measure_step(i, limits, x[i], a[i], x[i + 1], a[i + 1])[0], bound + least[i]
        if time <= _NEAR * bound:
            continue
        damping = _RIDGE
        for mu in barriers:
            for _ in range(most):
                taken, damping = _take_step(first, last, limits, x, a, mu, damping, newton)
                if not taken:
                    break


@njit(nogil=True, cache=True, error_model="numpy")
def join_rows(limits, x, a, time, use, start, stop):
    """Measure steps from ``start`` to ``stop``: their ``time`` and the ``use`` of the most used jerk limit (steps,)."""
    for i in range(start, stop):
        time[i], use[i] = 0.0, 0.0
        if limits.step[i] > 0.0:
            t, _, _, jerk, _ = _use_limits(i, limits, x[i], a[i], x[i + 1], a[i + 1])
            time[i], use[i] = t, jerk


@njit(nogil=True, cache=True, error_model="numpy")
def locate_times(limits, x, a, steps, times, states):
    """Find where the motion is ``times`` (k,) after the start of ``steps``: ``states`` (k, 3), mm, ṡ² and s̈."""
    for k in range(len(steps)):
        i, after = steps[k], times[k]
        t, v, rise, e0, e1, o = _join(limits.step[i], x[i], a[i], x[i + 1], a[i + 1])
        begin, speed, jerk = 0.0, np.sqrt(x[i]), e0
        base = a[i]
        if after > 0.5 * t:
            after, begin, speed, base, jerk = after - 0.5 * t, o, v, rise, e1
        states[k, 0] = begin + after * (speed + after * (0.5 * base + after * jerk / 6.0))
        states[k, 1] = (speed + after * (base + 0.5 * after * jerk)) ** 2
        states[k, 2] = base + after * jerk


@njit(nogil=True, cache=True, error_model="numpy")
def write_pieces(edges, limits, x, a, profile):
    """Write two pieces of constant s⃛ for each step of the stretches to the profile."""
    speed, rise, jerk = profile.speed, profile.acceleration, profile.jerk
    n, now = 0, 0.0
    for k in range(len(edges)):
        for i in range(edges[k, 0], edges[k, 1]):
            profile.row_times[i] = now
            t, v, middle, e0, e1, o = _join(limits.step[i], x[i], a[i], x[i + 1], a[i + 1])
            profile.time[n], profile.row[n], profile.shift[n] = now, i, 0.0
            speed[n], rise[n], jerk[n] = np.sqrt(x[i]), a[i], e0
            profile.time[n + 1], profile.row[n + 1], profile.shift[n + 1] = now + 0.5 * t, i, o
            speed[n + 1], rise[n + 1], jerk[n + 1] = v, middle, e1
            now, n = now + t, n + 2
        profile.row_times[edges[k, 1]] = profile.time[n] = now


@njit(nogil=True, cache=True, error_model="numpy")
def stretch_pieces(edges, profile, worst):
    """Stretch the time of each stretch by its factor ``worst`` (k,)."""
    time, row_times = profile.time, profile.row_times
    n, now = 0, 0.0
    for k in range(len(edges)):
        first, last, wider = edges[k, 0], edges[k, 1], worst[k]
        before = row_times[first]
        span = wider * (row_times[last] - before)
        for i in range(first, last):
            row_times[i] = now + wider * (row_times[i] - before)
            for _ in range(2):
                time[n] = now + wider * (time[n] - before)
                profile.speed[n] /= wider
                profile.acceleration[n] /= wider * wider
                profile.jerk[n] /= wider * wider * wider
                n += 1
        now += span
        row_times[last] = now
    time[n] = now
