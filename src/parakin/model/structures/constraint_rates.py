"""How far constraints are from being kept, and how fast that changes with the platform's motion."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Mat, Scalar, Trace, Vec, add, apply, derivative, dot, evaluate_trace, product, sub
from ...errors import DescriptionError
from ..chain import make_small_rotation
from ..elements import TRANSLATIONS, PlaneConstraint, RodConstraint
from ..legs import Leg
from ..spec import Spec
from .base import PlatformPlacement


def find_carrier(spec: Spec, drive: str) -> tuple[Leg, int]:
    """Find the leg of a drive, and the drive's number in it.

    Raises :class:`DescriptionError` where its drives move nothing that a rod could stand on.
    """
    leg, number = next((leg, i) for leg in spec.legs for i, own in enumerate(leg.drives) if own.name == drive)
    if not leg.has_carriers:
        raise DescriptionError("constraints", f"on {drive}: legs of kind {leg.kind} have no carriage or arm")
    return leg, number


def locate_rod(
    spec: Spec, constraint: RodConstraint, rotation: Mat, origin: Vec, joints: Sequence[Sequence[Scalar]] | None = None
) -> tuple[Vec, Vec]:
    """Locate a passive rod's foot and its platform's joint, base frame, mm.

    joints : of each leg; without them those of the leg's inverse in its own working mode
    """
    point = add(origin, apply(rotation, constraint.platform))
    if constraint.drive is None:
        return constraint.foot, point
    leg, number = find_carrier(spec, constraint.drive)
    if joints is None:
        own = leg.inverse(leg.place_joint(rotation, origin), getattr(leg, "branch", "")).joints
    else:
        own = list(joints[spec.legs.index(leg)])
    return leg.carry(constraint.foot, own, number), point


def list_rods(spec: Spec) -> dict[str, RodConstraint]:
    """List the passive rods by their names, which number the constraints from 1."""
    numbered = enumerate(spec.constraints, 1)
    return {f"constraint{number}": each for number, each in numbered if isinstance(each, RodConstraint)}


def locate_passive_rods(
    spec: Spec, placement: PlatformPlacement, joints: Sequence[Sequence[Scalar]]
) -> dict[str, tuple[Vec, Vec]]:
    """Locate both ends of each passive rod by its name, base frame, for the joints of each leg."""
    frame = placement.rotation, placement.origin
    return {name: locate_rod(spec, rod, *frame, joints) for name, rod in list_rods(spec).items()}


def measure_constraint(spec: Spec, constraint: PlaneConstraint | RodConstraint, rotation: Mat, origin: Vec) -> Scalar:
    """Measure how far a constraint's point is from its plane, or the rod from its length, mm."""
    if isinstance(constraint, RodConstraint):
        foot, point = locate_rod(spec, constraint, rotation, origin)
        span = sub(point, foot)
        return (dot(span, span) - constraint.rod**2) * (0.5 / constraint.rod)
    span = sub(add(origin, apply(rotation, constraint.platform)), constraint.foot)
    normal = constraint.normal if constraint.plane_of == "base" else apply(rotation, constraint.normal)
    return dot(normal, span)


def list_rates(spec: Spec, rotation: Mat, origin: Vec, axes: Sequence[Vec]) -> list[list[Scalar]]:
    """List each constraint's rates by the parasitic translations, and by turns about ``axes`` (base frame).

    Turns are about the platform's origin. A rod on a carriage or arm moves with it, as the leg's inverse tells.
    """
    trace = Trace()
    moved, turned = trace.inputs(3), trace.inputs(len(axes), 3)
    frame = [trace.inputs(3, 3 + len(axes) + 3 * i) for i in range(4)]
    along = [trace.inputs(3, 15 + len(axes) + 3 * i) for i in range(len(axes))]
    x, y, z = (sum((t * axis[i] for t, axis in zip(turned, along, strict=True)), 0.0) for i in range(3))
    placed = product(make_small_rotation((x, y, z)), frame[:3]), add(frame[3], moved)
    variables = [moved[i] for i, word in enumerate(TRANSLATIONS) if word in spec.parasitic] + turned
    rates = [derivative(measure_constraint(spec, each, *placed), v) for each in spec.constraints for v in variables]
    at = [0.0] * (3 + len(axes)) + [entry for row in (*rotation, origin, *axes) for entry in row]
    values = evaluate_trace(trace, rates, at)
    count = len(variables)
    return [values[i : i + count] for i in range(0, len(values), count)]
