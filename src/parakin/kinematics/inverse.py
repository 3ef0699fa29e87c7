"""The inverse problem in batches, and how far home is from singularities."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..kernels.batch import evaluate_tape
from ..model.elements import MOTION_UNITS
from ..model.traces import Model

SINGULAR = 1e-9  # of the greatest determinant that rows of the same sizes can have: what is less is rounding


def solve_inverse(model: Model, poses: Array, mode: str, out: Array | None = None) -> Array:
    """Compute the joints (N, joints) of poses (N, axes), mm and rad, in a working mode; NaN where a leg can't close."""
    out = np.empty((len(poses), len(model.drives))) if out is None else out
    return evaluate_tape(model.inverse_tape(mode), np.ascontiguousarray(poses), out)


def measure_regularity(model: Model, poses: Array) -> dict[str, Array]:
    """Measure how far poses (n, axes) are from singularities, (n,): |determinant| over its rows' sizes, from 0 to 1.

    ``parallel`` is of the legs against the motion's coordinates, a turn counted as the greatest leg's length at home;
    ``serial`` of the legs against their drives. NaN out of reach.
    """
    joints, legs, n = solve_inverse(model, poses, model.mode), model.leg_count, len(model.axes)
    count = len(model.structure.coordinates)
    coordinates = evaluate_tape(model.begin_tape(), poses, np.empty((len(poses), count)), joints)
    tape, jacobians = model.newton_tape(True), model.jacobian_tape()
    slopes = evaluate_tape(tape, coordinates, np.empty((len(poses), tape.outputs)), joints)
    a = slopes[:, legs:].reshape(-1, legs, count)
    a = a / np.where([MOTION_UNITS[word] == "rad" for word in model.structure.coordinates], max(model.sizes), 1.0)
    both = evaluate_tape(jacobians, poses, np.empty((len(poses), jacobians.outputs)), joints)
    b = both[:, n * n :].reshape(len(poses), n, -1)[:, :legs, :legs]
    return {"parallel": _compare_determinant(a), "serial": _compare_determinant(b)}


def _compare_determinant(matrices: Array) -> Array:
    """Divide the sizes of determinants by the products of their rows' sizes (Hadamard)."""
    with np.errstate(all="ignore"):
        ratio: Array = np.abs(np.linalg.det(matrices / np.linalg.norm(matrices, axis=2)[:, :, None]))
    return ratio
