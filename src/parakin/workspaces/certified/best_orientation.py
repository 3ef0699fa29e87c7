"""Margins at places, and of many turns the one that stays farthest from the limits there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from ...arrays import Array
from .constraints import Constraint
from .region import Region

TRIED = (17, 9, 5)  # turns along each range, for one, two and three ranges
_ZOOMS = 5  # about the best of them, each time at half the distance
_ABOUT = (-0.5, -0.25, 0.0, 0.25, 0.5)


def margins_at(region: Region, places: Array, turns: Array, more: Sequence[Constraint] = ()) -> Array:
    """Margins at places (N, d) with turns (N, s): of ``region.limits``, then of ``more``."""
    columns = [region.machine.limits.index(name) for name in region.limits]
    own = region.machine.margins(region.poses(places, turns), mode=region.mode)[:, columns]
    rows = np.concatenate([places, turns], 1)
    others = [0.5 * sum(end[:, 0] for end in constraint.at(rows, rows)) for constraint in more]
    return np.column_stack([own, *others])


def best_turns(region: Region, places: Array, more: Sequence[Constraint] = ()) -> tuple[Array, Array]:
    """Of the turns tried at each place (N, d), the one (N, s) whose least margin is greatest, and the margins there.

    Margins count as shares of the greatest of their kind.
    """
    low, high = (np.array([span[i] for span in region.swept_axes.values()], float) for i in (0, 1))
    s = len(low)
    along = TRIED[s - 1]
    tries = [(np.array(list(product(np.linspace(-0.5, 0.5, along), repeat=s))), 1.0)]
    tries += [(np.array(list(product(_ABOUT, repeat=s))), 2.0 / (along - 1) * 0.5**zoom) for zoom in range(_ZOOMS)]
    best = np.tile(0.5 * (low + high), (len(places), 1))
    scale: Array | None = None
    each = np.arange(len(places))
    for offsets, width in tries:
        turns = np.clip(best[:, None] + offsets * (width * (high - low)), low, high)
        rows = np.repeat(places, len(offsets), 0)
        margins = margins_at(region, rows, turns.reshape(-1, s), more).reshape(len(places), len(offsets), -1)
        if scale is None:
            size = np.abs(np.where(np.isfinite(margins), margins, 0.0)).max((0, 1), initial=0.0)
            scale = np.where(size > 0.0, size, 1.0)
        pick = np.where(np.isnan(margins), -np.inf, margins / scale).min(2).argmax(1)
        best, found = turns[each, pick], margins[each, pick]
    return best, found
