"""Kernels that grade the steps of a joint path: beside a short step none is long, and at stops they are shortest.

The size of steps allowed at a place rises from each row by as much as the way from it, so that a step is about twice as
long as its neighbour at most.
"""

from __future__ import annotations

import numpy as np

from ....kernels.compiling import njit

_GROWTH = 2.0  # times a step's length: its neighbour is no longer
_CUT = 1.7  # a rest is cut that is longer than the allowed size by more than this factor


@njit(nogil=True, cache=True, error_model="numpy")
def bound_sizes(step, size):
    """Lower ``size`` (rows,), the allowed steps at the rows, to what neighbouring steps and sizes allow."""
    count = len(step)
    for i in range(count):
        if step[i] > 0.0:
            size[i], size[i + 1] = min(size[i], step[i]), min(size[i + 1], step[i])
    for i in range(count):
        if step[i] > 0.0:
            size[i + 1] = min(size[i + 1], size[i] + (_GROWTH - 1.0) * step[i])
    for i in range(count - 1, -1, -1):
        if step[i] > 0.0:
            size[i] = min(size[i], size[i + 1] + (_GROWTH - 1.0) * step[i])


@njit(nogil=True, cache=True, error_model="numpy")
def cut_steps(step, size, steps, fractions):
    """Cut steps that are too long: fill ``steps`` and ``fractions`` as far as they reach; return the number of cuts.

    Fractions of a step ascend.
    """
    n = 0
    for i in range(len(step)):
        left, right, small, great = 0.0, step[i], size[i], size[i + 1]
        first = n
        while right - left > _CUT * min(small, great):
            if small <= great:
                left, small, cut = left + small, _GROWTH * small, left + small
            else:
                right, great, cut = right - great, _GROWTH * great, right - great
            if n < len(steps):
                steps[n], fractions[n] = i, cut / step[i]
            n += 1
        if n - first > 1 and n <= len(steps):
            fractions[first:n] = np.sort(fractions[first:n])
    return n
