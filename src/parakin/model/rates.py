"""Rates of the twist: A t' = B q', where t' are the tool's velocity and small turns instead of the pose's angles.

The angles of a pose have no rates where they are free (B = 0 of a five-axis machine); small turns have them everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..algebra import Scalar, Trace, derivative, norm, values
from .limits import platform_points
from .spec import Spec
from .structures import Structure


@dataclass(frozen=True)
class Rates:
    """A and B, a row a closure: the legs' in their order, then those of head and table.

    Columns of A are the tool tip's velocity along the machine's translations, then the structure's small turns;
    those of B are the joints. ``spans`` (mm) are by how much each leg's closure changes as the platform's joint moves
    by a unit length: the length of a rod.
    """

    a: list[list[Scalar]]
    b: list[list[Scalar]]
    spans: list[Scalar]


def drives_of_rows(spec: Spec) -> list[int]:
    """The joint that each leg's closure is of, as an index in the joint vector."""
    index = {drive.name: i for i, drive in enumerate(spec.drives)}
    return [index[drive.name] for leg in spec.legs for drive in leg.drives]


def rates(spec: Spec, structure: Structure, pose: Sequence[Scalar], joints: Sequence[Scalar]) -> Rates:
    """A and B at a pose and its joints, scalars of any kind."""
    trace = Trace()
    n, m, legs = len(pose), len(joints), len(spec.legs)
    x, q = trace.inputs(n), trace.inputs(m, n)
    turn = trace.inputs(len(structure.turns), n + m)
    free = [trace.inputs(3, n + m + len(turn) + 3 * i) for i in range(legs)]  # the platform's joints, on their own
    serial = q[m - sum(step.drive is not None for step in (*spec.head, *spec.table)) :]
    rotation, origin, tilts = structure.closure(x, serial, turn)
    index = {drive.name: i for i, drive in enumerate(spec.drives)}

    def closures(points: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
        own = [[q[index[drive.name]] for drive in leg.drives] for leg in spec.legs]
        return [leg.closures(p, given) for leg, p, given in zip(spec.legs, points, own, strict=True)]

    points = platform_points(spec, rotation, origin)
    rows = [*(f for group in closures(points) for f in group), *tilts]
    by = [term for term, axis in zip(x, structure.axes, strict=True) if axis in "XYZ"] + turn
    at_rest = [*pose, *joints, *[0.0] * len(turn)]
    a = values(trace, [derivative(f, term) for f in rows for term in by], at_rest)
    b = values(trace, [-derivative(f, term) for f in rows for term in q], at_rest)
    places = values(trace, [c for point in points for c in point], at_rest)
    spans = [
        norm(values(trace, [derivative(f, c) for c in point], [*at_rest, *places]))
        for group, point in zip(closures(free), free, strict=True)
        for f in group
    ]
    return Rates([a[i : i + n] for i in range(0, n * n, n)], [b[i : i + m] for i in range(0, n * m, m)], spans)
