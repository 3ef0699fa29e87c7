"""A machine as rigid bodies and joints: a tree that reaches from the base to every body, and loops that close it.

It is what simulators of mechanisms take. All stands as at home; lengths are mm, angles rad.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import Literal

import numpy as np

from ..arrays import Array
from ..machine import Machine
from ..model.chain import UNIT, compose_chain
from ..model.elements import ROTATIONS, BodyBuild, Drive, PlaneConstraint, RodConstraint, Step
from ..model.structures import PlatformPlacement
from .polygon import Points, order_polygon

WORLD = "world"
BASE = "base"
PLATFORM: str = "platform"
CENTRAL = "central"  # a central leg that turns every way, and what turns it

METRE = 1e-3  # of a millimetre: simulators count in metres

_NEAR = 1e-9  # mm; a body that ends nearer to its joint than this is a ball
_FREE = 5  # coordinates of a motion from which on nothing but its legs holds a platform


@dataclass(frozen=True, eq=False)
class BodyJoint:
    """What joins a body to the one that carries it.

    axis, pivot : (3,) in the body's frame; it slides along the axis, turns about it, or turns about the pivot
    value : of the coordinate at home, mm or rad; a ball has none
    low, high : the range of the coordinate
    """

    name: str
    kind: Literal["slide", "hinge", "ball", "free"]
    axis: Points
    pivot: Points
    value: float = 0.0
    low: float = -inf
    high: float = inf
    drive: Drive | None = None


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: where its frame is in its carrier's at home, its joints in their order, and what is seen of it.

    bars : (2, 3) each, in the body's frame; both ends at one place are a ball
    """

    name: str
    kind: str
    carrier: str
    rotation: Array
    origin: Points
    joints: tuple[BodyJoint, ...] = ()
    bars: tuple[Points, ...] = ()


@dataclass(frozen=True, eq=False)
class Loop:
    """A ball joint that closes a loop: a point of one body stays at a point of another, each in its body's frame."""

    name: str
    bodies: tuple[str, str]
    points: tuple[Points, Points]


@dataclass(frozen=True, eq=False)
class Multibody:
    """A machine's bodies, carriers first, its loops, and the frames between which a pose is measured.

    frames : body, rotation and origin in it, of ``tool`` and ``workpiece``
    drives : names of the joints that are driven, in the order of the joint vector
    builds : what bodies of a kind are made of, as far as it is stated
    size : a length that thicknesses follow, mm: the diagonal of the box about all bars at home
    """

    bodies: tuple[Body, ...]
    loops: tuple[Loop, ...]
    frames: dict[str, tuple[str, Array, Points]]
    drives: tuple[str, ...]
    size: float
    builds: Mapping[str, BodyBuild]


def build_multibody(machine: Machine) -> Multibody:
    """Build a machine's bodies and loops.

    Raises :class:`NoMethodError` where a leg's kind tells nothing of its bodies.
    """
    home = machine.home
    placement = machine.place_platform(home, machine.mode)
    joints = machine.inverse(home).tolist()
    structure = machine.structure
    serial = [float(angle) for angle in placement.serial]
    count = structure.head_joints
    head, tool = _build_chain("head", structure.head, serial[:count], PLATFORM)
    table, workpiece = _build_chain("table", structure.table, serial[count:], WORLD)
    base = Body(BASE, "base", WORLD, np.array(structure.mount, float), np.array(structure.base, float))
    platform = _build_platform(machine, placement, head[0].origin if head else tool[2])
    bodies, loops = [base, *_list_platform_bodies(platform)], []
    points = _locate_platform_joints(machine, placement)
    for number, own in enumerate(machine.group_joints(joints)):
        leg_bodies, leg_loops = _build_leg(machine, placement, number, points[number], own)
        bodies += leg_bodies
        loops += leg_loops
    rods = machine.locate_passive_rods(placement, machine.group_joints(joints))
    for number, constraint in enumerate(machine.constraints, 1):
        name = f"constraint{number}"
        if isinstance(constraint, RodConstraint):
            body, loop = _build_rod(machine, name, constraint, np.array(rods[name], float), bodies)
        else:
            body, loop = _build_plane(name, constraint, placement)
        bodies.append(body)
        loops.append(loop)
    frames = {"tool": tool, "workpiece": workpiece}
    every = (*bodies, *head, *table)
    return Multibody(every, tuple(loops), frames, machine.joints, _measure_size(every), machine.bodies)


def place_bodies(bodies: Sequence[Body]) -> dict[str, tuple[Array, Points]]:
    """Find rotation and origin of bodies in the machine's frame at home, by their names."""
    placed: dict[str, tuple[Array, Points]] = {WORLD: (np.eye(3), np.zeros(3))}
    for body in bodies:
        rotation, origin = placed[body.carrier]
        placed[body.name] = (rotation @ body.rotation, rotation @ body.origin + origin)
    return placed


def _measure_size(bodies: Sequence[Body]) -> float:
    placed = place_bodies(bodies)
    points = [bar @ placed[body.name][0].T + placed[body.name][1] for body in bodies for bar in body.bars]
    return float(np.linalg.norm(np.ptp(np.vstack(points), axis=0)))


def _build_platform(machine: Machine, placement: PlatformPlacement, head: Points) -> Body:
    """Build the platform with the joints of its motion, a passive leg's or what the legs leave it.

    head : (3,) where it carries the next body, or the tool's tip, in its frame
    """
    structure = machine.structure
    rotation, origin = np.array(placement.rotation, float), np.array(placement.origin, float)
    ring = order_polygon(_locate_platform_joints(machine, placement))
    corners = [*ring, ring[0]] if len(ring) != 2 else list(ring)
    bars = [np.array(pair) for pair in pairwise(corners)]
    if structure.has_central_leg:
        bars.append(np.array([np.zeros(3), -rotation.T @ origin]))
    if np.linalg.norm(head - ring.mean(axis=0)) > _NEAR:
        bars.append(np.array([ring.mean(axis=0), head]))
    bounds = {limit.name: limit.bound for limit in machine.limit_definitions}
    joints = []
    if len(structure.coordinates) >= _FREE or machine.constraints:
        joints.append(BodyJoint(PLATFORM, "free", np.zeros(3), np.zeros(3)))
        mount, base = np.array(structure.mount, float), np.array(structure.base, float)
        placed = mount @ rotation, mount @ origin + base
        return Body(PLATFORM, "platform", WORLD, *placed, tuple(joints), tuple(bars))
    before: list[Step] = []
    for word, value in structure.list_motion(placement):
        turned, pivot = compose_chain(before, ())
        turns, place = word in ROTATIONS, np.array(pivot if structure.has_central_leg else placement.origin, float)
        joints.append(
            BodyJoint(
                f"{PLATFORM}_{word}",
                "hinge" if turns else "slide",
                rotation.T @ np.array(turned, float) @ np.array(UNIT[word], float),
                rotation.T @ (place - origin),
                float(value),
                bounds.get(f"{word}.min", -inf),
                bounds.get(f"{word}.max", inf),
            )
        )
        before.append(Step(word, float(value)))
    return Body(PLATFORM, "platform", BASE, rotation, origin, tuple(joints), tuple(bars))


def _list_platform_bodies(platform: Body) -> list[Body]:
    """List a platform, before it a central leg that turns every way: its three turns are a ball, free of poles."""
    turns = [joint for joint in platform.joints if joint.kind == "hinge"]
    if len(turns) < 3:
        return [platform]
    ball = BodyJoint(CENTRAL, "ball", np.zeros(3), np.zeros(3))
    ends = np.array([np.zeros(3), platform.rotation.T @ platform.origin])
    leg = Body(CENTRAL, "rod", BASE, platform.rotation, np.zeros(3), (ball,), (ends,))
    slides = tuple(joint for joint in platform.joints if joint.kind == "slide")
    bars = tuple(bar for bar in platform.bars if np.ptp(bar + ends, axis=0).max() > _NEAR)  # the leg is one of its own
    return [leg, replace(platform, carrier=leg.name, rotation=np.eye(3), origin=ends[1], joints=slides, bars=bars)]


def _locate_platform_joints(machine: Machine, placement: PlatformPlacement) -> Points:
    """Locate every leg's joint (N, 3) in the platform's frame."""
    fixed = [leg.find_fixed_joint() for leg in machine.legs]
    placed = np.array(machine.place_leg_joints(placement), float)
    moving = (placed - np.array(placement.origin, float)) @ np.array(placement.rotation, float)
    return np.array([own if joint is None else joint for joint, own in zip(fixed, moving, strict=True)], float)


def _build_leg(
    machine: Machine, placement: PlatformPlacement, number: int, on_platform: Points, joints: list[float]
) -> tuple[list[Body], list[Loop]]:
    """Build a leg's bodies, which stand parallel to the base at home, and the loops that it closes.

    on_platform : (3,) the platform's joint in the platform's frame
    """
    leg = machine.legs[number]
    links = leg.links(machine.place_leg_joints(placement)[number], joints)
    names = [f"{leg.drives[0].name}_{i}" for i in range(len(links))]
    starts = [np.array(link.start, float) for link in links]
    bodies, loops = [], []
    for name, link, start in zip(names, links, starts, strict=True):
        end = np.array(link.end, float)
        carrier = BASE if link.carrier is None else names[link.carrier]
        origin = start if link.carrier is None else start - starts[link.carrier]
        axis = np.zeros(3) if link.axis is None else np.array(link.axis, float)
        if link.drive is None:
            joint = BodyJoint(name, link.joint, axis, np.zeros(3))
        else:
            drive = leg.drives[link.drive]
            value = joints[link.drive] - drive.offset
            joint = BodyJoint(drive.name, link.joint, axis, np.zeros(3), value, drive.low, drive.high, drive)
        is_carriage = np.linalg.norm(end - start) < _NEAR
        bar = np.array([np.zeros(3), end - start])
        bodies.append(Body(name, "carriage" if is_carriage else "rod", carrier, np.eye(3), origin, (joint,), (bar,)))
        if link.meets is None:
            continue
        if isinstance(link.meets, int):
            met, place = names[link.meets], end - starts[link.meets]
        elif link.meets == "ring":
            ring, along = _build_ring(f"{leg.drives[0].name}_ring", np.array(leg.platform, float), on_platform)
            bodies.append(ring)
            met, place = ring.name, on_platform - ring.origin
            # Two points of a hinge hold it as two ball joints.
            second = np.array(placement.rotation, float) @ along
            loops.append(Loop(f"{name}_{met}_hinge", (name, met), (end - start + second, place + along)))
        else:
            met, place = PLATFORM, on_platform
        loops.append(Loop(f"{name}_{met}", (name, met), (end - start, place)))
    return bodies, loops


def _build_ring(name: str, centre: Points, joint: Points) -> tuple[Body, Points]:
    """Build a ring that turns about the platform's z, and its hinge's direction, a tenth of its radius long."""
    arm = joint - centre
    turning = BodyJoint(name, "hinge", np.array(UNIT["rz"], float), np.zeros(3))
    bar = np.array([np.zeros(3), arm])
    return Body(name, "platform", PLATFORM, np.eye(3), centre, (turning,), (bar,)), 0.1 * np.cross(UNIT["rz"], arm)


def _build_rod(
    machine: Machine, name: str, rod: RodConstraint, ends: Points, bodies: Sequence[Body]
) -> tuple[Body, Loop]:
    """Build a passive rod from what carries its foot, and the ball joint that holds it to the platform.

    ends : (2, 3) in the base frame
    """
    carrier, start = BASE, np.zeros(3)
    if rod.drive is not None:
        moved = next(body for body in bodies if body.joints and body.joints[0].name == rod.drive)
        carrier, start = moved.name, _locate_in_base(moved, bodies)
    joint = BodyJoint(name, "ball", np.zeros(3), np.zeros(3))
    bar = np.array([np.zeros(3), ends[1] - ends[0]])
    body = Body(name, "rod", carrier, np.eye(3), ends[0] - start, (joint,), (bar,))
    return body, Loop(f"{name}_{PLATFORM}", (name, PLATFORM), (ends[1] - ends[0], np.array(rod.platform, float)))


def _locate_in_base(body: Body, bodies: Sequence[Body]) -> Points:
    """Locate the origin (3,) of a leg's body in the base frame; legs' bodies stand parallel to it."""
    if body.carrier == BASE:
        return body.origin
    carrier = next(other for other in bodies if other.name == body.carrier)
    return body.origin + _locate_in_base(carrier, bodies)


def _build_plane(name: str, constraint: PlaneConstraint, placement: PlatformPlacement) -> tuple[Body, Loop]:
    """Build a puck that slides in a constraint's plane, and the ball joint that holds it to the other body's point."""
    rotation, origin = np.array(placement.rotation, float), np.array(placement.origin, float)
    foot, platform = np.array(constraint.foot, float), np.array(constraint.platform, float)
    if constraint.plane_of == "base":
        carrier, other, place, point = BASE, PLATFORM, origin + rotation @ platform, platform
    else:
        carrier, other, place, point = PLATFORM, BASE, rotation.T @ (foot - origin), foot
    in_plane = np.linalg.svd(np.array(constraint.normal, float)[None])[2][1:]
    nowhere = np.zeros(3)
    joints = tuple(
        BodyJoint(f"{name}_{letter}", "slide", axis, nowhere) for letter, axis in zip("uv", in_plane, strict=True)
    )
    puck = Body(name, "carriage", carrier, np.eye(3), place, joints, (np.zeros((2, 3)),))
    return puck, Loop(name, (name, other), (nowhere, point))


def _build_chain(
    kind: str, steps: Sequence[Step], joints: Sequence[float], carrier: str
) -> tuple[list[Body], tuple[str, Array, Points]]:
    """Build a body for every driven step of a serial chain, and the frame at its end."""
    bodies: list[Body] = []
    fixed: list[Step] = []
    values = iter(joints)
    for step in steps:
        if step.drive is None:
            fixed.append(step)
            continue
        value = next(values)
        rotation, origin = _compose([*fixed, Step(step.axis, step.value + step.sign * value)])
        axis = step.sign * np.array(UNIT[step.axis], float)
        name = step.drive.name
        way: Literal["slide", "hinge"] = "hinge" if step.axis in ROTATIONS else "slide"
        joint = BodyJoint(name, way, axis, np.zeros(3), value, step.drive.low, step.drive.high, step.drive)
        bodies.append(Body(f"{name}_body", kind, carrier, rotation, origin, (joint,)))
        carrier, fixed = bodies[-1].name, []
    rotation, origin = _compose(fixed)
    ends = [body.origin for body in bodies[1:]] + [origin]
    spans = [(np.array([np.zeros(3), end]),) for end in ends]
    seen = [replace(body, bars=bars) for body, bars in zip(bodies, spans, strict=False)]
    return seen, (carrier, rotation, origin)


def _compose(steps: Sequence[Step]) -> tuple[Array, Points]:
    rotation, origin = compose_chain(steps, ())
    return np.array(rotation, float), np.array(origin, float)
