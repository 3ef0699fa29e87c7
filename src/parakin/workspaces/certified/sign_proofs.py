"""Proofs of a margin's sign over whole boxes, by forms that intervals bound far closer than the margin itself.

Each takes boxes [low, high] (N, d) of positions and orientations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ...algebra import Scalar, Term
from ...arrays import Array
from .matrix_bounds import MatrixBounds, prove_regular


class FormPlanes(NamedTuple):
    """Linear bounds of a form over N boxes: slopes·v + low ≤ form ≤ slopes·v + high, for the inputs v in [-1, 1]^d.

    slopes : (N, d)
    low, high : (N,), NaN where there are none
    """

    slopes: Array
    low: Array
    high: Array


class ProvedSigns(NamedTuple):
    """What is proved of a margin over N boxes.

    sign : (N,) 1 where it is kept all over the box, -1 where it is broken all over it, 0 where neither is proved
    spread : (N, d) how far each input spreads the form's bounds
    planes : bounds of a form that has the margin's sign, if there is one
    """

    sign: Array
    spread: Array
    planes: FormPlanes | None = None


SignProof: TypeAlias = Callable[[Array, Array], ProvedSigns]

ROUNDING = 1e-12  # relative, of sums of a few products


def make_margin_proof(margin: Scalar, inputs: Sequence[Term]) -> SignProof:
    """Make the proof by another margin of the same sign."""
    bounds = MatrixBounds([[margin]], inputs, inputs[0].trace)

    def prove(low: Array, high: Array) -> ProvedSigns:
        form = bounds(low, high)
        change = form.linear_change[:, 0, 0]
        rest = form.rest[:, 0, 0] + ROUNDING * (change + form.rest[:, 0, 0])
        middle = form.middle[:, 0, 0]
        planes = FormPlanes(form.half * form.slopes[:, :, 0, 0], middle - rest, middle + rest)
        with np.errstate(invalid="ignore"):
            kept, broken = planes.low - change >= 0.0, planes.high + change < 0.0
        return ProvedSigns(
            np.where(kept, 1.0, np.where(broken, -1.0, 0.0)),
            form.half * (np.abs(form.slopes) + form.spread)[:, :, 0, 0],
            planes,
        )

    return prove


def make_opposite_proof(prove: SignProof) -> SignProof:
    """Make the proof for the margin of the opposite sign."""

    def prove_opposite(low: Array, high: Array) -> ProvedSigns:
        proved = prove(low, high)
        planes = proved.planes
        if planes is not None:
            planes = FormPlanes(-planes.slopes, -planes.high, -planes.low)
        return ProvedSigns(-proved.sign, proved.spread, planes)

    return prove_opposite


def make_side_proof(rows: Sequence[Sequence[Scalar]], side: float, inputs: Sequence[Term]) -> SignProof:
    """Make the proof that a determinant has the sign of ``side`` all over a box, by the matrices' regularity."""
    bounds = MatrixBounds(rows, inputs, inputs[0].trace)

    def prove(low: Array, high: Array) -> ProvedSigns:
        regular = prove_regular(bounds(low, high))
        return ProvedSigns(regular.sign * side, regular.spread)

    return prove
