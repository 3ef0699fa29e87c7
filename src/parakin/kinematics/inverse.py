"""The inverse problem in batches."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..kernels.batch import evaluate_tape
from ..model.traces import Model

SINGULAR = 1e-9  # of the greatest determinant that rows of the same sizes can have: what is less is rounding


def solve_inverse(model: Model, poses: Array, mode: str, out: Array | None = None) -> Array:
    """Compute the joints (N, joints) of poses (N, axes), mm and rad, in a working mode; NaN where a leg can't close."""
    out = np.empty((len(poses), len(model.drives))) if out is None else out
    return evaluate_tape(model.inverse_tape(mode), np.ascontiguousarray(poses), out)
