"""The Jacobians of the twist: A t' = B q', where t' are the tool's velocity and small turns, not the pose's angles.

The angles of a pose have no rates where they are free (B = 0 of a five-axis machine); small turns have them everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from ..algebra import Scalar, Trace, derivative, evaluate_trace, expand_determinant, norm, sqrt
from .limits import compute_platform_points, group_joints_by_leg
from .spec import Spec
from .structures import Structure


@dataclass(frozen=True)
class TwistRates:
    """A and B, a row for each closure: the legs' in their order, then those of head and table.

    a : (m, n) columns are the tool tip's velocity along the machine's translations, then the structure's small turns
    b : (m, m) columns are the joints
    wrench_norms : mm, how much each leg's closure changes as the platform's joint moves by a unit length: a rod's
        length; a leg's row of A divided by it is a unit wrench
    """

    a: list[list[Scalar]]
    b: list[list[Scalar]]
    wrench_norms: list[Scalar]


def list_closure_joints(spec: Spec) -> list[int]:
    """List the joint of each leg's closure, as an index in the joint vector."""
    index = {drive.name: i for i, drive in enumerate(spec.drives)}
    return [index[drive.name] for leg in spec.legs for drive in leg.drives]


def compute_twist_rates(
    spec: Spec,
    structure: Structure,
    pose: Sequence[Scalar],
    joints: Sequence[Scalar],
    given: Sequence[Scalar] = (),
) -> TwistRates:
    """Compute A and B at a pose and its joints, scalars of any kind.

    given : the inputs of the trace on which the description's own numbers are, none where they are plain numbers
    """
    trace = given[0].trace if given else Trace()
    n, m, legs, k = len(pose), len(joints), len(spec.legs), len(given)
    x, q = trace.inputs(n, k), trace.inputs(m, k + n)
    turn = trace.inputs(len(structure.turns), k + n + m)
    free = [trace.inputs(3, k + n + m + len(turn) + 3 * i) for i in range(legs)]  # the platform's joints as variables
    serial = q[m - sum(step.drive is not None for step in (*spec.head, *spec.table)) :]
    rotation, origin, tilts = structure.closure(x, serial, turn)

    def closures(points: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
        own = group_joints_by_leg(spec, q)
        return [leg.closures(p, given) for leg, p, given in zip(spec.legs, points, own, strict=True)]

    points = compute_platform_points(spec, rotation, origin)
    rows = [*(f for group in closures(points) for f in group), *tilts]
    twist = [term for term, axis in zip(x, structure.axes, strict=True) if axis in "XYZ"] + turn
    at_rest = [*given, *pose, *joints, *[0.0] * len(turn)]
    a = evaluate_trace(trace, [derivative(f, term) for f in rows for term in twist], at_rest)
    b = evaluate_trace(trace, [-derivative(f, term) for f in rows for term in q], at_rest)
    positions = evaluate_trace(trace, [c for point in points for c in point], at_rest)
    wrench_norms = [
        norm(evaluate_trace(trace, [derivative(f, c) for c in point], [*at_rest, *positions]))
        for group, point in zip(closures(free), free, strict=True)
        for f in group
    ]
    a_rows, b_rows = [a[i : i + n] for i in range(0, m * n, n)], [b[i : i + m] for i in range(0, m * m, m)]
    return TwistRates(a_rows, b_rows, wrench_norms)


def trace_determinant(rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """Trace the determinant of a matrix of scalars of any kind; of one with more rows than columns its volume.

    The volume √det(AᵀA) is the root of the sum of all minors' squares (Cauchy-Binet), zero where the rank falls.
    """
    n = len(rows[0])
    if len(rows) == n:
        return expand_determinant(rows)
    minors = [expand_determinant(chosen) for chosen in combinations(rows, n)]
    return sqrt(sum((minor * minor for minor in minors[1:]), minors[0] * minors[0]))
