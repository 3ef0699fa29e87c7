"""Kernels that expand a step's time and the logarithmic barriers of its limits to the second order.

The Hessian of the barriers is taken from the limits' gradients alone (Gauss and Newton).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit
from .step_limits import join_step

_ROUNDED = {"contract", "arcp"}  # a·b + c is rounded once, a / b may be a·(1/b): a seventh off the time


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


@njit(nogil=True, cache=True)
def allocate_derivatives():
    """Allocate the derivatives of a step."""
    return Derivatives(
        np.empty(4), np.zeros((3, 4)),
        np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4)), np.empty((2, 4)), np.empty((3, 4)),
        np.empty(4), np.empty((4, 4)), np.empty((3, 4)),
    )  # fmt: skip


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
def _expand_joining(h, x0, a0, x1, a1, d):
    """Derive what :func:`_join` computes by x0, a0, x1 and a1: rows of ``d``, see :class:`Derivatives`."""
    t, v, _, e0, e1, _ = join_step(h, x0, a0, x1, a1)
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
def _add_accelerations(i, limits, k, weight, d):
    """Add the barriers of the joints' accelerations at place k of step i: its start, its middle or its end."""
    at, rise = d.state[k, 0], d.state[k, 2]
    square, tight = d.state[k, 1] ** 2, limits.tightening[i] ** 2
    dsquare, drise, dat = d.square[k], d.rise[k], d.way[k]
    h, f0, f1, f2, s0, s1, s2, s3, s4, s5 = limits.step[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(limits.per_acceleration)):
        bend0, w = limits.curvature[i, j], limits.per_acceleration[j] * tight
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
def _add_forces(i, limits, k, weight, d):
    """Add the barriers of the drives' forces at place k of step i: its start, its middle or its end."""
    at, rise, form = d.state[k, 0], d.state[k, 2], d.form[0]
    square, tight, h = d.state[k, 1] ** 2, limits.tightening[i] ** 2, limits.step[i]
    for j in range(limits.along.shape[1]):
        along, across = limits.along[i, j] * tight, limits.across[i, j] * tight
        bend, turn = (limits.along[i + 1, j] * tight - along) / h, (limits.across[i + 1, j] * tight - across) / h
        p, q = along + bend * at, across + turn * at
        rest = 1.0 / (1.0 - p * rise - q * square)
        for n in range(4):
            change = (bend * rise + turn * square) * d.way[k, n]
            form[n] = (p * d.rise[k, n] + q * d.square[k, n] + change) * rest
        for n in range(4):
            d.gradient[n] += weight * form[n]
            for m in range(n, 4):
                d.hessian[n, m] += weight * form[n] * form[m]


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
def _add_jerks(i, limits, k, piece, weight, d):
    """Add the barriers of the joints' jerks at place k of step i, its start, middle or end, with a piece's s⃛."""
    at, speed, rise, jerk = d.state[k, 0], d.state[k, 1], d.state[k, 2], d.state[piece, 3]
    dspeed, drise, djerk, dat, tight = d.speed[k], d.rise[k], d.jerk[piece], d.way[k], limits.tightening[i] ** 3
    h, f0, f1, f2, s0, s1, s2, s3, s4, s5 = limits.step[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(limits.per_jerk)):
        bend0, w = limits.curvature[i, j], limits.per_jerk[j] * tight
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
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


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_ROUNDED)
def expand_step(i, limits, weight, x0, a0, x1, a1, d):
    """Expand a step's time and barriers to the second order: ``d.gradient``, and the upper half of ``d.hessian``."""
    h = limits.step[i]
    t, v, a, e0, e1, o = join_step(h, x0, a0, x1, a1)
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
        _add_forces(i, limits, k, weight, d)
    _add_ceilings(i, limits, t, weight, d)
    _add_flow(h, t, x0, a0, x1, a1, weight, d)
    _add_jerks(i, limits, 0, 0, weight, d)
    _add_jerks(i, limits, 1, 0, weight, d)
    _add_jerks(i, limits, 1, 1, weight, d)
    _add_jerks(i, limits, 2, 1, weight, d)
