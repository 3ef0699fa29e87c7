"""The best orientation at a position: of those sampled, the one that stays farthest from the limits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from ...arrays import Array
from .constraints import Constraint
from .region import Region

_SAMPLES = (17, 9, 5)  # along each range, for one, two and three swept axes
_ZOOMS = 5  # rounds about the best sample, each at half the distance
_AROUND = (-0.5, -0.25, 0.0, 0.25, 0.5)  # of that distance


def evaluate_margins(region: Region, positions: Array, orientations: Array, more: Sequence[Constraint] = ()) -> Array:
    """Evaluate margins at positions (N, d) with orientations (N, s): of ``region.limits``, then of ``more``."""
    names = region.machine.limits
    columns = [names.index(name) for name in region.limits if name in names]
    sides = [constraint for constraint in region.constraints if not constraint.implied and constraint.name not in names]
    own = region.machine.margins(region.poses(positions, orientations), mode=region.mode)[:, columns]
    rows = np.concatenate([positions, orientations], 1)
    others = [0.5 * sum(end[:, 0] for end in constraint.point_program(rows, rows)) for constraint in (*sides, *more)]
    return np.column_stack([own, *others])


def find_best_orientations(region: Region, positions: Array, more: Sequence[Constraint] = ()) -> tuple[Array, Array]:
    """Find the orientation of the greatest least margin at each position (N, d), by sampling ever closer to the best.

    Each margin is divided by its greatest size. Returns the orientations (N, s) and the margins there.
    """
    low, high = region.swept_bounds
    s = len(low)
    along = _SAMPLES[s - 1]
    rounds = [(np.array(list(product(np.linspace(-0.5, 0.5, along), repeat=s))), 1.0)]
    rounds += [(np.array(list(product(_AROUND, repeat=s))), 2.0 / (along - 1) * 0.5**zoom) for zoom in range(_ZOOMS)]
    best = np.tile(0.5 * (low + high), (len(positions), 1))
    scale: Array | None = None
    each = np.arange(len(positions))
    for offsets, width in rounds:
        samples = np.clip(best[:, None] + offsets * (width * (high - low)), low, high)
        rows = np.repeat(positions, len(offsets), 0)
        margins = evaluate_margins(region, rows, samples.reshape(-1, s), more)
        margins = margins.reshape(len(positions), len(offsets), -1)
        if scale is None:
            size = np.abs(np.where(np.isfinite(margins), margins, 0.0)).max((0, 1), initial=0.0)
            scale = np.where(size > 0.0, size, 1.0)
        pick = np.where(np.isnan(margins), -np.inf, margins / scale).min(2).argmax(1)
        best, best_margins = samples[each, pick], margins[each, pick]
    return best, best_margins
