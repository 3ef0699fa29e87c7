"""The machine's equations as traces, compiled to tapes on first use: inverse, closures, Jacobians, margins, poses.

Inputs are numbered: first the pose (or the motion's coordinates), then the joint vector.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ..algebra import Scalar, Trace, absolute, derivative, evaluate_trace
from ..kernels.tape import Tape, compile_tape
from ..units import AXIS_UNITS
from .equations import Equations
from .rates import compute_twist_rates
from .spec import Spec
from .spheres import compute_square_height


class Model(Equations):
    """A machine's equations with their tapes."""

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self._tapes: dict[tuple[object, ...], Tape] = {}

    def keep_tape(self, key: tuple[object, ...], inputs: int, outputs: Callable[[Trace], list[Scalar]]) -> Tape:
        """Compile the tape of a trace's outputs, or return the one that is kept under the key."""
        tape = self._tapes.get(key)
        if tape is None:
            trace = Trace()
            tape = self._tapes[key] = compile_tape(trace, outputs(trace), inputs)
        return tape

    @property
    def _poses(self) -> int:
        return len(self.axes)

    @property
    def _motions(self) -> int:
        return len(self.structure.coordinates)

    def _pose_and_joints(self, trace: Trace) -> tuple[list[Scalar], list[Scalar]]:
        return list(trace.inputs(self._poses)), list(trace.inputs(len(self.drives), self._poses))

    def _coordinates_and_joints(self, trace: Trace) -> tuple[list[Scalar], list[Scalar]]:
        return list(trace.inputs(self._motions)), list(trace.inputs(len(self.drives), self._motions))

    # The inverse problem, limits and rates.

    def inverse_tape(self, mode: str) -> Tape:
        """Compile pose -> joints."""
        return self.keep_tape(("inverse", mode), self._poses, lambda t: self.invert(t.inputs(self._poses), mode)[0])

    def inverse_with_first_tape(self, mode: str) -> Tape:
        """Compile pose, first joint of the wrist -> joints, for poses where that joint is free."""
        n = self._poses
        return self.keep_tape(
            ("inverse with first", mode), n + 1, lambda t: self.invert(t.inputs(n), mode, t.input(n))[0]
        )

    def freedom_tape(self) -> Tape:
        """Compile pose -> sin² of the tool axis against the first axis of head and table; 1 where there is none."""

        def outputs(trace: Trace) -> list[Scalar]:
            placed = self.structure.place(trace.inputs(self._poses), self.structure.branches)
            return [1.0 if placed.freedom is None else placed.freedom]

        return self.keep_tape(("freedom",), self._poses, outputs)

    def legs_tape(self, mode: str) -> Tape:
        """Compile coordinates -> the legs' joints, in the order of the joint vector, and their derivatives."""

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates = list(trace.inputs(self._motions))
            inverses = self.invert_legs(*self.structure.frame(coordinates), mode)
            legs = self.list_leg_joints(inverses)
            return legs + [derivative(q, y) for q in legs for y in coordinates]

        return self.keep_tape(("legs", mode), self._motions, outputs)

    def mode_tape(self, mode: str) -> Tape:
        """Compile pose, joints -> how far the joints are from those of a working mode; see :meth:`compare_mode`."""
        width = self._poses + len(self.drives)
        return self.keep_tape(("mode", mode), width, lambda t: self.compare_mode(*self._pose_and_joints(t), mode))

    def margins_tape(self, mode: str) -> Tape:
        """Compile pose, joints -> every margin, in the order of :attr:`limits`."""

        def outputs(trace: Trace) -> list[Scalar]:
            pose, joints = self._pose_and_joints(trace)
            return [margin for _, margin in self.margins(pose, joints, mode)]

        return self.keep_tape(("margins", mode), self._poses + len(self.drives), outputs)

    def check_tape(self, mode: str) -> Tape:
        """Compile pose -> every margin, with the inverse in between."""

        def outputs(trace: Trace) -> list[Scalar]:
            return [margin for _, margin in self.own_margins(trace.inputs(self._poses), mode)]

        return self.keep_tape(("check", mode), self._poses, outputs)

    def jacobian_tape(self) -> Tape:
        """Compile pose, joints -> A (m·n) and B (m·m) with A x' = B q'."""

        def outputs(trace: Trace) -> list[Scalar]:
            pose, joints = self._pose_and_joints(trace)
            rotation, origin, rows = self.structure.closure(pose, self.list_serial(joints))
            f = [*self.closures(rotation, origin, joints), *rows]
            a = [derivative(row, x) for row in f for x in pose]
            return a + [-derivative(row, q) for row in f for q in joints]

        return self.keep_tape(("jacobian",), self._poses + len(self.drives), outputs)

    def rates_tape(self) -> Tape:
        """Compile pose, joints -> A (m·n), B (m·m) and the legs' wrench norms: see :mod:`parakin.model.rates`."""

        def outputs(trace: Trace) -> list[Scalar]:
            twist = compute_twist_rates(self.spec, self.structure, *self._pose_and_joints(trace))
            return [scalar for row in (*twist.a, *twist.b, twist.wrench_norms) for scalar in row]

        return self.keep_tape(("rates",), self._poses + len(self.drives), outputs)

    def constraint_rates_tape(self) -> Tape:
        """Compile pose -> the rates of the constraints; see :meth:`~.structures.Structure.list_constraint_rates`."""
        return self.keep_tape(
            ("constraint rates",),
            self._poses,
            lambda t: [rate for row in self.trace_constraint_rates(t.inputs(self._poses)) for rate in row],
        )

    # Newton's method on the closures, in the motion's coordinates.

    def begin_tape(self, from_poses: bool = True) -> Tape:
        """Compile pose (or coordinates as they are), joints -> the motion's coordinates to start from."""
        width = self._poses if from_poses else self._motions

        def outputs(trace: Trace) -> list[Scalar]:
            given, joints = trace.inputs(width), trace.inputs(len(self.drives), width)
            return (
                self.structure.place_with_joints(given, self.list_serial(joints)).coordinates
                if from_poses
                else list(given)
            )

        return self.keep_tape(("begin", from_poses), width + len(self.drives), outputs)

    def end_tape(self, to_poses: bool = True) -> Tape:
        """Compile coordinates, joints -> pose (or coordinates as they are)."""

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates, joints = self._coordinates_and_joints(trace)
            return self.compute_pose(coordinates, joints) if to_poses else coordinates

        return self.keep_tape(("end", to_poses), self._motions + len(self.drives), outputs)

    def newton_tape(self, derivatives: bool) -> Tape:
        """Compile coordinates, joints -> closures in mm, and then, if wanted, their derivatives by the coordinates.

        The closures come in the order in which elimination at home needs no exchange, of a redundant machine, whose
        matrix is not eliminated, in their own.
        """

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates, joints = self._coordinates_and_joints(trace)
            f = self.scaled_closures(coordinates, joints)
            f = [f[i] for i in self.closure_order]
            return f + [derivative(row, y) for row in f for y in coordinates] if derivatives else f

        return self.keep_tape(("newton", derivatives), self._motions + len(self.drives), outputs)

    @cached_property
    def leading_closures(self) -> list[int]:
        """As many of the legs' closures as the motion has coordinates, which hold the platform at home alone."""
        order, count = self._pivot_closures(), len(self.structure.coordinates)
        return sorted(order[:count])

    @cached_property
    def closure_order(self) -> list[int]:
        """The order in which :meth:`newton_tape` has the closures."""
        return list(range(self.leg_count)) if self.is_redundant else self._pivot_closures()

    def _pivot_closures(self) -> list[int]:
        """Order the closures as elimination with exchanges of rows does at home."""
        trace = Trace()
        coordinates, joints = self._coordinates_and_joints(trace)
        f = self.scaled_closures(coordinates, joints)
        entries = [derivative(row, y) for row in f for y in coordinates]
        home, placed, _ = self.invert(self.home, self.mode)
        at_home = evaluate_trace(trace, entries, [*placed.coordinates, *home])
        matrix = np.array(at_home, float).reshape(len(f), len(coordinates))
        order = list(range(len(f)))
        for k in range(min(len(f) - 1, len(coordinates))):
            best = k + int(np.abs(matrix[k:, k]).argmax())
            order[k], order[best] = order[best], order[k]
            matrix[[k, best]] = matrix[[best, k]]
            if matrix[k, k] != 0.0:
                matrix[k + 1 :] -= np.outer(matrix[k + 1 :, k] / matrix[k, k], matrix[k])
        return order

    # The direct problem in closed form.

    def spheres_tape(self, side: float | None) -> Tape:
        """Compile joints -> pose, on the given side of the centres' plane, then the closures there, mm.

        With None: joints, near pose -> the same, on the pose's side.
        """

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            near = None
            if side is None:
                pose = trace.inputs(self._poses, len(joints))
                near = self.structure.place_with_joints(pose, self.list_serial(joints)).origin
            coordinates = self.spheres(joints, side, near)
            return self.compute_pose(coordinates, joints) + self.scaled_closures(coordinates, joints)

        return self.keep_tape(("spheres", side), len(self.drives) + (self._poses if side is None else 0), outputs)

    def spheres_with_height_tape(self) -> Tape:
        """Compile joints -> as :meth:`spheres_tape`, on home's side, then the squared height over the centres, mm²."""

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            coordinates, height = self.trace_home_spheres(joints)
            return [*self.compute_pose(coordinates, joints), *self.scaled_closures(coordinates, joints), height]

        return self.keep_tape(("spheres with height",), len(self.drives), outputs)

    def trace_home_spheres(self, joints: Sequence[Scalar]) -> tuple[list[Scalar], Scalar]:
        """Trace the common point of the legs' spheres on home's side, and its squared height over the centres, mm²."""
        return self.spheres(joints, self.home_side), compute_square_height(*self.find_spheres(joints))

    def spheres_on_side_tape(self) -> Tape:
        """Compile joints, a number -> as :meth:`spheres_tape`, on the side that the number's sign tells."""

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            coordinates = self.spheres(joints, trace.input(len(joints)))
            return self.compute_pose(coordinates, joints) + self.scaled_closures(coordinates, joints)

        return self.keep_tape(("spheres on side",), len(self.drives) + 1, outputs)

    def own_side_tape(self, mode: str) -> Tape:
        """Compile pose -> the side of the spheres' centres on which it lies, with its own joints in a working mode."""

        return self.keep_tape(
            ("own side", mode), self._poses, lambda t: [self.measure_own_side(t.inputs(self._poses), mode)]
        )

    def beside_tape(self, limit: float) -> Tape:
        """Compile two poses -> by how much each coordinate differs less than a fraction of the longest leg, or rad."""
        n, size = self._poses, max(self.sizes)
        bounds = [limit if AXIS_UNITS[axis] == "rad" else limit * size for axis in self.axes]

        def outputs(trace: Trace) -> list[Scalar]:
            pairs = zip(trace.inputs(n), trace.inputs(n, n), bounds, strict=True)
            return [bound - absolute(one - other) for one, other, bound in pairs]

        return self.keep_tape(("beside", limit), 2 * n, outputs)
