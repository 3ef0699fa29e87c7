"""The machine's computations as traces, compiled to tapes on first use: inverse, closures, Jacobians, margins, poses.

Inputs are numbered: first the pose (or the motion's coordinates), then the joint vector.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, reduce

import numpy as np

from ..algebra import (
    Scalar,
    Trace,
    Vec,
    absolute,
    apply,
    atan2,
    derivative,
    evaluate_trace,
    minimum,
    norm,
    scale,
    sincos,
    sqrt,
    sub,
    transpose,
)
from ..errors import DescriptionError
from ..kernels.tape import Tape, compile_tape
from ..units import AXIS_UNITS
from .elements import ROTATIONS
from .legs import Inverse
from .limits import HomeRods, Limit, compute_platform_points, group_joints_by_leg, list_limits
from .rates import compute_twist_rates
from .spec import Spec
from .spheres import CENTRES_NEEDED, compute_square_height, find_common_point, measure_side
from .structures import PlatformPlacement, Structure, make_structure

ARM = 0.2  # of the greatest leg: the length by which angles of turning drives are compared with lengths

FAR = 1e12  # mm; more than any pose's coordinate


class Model:
    """A machine's mathematics in :mod:`parakin.algebra`, for numbers, arrays and traces."""

    def __init__(self, spec: Spec):
        self.spec = spec
        self.structure: Structure = make_structure(spec)
        self.axes = self.structure.axes
        self.drives = spec.drives
        self.serial = len(self.drives) - sum(len(leg.drives) for leg in spec.legs)
        self._tapes: dict[tuple[object, ...], Tape] = {}

    # Working modes: the signs of every leg's choices, then head and table's.

    @property
    def mode(self) -> str:
        """The working mode that the file names."""
        return "".join(getattr(leg, "branch", "") for leg in self.spec.legs) + self.structure.branches

    def split_mode(self, mode: str) -> tuple[list[str], str]:
        signs, rest = [], mode
        for leg in self.spec.legs:
            count = len(leg.branches)
            signs.append(rest[:count])
            rest = rest[count:]
        return signs, rest

    # The problems, on scalars of any kind.

    def invert(
        self, pose: Sequence[Scalar], mode: str, first: Scalar | None = None
    ) -> tuple[list[Scalar], PlatformPlacement, list[Inverse]]:
        """Compute the joint vector, placement and each leg's inverse for a pose."""
        signs, branch = self.split_mode(mode)
        placed = self.structure.place(pose, branch, first)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        legs = [leg.inverse(point, s) for leg, point, s in zip(self.spec.legs, points, signs, strict=True)]
        by_name = {
            drive.name: q
            for leg, inverse in zip(self.spec.legs, legs, strict=True)
            for drive, q in zip(leg.drives, inverse.joints, strict=True)
        }
        by_name.update(zip((d.name for d in self.drives[len(by_name) :]), placed.serial, strict=True))
        return [by_name[drive.name] for drive in self.drives], placed, legs

    def margins(self, pose: Sequence[Scalar], joints: Sequence[Scalar], mode: str) -> list[tuple[Limit, Scalar]]:
        """List every limit with its margin, for a pose and the joints that a path takes there."""
        signs, _ = self.split_mode(mode)
        placed = self.structure.place_with_joints(pose, self._serial(joints))
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        legs = [leg.inverse(point, s) for leg, point, s in zip(self.spec.legs, points, signs, strict=True)]
        return self._margins(placed, joints, legs)

    def own_margins(self, pose: Sequence[Scalar], mode: str) -> list[tuple[Limit, Scalar]]:
        """List every limit with its margin, for a pose and its inverse."""
        joints, placed, legs = self.invert(pose, mode)
        return self._margins(placed, joints, legs)

    def _margins(
        self, placed: PlatformPlacement, joints: Sequence[Scalar], legs: Sequence[Inverse]
    ) -> list[tuple[Limit, Scalar]]:
        home = self.rods_at_home if any(cone.axis is None for cone in self.spec.limits.cones) else None
        coordinates = list(zip(self.structure.coordinates, placed.coordinates, strict=True))
        return list_limits(self.spec, placed, coordinates, joints, [leg.reach for leg in legs], home)

    def closures(self, rotation: Sequence[Vec], origin: Vec, joints: Sequence[Scalar]) -> list[Scalar]:
        """List every leg's closure, mm²."""
        points = compute_platform_points(self.spec, rotation, origin)
        given = group_joints_by_leg(self.spec, joints)
        return [f for leg, p, q in zip(self.spec.legs, points, given, strict=True) for f in leg.closures(p, q)]

    @cached_property
    def home(self) -> list[float]:
        return [float(self.spec.home.get(letter, 0.0)) for letter in self.axes]

    @cached_property
    def rods_at_home(self) -> HomeRods:
        joints, placed, _ = self.invert(self.home, self.mode)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        given = group_joints_by_leg(self.spec, joints)
        rods = [leg.struts(p, q)[0] for leg, p, q in zip(self.spec.legs, points, given, strict=True)]
        units = [scale(sub(point, foot), 1.0 / norm(sub(point, foot))) for foot, point in rods]
        back = transpose(placed.rotation)
        return HomeRods(tuple(units), tuple(apply(back, u) for u in units))

    @cached_property
    def sizes(self) -> list[float]:
        """A length a closure, mm: divided by it a closure is (no less than) the distance by which its leg is open."""
        joints, placed, _ = self.invert(self.home, self.mode)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        given = group_joints_by_leg(self.spec, joints)
        sizes = []
        for leg, point, q in zip(self.spec.legs, points, given, strict=True):
            foot, end = leg.struts(point, q)[0]
            sizes += [leg.size(float(norm(sub(end, foot))))] * len(leg.drives)
        return sizes

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        limits = tuple(limit for limit, _ in self.own_margins(self.home, self.mode))
        names = [limit.name for limit in limits]
        for name in names:
            if names.count(name) > 1:
                raise DescriptionError("limits", f"two are called {name}; rename the joint or join the limits")
        return limits

    @cached_property
    def by_spheres(self) -> bool:
        """True where the direct problem is the common point of spheres or circles: no turns, one rod a leg."""
        turns = any(word in ROTATIONS for word in self.spec.motion)
        held = [leg.sphere([0.0] * len(leg.drives)) is not None for leg in self.spec.legs]
        return not turns and all(held) and len(held) in CENTRES_NEEDED

    @cached_property
    def turning_columns(self) -> list[int]:
        """Columns of a pose that are angles."""
        return [column for column, axis in enumerate(self.axes) if AXIS_UNITS[axis] == "rad"]

    @cached_property
    def turning_joints(self) -> list[int]:
        """Columns of a joint vector that are angles, legs' too."""
        return [column for column, drive in enumerate(self.drives) if drive.unit == "rad"]

    @property
    def has_modes(self) -> bool:
        """The legs' inverse has choices."""
        return any(leg.branches for leg in self.spec.legs)

    @cached_property
    def home_side(self) -> float:
        """The side of the spheres' centres on which the platform is at home."""
        joints, placed, _ = self.invert(self.home, self.mode)
        centres, _, plane = self.find_spheres(joints)
        return 1.0 if measure_side(centres, plane, placed.origin) >= 0.0 else -1.0

    @property
    def leg_count(self) -> int:
        """How many of the joints are the legs'; head and table's follow them."""
        return len(self.drives) - self.serial

    @property
    def wrist_joints(self) -> tuple[int, int] | None:
        """The two turning joints that point the tool, as indices in the joint vector, in the order of their axes."""
        order = self.structure.serial_order
        return (self.leg_count + order[0], self.leg_count + order[1]) if order else None

    # Tapes.

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

    def _serial(self, joints: Sequence[Scalar]) -> list[Scalar]:
        return list(joints[len(self.drives) - self.serial :])

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

    def begin_tape(self, from_poses: bool = True) -> Tape:
        """Compile pose (or coordinates as they are), joints -> the motion's coordinates to start from."""
        width = self._poses if from_poses else self._motions

        def outputs(trace: Trace) -> list[Scalar]:
            given, joints = trace.inputs(width), trace.inputs(len(self.drives), width)
            return (
                self.structure.place_with_joints(given, self._serial(joints)).coordinates if from_poses else list(given)
            )

        return self.keep_tape(("begin", from_poses), width + len(self.drives), outputs)

    def end_tape(self, to_poses: bool = True) -> Tape:
        """Compile coordinates, joints -> pose (or coordinates as they are)."""

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates, joints = self._coordinates_and_joints(trace)
            return self.compute_pose(coordinates, joints) if to_poses else coordinates

        return self.keep_tape(("end", to_poses), self._motions + len(self.drives), outputs)

    def compute_pose(self, coordinates: Sequence[Scalar], joints: Sequence[Scalar]) -> list[Scalar]:
        """Compute the pose; NaN where a leg closes otherwise than it is built, as a strut of negative length does."""
        first, *others = self.structure.pose(coordinates, self._serial(joints))
        points = compute_platform_points(self.spec, *self.structure.frame(coordinates))
        given = group_joints_by_leg(self.spec, joints)
        margins = [
            m for leg, p, q in zip(self.spec.legs, points, given, strict=True) for m in leg.assembly_margins(p, q)
        ]
        if margins:
            first = minimum(first, FAR + sqrt(reduce(minimum, margins)))
        return [first, *others]

    def newton_tape(self, derivatives: bool) -> Tape:
        """Compile coordinates, joints -> closures in mm, and then, if wanted, their derivatives by the coordinates.

        The closures come in the order in which elimination at home needs no exchange.
        """

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates, joints = self._coordinates_and_joints(trace)
            f = self.scaled_closures(coordinates, joints)
            f = [f[i] for i in self.closure_order]
            return f + [derivative(row, y) for row in f for y in coordinates] if derivatives else f

        return self.keep_tape(("newton", derivatives), self._motions + len(self.drives), outputs)

    def scaled_closures(self, coordinates: Sequence[Scalar], joints: Sequence[Scalar]) -> list[Scalar]:
        """Compute every leg's closure in mm, from the motion's coordinates."""
        closures = self.closures(*self.structure.frame(coordinates), joints)
        return [c * (1.0 / size) for c, size in zip(closures, self.sizes, strict=True)]

    @cached_property
    def closure_order(self) -> list[int]:
        trace = Trace()
        coordinates, joints = self._coordinates_and_joints(trace)
        f = self.scaled_closures(coordinates, joints)
        entries = [derivative(row, y) for row in f for y in coordinates]
        home, placed, _ = self.invert(self.home, self.mode)
        at_home = evaluate_trace(trace, entries, [*placed.coordinates, *home])
        matrix = np.array(at_home, float).reshape(len(f), len(coordinates))
        order = list(range(len(f)))
        for k in range(len(order) - 1):
            best = k + int(np.abs(matrix[k:, k]).argmax())
            order[k], order[best] = order[best], order[k]
            matrix[[k, best]] = matrix[[best, k]]
            if matrix[k, k] != 0.0:
                matrix[k + 1 :] -= np.outer(matrix[k + 1 :, k] / matrix[k, k], matrix[k])
        return order

    def legs_tape(self, mode: str) -> Tape:
        """Compile coordinates -> the legs' joints, in the order of the joint vector, and their derivatives."""

        def outputs(trace: Trace) -> list[Scalar]:
            coordinates = list(trace.inputs(self._motions))
            points = compute_platform_points(self.spec, *self.structure.frame(coordinates))
            signs, _ = self.split_mode(mode)
            joints = {
                drive.name: q
                for leg, point, s in zip(self.spec.legs, points, signs, strict=True)
                for drive, q in zip(leg.drives, leg.inverse(point, s).joints, strict=True)
            }
            legs = [joints[drive.name] for drive in self.drives[: len(self.drives) - self.serial]]
            return legs + [derivative(q, y) for q in legs for y in coordinates]

        return self.keep_tape(("legs", mode), self._motions, outputs)

    def mode_tape(self, mode: str) -> Tape:
        """Compile pose, joints -> how far the joints are from those of a working mode; see :meth:`compare_mode`."""
        width = self._poses + len(self.drives)
        return self.keep_tape(("mode", mode), width, lambda t: self.compare_mode(*self._pose_and_joints(t), mode))

    def compare_mode(self, pose: Sequence[Scalar], joints: Sequence[Scalar], mode: str) -> list[Scalar]:
        """Subtract given joints from the legs' joints in a working mode at a pose, its platform as they place it; mm.

        Angles are taken within half a turn, times an arm of :data:`ARM` of the greatest leg.
        """
        arm = ARM * max(self.sizes)

        def compare(unit: str, off: Scalar) -> Scalar:
            return atan2(*sincos(off)) * arm if unit == "rad" else off

        placed = self.structure.place_with_joints(pose, self._serial(joints))
        signs, _ = self.split_mode(mode)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        own = group_joints_by_leg(self.spec, joints)
        return [
            compare(unit, q - given)
            for leg, point, s, all_given in zip(self.spec.legs, points, signs, own, strict=True)
            for unit, q, given in zip(leg.units, leg.inverse(point, s).joints, all_given, strict=True)
        ]

    def list_branch_margins(self, pose: Sequence[Scalar], joints: Sequence[Scalar], mode: str) -> list[Scalar] | None:
        """List how clear of other working modes the legs' joints are at a pose, mm; None where a leg can't tell it."""
        placed = self.structure.place_with_joints(pose, self._serial(joints))
        signs, _ = self.split_mode(mode)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        given = group_joints_by_leg(self.spec, joints)
        margins: list[Scalar] = []
        for leg, point, q, s in zip(self.spec.legs, points, given, signs, strict=True):
            own = leg.branch_margins(point, q, s) if leg.branches else []
            if own is None:
                return None
            margins += own
        return margins

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
        """Compile pose, joints -> A (n·n) and B (n·n) with A x' = B q'."""

        def outputs(trace: Trace) -> list[Scalar]:
            pose, joints = self._pose_and_joints(trace)
            rotation, origin, rows = self.structure.closure(pose, self._serial(joints))
            f = [*self.closures(rotation, origin, joints), *rows]
            a = [derivative(row, x) for row in f for x in pose]
            return a + [-derivative(row, q) for row in f for q in joints]

        return self.keep_tape(("jacobian",), self._poses + len(self.drives), outputs)

    def rates_tape(self) -> Tape:
        """Compile pose, joints -> A (n·n), B (n·n) and the legs' wrench norms: see :mod:`parakin.model.rates`."""

        def outputs(trace: Trace) -> list[Scalar]:
            twist = compute_twist_rates(self.spec, self.structure, *self._pose_and_joints(trace))
            return [scalar for row in (*twist.a, *twist.b, twist.wrench_norms) for scalar in row]

        return self.keep_tape(("rates",), self._poses + len(self.drives), outputs)

    def spheres_tape(self, side: float | None) -> Tape:
        """Compile joints -> pose, on the given side of the centres' plane, then the closures there, mm.

        With None: joints, near pose -> the same, on the pose's side.
        """

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            near = None
            if side is None:
                pose = trace.inputs(self._poses, len(joints))
                near = self.structure.place_with_joints(pose, self._serial(joints)).origin
            coordinates = self.spheres(joints, side, near)
            return self.compute_pose(coordinates, joints) + self.scaled_closures(coordinates, joints)

        return self.keep_tape(("spheres", side), len(self.drives) + (self._poses if side is None else 0), outputs)

    def spheres_with_height_tape(self) -> Tape:
        """Compile joints, near pose -> as :meth:`spheres_tape`, then the square of the height over the centres, mm²."""

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            placed = self.structure.place_with_joints(trace.inputs(self._poses, len(joints)), self._serial(joints))
            coordinates = self.spheres(joints, None, placed.origin)
            closures = self.scaled_closures(coordinates, joints)
            return [
                *self.compute_pose(coordinates, joints),
                *closures,
                compute_square_height(*self.find_spheres(joints)),
            ]

        return self.keep_tape(("spheres with height",), len(self.drives) + self._poses, outputs)

    def spheres_on_side_tape(self) -> Tape:
        """Compile joints, a number -> as :meth:`spheres_tape`, on the side that the number's sign tells."""

        def outputs(trace: Trace) -> list[Scalar]:
            joints = list(trace.inputs(len(self.drives)))
            coordinates = self.spheres(joints, trace.input(len(joints)))
            return self.compute_pose(coordinates, joints) + self.scaled_closures(coordinates, joints)

        return self.keep_tape(("spheres on side",), len(self.drives) + 1, outputs)

    def beside_tape(self, limit: float) -> Tape:
        """Compile two poses -> by how much each coordinate differs less than a fraction of the longest leg, or rad."""
        n, size = self._poses, max(self.sizes)
        bounds = [limit if AXIS_UNITS[axis] == "rad" else limit * size for axis in self.axes]

        def outputs(trace: Trace) -> list[Scalar]:
            pairs = zip(trace.inputs(n), trace.inputs(n, n), bounds, strict=True)
            return [bound - absolute(one - other) for one, other, bound in pairs]

        return self.keep_tape(("beside", limit), 2 * n, outputs)

    def own_side_tape(self, mode: str) -> Tape:
        """Compile pose -> the side of the spheres' centres on which it lies, with its own joints in a working mode."""

        return self.keep_tape(
            ("own side", mode), self._poses, lambda t: [self.measure_own_side(t.inputs(self._poses), mode)]
        )

    def measure_own_side(self, pose: Sequence[Scalar], mode: str) -> Scalar:
        """Measure on which side of the spheres' centres a pose lies with its own joints; NaN out of reach."""
        joints, placed, _ = self.invert(pose, mode)
        centres, _, plane = self.find_spheres(joints)
        return measure_side(centres, plane, placed.origin)

    def spheres(self, joints: Sequence[Scalar], side: Scalar | None, near: Vec | None = None) -> list[Scalar]:
        """Find the motion's coordinates by the common point of the legs' spheres; ``near`` picks the nearer of two."""
        centres, radii, plane = self.find_spheres(joints)
        return self.structure.coordinates_at(find_common_point(centres, radii, plane, side, near))

    def find_spheres(self, joints: Sequence[Scalar]) -> tuple[list[Vec], list[Scalar], list[int]]:
        """Find centres and radii of the spheres that hold the platform's origin, and the coordinates it moves in."""
        centres, radii = [], []
        for leg, q in zip(self.spec.legs, group_joints_by_leg(self.spec, joints), strict=True):
            sphere = leg.sphere(q)
            assert sphere is not None
            centres.append(sub(sphere[0], leg.platform))
            radii.append(sphere[1])
        return centres, radii, [i for i, word in enumerate(("tx", "ty", "tz")) if word in self.spec.motion]
