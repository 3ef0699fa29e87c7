"""Inverse dynamics: the drives' forces for a motion, by virtual work over all bodies.

With z = (y, q) of the motion's coordinates y and the joints q the closures f(z) = 0 give y' = G q' and
y'' = G q'' - F⁻¹ γ, where F = ∂f/∂y, G = -F⁻¹ ∂f/∂q, and γ is the second derivative of f along z'. Each body's
weighted vectors v (:mod:`.inertia_vectors`) give Q = Σ w (∂v/∂z)ᵀ (v'' - g); the drives' forces are Q_q + Gᵀ Q_y.
All derivatives are the traces' own.

With more drives than freedoms motions that keep the closures fix only Kᵀτ of the drives' forces τ, with q' = K y'. They
share it so that the sum of their squares is least, torques taken as forces at the length of their leg; G is then the
pseudo-inverse of K in that measure, and the forces are Gᵀ(Q_y + Kᵀ Q_q).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from ..algebra import Scalar, Term, Trace, derivative
from ..arrays import Array
from ..families.family import solve_each
from ..kernels.batch import evaluate_tape
from ..kernels.tape import Tape, compile_tape
from ..kinematics.tall_matrices import invert_from_left
from ..machine import Machine
from .inertia_vectors import WeightedVector, list_weighted_vectors

GRAVITY = 9806.65  # mm/s², along -Z of the machine's frame
_NEWTON = 1e-3  # of kg mm/s²
WATT = 1e-3  # of N mm/s


class Motion(NamedTuple):
    """A machine in motion, at N times.

    poses : (N, axes) mm, rad
    joints, speeds, accelerations : (N, joints) mm, rad and seconds
    """

    poses: Array
    joints: Array
    speeds: Array
    accelerations: Array


class PathForces(NamedTuple):
    """The drives' forces along a path by its length s: inertia·s̈ + centrifugal·ṡ² + weight; (N, joints) each.

    Per mm/s², per mm²/s², and N or Nmm.
    """

    inertia: Array
    centrifugal: Array
    weight: Array


class WeightRates(NamedTuple):
    """Rates of the weight's potential V at rest, and of the legs' closures f in mm, which coordinates and joints keep.

    by_coordinates, by_joints : (N, n) and (N, joints) of V: N or Nmm
    slopes, by_drives : (N, closures, n) of f by the coordinates, and (N, closures, joints) of -f by the joints
    """

    by_coordinates: Array
    by_joints: Array
    slopes: Array
    by_drives: Array


class _Placed(NamedTuple):
    """A machine at N poses.

    z : (N, z) coordinates and joints
    ways : (N, n, joints) G
    joint_ways : (N, joints, joints) how joints that keep the closures follow given ones; None where these are free
    inverse : (N, n, closures) of F from the left where it is tall, else None
    slopes : (N, closures, n) F
    """

    z: Array
    ways: Array
    joint_ways: Array | None
    inverse: Array | None
    slopes: Array

    def solve(self, right: Array) -> Array:
        """Solve F x = r for each right side (N, closures, k)."""
        return solve_each(self.slopes, right) if self.inverse is None else self.inverse @ right

    def follow(self, by_coordinates: Array, by_joints: Array) -> Array:
        """Compute how what is given by coordinates (N, k, n) and joints (N, k, joints) follows the joints."""
        own = by_joints if self.joint_ways is None else by_joints @ self.joint_ways
        return own + by_coordinates @ self.ways

    def share(self, by_coordinates: Array, by_joints: Array) -> Array:
        """Share generalized forces on coordinates (N, n) and joints (N, joints) among the drives, (N, joints)."""
        own = by_joints if self.joint_ways is None else np.einsum("nij,ni->nj", self.joint_ways, by_joints)
        return np.asarray(own + np.einsum("nij,ni->nj", self.ways, by_coordinates))


class Dynamics:
    """A machine's equations of motion, for batches; forces are N along a joint, Nmm about one.

    Raises :class:`NoMethodError` where a leg's kind tells nothing of its bodies.
    """

    def __init__(self, machine: Machine):
        self.machine = machine
        self._equations = machine.trace_equations({})
        self._rotors = np.array([drive.inertia for drive in machine.drives])
        self._coordinates = len(machine.structure.coordinates)
        self._width = self._coordinates + len(machine.joints)
        self._tapes: dict[str, Tape] = {}  # compiled when first asked for
        axes = len(machine.axes)
        trace = Trace()
        placed = machine.structure.place_with_joints(
            trace.inputs(axes), self._equations.list_serial(trace.inputs(len(machine.joints), axes))
        )
        self._begin = compile_tape(trace, placed.coordinates, axes + len(machine.joints))

    def __repr__(self) -> str:
        return f"<parakin dynamics of {self.machine.name}>"

    # Tapes: inputs are z, then z', then z'' and the gravity.

    def _compile(self, name: str) -> Tape:
        kinds: dict[str, tuple[int, Callable[[Trace], Sequence[Scalar]]]] = {
            "slopes": (1, self._trace_slopes),
            "bends": (2, self._trace_bends),
            "forces": (3, self._trace_forces),
            "tip": (1, self._trace_tip),
            "turns": (3, self._trace_turns),
        }
        blocks, trace_outputs = kinds[name]
        trace = Trace()
        return compile_tape(trace, trace_outputs(trace), blocks * self._width + (blocks == 3))

    def _block(self, trace: Trace, number: int = 0) -> list[Term]:
        return trace.inputs(self._width, number * self._width)

    def _trace_closures(self, trace: Trace) -> list[Scalar]:
        z, n = self._block(trace), self._coordinates
        return self._equations.scaled_closures(z[:n], z[n:])

    def _trace_slopes(self, trace: Trace) -> list[Scalar]:
        return [derivative(f, z) for f in self._trace_closures(trace) for z in self._block(trace)]

    def _trace_bends(self, trace: Trace) -> list[Scalar]:
        z, rates = self._block(trace), self._block(trace, 1)
        return [_differentiate_along(_differentiate_along(f, z, rates), z, rates) for f in self._trace_closures(trace)]

    def _trace_forces(self, trace: Trace) -> list[Scalar]:
        z, rates, bends = (self._block(trace, number) for number in range(3))
        gravity, n = trace.input(3 * self._width), self._coordinates
        totals: list[Scalar] = [0.0] * self._width
        for weighted in list_weighted_vectors(self.machine, self._equations, z[:n], z[n:]):
            _add_forces(weighted, (z, rates, bends), gravity, totals)
        return totals

    def _trace_tip(self, trace: Trace) -> list[Scalar]:
        z, n = self._block(trace), self._coordinates
        pose = self._equations.structure.pose(z[:n], self._equations.list_serial(z[n:]))
        tip = [x for x, axis in zip(pose, self.machine.axes, strict=True) if axis in "XYZ"]
        return [derivative(x, one) for x in tip for one in z]

    def _trace_turns(self, trace: Trace) -> list[Scalar]:
        """Trace the second derivatives of the weight's potential, by the gravity, and of the tip's place."""
        states = [self._block(trace, number) for number in range(3)]
        z, n = states[0], self._coordinates
        potential: Scalar = 0.0
        for weighted in list_weighted_vectors(self.machine, self._equations, z[:n], z[n:]):
            if weighted.falls:
                potential = potential + weighted.weight * weighted.vector[2]
        pose = self._equations.structure.pose(z[:n], self._equations.list_serial(z[n:]))
        tip = [x for x, axis in zip(pose, self.machine.axes, strict=True) if axis in "XYZ"]
        return [_differentiate_twice(term, *states) for term in (trace.input(3 * self._width) * potential, *tip)]

    # Batches.

    def _evaluate(self, name: str, inputs: Array) -> Array:
        if name not in self._tapes:
            self._tapes[name] = self._compile(name)
        tape = self._tapes[name]
        return evaluate_tape(tape, np.ascontiguousarray(inputs), np.empty((len(inputs), tape.outputs)))

    def _place(self, poses: Array, joints: Array) -> _Placed:
        """Place the machine, with F and G."""
        n, machine = self._coordinates, self.machine
        coordinates = evaluate_tape(self._begin, poses, np.empty((len(poses), n)), joints)
        z = np.hstack([coordinates, joints])
        slopes = self._evaluate("slopes", z).reshape(len(z), machine.leg_count, self._width)
        by_coordinates, by_joints = np.ascontiguousarray(slopes[:, :, :n]), slopes[:, :, n:]
        if not machine.is_redundant:
            return _Placed(z, -solve_each(by_coordinates, by_joints), None, None, by_coordinates)
        by_legs = by_joints[:, :, : machine.leg_count]
        inverse = invert_from_left(by_coordinates, by_legs / self._arms)
        ways = -inverse @ by_joints
        joint_ways = np.tile(np.eye(joints.shape[1]), (len(z), 1, 1))
        joint_ways[:, : machine.leg_count] = solve_each(by_legs, by_coordinates @ inverse @ by_joints)
        return _Placed(z, ways, joint_ways, inverse, by_coordinates)

    @property
    def _arms(self) -> Array:
        """What brings motions of the legs' drives to mm, (legs' joints,): turns count at the length of their leg."""
        arms = dict(zip(self.machine.closure_joints, self.machine.leg_sizes, strict=True))
        units = self.machine.joint_units
        return np.array([arms[i] if units[i] == "rad" else 1.0 for i in range(self.machine.leg_count)])

    def _compute(self, placed: _Placed, motion: tuple[Array, Array], gravity: float) -> Array:
        z, ways = placed.z, placed.ways
        speeds, accelerations = motion
        n = self._coordinates
        rates = np.hstack([_apply_each(ways, speeds), speeds])
        bends = self._evaluate("bends", np.hstack([z, rates]))
        own = _apply_each(ways, accelerations) - placed.solve(bends[:, :, None])[:, :, 0]
        state = np.hstack([z, rates, own, accelerations, np.full((len(z), 1), gravity)])
        forces = _NEWTON * self._evaluate("forces", state)
        return placed.share(forces[:, :n], forces[:, n:] + self._rotors * accelerations)

    def compute_forces(self, motion: Motion, force: Array | None = None) -> Array:
        """Compute the drives' forces, (N, joints); NaN where a pose is out of reach or singular.

        force : (translations,) or (N, translations), N: what acts on the tool's tip, along the pose's axes
        """
        placed = self._place(motion.poses, motion.joints)
        result = self._compute(placed, (motion.speeds, motion.accelerations), GRAVITY)
        return result if force is None else result - self._hold_force(placed, force)

    def _hold_force(self, placed: _Placed, force: Array) -> Array:
        """Compute what a force on the tip does to the joints, (N, joints): the drives give as much the other way."""
        n = self._coordinates
        rates = self._evaluate("tip", placed.z).reshape(len(placed.z), -1, self._width)
        whole = placed.follow(rates[:, :, :n], rates[:, :, n:])
        return np.asarray(np.einsum("nij,ni->nj", whole, np.broadcast_to(force, whole.shape[:2])))

    def compute_weight_rates(self, poses: Array, joints: Array) -> WeightRates:
        """Compute the rates of the weight's potential at rest, and of the legs' closures."""
        n, still = self._coordinates, np.zeros((len(poses), 2 * self._width))
        z = self._place(poses, joints).z
        forces = _NEWTON * self._evaluate("forces", np.hstack([z, still, np.full((len(z), 1), GRAVITY)]))
        slopes = self._evaluate("slopes", z).reshape(len(z), self.machine.leg_count, self._width)
        return WeightRates(forces[:, :n], forces[:, n:], slopes[:, :, :n], -slopes[:, :, n:])

    def compute_load_rates(self, poses: Array, joints: Array, force: Array) -> Array:
        """Compute how the drives' forces at rest change with the joints, (N, joints, joints) N/mm, under a load.

        force : (translations,) N on the tool's tip, along the pose's axes; the weight is added

        It is the Hessian of the loads' potential, from its second derivatives along sums of two joints.
        """
        placed = self._place(poses, joints)
        z, ways = placed.z, placed.ways
        count = joints.shape[1]
        second = np.empty((count, count, len(z)))
        for i, j in combinations_with_replacement(range(count), 2):
            speeds = np.zeros_like(joints)
            speeds[:, i] = speeds[:, j] = 1.0
            rates = np.hstack([_apply_each(ways, speeds), speeds])
            bends = self._evaluate("bends", np.hstack([z, rates]))
            own = -placed.solve(bends[:, :, None])[:, :, 0]
            state = np.hstack([z, rates, own, np.zeros_like(joints), np.full((len(z), 1), GRAVITY)])
            curvatures = self._evaluate("turns", state)
            second[i, j] = second[j, i] = _NEWTON * curvatures[:, 0] - curvatures[:, 1:] @ force
        single = np.einsum("iin->in", second)
        both = 0.5 * (second - single[:, None] - single[None])
        both[np.arange(count), np.arange(count)] = single
        return np.ascontiguousarray(both.transpose(2, 0, 1))

    def compute_path_forces(
        self, poses: Array, joints: Array, slopes: Array, bends: Array, force: Array | None = None
    ) -> PathForces:
        """Compute the drives' forces along a path, from the joints' first and second derivatives by its length.

        force : as of :meth:`compute_forces`; what it asks for is part of the weight
        """
        placed, still = self._place(poses, joints), np.zeros_like(joints)
        weight = self._compute(placed, (still, still), GRAVITY)
        return PathForces(
            self._compute(placed, (still, slopes), 0.0),
            self._compute(placed, (slopes, bends), 0.0),
            weight if force is None else weight - self._hold_force(placed, force),
        )


def _differentiate_along(y: Scalar, z: Sequence[Term], rates: Sequence[Scalar]) -> Scalar:
    """Differentiate a trace along rates of its inputs."""
    total: Scalar = 0.0
    for one, rate in zip(z, rates, strict=True):
        total = derivative(y, one) * rate + total
    return total


def _differentiate_twice(y: Scalar, z: Sequence[Term], rates: Sequence[Scalar], bends: Sequence[Scalar]) -> Scalar:
    """Differentiate a trace twice by the time, from the first and second derivatives of its inputs."""
    return _differentiate_along(_differentiate_along(y, z, rates), z, rates) + _differentiate_along(y, z, bends)


def _add_forces(
    weighted: WeightedVector, states: tuple[list[Term], list[Term], list[Term]], gravity: Term, totals: list[Scalar]
) -> None:
    """Add a vector's w (∂v/∂z)ᵀ (v'' - g) to the totals."""
    z, rates, bends = states
    for number, component in enumerate(weighted.vector):
        slopes = [derivative(component, one) for one in z]
        second = _differentiate_twice(component, z, rates, bends)
        if weighted.falls and number == 2:
            second = gravity + second
        for i, slope in enumerate(slopes):
            if isinstance(slope, Term) or slope != 0.0:
                totals[i] = weighted.weight * (slope * second) + totals[i]


def _apply_each(matrices: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))
