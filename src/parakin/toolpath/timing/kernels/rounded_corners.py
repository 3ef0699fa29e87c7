"""Kernels for a path of straight pieces with rounded corners: where its rows lie, and the poses there.

Before a corner the pose's second derivative rises linearly over ``rise``, up to ``bend`` at the corner, and behind it
falls again over ``fall``. Behind a corner that adds bend·fall²/6·(1 - d/fall)³ to the straight line of the piece at the
distance d from the corner, and before it the same with ``rise``. The roundings of neighbours may overlap up to each
other's corners; there they add up.

A row lies on a piece (``segment``) at a distance from the piece's start (``offset``). ``curve`` is a
:class:`~parakin.toolpath.timing.corners.Curve`.
"""

from __future__ import annotations

import numpy as np

from ....kernels.compiling import njit

SLIVER = 2e-3  # fraction of a piece: roundings that end nearer to each other, or to the piece's far end, end together


@njit(nogil=True, cache=True)
def _find_knots(curve, piece, knots):
    """Write the knots of a piece, where its roundings end, to ``knots`` (4,); returns how many there are."""
    whole, fall, rise = curve.length[piece], curve.fall[piece], curve.rise[piece + 1]
    near = SLIVER * whole
    a = fall if fall < whole - near else 0.0
    b = whole - rise if rise < whole - near else whole
    a, b = min(a, b), max(a, b)
    knots[0] = 0.0
    count = 1
    if a > 0.0:
        knots[count] = a
        count += 1
    if a + near < b < whole:
        knots[count] = b
        count += 1
    knots[count] = whole
    return count + 1


@njit(nogil=True, cache=True)
def place_rows(curve, corner_steps, each, longest, segment, offset):
    """Place the rows of a path: fill ``segment`` and ``offset``, as far as they reach; returns how many rows there are.

    corner_steps : (corners,) the least number of steps between two knots where a corner is rounded
    each : the least number of steps between any two knots; longest : no step is longer
    """
    knots = np.empty(4)
    row = 0
    for piece in range(len(curve.length)):
        count = _find_knots(curve, piece, knots)
        for i in range(count - 1):
            span = knots[i + 1] - knots[i]
            steps = max(each, int(np.ceil(span / longest)))
            if knots[i] + 0.5 * span < curve.fall[piece]:
                steps = max(steps, corner_steps[piece])
            if knots[i + 1] - 0.5 * span > curve.length[piece] - curve.rise[piece + 1]:
                steps = max(steps, corner_steps[piece + 1])
            for step in range(steps):
                if row < len(segment):
                    segment[row], offset[row] = piece, knots[i] + span * step / steps
                row += 1
        if curve.parted[piece + 1] or piece == len(curve.length) - 1:
            if row < len(segment):
                segment[row], offset[row] = piece, curve.length[piece]
            row += 1
    return row


@njit(nogil=True, cache=True)
def blend_poses(curve, segment, offset, poses, start, stop):
    """Compute the poses of rows into ``poses`` (rows, axes): the straight piece and the roundings at its ends."""
    begin, slope, bend, rise, fall = curve.begin, curve.slope, curve.bend, curve.rise, curve.fall
    for row in range(start, stop):
        k, o = segment[row], offset[row]
        rest = curve.length[k] - o
        a = max(0.0, 1.0 - o / fall[k]) if fall[k] > 0.0 else 0.0
        b = max(0.0, 1.0 - rest / rise[k + 1]) if rise[k + 1] > 0.0 else 0.0
        a, b = fall[k] * fall[k] * a * a * a / 6.0, rise[k + 1] * rise[k + 1] * b * b * b / 6.0
        for c in range(poses.shape[1]):
            poses[row, c] = begin[k, c] + slope[k, c] * o + bend[k, c] * a + bend[k + 1, c] * b
