"""det A as a margin over a region: on which side of the parallel singularities a place is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...algebra import Scalar
from ...model.rates import compute_twist_rates
from ..certified.constraints import Constraint
from ..certified.region import Region

NAME = "parallel singularity"
NOUGHT = 1e-12  # of the product of the rows' sizes at home: a determinant no greater has no sign


def sides(region: Region) -> tuple[Constraint, Constraint]:
    """det A > 0 and det A < 0, the first where its sign is as at home, and as margins of no unit.

    A is of the tool's twist, so that free angles of the pose do not count; of five axes it is the legs' rows against
    the translations, for head and table never matter here.
    """
    asked = region.slice
    d = len(region.free_axes)
    margin = determinant(_block(region, asked.pose)) / _size(region)
    x, turns = asked.inputs[:d], asked.inputs[d:]
    return Constraint(NAME, margin - NOUGHT, x, turns), Constraint(NAME, -margin - NOUGHT, x, turns)


def _block(region: Region, pose: Sequence[Scalar]) -> list[list[Scalar]]:
    model = region.machine.model
    with np.errstate(all="ignore"):  # what a pose out of reach makes of numbers is NaN
        found = compute_twist_rates(model.spec, model.structure, pose, model.invert(pose, region.mode)[0])
    legs = len(found.spans)
    size = legs if len(found.a) - legs == 2 else len(found.a)
    return [row[:size] for row in found.a[:size]]


def _size(region: Region) -> float:
    """What det A is at most at home (Hadamard), with its sign; of another working mode that is not there, of none."""
    rows = np.array(_block(region, [np.float64(value) for value in region.machine.home]), float)
    most = float(np.prod(np.sqrt((rows**2).sum(1))))
    if not (np.isfinite(most) and most > 0.0):
        return 1.0
    return -most if np.linalg.det(rows) < 0.0 else most


def determinant(rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """Of scalars of any kind, without a quotient: by all minors of the first rows."""
    minors: dict[tuple[int, ...], Scalar] = {(): 1.0}
    for row in rows:
        longer: dict[tuple[int, ...], Scalar] = {}
        for columns, minor in minors.items():
            for j, entry in enumerate(row):
                if j not in columns:
                    wider = tuple(sorted((*columns, j)))
                    sign = -1.0 if (len(columns) - wider.index(j)) % 2 else 1.0
                    longer[wider] = minor * entry * sign + longer.get(wider, 0.0)
        minors = longer
    return minors[tuple(range(len(rows)))]
