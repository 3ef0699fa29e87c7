"""The Jacobians of the twist: A t' = B q', where t' are the tool's velocity and small turns, not the pose's angles.

The angles of a pose have no rates where they are free (B = 0 of a five-axis machine); small turns have them everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from ..algebra import Mat, Scalar, Term, Trace, Vec, derivative, evaluate_trace, expand_determinant, norm, sqrt
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


@dataclass(frozen=True, eq=False)
class TwistTrace:
    """The closures as a trace whose derivatives are :class:`TwistRates`, each taken when it is asked for.

    pose, joints : scalars of any kind, as are the results
    given : the inputs of the trace on which the description's own numbers are, none where they are plain numbers
    """

    spec: Spec
    structure: Structure
    pose: Sequence[Scalar]
    joints: Sequence[Scalar]
    given: Sequence[Scalar] = ()

    @cached_property
    def a(self) -> list[list[Scalar]]:
        """A of :class:`TwistRates`."""
        x, _, turn = self._inputs
        return self._differentiate([t for t, axis in zip(x, self.structure.axes, strict=True) if axis in "XYZ"] + turn)

    @cached_property
    def b(self) -> list[list[Scalar]]:
        """B of :class:`TwistRates`."""
        return [[-slope for slope in row] for row in self._differentiate(self._inputs[1])]

    @cached_property
    def wrench_norms(self) -> list[Scalar]:
        """Wrench norms of :class:`TwistRates`."""
        positions = self._evaluate([c for point in self._points for c in point])
        start, legs = len(self._at_rest), len(self.spec.legs)
        free = [self._trace.inputs(3, start + 3 * i) for i in range(legs)]  # the platform's joints as variables
        at = [*self._at_rest, *positions]
        return [
            norm(evaluate_trace(self._trace, [derivative(f, c) for c in point], at))
            for group, point in zip(self._close_legs(free), free, strict=True)
            for f in group
        ]

    @cached_property
    def _trace(self) -> Trace:
        return self.given[0].trace if self.given else Trace()

    @cached_property
    def _inputs(self) -> tuple[list[Term], list[Term], list[Term]]:
        """Variables for the pose, the joints and the structure's small turns."""
        n, m, k = len(self.pose), len(self.joints), len(self.given)
        turns = len(self.structure.turns)
        return self._trace.inputs(n, k), self._trace.inputs(m, k + n), self._trace.inputs(turns, k + n + m)

    @cached_property
    def _at_rest(self) -> list[Scalar]:
        return [*self.given, *self.pose, *self.joints, *[0.0] * len(self.structure.turns)]

    @cached_property
    def _placed(self) -> tuple[Mat, Vec, list[Scalar]]:
        x, q, turn = self._inputs
        serial = q[len(q) - sum(step.drive is not None for step in (*self.spec.head, *self.spec.table)) :]
        return self.structure.closure(x, serial, turn)

    @cached_property
    def _points(self) -> list[Vec]:
        rotation, origin, _ = self._placed
        return compute_platform_points(self.spec, rotation, origin)

    @cached_property
    def _rows(self) -> list[Scalar]:
        return [*(f for group in self._close_legs(self._points) for f in group), *self._placed[2]]

    def _close_legs(self, points: Sequence[Vec]) -> list[list[Scalar]]:
        own = group_joints_by_leg(self.spec, self._inputs[1])
        return [leg.closures(p, given) for leg, p, given in zip(self.spec.legs, points, own, strict=True)]

    def _evaluate(self, outputs: Sequence[Scalar]) -> list[Scalar]:
        return evaluate_trace(self._trace, outputs, self._at_rest)

    def _differentiate(self, variables: Sequence[Term]) -> list[list[Scalar]]:
        slopes = self._evaluate([derivative(f, term) for f in self._rows for term in variables])
        width = len(variables)
        return [slopes[i : i + width] for i in range(0, len(slopes), width)]


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
    """Compute A and B at a pose and its joints; arguments as of :class:`TwistTrace`."""
    trace = TwistTrace(spec, structure, pose, joints, given)
    return TwistRates(trace.a, trace.b, trace.wrench_norms)


def trace_determinant(rows: Sequence[Sequence[Scalar]]) -> Scalar:
    """Trace the determinant of a matrix of scalars of any kind; of one with more rows than columns its volume.

    The volume √det(AᵀA) is the root of the sum of all minors' squares (Cauchy-Binet), zero where the rank falls.
    """
    n = len(rows[0])
    if len(rows) == n:
        return expand_determinant(rows)
    minors = [expand_determinant(chosen) for chosen in combinations(rows, n)]
    return sqrt(sum((minor * minor for minor in minors[1:]), minors[0] * minors[0]))
