"""Kernels for ceilings of the path speed: the feed ceiling, of the programmed feed, and that of the joints' speeds too.

A ceiling bounds ṡ², the square of the path speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....arrays import Array, Indices
from ....kernels.compiling import njit
from .splines import compute_start_slope

_LITTLE = 1.1  # (q')²·ṡ² may exceed its ends by so much, and they be lowered for that


class CurveRows(NamedTuple):
    """Rows on a curve: their pieces and mm from the piece's start, (rows,), and mm from row to row, (rows - 1,)."""

    segment: Indices
    offset: Array
    step: Array


class FeedLimits(NamedTuple):
    """What a program demands of k pieces: the greatest speed of the tip and of s itself, (k,) mm/s.

    tip_columns : the columns of a pose that are the tip's lengths
    """

    tip_columns: Indices
    tip_speed: Array
    path_speed: Array


class StepCeilings(NamedTuple):
    """The greatest ṡ² at the start and at the end of each step, (steps,); between them it goes straight in s."""

    start: Array
    end: Array


@njit(nogil=True, cache=True, error_model="numpy")
def compute_feed_ceilings(rows, curve, limits, ceiling, start, stop):
    """Compute the greatest ṡ² over each step with which the tip keeps to the feed, into ``ceiling`` (steps,).

    Over a step the tip's slope is a parabola in s, so it stays within its three Bernstein coefficients.

    rows : :class:`CurveRows`; limits : :class:`FeedLimits`
    """
    slope, bend, rise, fall = curve.slope, curve.bend, curve.rise, curve.fall
    for r in range(start, stop):
        k, o, h = rows.segment[r], rows.offset[r], rows.step[r]
        s0, s1, s2 = 0.0, 0.0, 0.0
        a, b = 0.0, 0.0
        a1, b1 = 0.0, 0.0
        if fall[k] > 0.0:
            a, a1 = max(0.0, 1.0 - o / fall[k]), max(0.0, 1.0 - (o + h) / fall[k])
        if rise[k + 1] > 0.0:
            rest = curve.length[k] - o
            b, b1 = max(0.0, 1.0 - rest / rise[k + 1]), max(0.0, 1.0 - (rest - h) / rise[k + 1])
        for c in limits.tip_columns:
            falling, rising = 0.5 * fall[k] * bend[k, c], 0.5 * rise[k + 1] * bend[k + 1, c]
            first = slope[k, c] - a * a * falling + b * b * rising
            last = slope[k, c] - a1 * a1 * falling + b1 * b1 * rising
            middle = first + 0.5 * h * (a * bend[k, c] + b * bend[k + 1, c])
            s0 += first * first
            s1 += middle * middle
            s2 += last * last
        ceiling[r] = limits.path_speed[k] * limits.path_speed[k]
        if limits.tip_speed[k] < np.inf:
            ceiling[r] = min(ceiling[r], limits.tip_speed[k] * limits.tip_speed[k] / max(s0, s1, s2))


@njit(nogil=True, cache=True, error_model="numpy")
def compute_speed_ceilings(rows, speed, highest, ceilings, start, stop):
    """Compute what feed and joint speeds allow for ṡ² at both ends of each step, and straight between them.

    rows : :class:`~.splines.JointRows`; speed : (joints,) the joints' limits
    highest : what ṡ² is bounded by in any case; ceilings : :class:`StepCeilings`, overwritten
    """
    q, bend = rows.joints, rows.curvature
    for i in range(start, stop):
        h = rows.step[i]
        a = b = min(rows.feed_ceiling[i], highest)
        for j in range(len(speed)):
            if h > 0.0 and speed[j] < np.inf:
                m0, m1 = bend[i, j], bend[i + 1, j]
                d0 = compute_start_slope(q, bend, h, i, j)
                d1, d2 = d0 + 0.5 * h * m0, d0 + 0.5 * h * (m0 + m1)
                # With ṡ² at both ends as the speed there allows, (q')²·ṡ² is no more between them than the greatest
                # of its Bernstein coefficients; where that is too much, q' is taken as its greatest everywhere.
                l0, l2 = 1.0 / (d0 * d0), 1.0 / (d2 * d2)
                p1, p2, p3 = d0 * d1, (2.0 * d1 * d1 + d0 * d2) / 3.0, d1 * d2
                c1, c2 = 0.8 * p1 * l0 + 0.2 * d0 * d0 * l2, 0.6 * p2 * l0 + 0.4 * p1 * l2
                c3, c4 = 0.4 * p3 * l0 + 0.6 * p2 * l2, 0.2 * d2 * d2 * l0 + 0.8 * p3 * l2
                over = max(1.0, c1, c2, c3, c4)
                if over < _LITTLE:
                    l0, l2 = l0 / over, l2 / over
                else:
                    l0 = l2 = 1.0 / max(d0 * d0, d1 * d1, d2 * d2)
                a, b = min(a, speed[j] ** 2 * l0), min(b, speed[j] ** 2 * l2)
        ceilings.start[i], ceilings.end[i] = a, b
