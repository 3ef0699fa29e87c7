"""Every limit of a machine as a named margin g ≥ 0: the one place that says what is allowed.

The Boolean workspace, the refusal of a tool path and the pictures all come from these margins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite
from typing import Literal

from ..algebra import Mat, Scalar, Vec, add, apply, atan2, cross, dot, held, larger, norm, scale, smaller, sub
from .legs import Leg, Reach
from .parts import Cone
from .spec import Spec
from .structures import PlatformPlacement


@dataclass(frozen=True)
class Limit:
    """One margin: what it is of, its bound, and how to read it (value = bound ± margin).

    The bound of a reach is the rod's length, 0 where it is no matter of one rod.
    """

    name: str
    subject: str
    unit: Literal["mm", "rad", "mm²", "1"]
    side: Literal["min", "max", "reach"]
    bound: float = 0.0

    def value(self, margin: float) -> float:
        """The bounded quantity for a margin; for a reach the margin itself."""
        if self.side == "reach":
            return margin
        return self.bound - margin if self.side == "max" else self.bound + margin


def limits_of(
    spec: Spec,
    pose: PlatformPlacement,
    coordinates: Sequence[tuple[str, Scalar]],
    joints: Sequence[Scalar],
    reaches: Sequence[tuple[Reach, ...]],
    home: Home | None,
) -> list[tuple[Limit, Scalar]]:
    """All limits with their margins.

    ``coordinates`` are the motion's, with their names; ``reaches`` each leg's own margins; ``home`` is needed by cones
    without an axis.

    Reach comes first, so that a pose where a leg can't close is never blamed on something that follows from it.
    """
    return [
        *_reach(spec, pose, reaches),
        *_drives(spec, joints),
        *_passive(spec, dict(coordinates)),
        *_gaps(spec, joints),
        *_cones(spec, pose, joints, home),
        *_clearance(spec, pose, joints),
    ]


@dataclass(frozen=True)
class Home:
    """Unit rod directions of every leg at home: in the base frame, and in the platform's."""

    foot: tuple[Vec, ...]
    platform: tuple[Vec, ...]


def leg_joints(spec: Spec, joints: Sequence[Scalar]) -> list[list[Scalar]]:
    """The joint vector, leg by leg (``joints`` may go on with those of head and table)."""
    index = {drive.name: i for i, drive in enumerate(spec.drives)}
    return [[joints[index[drive.name]] for drive in leg.drives] for leg in spec.legs]


def platform_points(spec: Spec, rotation: Mat, origin: Vec) -> list[Vec]:
    """The platform's joint of every leg in the base frame."""
    return [add(origin, apply(rotation, leg.platform)) for leg in spec.legs]


def _between(
    name: str, subject: str, unit: Literal["mm", "rad"], value: Scalar, low: float, high: float
) -> Iterator[tuple[Limit, Scalar]]:
    if isfinite(low):
        yield Limit(f"{name}.min", subject, unit, "min", low), value - low
    if isfinite(high):
        yield Limit(f"{name}.max", subject, unit, "max", high), high - value


def _reach(spec: Spec, pose: PlatformPlacement, reaches: Sequence[tuple[Reach, ...]]) -> Iterator[tuple[Limit, Scalar]]:
    for margin in pose.reach:
        yield Limit("tool.reach", "the tool's axis", "1", "reach"), margin
    for leg, margins in zip(spec.legs, reaches, strict=True):
        for drive, reach in zip(leg.drives, margins, strict=False):
            yield Limit(f"{drive.name}.reach", f"leg {drive.name}", "mm²", "reach", reach.rod), reach.margin


def _drives(spec: Spec, joints: Sequence[Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    legs = {drive.name for leg in spec.legs for drive in leg.drives}
    for drive, q in zip(spec.drives, joints, strict=True):
        subject = f"{'leg' if drive.name in legs else 'joint'} {drive.name}"
        yield from _between(drive.name, subject, drive.unit, q, drive.low, drive.high)


def _passive(spec: Spec, given: Mapping[str, Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    for bound in spec.limits.passive:
        unit: Literal["mm", "rad"] = "mm" if bound.name.startswith("t") else "rad"
        yield from _between(bound.name, f"passive {bound.name}", unit, given[bound.name], bound.low, bound.high)


def _gaps(spec: Spec, joints: Sequence[Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    given = {drive.name: q for drive, q in zip(spec.drives, joints, strict=True)}
    for gap in spec.limits.gaps:
        name = f"gap {gap.first}-{gap.second}"
        yield from _between(name, name, "mm", given[gap.second] - given[gap.first], gap.low, gap.high)


def _rods(spec: Spec, pose: PlatformPlacement, joints: Sequence[Scalar]) -> list[list[tuple[Vec, Vec]]]:
    points = platform_points(spec, pose.rotation, pose.origin)
    given = leg_joints(spec, joints)
    return [leg.struts(point, q) for leg, point, q in zip(spec.legs, points, given, strict=True)]


def _cone_axis(cone: Cone, number: int, home: Home | None) -> Vec:
    if cone.axis is not None:
        return cone.axis
    assert home is not None
    return (home.foot if cone.at == "foot" else home.platform)[number]


def _cones(
    spec: Spec, pose: PlatformPlacement, joints: Sequence[Scalar], home: Home | None
) -> Iterator[tuple[Limit, Scalar]]:
    if not spec.limits.cones:
        return
    rods = [struts[0] for struts in _rods(spec, pose, joints)]
    for cone in spec.limits.cones:
        for number, (leg, (foot, point)) in enumerate(zip(spec.legs, rods, strict=True)):
            axis = _cone_axis(cone, number, home)
            if cone.at == "platform":
                axis = apply(pose.rotation, axis)
            rod = sub(point, foot)
            angle = atan2(norm(cross(axis, rod)), dot(axis, rod))
            name = leg.drives[0].name
            limit = Limit(f"{name}.{cone.at}", f"{cone.at} joint of {name}", "rad", "max", cone.angle)
            yield limit, cone.angle - angle


def _clearance(spec: Spec, pose: PlatformPlacement, joints: Sequence[Scalar]) -> Iterator[tuple[Limit, Scalar]]:
    least = spec.limits.clearance
    if least is None:
        return
    # From the platform's end, where neighbours are closest: there the platform's place drops out of their difference.
    struts = [struts[0][::-1] for struts in _rods(spec, pose, joints)]
    for (one, a), (two, b) in combinations(zip(spec.legs, struts, strict=True), 2):
        if _share_a_joint(one, two):
            continue
        names = f"{one.drives[0].name}-{two.drives[0].name}"
        yield Limit(f"clearance {names}", f"clearance of {names}", "mm", "min", least), distance(a, b) - least


def _share_a_joint(one: Leg, two: Leg) -> bool:
    return one.platform == two.platform or (one.held_at() is not None and one.held_at() == two.held_at())


def distance(a: tuple[Vec, Vec], b: tuple[Vec, Vec]) -> Scalar:
    """Least distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9), branch-free."""
    u, v, w = sub(a[1], a[0]), sub(b[1], b[0]), sub(a[0], b[0])
    uu, vv, uv, uw, vw = dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)
    # A tiny share of |u|²|v|² keeps parallel segments from 0/0; any point serves for those.
    s = _clamped((uv * vw - uw * vv) / larger(uu * vv - uv * uv, 1e-14 * (uu * vv)))
    t = _clamped((uv * s + vw) / vv)
    s = _clamped((uv * t - uw) / uu)
    return norm(sub(add(w, scale(u, held(s))), scale(v, held(t))))


def _clamped(x: Scalar) -> Scalar:
    return larger(smaller(x, 1.0), 0.0)
