"""Every limit of a machine as a named margin g ≥ 0. This module alone says what is allowed.

The workspaces, the refusal of a tool path and the pictures all use these margins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations
from math import cos, inf, pi
from typing import Literal, NamedTuple

from ..algebra import (
    Mat,
    Scalar,
    Term,
    Vec,
    add,
    apply,
    atan2,
    cross,
    dot,
    maximum,
    minimum,
    norm,
    scale,
    stop_gradient,
    sub,
    transpose,
)
from ..errors import DescriptionError, quote, suggest
from .elements import MOTION_UNITS, Cone
from .legs import Reach
from .nominal_values import find_nominal_value
from .spec import Spec
from .structures import PlatformPlacement, list_rods, locate_passive_rods

_ONE_JOINT = 1.0  # mm: nearer points of two legs are one joint
_ONE_BEARING = 0.1  # of the clearance: so are these, for bearings so near could never keep it


@dataclass(frozen=True)
class Limit:
    """One limit: what it bounds, and how to read its margin (value = bound ± margin).

    name, subject : such as ``d1.max``, and what it is about in words, ``leg d1``
    unit : of margin and bound; mm² of a rod's reach, 1 where they have none
    side : whether it is the least or the greatest value that is bounded, or a reach
    bound : of a reach the rod's length, mm, 0 where it does not depend on one rod alone
    """

    name: str
    subject: str
    unit: Literal["mm", "rad", "mm²", "1"]
    side: Literal["min", "max", "reach"]
    bound: float = 0.0

    def value(self, margin: float) -> float:
        """Compute the bounded quantity for a ``margin``; for a reach the margin itself."""
        if self.side == "reach":
            return margin
        return self.bound - margin if self.side == "max" else self.bound + margin


def list_limits(
    spec: Spec,
    placement: PlatformPlacement,
    coordinates: Sequence[tuple[str, Scalar]],
    joints: Sequence[Scalar],
    reaches: Sequence[tuple[Reach, ...]],
    home: HomeRods | None,
) -> list[tuple[Limit, Scalar]]:
    """List all limits with their margins.

    placement : the platform's for a pose
    coordinates : the motion's, with their names
    joints : the joint vector
    reaches : each leg's own margins
    home : the rods at home; cones without an axis need them

    Reach comes first, so that no other limit is named where a leg can't close.
    """
    return [
        *_list_reach(spec, placement, reaches),
        *_list_drive_limits(spec, joints),
        *_list_passive_limits(spec, dict(coordinates)),
        *_list_gaps(spec, joints),
        *_list_cones(spec, placement, joints, home),
        *_list_clearances(spec, placement, joints),
    ]


@dataclass(frozen=True)
class HomeRods:
    """Unit rod directions of every leg at home: in the base frame, and in the platform's."""

    foot: tuple[Vec, ...]
    platform: tuple[Vec, ...]


def group_joints_by_leg(spec: Spec, joints: Sequence[Scalar]) -> list[list[Scalar]]:
    """Group the joint vector by leg, offsets added; ``joints`` may go on with those of head and table."""
    index = {drive.name: i for i, drive in enumerate(spec.drives)}
    return [[joints[index[drive.name]] + drive.offset for drive in leg.drives] for leg in spec.legs]


def compute_platform_points(spec: Spec, rotation: Mat, origin: Vec) -> list[Vec]:
    """Compute the platform's joint of every leg in the base frame, mm."""
    return [leg.place_joint(rotation, origin) for leg in spec.legs]


def _list_bounds(
    name: str, subject: str, unit: Literal["mm", "rad"], value: Scalar, low: float, high: float
) -> Iterator[tuple[Limit, Scalar]]:
    if low != -inf:
        yield Limit(f"{name}.min", subject, unit, "min", low), value - low
    if high != inf:
        yield Limit(f"{name}.max", subject, unit, "max", high), high - value


def _list_reach(
    spec: Spec, placement: PlatformPlacement, reaches: Sequence[tuple[Reach, ...]]
) -> Iterator[tuple[Limit, Scalar]]:
    for number, margin in enumerate(placement.constraint_reach):
        which = f" {number + 1}" if len(placement.constraint_reach) > 1 else ""
        yield Limit(f"constraints{which}.reach", f"the platform's constraints{which}", "1", "reach"), margin
    for margin in placement.reach:
        yield Limit("tool.reach", "the tool's axis", "1", "reach"), margin
    for leg, margins in zip(spec.legs, reaches, strict=True):
        for drive, reach in zip(leg.drives, margins, strict=False):
            yield Limit(f"{drive.name}.reach", f"leg {drive.name}", "mm²", "reach", reach.rod), reach.margin


def _list_drive_limits(spec: Spec, joints: Sequence[Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    legs = {drive.name for leg in spec.legs for drive in leg.drives}
    for drive, q in zip(spec.drives, joints, strict=True):
        subject = f"{'leg' if drive.name in legs else 'joint'} {drive.name}"
        yield from _list_bounds(drive.name, subject, drive.unit, q, drive.low, drive.high)


def _list_passive_limits(spec: Spec, coordinates: Mapping[str, Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    for bound in spec.limits.passive:
        unit = MOTION_UNITS[bound.name]
        yield from _list_bounds(
            bound.name, f"passive {bound.name}", unit, coordinates[bound.name], bound.low, bound.high
        )


def _list_gaps(spec: Spec, joints: Sequence[Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    position = {drive.name: q for drive, q in zip(spec.drives, joints, strict=True)}
    for gap in spec.limits.gaps:
        name = f"gap {gap.first}-{gap.second}"
        yield from _list_bounds(name, name, "mm", position[gap.second] - position[gap.first], gap.low, gap.high)


def _compute_rods(spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar]) -> list[list[tuple[Vec, Vec]]]:
    points = compute_platform_points(spec, placement.rotation, placement.origin)
    by_leg = group_joints_by_leg(spec, joints)
    return [leg.struts(point, q) for leg, point, q in zip(spec.legs, points, by_leg, strict=True)]


def _find_cone_axis(cone: Cone, number: int, home: HomeRods | None) -> Vec:
    if cone.axis is not None:
        return cone.axis
    assert home is not None
    return (home.foot if cone.at == "foot" else home.platform)[number]


def _list_cones(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar], home: HomeRods | None
) -> Iterator[tuple[Limit, Scalar]]:
    for limit, axis, rod in _list_tilted_rods(spec, placement, joints, home):
        yield limit, limit.bound - atan2(norm(cross(axis, rod)), dot(axis, rod))


def _list_tilted_rods(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar], home: HomeRods | None
) -> Iterator[tuple[Limit, Vec, Vec]]:
    """List the limits of cones, each with the cone's unit axis and the rod."""
    if not spec.limits.cones:
        return
    rods = [struts[0] for struts in _compute_rods(spec, placement, joints)]
    for cone in spec.limits.cones:
        for number, (leg, (foot, point)) in enumerate(zip(spec.legs, rods, strict=True)):
            axis = _find_cone_axis(cone, number, home)
            if cone.at == "platform":
                axis = apply(placement.rotation, axis)
            name = leg.drives[0].name
            limit = Limit(f"{name}.{cone.at}", f"{cone.at} joint of {name}", "rad", "max", cone.angle)
            yield limit, axis, sub(point, foot)


SegmentPair = tuple[tuple[Vec, Vec], tuple[Vec, Vec]]


class SignForms(NamedTuple):
    """What tells the signs of margins that intervals bound badly, by the limits' names.

    cones : what is ≥ 0 where the margin is, without the corner at the cone's axis
    struts : both ends of two struts that must be clear, in the base frame and in the platform's
    """

    cones: dict[str, Scalar]
    struts: dict[str, list[SegmentPair]]


def list_sign_forms(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar], home: HomeRods | None
) -> SignForms:
    """List the forms of cones narrower than half a turn and of clearances, whose bounds are numbers."""
    tilted = _list_tilted_rods(spec, placement, joints, home)
    cones = {
        limit.name: dot(axis, rod) - cos(limit.bound) * norm(rod)
        for limit, axis, rod in tilted
        if not isinstance(limit.bound, Term) and limit.bound < pi
    }
    back = transpose(placement.rotation)

    def turn_back(strut: _Strut) -> tuple[Vec, Vec]:
        """Place a strut in the platform's frame, where a joint of the platform stands still."""
        near, far = (apply(back, sub(end, placement.origin)) for end in strut.ends)
        return near if strut.platform is None else strut.platform, far

    is_number = spec.limits.clearance is not None and not isinstance(spec.limits.clearance, Term)
    pairs = _list_strut_pairs(spec, placement, joints) if is_number else ()
    struts = {
        f"clearance {names}": [(one.ends, two.ends), (turn_back(one), turn_back(two))] for names, one, two in pairs
    }
    return SignForms(cones, struts)


def _list_clearances(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar]
) -> Iterator[tuple[Limit, Scalar]]:
    least = spec.limits.clearance
    if least is None:
        return
    for names, distance in list_strut_distances(spec, placement, joints):
        yield Limit(f"clearance {names}", f"clearance of {names}", "mm", "min", least), distance - least


def list_strut_distances(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar]
) -> Iterator[tuple[str, Scalar]]:
    """List the distances of the axes of all pairs of struts that share no joint, with their names."""
    for names, one, two in _list_strut_pairs(spec, placement, joints):
        yield names, compute_segment_distance(one.ends, two.ends)


def _list_strut_pairs(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar]
) -> Iterator[tuple[str, _Strut, _Strut]]:
    joined = find_joined_struts(spec)
    for one, two in combinations(_list_struts(spec, placement, joints), 2):
        if (one.name, two.name) not in joined and (two.name, one.name) not in joined:
            yield f"{one.name}-{two.name}", one, two


def find_joined_struts(spec: Spec) -> tuple[tuple[str, str], ...]:
    """Find the pairs of struts that meet in a joint: those that the machine's file names, else nearly equal points."""
    ends = [(leg.drives[0].name, leg.find_fixed_joint(), leg.fixed_foot()) for leg in spec.legs]
    for name, rod in list_rods(spec).items():
        ends.append((name, rod.platform, rod.foot if rod.drive is None else None))
    if spec.limits.joined is not None:
        known = [name for name, _, _ in ends]
        for name in chain.from_iterable(spec.limits.joined):
            if name not in known:
                raise DescriptionError("limits", f"joined: unknown strut {quote(name)}{suggest(name, known)}")
        return spec.limits.joined
    nearest = max(_ONE_JOINT, _ONE_BEARING * find_nominal_value(spec.limits.clearance or 0.0))
    return tuple(
        (one, two)
        for (one, *own), (two, *other) in combinations(ends, 2)
        if any(
            a is not None and b is not None and norm([find_nominal_value(x) for x in sub(a, b)]) < nearest
            for a, b in zip(own, other, strict=True)
        )
    )


class _Strut(NamedTuple):
    """A strut that holds the platform: both ends in the base frame, and the platform's joint, None where it moves."""

    name: str
    ends: tuple[Vec, Vec]
    platform: Vec | None


def _list_struts(spec: Spec, placement: PlatformPlacement, joints: Sequence[Scalar]) -> list[_Strut]:
    """List the struts of legs and the passive rods.

    They begin at the platform, where neighbours are closest: the platform's position cancels in their differences.
    """
    rods = _compute_rods(spec, placement, joints)
    struts = [
        _Strut(leg.drives[0].name, own[0][::-1], leg.find_fixed_joint())
        for leg, own in zip(spec.legs, rods, strict=True)
    ]
    passive = locate_passive_rods(spec, placement, group_joints_by_leg(spec, joints))
    return [*struts, *(_Strut(name, passive[name][::-1], rod.platform) for name, rod in list_rods(spec).items())]


def compute_segment_distance(a: tuple[Vec, Vec], b: tuple[Vec, Vec]) -> Scalar:
    """Compute the least distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9), branch-free.

    Its rate is that of the gap along its direction, whose parts are never beyond 1: so its bounds over a span are
    finite where segments are nearly parallel, and where they are nearest is open.
    """
    u, v, w = sub(a[1], a[0]), sub(b[1], b[0]), sub(a[0], b[0])
    uu, vv, uv, uw, vw = dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)
    # A tiny part of |u|²|v|² avoids 0/0 for parallel segments, where any point is right.
    s = _clamp_fraction((uv * vw - uw * vv) / maximum(uu * vv - uv * uv, 1e-14 * (uu * vv)))
    t = _clamp_fraction((uv * s + vw) / vv)
    s = _clamp_fraction((uv * t - uw) / uu)
    gap = sub(add(w, scale(u, stop_gradient(s))), scale(v, stop_gradient(t)))
    distance = norm(gap)
    if isinstance(distance, Term):
        along = [maximum(minimum(x / distance, 1.0), -1.0) for x in gap]
        distance.trace.known_slopes[distance.index] = list(zip(along, gap, strict=True))
    return distance


def _clamp_fraction(x: Scalar) -> Scalar:
    return maximum(minimum(x, 1.0), 0.0)
