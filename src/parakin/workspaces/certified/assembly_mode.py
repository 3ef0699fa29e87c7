"""The sign of det A as a constraint: on which side of the parallel singularities a position is, its assembly mode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...algebra import Scalar, expand_determinant
from .constraints import Constraint, TracedPose, trace_twist_rows
from .sign_proofs import SignProof, make_side_proof

PARALLEL_SINGULARITY = "parallel singularity"
ZERO = 1e-12  # determinants up to this fraction of the product of the rows' sizes at home have no sign


def make_side_constraints(traced: TracedPose) -> tuple[Constraint, Constraint]:
    """Make the constraints det A > 0 and det A < 0, without unit, the first where the sign is that of home.

    A is of the tool's twist, so that free angles of the pose do not count. Of five axes it is the legs' rows against
    the translations, for head and table have no parallel singularity.
    """
    d, scale = len(traced.free_axes), _scale_at_home(traced)
    margin = expand_determinant(_trace_leg_rows(traced, traced.inputs)) / scale
    x, orientation = traced.inputs[:d], traced.inputs[d:]
    sides: tuple[SignProof | None, SignProof | None] = None, None
    height, width = traced.machine.parallel_block
    if height == width:
        inputs = traced.jump_free_inputs
        rows, side = _trace_leg_rows(traced, inputs), 1.0 if scale > 0.0 else -1.0
        sides = make_side_proof(rows, side, inputs), make_side_proof(rows, -side, inputs)
    own, other = (
        Constraint(PARALLEL_SINGULARITY, sign * margin - ZERO, x, orientation, sign=proof, sign_first=True)
        for sign, proof in zip((1.0, -1.0), sides, strict=True)
    )
    return own, other


def _trace_leg_rows(traced: TracedPose, inputs: Sequence[Scalar]) -> list[list[Scalar]]:
    """Trace the block of A that can become singular."""
    with np.errstate(all="ignore"):  # a pose out of reach gives NaN
        rows = traced.trace_twist_rows(inputs)
    height, width = traced.machine.parallel_block
    return [row[:width] for row in rows[:height]]


def _scale_at_home(traced: TracedPose) -> float:
    """Compute Hadamard's bound of det A at home, with its sign there; 1 where another working mode can't reach home."""
    machine = traced.machine
    home = [np.float64(value) for value in machine.home]
    with np.errstate(all="ignore"):
        whole = trace_twist_rows(machine, home, traced.mode)
    height, width = machine.parallel_block
    rows = np.array(whole, float)[:height, :width]
    most = float(np.prod(np.sqrt((rows**2).sum(1))))
    if not (np.isfinite(most) and most > 0.0):
        return 1.0
    return -most if np.linalg.det(rows) < 0.0 else most
