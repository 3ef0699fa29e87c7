"""All roots of the closures in a box of the motion's coordinates, by bisection with Krawczyk's test on intervals.

Every part of the box is either shown to hold no root, shown to hold exactly one, or cut until it is too small to
matter; so no assembly mode is missed.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Flags
from ..errors import NoMethodError
from ..kernels.intervals import IntervalProgram

SMALL = 1e-7  # a box still undecided at this fraction of the first box's width holds a (nearly) double root
MOST = 400_000  # boxes at a time


def isolate_roots(program: IntervalProgram, low: Array, high: Array) -> Array:
    """Isolate all roots of the program's first n outputs in the box [low, high]; return a point (k, n) near each.

    The program gives n functions of n inputs, then their n·n derivatives. Raises :class:`NoMethodError` where the
    search would not end (a continuum of roots).
    """
    n = len(low)
    width = high - low
    lows, highs = low[None, :].copy(), high[None, :].copy()
    points: list[Array] = []
    while len(lows):
        if len(lows) > MOST:
            raise NoMethodError("the assemblies can't be told apart here: the legs leave the platform free to move")
        f_low, f_high = program(lows, highs)
        alive = ~((f_low[:, :n] > 0.0) | (f_high[:, :n] < 0.0)).any(1)
        lows, highs = lows[alive], highs[alive]
        j_low, j_high = (b[alive][:, n:].reshape(-1, n, n) for b in (f_low, f_high))
        middle = 0.5 * (lows + highs)
        m_low, m_high = program(middle, middle)
        lows, highs, single = _apply_krawczyk(lows, highs, middle, m_low[:, :n], m_high[:, :n], j_low, j_high)
        points.append(0.5 * (lows + highs)[single])
        empty = (lows > highs).any(1)
        rest = ~single & ~empty
        lows, highs = lows[rest], highs[rest]
        relative = (highs - lows) / width
        tiny = relative.max(1, initial=0.0) < SMALL
        points.append(0.5 * (lows + highs)[tiny])
        lows, highs, relative = lows[~tiny], highs[~tiny], relative[~tiny]
        axis = relative.argmax(1) if len(lows) else np.zeros(0, np.int64)
        row = np.arange(len(lows))
        cut = 0.5 * (lows[row, axis] + highs[row, axis])
        left, right = highs.copy(), lows.copy()
        left[row, axis], right[row, axis] = cut, cut
        lows, highs = np.concatenate([lows, right]), np.concatenate([left, highs])
    return np.concatenate(points) if points else np.empty((0, n))


def _apply_krawczyk(
    low: Array, high: Array, middle: Array, f_low: Array, f_high: Array, j_low: Array, j_high: Array
) -> tuple[Array, Array, Flags]:
    """Shrink boxes by Krawczyk's operator c - Y·f(c) + (1 - Y·F'(X))·(X - c); tell where it proves one root."""
    n = low.shape[1]
    centre = 0.5 * (j_low + j_high)
    finite: Flags = np.asarray(np.isfinite(centre).all((1, 2)))
    regular = finite & (np.linalg.det(np.where(finite[:, None, None], centre, 0.0)) != 0.0)
    y = np.zeros_like(centre)
    y[regular] = np.linalg.inv(centre[regular])
    radius = 0.5 * (j_high - j_low)
    half = 0.5 * (high - low)
    # |Y|·radius bounds 1 - Y·F'(X); its middle is zero up to rounding, which the factor covers.
    spread = np.einsum("bij,bjk->bik", np.abs(y), radius) * (1.0 + 1e-9) + 1e-12
    f_middle, f_radius = 0.5 * (f_low + f_high), 0.5 * (f_high - f_low)
    shift = np.einsum("bij,bj->bi", y, f_middle)
    reach = np.einsum("bij,bj->bi", spread, half) + np.einsum("bij,bj->bi", np.abs(y), f_radius) * (1.0 + 1e-9)
    reach += 1e-12 * np.abs(shift)
    k_low, k_high = middle - shift - reach, middle - shift + reach
    usable = regular & np.isfinite(reach).all(1)
    single = usable & ((k_low > low) & (k_high < high)).all(1)
    new_low = np.where(usable[:, None], np.maximum(low, k_low), low)
    new_high = np.where(usable[:, None], np.minimum(high, k_high), high)
    return new_low, new_high, single & (n > 0)
