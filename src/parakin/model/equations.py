"""The equations of a machine on scalars of any kind: inverse, closures, margins, common points of spheres, modes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, reduce

from ..algebra import Scalar, Vec, add, apply, atan2, minimum, norm, scale, sincos, sqrt, sub, transpose
from ..errors import DescriptionError
from ..units import AXIS_UNITS
from .elements import ROTATIONS, RodConstraint
from .legs import Inverse, Leg
from .limits import (
    HomeRods,
    Limit,
    SignForms,
    compute_platform_points,
    group_joints_by_leg,
    list_limits,
    list_sign_forms,
    list_strut_distances,
)
from .nominal_values import find_nominal_value
from .rates import TwistRates, TwistTrace, compute_twist_rates
from .spec import Spec
from .spheres import CENTRES_NEEDED, find_common_point, measure_side
from .structures import PlatformPlacement, Structure, list_rods, locate_passive_rods, make_structure

ARM = 0.2  # of the greatest leg: the length by which angles of turning drives are compared with lengths

FAR = 1e12  # mm; more than any pose's coordinate


class Equations:
    """A machine's equations in :mod:`parakin.algebra`, for numbers, arrays and traces."""

    def __init__(self, spec: Spec):
        self.spec = spec
        self.structure: Structure = make_structure(spec)
        self.axes = self.structure.axes
        self.drives = spec.drives
        self.leg_count = sum(len(leg.drives) for leg in spec.legs)  # of the joints; head and table's follow them

    @property
    def legs(self) -> tuple[Leg, ...]:
        return self.spec.legs

    def place_leg_joints(self, placement: PlatformPlacement) -> list[Vec]:
        """Compute the platform's joint of every leg in the base frame, mm, with the platform placed."""
        return compute_platform_points(self.spec, placement.rotation, placement.origin)

    @property
    def passive_rods(self) -> dict[str, RodConstraint]:
        """The constraints that are rods, by their names."""
        return list_rods(self.spec)

    def locate_passive_rods(
        self, placement: PlatformPlacement, joints: Sequence[Sequence[Scalar]]
    ) -> dict[str, tuple[Vec, Vec]]:
        """Locate both ends of each passive rod in the base frame, mm, for the joints of each leg."""
        return locate_passive_rods(self.spec, placement, joints)

    def group_joints(self, joints: Sequence[Scalar]) -> list[list[Scalar]]:
        """Group a joint vector by leg; it may go on with the joints of head and table."""
        return group_joints_by_leg(self.spec, joints)

    @cached_property
    def turning_columns(self) -> list[int]:
        """Columns of a pose that are angles."""
        return [column for column, axis in enumerate(self.axes) if AXIS_UNITS[axis] == "rad"]

    @cached_property
    def turning_joints(self) -> list[int]:
        """Columns of a joint vector that are angles, legs' too."""
        return [column for column, drive in enumerate(self.drives) if drive.unit == "rad"]

    @property
    def wrist_joints(self) -> tuple[int, int] | None:
        """The two turning joints that point the tool, as indices in the joint vector, in the order of their axes."""
        order = self.structure.serial_order
        return (self.leg_count + order[0], self.leg_count + order[1]) if order else None

    @property
    def redundancy(self) -> int:
        """How many drives there are more than freedoms."""
        return len(self.drives) - len(self.axes)

    @property
    def is_redundant(self) -> bool:
        """Whether there are more drives than freedoms, so that the joints follow the pose and not it them."""
        return self.redundancy > 0

    @property
    def parallel_block(self) -> tuple[int, int]:
        """How many rows and columns of A tell parallel singularities: the legs' alone where a wrist never matters.

        A redundant machine has more rows than columns.
        """
        rows = len(self.drives) if self.wrist_joints is None else self.leg_count
        return rows, rows - self.redundancy

    # Working modes: the signs of every leg's choices, then head and table's.

    @property
    def mode(self) -> str:
        """The working mode that the file names."""
        return "".join(getattr(leg, "branch", "") for leg in self.spec.legs) + self.structure.branches

    @property
    def has_modes(self) -> bool:
        """Whether the legs' inverse has choices."""
        return any(leg.branches for leg in self.spec.legs)

    @property
    def fixed_signs(self) -> list[int]:
        """Places of signs in a working mode that can't be others: of legs by whose joints motions are solved for."""
        if not self.structure.is_solved:
            return []
        carriers = {each.drive for each in self.spec.constraints if isinstance(each, RodConstraint)}
        places: list[int] = []
        place = 0
        for leg in self.spec.legs:
            if carriers & {drive.name for drive in leg.drives}:
                places += range(place, place + len(leg.branches))
            place += len(leg.branches)
        return places

    def split_mode(self, mode: str) -> tuple[list[str], str]:
        """Split a working mode into each leg's signs, and head and table's."""
        signs, rest = [], mode
        for leg in self.spec.legs:
            count = len(leg.branches)
            signs.append(rest[:count])
            rest = rest[count:]
        return signs, rest

    def compare_mode(self, pose: Sequence[Scalar], joints: Sequence[Scalar], mode: str) -> list[Scalar]:
        """Subtract given joints from the legs' joints in a working mode at a pose, its platform as they place it; mm.

        Angles are taken within half a turn, times an arm of :data:`ARM` of the greatest leg.
        """
        arm = ARM * max(self.sizes)

        def compare(unit: str, off: Scalar) -> Scalar:
            return atan2(*sincos(off)) * arm if unit == "rad" else off

        placed = self.structure.place_with_joints(pose, self.list_serial(joints))
        signs, _ = self.split_mode(mode)
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        own = group_joints_by_leg(self.spec, joints)
        return [
            compare(unit, q - given)
            for leg, point, s, all_given in zip(self.spec.legs, points, signs, own, strict=True)
            for unit, q, given in zip(leg.units, leg.inverse(point, s).joints, all_given, strict=True)
        ]

    def list_branch_margins(
        self, coordinates: Sequence[Scalar], joints: Sequence[Scalar], mode: str
    ) -> list[Scalar] | None:
        """List how clear of other working modes the legs' joints are, mm; None where a leg can't tell it."""
        signs, _ = self.split_mode(mode)
        points = compute_platform_points(self.spec, *self.structure.frame(coordinates))
        given = group_joints_by_leg(self.spec, joints)
        margins: list[Scalar] = []
        for leg, point, q, s in zip(self.spec.legs, points, given, signs, strict=True):
            own = leg.branch_margins(point, q, s) if leg.branches else []
            if own is None:
                return None
            margins += own
        return margins

    # The inverse problem, closures and margins.

    def invert(
        self, pose: Sequence[Scalar], mode: str, first: Scalar | None = None
    ) -> tuple[list[Scalar], PlatformPlacement, list[Inverse]]:
        """Compute the joint vector, placement and each leg's inverse for a pose."""
        placed = self.structure.place(pose, self.split_mode(mode)[1], first)
        legs = self.invert_legs(placed.rotation, placed.origin, mode)
        serial = self.drives[self.leg_count :]
        of_serial = [q - drive.offset for drive, q in zip(serial, placed.serial, strict=True)]
        return [*self.list_leg_joints(legs), *of_serial], placed, legs

    def list_leg_joints(self, inverses: Sequence[Inverse]) -> list[Scalar]:
        """List what the legs' drives say, in the order of the joint vector, for each leg's joints."""
        by_name = {
            drive.name: q - drive.offset
            for leg, inverse in zip(self.spec.legs, inverses, strict=True)
            for drive, q in zip(leg.drives, inverse.joints, strict=True)
        }
        return [by_name[drive.name] for drive in self.drives[: self.leg_count]]

    def invert_legs(self, rotation: Sequence[Vec], origin: Vec, mode: str) -> list[Inverse]:
        """Compute each leg's inverse with the platform placed."""
        points, (signs, _) = compute_platform_points(self.spec, rotation, origin), self.split_mode(mode)
        return [leg.inverse(point, s) for leg, point, s in zip(self.spec.legs, points, signs, strict=True)]

    def closures(self, rotation: Sequence[Vec], origin: Vec, joints: Sequence[Scalar]) -> list[Scalar]:
        """List every leg's closure, mm²."""
        points = compute_platform_points(self.spec, rotation, origin)
        given = group_joints_by_leg(self.spec, joints)
        return [f for leg, p, q in zip(self.spec.legs, points, given, strict=True) for f in leg.closures(p, q)]

    def scaled_closures(self, coordinates: Sequence[Scalar], joints: Sequence[Scalar]) -> list[Scalar]:
        """Compute every leg's closure in mm, from the motion's coordinates."""
        closures = self.closures(*self.structure.frame(coordinates), joints)
        return [c * (1.0 / size) for c, size in zip(closures, self.sizes, strict=True)]

    def compute_pose(self, coordinates: Sequence[Scalar], joints: Sequence[Scalar]) -> list[Scalar]:
        """Compute the pose; NaN where a leg closes otherwise than it is built, as a strut of negative length does.

        NaN too where coordinates write a frame a second way, in which their determinant has the other sign.
        """
        first, *others = self.structure.pose(coordinates, self.list_serial(joints))
        points = compute_platform_points(self.spec, *self.structure.frame(coordinates))
        given = group_joints_by_leg(self.spec, joints)
        margins = [
            m for leg, p, q in zip(self.spec.legs, points, given, strict=True) for m in leg.assembly_margins(p, q)
        ]
        margins += self.structure.list_coordinate_margins(coordinates)
        if margins:
            first = minimum(first, FAR + sqrt(reduce(minimum, margins)))
        return [first, *others]

    def margins(self, pose: Sequence[Scalar], joints: Sequence[Scalar], mode: str) -> list[tuple[Limit, Scalar]]:
        """List every limit with its margin, for a pose and the joints that a path takes there."""
        placed = self.structure.place_with_joints(pose, self.list_serial(joints))
        return self._margins(placed, joints, self.invert_legs(placed.rotation, placed.origin, mode))

    def own_margins(self, pose: Sequence[Scalar], mode: str) -> list[tuple[Limit, Scalar]]:
        """List every limit with its margin, for a pose and its inverse."""
        joints, placed, legs = self.invert(pose, mode)
        return self._margins(placed, joints, legs)

    def _margins(
        self, placed: PlatformPlacement, joints: Sequence[Scalar], legs: Sequence[Inverse]
    ) -> list[tuple[Limit, Scalar]]:
        home = self._cone_rods
        coordinates = self.structure.list_motion(placed)
        return list_limits(self.spec, placed, coordinates, joints, [leg.reach for leg in legs], home)

    @property
    def _cone_rods(self) -> HomeRods | None:
        """The rods at home, if cones need them."""
        return self.rods_at_home if any(cone.axis is None for cone in self.spec.limits.cones) else None

    def list_sign_forms(self, pose: Sequence[Scalar], mode: str) -> SignForms:
        """List what tells the signs of limits' margins at a pose; see :class:`~.limits.SignForms`."""
        joints, placed, _ = self.invert(pose, mode)
        return list_sign_forms(self.spec, placed, joints, self._cone_rods)

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        limits = tuple(limit for limit, _ in self.own_margins(self.home, self.mode))
        names = [limit.name for limit in limits]
        for name in names:
            if names.count(name) > 1:
                raise DescriptionError("limits", f"two are called {name}; rename the joint or join the limits")
        return limits

    def list_serial(self, joints: Sequence[Scalar]) -> list[Scalar]:
        """List the angles of head and table in a joint vector, offsets added."""
        serial = self.drives[self.leg_count :]
        return [q + drive.offset for drive, q in zip(serial, joints[self.leg_count :], strict=True)]

    def trace_constraint_rates(self, pose: Sequence[Scalar]) -> list[list[Scalar]]:
        """Compute the rates of the constraints at a pose; see :meth:`~.structures.Structure.list_constraint_rates`."""
        placed = self.structure.place(pose, self.structure.branches)
        return self.structure.list_constraint_rates(pose, placed.rotation, placed.origin)

    def compute_twist_rates(
        self, pose: Sequence[Scalar], joints: Sequence[Scalar], given: Sequence[Scalar] = ()
    ) -> TwistRates:
        """Compute A and B of the tool's twist; see :func:`~.rates.compute_twist_rates`."""
        return compute_twist_rates(self.spec, self.structure, pose, joints, given)

    def trace_twist_rows(self, pose: Sequence[Scalar], joints: Sequence[Scalar]) -> list[list[Scalar]]:
        """Trace A of the tool's twist alone."""
        return TwistTrace(self.spec, self.structure, pose, joints).a

    # Home.

    @cached_property
    def home(self) -> list[float]:
        return [0.0 + self.spec.home.get(letter, 0.0) for letter in self.axes]

    def _find_rods(self, placed: PlatformPlacement, joints: Sequence[Scalar]) -> list[tuple[Vec, Vec]]:
        """Find foot and end of each leg's first strut."""
        points = compute_platform_points(self.spec, placed.rotation, placed.origin)
        given = group_joints_by_leg(self.spec, joints)
        return [leg.struts(p, q)[0] for leg, p, q in zip(self.spec.legs, points, given, strict=True)]

    def list_feet(self, pose: Sequence[Scalar], mode: str) -> list[Vec]:
        """List where each strut is joined to the base at a pose, mm in the machine's frame."""
        joints, placed, _ = self.invert(pose, mode)
        points, given = compute_platform_points(self.spec, placed.rotation, placed.origin), self.group_joints(joints)
        struts = (s for leg, p, q in zip(self.legs, points, given, strict=True) for s in leg.struts(p, q))
        return [add(apply(self.structure.mount, foot), self.structure.base) for foot, _ in struts]

    def list_strut_distances(self, pose: Sequence[Scalar], mode: str) -> list[Scalar]:
        """List the distances of the axes of all pairs of struts that share no joint, at a pose, mm."""
        joints, placed, _ = self.invert(pose, mode)
        return [distance for _, distance in list_strut_distances(self.spec, placed, joints)]

    @cached_property
    def rods_at_home(self) -> HomeRods:
        joints, placed, _ = self.invert(self.home, self.mode)
        rods = self._find_rods(placed, joints)
        units = [scale(sub(point, foot), 1.0 / norm(sub(point, foot))) for foot, point in rods]
        back = transpose(placed.rotation)
        return HomeRods(tuple(units), tuple(apply(back, u) for u in units))

    @cached_property
    def sizes(self) -> list[float]:
        """A length a closure, mm: divided by it a closure is (no less than) the distance by which its leg is open."""
        joints, placed, _ = self.invert(self.home, self.mode)
        sizes = []
        for leg, (foot, end) in zip(self.spec.legs, self._find_rods(placed, joints), strict=True):
            sizes += [leg.size(find_nominal_value(norm(sub(end, foot))))] * len(leg.drives)
        return sizes

    # The direct problem in closed form.

    @cached_property
    def by_spheres(self) -> bool:
        """True where the direct problem is the common point of spheres or circles: no turns, one rod a leg."""
        turns = any(word in ROTATIONS for word in self.spec.motion)
        on_spheres = [leg.sphere([0.0] * len(leg.drives)) is not None for leg in self.spec.legs]
        return not turns and all(on_spheres) and len(on_spheres) in CENTRES_NEEDED and not self.is_redundant

    def find_spheres(self, joints: Sequence[Scalar]) -> tuple[list[Vec], list[Scalar], list[int]]:
        """Find centres and radii of the spheres that hold the platform's origin, and the coordinates it moves in."""
        centres, radii = [], []
        for leg, q in zip(self.spec.legs, group_joints_by_leg(self.spec, joints), strict=True):
            sphere = leg.sphere(q)
            assert sphere is not None
            centres.append(sub(sphere[0], leg.platform))
            radii.append(sphere[1])
        return centres, radii, [i for i, word in enumerate(("tx", "ty", "tz")) if word in self.spec.motion]

    def spheres(self, joints: Sequence[Scalar], side: Scalar | None, near: Vec | None = None) -> list[Scalar]:
        """Find the motion's coordinates by the common point of the legs' spheres; ``near`` picks the nearer of two."""
        centres, radii, plane = self.find_spheres(joints)
        return self.structure.coordinates_at(find_common_point(centres, radii, plane, side, near))

    @cached_property
    def home_side(self) -> float:
        """The side of the spheres' centres on which the platform is at home."""
        joints, placed, _ = self.invert(self.home, self.mode)
        centres, _, plane = self.find_spheres(joints)
        return 1.0 if measure_side(centres, plane, placed.origin) >= 0.0 else -1.0

    def measure_own_side(self, pose: Sequence[Scalar], mode: str) -> Scalar:
        """Measure on which side of the spheres' centres a pose lies with its own joints; NaN out of reach."""
        joints, placed, _ = self.invert(pose, mode)
        centres, _, plane = self.find_spheres(joints)
        return measure_side(centres, plane, placed.origin)
