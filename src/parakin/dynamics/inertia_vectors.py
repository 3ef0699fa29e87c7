"""A machine's bodies as vectors with weights, on scalars of any kind.

The kinetic energy of a rigid body is Σ ½ w |v'|² over four vectors v: its centre, weighted by its mass, and three unit
vectors along the principal axes of its second moments of mass, weighted by these. A round bar that does not spin about
itself has two: its centre, and its direction with the inertia across it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..algebra import ORIGIN, Mat, Scalar, Vec, add, apply, cross, move_along, norm, product, scale, sub, transpose
from ..arrays import Array
from ..errors import NoMethodError
from ..machine import Machine
from ..model.chain import compose_chain
from ..model.elements import PlaneConstraint, RodConstraint, Step
from ..model.equations import Equations
from ..model.legs import Leg, Link
from ..model.structures import PlatformPlacement
from .masses import BodyMass, compute_masses
from .multibody import CENTRAL, PLATFORM, build_multibody, place_bodies

_LEAST = 1e-12  # of a body's greatest second moment: a smaller one is rounding


class WeightedVector(NamedTuple):
    """A vector in M whose rate has the energy ½ weight·|v'|².

    weight : kg of a point, kg mm² of a unit vector
    falls : whether it is a point that has weight
    """

    weight: float
    vector: Vec
    falls: bool


class BodyFrame(NamedTuple):
    """Where a body is, in M.

    directions : unit vectors at right angles that turn with it: three; one for a round bar that does not spin about it;
        none for a body that does not turn
    """

    origin: Vec
    directions: tuple[Vec, ...]


def list_weighted_vectors(
    machine: Machine, equations: Equations, coordinates: Sequence[Scalar], joints: Sequence[Scalar]
) -> list[WeightedVector]:
    """List the vectors of all bodies for the motion's coordinates and joints, scalars of any kind.

    Raises :class:`NoMethodError` where a leg's kind tells nothing of its bodies, or not how each of them moves.
    """
    multibody = build_multibody(machine)
    masses = compute_masses(multibody)
    at_home = place_bodies(multibody.bodies)
    home = machine.place_platform(machine.home, machine.mode)
    home_joints = machine.inverse(machine.home).tolist()
    frames_at_home = dict(_list_frames(equations, machine.constraints, home.coordinates, home_joints))
    lost = {body.name for body in multibody.bodies if body.joints} - set(frames_at_home)
    if lost:
        raise NoMethodError(f"it is not known how {', '.join(sorted(lost))} moves")
    vectors: list[WeightedVector] = []
    for name, frame in _list_frames(equations, machine.constraints, coordinates, joints):
        if name not in masses:
            continue  # a central leg that is part of its platform
        home_frame = frames_at_home[name]
        vectors += _list_body_vectors(masses[name], at_home[name], home_frame, frame)
    return vectors


def _list_body_vectors(
    mass: BodyMass, placed: tuple[Array, Array], at_home: BodyFrame, frame: BodyFrame
) -> Iterator[WeightedVector]:
    """List a body's vectors, whose shape in its frame follows from where it is at home."""
    rotation, origin = placed
    off = rotation @ mass.centre + origin - np.array(at_home.origin, float)
    inertia = rotation @ mass.inertia @ rotation.T
    axes = np.array(at_home.directions, float).reshape(-1, 3)
    centre = frame.origin
    if not frame.directions:
        centre = add(centre, tuple(off.tolist()))
    for axis, direction in zip(axes, frame.directions, strict=True):
        centre = move_along(centre, direction, float(axis @ off))
    yield WeightedVector(mass.mass, centre, True)
    if len(axes) == 1:
        (axis,) = axes
        across = 0.5 * float(np.trace(inertia) - axis @ inertia @ axis)
        yield WeightedVector(across, frame.directions[0], False)
    if len(axes) == 3:
        moments = axes @ (0.5 * np.trace(inertia) * np.eye(3) - inertia) @ axes.T
        sizes, own = np.linalg.eigh(moments)
        for size, column in zip(sizes.tolist(), own.T.tolist(), strict=True):
            if size > _LEAST * sizes[-1]:
                yield WeightedVector(size, apply(transpose(frame.directions), column), False)


def _list_frames(
    equations: Equations,
    constraints: Sequence[PlaneConstraint | RodConstraint],
    coordinates: Sequence[Scalar],
    joints: Sequence[Scalar],
) -> Iterator[tuple[str, BodyFrame]]:
    """List where all bodies are that move, by the names that :func:`build_multibody` gives them."""
    structure = equations.structure
    rotation, origin = structure.frame(coordinates)

    def to_machine(point: Vec) -> Vec:
        return add(apply(structure.mount, point), structure.base)

    turned = product(structure.mount, rotation)
    platform = BodyFrame(to_machine(origin), tuple(transpose(turned)))
    yield PLATFORM, platform
    if structure.has_central_leg:
        yield CENTRAL, BodyFrame(to_machine(ORIGIN), platform.directions)
    placement = PlatformPlacement(rotation, origin, [], [])
    points, of_legs = equations.place_leg_joints(placement), equations.group_joints(joints)
    for leg, point, own in zip(equations.legs, points, of_legs, strict=True):
        for name, frame in _list_leg_frames(leg, rotation, origin, point, own):
            directions = tuple(apply(structure.mount, direction) for direction in frame.directions)
            yield name, BodyFrame(to_machine(frame.origin), directions)
    rods = equations.locate_passive_rods(placement, of_legs)
    for number, constraint in enumerate(constraints, 1):
        name = f"constraint{number}"
        if isinstance(constraint, RodConstraint):
            start, end = (to_machine(point) for point in rods[name])
            yield name, BodyFrame(end, (_normalise(sub(end, start)),))
        elif constraint.plane_of == "base":
            yield name, BodyFrame(to_machine(add(origin, apply(rotation, constraint.platform))), ())
        else:
            yield name, BodyFrame(to_machine(constraint.foot), platform.directions)
    serial = equations.list_serial(joints)
    count = structure.head_joints
    yield from _list_chain_frames(structure.head, serial[:count], (turned, platform.origin))
    yield from _list_chain_frames(structure.table, serial[count:], compose_chain((), ()))


def _list_leg_frames(
    leg: Leg, rotation: Mat, origin: Vec, point: Vec, joints: list[Scalar]
) -> Iterator[tuple[str, BodyFrame]]:
    """List where a leg's bodies are, in the base frame; what does not change its length hangs on its end."""
    links, name = leg.links(point, joints), leg.drives[0].name
    hinge: Vec | None = None
    for link in links:
        if link.meets == "ring":
            z = tuple(row[2] for row in rotation)
            centre = add(origin, apply(rotation, leg.platform))
            arm = _normalise(sub(point, centre))
            hinge = cross(z, arm)
            yield f"{name}_ring", BodyFrame(centre, (arm, hinge, z))
    directions: list[tuple[Vec, ...]] = []
    for number, link in enumerate(links):
        directions.append(_find_directions(link, directions, hinge))
        yield f"{name}_{number}", BodyFrame(link.end, directions[-1])


def _find_directions(link: Link, before: list[tuple[Vec, ...]], hinge: Vec | None) -> tuple[Vec, ...]:
    """Find the directions that turn with a link, from those of the links before it.

    hinge : direction of the hinge that holds the leg's strut to its ring
    """
    if link.joint == "slide":
        return () if link.carrier is None else before[link.carrier]
    along = link.axis if link.joint == "ball" and link.axis is not None else _normalise(sub(link.end, link.start))
    across = link.axis if link.joint == "hinge" else hinge
    assert along is not None
    return (along,) if across is None else (along, across, cross(along, across))


def _normalise(vector: Vec) -> Vec:
    return scale(vector, 1.0 / norm(vector))


def _list_chain_frames(
    steps: Sequence[Step], joints: Sequence[Scalar], start: tuple[Mat, Vec]
) -> Iterator[tuple[str, BodyFrame]]:
    """List where the bodies of a serial chain are, one for each driven step, in M."""
    driven = 0
    for count, step in enumerate(steps, 1):
        if step.drive is None:
            continue
        driven += 1
        rotation, origin = compose_chain(steps[:count], joints[:driven])
        place = add(start[1], apply(start[0], origin))
        yield f"{step.drive.name}_body", BodyFrame(place, tuple(transpose(product(start[0], rotation))))
