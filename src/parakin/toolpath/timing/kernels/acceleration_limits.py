"""Kernels for the joints' acceleration limits: they bound the path's acceleration over each step, by lines.

The joints are cubic splines of the path's parameter s: over a step h their second derivative is linear and the first a
parabola. With s̈ = u constant over a step, x = ṡ² is linear too, and a joint's acceleration q'·u + q''·x is a parabola.
Its three Bernstein coefficients are linear in u and the step's first x, and the parabola lies between the least and the
greatest of them. So a trajectory that keeps these within the limit keeps it everywhere, between the rows as well. So
it is with the drives' forces, whose coefficients are linear over a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....kernels.compiling import njit
from .splines import compute_start_slope


class AccelerationLimits(NamedTuple):
    """Bounds of acceleration, infinite for none: of the joints, (joints,), and of u = s̈ itself, ``path`` (steps,)."""

    joints: Array
    path: Array


class AccelerationLines(NamedTuple):
    """Bounds of u over one step, from -``lower`` to ``upper``, less ``tilt``·x; ``coefficients`` (6,) is scratch."""

    coefficients: Array
    upper: Array
    lower: Array
    tilt: Array


@njit(nogil=True, cache=True)
def allocate_lines(rows, limits):
    """Allocate the lines of one step: three for each joint and each force, and one for the path's own bound."""
    most = 3 * (len(limits.joints) + len(rows.forces.drive)) + 1
    return AccelerationLines(np.empty(6), np.empty(most), np.empty(most), np.empty(most))


@njit(nogil=True, cache=True, error_model="numpy")
def _expand_acceleration(i, j, rows, coefficients):
    """Write the Bernstein coefficients of joint j's acceleration α·u + β·x over step i: three pairs of α and β."""
    h, q, bend = rows.step[i], rows.joints, rows.curvature
    m0, m1 = bend[i, j], bend[i + 1, j]
    d = compute_start_slope(q, bend, h, i, j)
    coefficients[0], coefficients[1] = d, m0
    coefficients[2], coefficients[3] = d + 1.5 * h * m0, 0.5 * (m0 + m1)
    coefficients[4], coefficients[5] = d + h * (0.5 * m0 + 2.5 * m1), m1


@njit(nogil=True, cache=True, error_model="numpy")
def _expand_force(i, c, rows, coefficients):
    """Write the Bernstein coefficients of force bound c's α·u + β·x over step i: three pairs of α and β."""
    h, along, across = rows.step[i], rows.forces.along, rows.forces.across
    a0, a1, b0, b1 = along[i, c], along[i + 1, c], across[i, c], across[i + 1, c]
    coefficients[0], coefficients[1] = a0, b0
    coefficients[2], coefficients[3] = 0.5 * (a0 + a1) + h * b0, 0.5 * (b0 + b1)
    coefficients[4], coefficients[5] = a1 + 2.0 * h * b1, b1


@njit(nogil=True, cache=True, error_model="numpy")
def bound_acceleration(i, rows, limits, lines):
    """Write the bounds of u over step i to ``lines``; returns how many there are, and a bound of x alone."""
    count, highest = 0, np.inf
    if limits.path[i] < np.inf:
        lines.upper[0] = lines.lower[0] = limits.path[i]
        lines.tilt[0] = 0.0
        count = 1
    for j in range(len(limits.joints)):
        if limits.joints[j] < np.inf:
            w = 1.0 / limits.joints[j]
            _expand_acceleration(i, j, rows, lines.coefficients)
            for k in range(0, 6, 2):
                a, b = lines.coefficients[k] * w, lines.coefficients[k + 1] * w
                if a != 0.0:
                    lines.upper[count] = lines.lower[count] = 1.0 / abs(a)
                    lines.tilt[count] = b / a
                    count += 1
                elif b != 0.0:
                    highest = min(highest, 1.0 / abs(b))
    for c in range(len(rows.forces.drive)):
        _expand_force(i, c, rows, lines.coefficients)
        for k in range(0, 6, 2):
            a, b = lines.coefficients[k], lines.coefficients[k + 1]
            if a != 0.0:
                lines.upper[count] = 1.0 / a if a > 0.0 else np.inf
                lines.lower[count] = -1.0 / a if a < 0.0 else np.inf
                lines.tilt[count] = b / a
                count += 1
            elif b > 0.0:
                highest = min(highest, 1.0 / b)
    return count, highest
