"""Constraints: what must be ≥ 0 for a pose to be allowed, as functions of position x and of the swept orientation θ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite

import numpy as np

from ... import algebra as alg
from ...algebra import Scalar, Term, Trace, absolute, derivative, find_dependencies, maximum, minimum, norm, sub
from ...arrays import Array
from ...kernels.intervals import IntervalProgram, JumpFreeTrace
from ...machine import Machine
from ...model.equations import Equations
from .sign_proofs import SignProof, make_margin_proof, make_opposite_proof
from .strut_separation import make_separation_proof

_ROUNDING = 1e-12  # relative, of bounds that limits imply


@dataclass(frozen=True, eq=False)
class Constraint:
    """One margin, ≥ 0 where it is kept, of a position x and an orientation θ.

    Two programs bound it over boxes of x, then θ, by Taylor's formula about the middle. ``point_program`` gives the
    margin and, of a smooth one, its gradient by x. ``box_program`` gives the margin, the guard, the gradient by θ and
    the second derivatives by x (d(d + 1)/2 of them), or of one with corners the gradient by x instead.

    name : the limit's
    margin : as a term of the inputs
    position, orientation : the inputs: d coordinates of x, mm, and those of θ, rad
    implied : it follows from others, and serves only to prove that they can't hold
    sign : proves the margin's sign over boxes of x, then θ, where the programs don't tell it
    sign_first : it is asked of large cells only, and before the programs, which then need not be made
    """

    name: str
    margin: Scalar
    position: Sequence[Term]
    orientation: Sequence[Term] = ()
    implied: bool = False
    sign: SignProof | None = None
    sign_first: bool = False

    def negate(self) -> Constraint:
        """Make the constraint that is kept where this one is broken."""
        sign = None if self.sign is None else make_opposite_proof(self.sign)
        return replace(self, margin=0.0 - self.margin, sign=sign)

    @cached_property
    def _trace(self) -> Trace:
        return self.position[0].trace

    @cached_property
    def _nodes(self) -> list[Term]:
        margin = self.margin
        return [self._trace.nodes[i] for i in find_dependencies([margin])] if isinstance(margin, Term) else []

    @cached_property
    def is_smooth(self) -> bool:
        """Whether the margin has no corners, so that Taylor's formula holds to the second order.

        A term with a stopped gradient has only a first order, for it moves all the same.
        """
        corners = (alg.MIN, alg.MAX, alg.ABS, alg.COPYSIGN, alg.SELECT, alg.STOP_GRADIENT)
        return not any(node.op in corners for node in self._nodes)

    @cached_property
    def guard(self) -> Scalar:
        """A term > 0 where no angle jumps by a turn, so that derivatives bound how the margin changes."""
        guard: Scalar = 1.0
        for node in self._nodes:
            if node.op == alg.ATAN2:
                y, x = node.args
                guard = minimum(guard, maximum(x, absolute(y)))
        return guard

    @cached_property
    def point_program(self) -> IntervalProgram:
        """Program of the margin and, of a smooth one, its gradient by x."""
        gradient = [derivative(self.margin, x) for x in self.position] if self.is_smooth else []
        return IntervalProgram(self._trace, [self.margin, *gradient])

    @cached_property
    def box_program(self) -> IntervalProgram:
        """Program of the margin, the guard and the derivatives that bound it over a box."""
        by_position = [derivative(self.margin, x) for x in self.position]
        if self.is_smooth:
            by_position = [derivative(g, y) for i, g in enumerate(by_position) for y in self.position[i:]]
        by_orientation = [derivative(self.margin, x) for x in self.orientation]
        return IntervalProgram(self._trace, [self.margin, self.guard, *by_orientation, *by_position])


@dataclass(frozen=True, eq=False)
class TracedPose:
    """A machine's pose as terms: free and swept axes are inputs of a trace, fixed axes are numbers.

    machine, mode : whose poses these are, and in which working mode
    free_axes, swept_axes : the inputs, in this order
    fixed_axes : the values of the others, mm and rad

    inputs : as its methods take them: a scalar for each free axis, then for each swept one
    """

    machine: Machine
    free_axes: tuple[str, ...]
    swept_axes: tuple[str, ...]
    fixed_axes: Mapping[str, float]
    mode: str

    @cached_property
    def inputs(self) -> list[Term]:
        """A term for each free axis, then for each swept one."""
        return Trace().inputs(len(self.free_axes) + len(self.swept_axes))

    @cached_property
    def pose(self) -> list[Scalar]:
        """The whole pose; the trace folds away what depends on fixed axes alone."""
        return self.place(self.inputs)

    def place(self, inputs: Sequence[Scalar]) -> list[Scalar]:
        """Compute the whole pose from a scalar for each free axis, then for each swept one."""
        varied = dict(zip((*self.free_axes, *self.swept_axes), inputs, strict=True))
        return [varied[axis] if axis in varied else np.float64(self.fixed_axes[axis]) for axis in self.machine.axes]

    @cached_property
    def jump_free_inputs(self) -> list[Term]:
        """Inputs as :attr:`inputs`, of a trace whose angles don't jump over intervals."""
        return JumpFreeTrace().inputs(len(self.inputs))

    def trace_equations(self, inputs: Sequence[Scalar]) -> Equations:
        """Trace the machine's equations, whose numbers are the same at all poses."""
        return self.machine.trace_equations({})

    def trace_twist_rows(self, inputs: Sequence[Scalar]) -> list[list[Scalar]]:
        """Trace A of the tool's twist at the pose of these inputs."""
        pose = self.place(inputs)
        return trace_twist_rows(self.machine, pose, self.mode)

    def build_constraints(self, without: Sequence[str] = ()) -> list[Constraint]:
        """Build the constraints of the machine's limits, but for those named in ``without``, and what they imply."""
        limits, d = self.build_limits(without), len(self.free_axes)
        implied = [*_bound_angle_sizes(limits), *self._bound_reach(without)]
        x, orientation = self.inputs[:d], self.inputs[d:]
        return limits + [Constraint(name, g, x, orientation, implied=True) for name, g in implied]

    def build_limits(self, without: Sequence[str] = ()) -> list[Constraint]:
        """Build the constraints of the machine's limits, but for those named in ``without``."""
        with np.errstate(all="ignore"):  # fixed axes out of reach give numbers that are not finite, a broken margin
            margins = self.trace_equations(self.inputs).own_margins(self.pose, self.mode)
        d, signs = len(self.free_axes), self._make_sign_proofs()
        x, orientation = self.inputs[:d], self.inputs[d:]
        kept = [(limit.name, margin) for limit, margin in margins if limit.name not in without]
        return [Constraint(name, margin, x, orientation, sign=signs.get(name)) for name, margin in kept]

    def _make_sign_proofs(self) -> dict[str, SignProof]:
        inputs = self.jump_free_inputs
        with np.errstate(all="ignore"):
            forms = self.trace_equations(inputs).list_sign_forms(self.place(inputs), self.mode)
        proofs = {name: make_margin_proof(margin, inputs) for name, margin in forms.cones.items()}
        least = {limit.name: limit.bound for limit in self.machine.limit_definitions}
        clear = {name: make_separation_proof(pair, least[name], inputs) for name, pair in forms.struts.items()}
        return proofs | clear

    def _bound_reach(self, without: Sequence[str]) -> list[tuple[str, Scalar]]:
        """Bound how far platform and tool may be, whatever the orientation.

        With a central leg the rotation follows from the position, and near the axis of its first turn the rotation has
        no bounds; on a table that turns all round the workpiece's position tells little of the machine's. There this
        still bounds the machine's reach. So it does where a ring's joint is anywhere, its foot being on the axis.
        """
        structure = self.machine.structure
        is_table_swept = bool(self.swept_axes) and structure.has_turning_table
        has_rings = any(leg.find_fixed_joint() is None for leg in self.machine.legs)
        is_far = structure.carries_pole or has_rings
        if not is_far and not is_table_swept:
            return []
        with np.errstate(all="ignore"):
            _, platform, _ = self.machine.trace_inverse(self.pose, self.mode)
        margins, shifts = [], structure.bound_shift()
        for name, middle, most in self._list_reach_spheres(without):
            if is_far:
                margins.append((name, most - norm(sub(platform.origin, middle.tolist()))))
            if is_table_swept and isfinite(shifts):  # turns keep lengths, and each shift adds at most its own
                tip = [value for axis, value in zip(self.machine.axes, self.pose, strict=True) if axis in "XYZ"]
                farthest = (most + np.linalg.norm(middle) + shifts) * (1.0 + _ROUNDING)
                margins.append((name, farthest - norm(tip)))
        return margins

    def _list_reach_spheres(self, without: Sequence[str]) -> Iterator[tuple[str, Array, float]]:
        """Yield spheres that hold the platform's origin: a joint of their leg, the middle (3,) and the radius, mm."""
        for leg in self.machine.legs:
            low = [-np.inf if f"{drive.name}.min" in without else drive.low for drive in leg.drives]
            high = [np.inf if f"{drive.name}.max" in without else drive.high for drive in leg.drives]
            trace = Trace()
            sphere = leg.bound_platform([q + d.offset for q, d in zip(trace.inputs(len(low)), leg.drives, strict=True)])
            if sphere is None:
                continue
            centre, radius = sphere
            down, up = (
                ends[0] for ends in IntervalProgram(trace, [*centre, radius])(np.array([low]), np.array([high]))
            )
            if np.isfinite(down[:3]).all() and np.isfinite(up).all():
                middle, half = 0.5 * (down + up)[:3], 0.5 * (up - down)[:3]
                most = (up[3] + np.linalg.norm(half) + np.linalg.norm(leg.platform)) * (1.0 + _ROUNDING)
                yield leg.drives[0].name, middle, float(most)


def trace_twist_rows(machine: Machine, pose: Sequence[Scalar], mode: str) -> list[list[Scalar]]:
    """Trace A of the tool's twist at a pose in a working mode."""
    return machine.trace_equations({}).trace_twist_rows(pose, machine.trace_inverse(pose, mode)[0])


def _bound_angle_sizes(limits: Sequence[Constraint]) -> list[tuple[str, Scalar]]:
    """Derive margins of an angle's size from limits on both sides of it: a size does not jump at ±180°."""
    bounds: dict[int, dict[bool, tuple[float, Term, str]]] = {}
    for limit in limits:
        g = limit.margin
        if isinstance(g, Term) and g.op == alg.LIN and len(g.args) == 1 and g.args[0].op == alg.ATAN2:
            angle = g.args[0]
            bounds.setdefault(angle.index, {})[g.k[1] < 0.0] = abs(g.k[0] / g.k[1]), angle, limit.name
    sizes = []
    for sides in bounds.values():
        most = max(bound for bound, _, _ in sides.values())
        _, angle, name = next(iter(sides.values()))
        if len(sides) == 2 and most < np.pi:
            y, x = angle.args
            sizes.append((name, most - alg.atan2(absolute(y), x)))
    return sizes
