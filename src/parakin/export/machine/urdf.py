"""A machine as a URDF, which knows trees only, and a JSON file beside it with the loops that close it.

Lengths are metres, masses kilograms. A driven joint has parakin's value. Joints that URDF does not know are chains of
those it does: a ball is three hinges, of which two are named ``_y`` and ``_z``.
"""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, isfinite, pi
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np

from ...arrays import Array
from ...dynamics.masses import NOTHING, BodyMass, compute_masses, find_radius
from ...dynamics.multibody import METRE, WORLD, Body, BodyJoint, Multibody, build_multibody
from ...dynamics.polygon import Points
from ...machine import Machine
from ...version import __version__

_LEAST_INERTIA, _LEAST_MASS = 1e-9, 1e-6  # kg m² and kg; a body without one is none to simulators
_EFFORT = 1e5  # N and N m: URDF asks for a bound of each drive's
_KINDS = {"slide": "prismatic", "hinge": "revolute", "free": "floating"}


def render_urdf(machine: Machine) -> tuple[str, str]:
    """Render a machine's tree as URDF, and its loops and drives as JSON."""
    multibody = build_multibody(machine)
    masses = compute_masses(multibody)
    root = Element("robot", name=machine.name)
    root.append(Comment(f" {machine.spec.title}; by parakin {__version__}. Loops are in {machine.name}_loops.json. "))
    SubElement(root, "link", name=WORLD)
    for body in multibody.bodies:
        carrier = body.carrier
        joints = body.joints or (BodyJoint(body.name, "free", np.zeros(3), np.zeros(3)),)
        steps = [step for joint in joints for step in _split_ball(joint)]
        frames = _place_joints(body, steps)
        for number, (joint, frame) in enumerate(zip(steps, frames, strict=True)):
            is_last = number == len(steps) - 1
            link = body.name if is_last else f"{body.name}_{joint.name}"
            kind = "fixed" if not body.joints else _KINDS[joint.kind]
            _add_joint(root, joint, kind, (carrier, link), frame)
            _add_link(root, link, (body, find_radius(multibody, body.kind), masses[body.name]) if is_last else None)
            carrier = link
    for name, (body_name, rotation, origin) in multibody.frames.items():
        frame = np.column_stack([rotation, origin])
        _add_joint(
            root, BodyJoint(f"{name}_frame", "free", np.zeros(3), np.zeros(3)), "fixed", (body_name, name), frame
        )
        SubElement(root, "link", name=name)
    indent(root)
    return tostring(root, encoding="unicode") + "\n", json.dumps(_encode_loops(machine, multibody), indent=2) + "\n"


def _encode_loops(machine: Machine, multibody: Multibody) -> dict[str, Any]:
    """Encode what URDF can't say: points of two links that stay together, metres, and home."""
    home = {
        joint.name: joint.value * (METRE if joint.kind == "slide" else 1.0)
        for body in multibody.bodies
        for joint in body.joints
        if joint.kind in ("slide", "hinge")
    }
    loops = [
        {"name": loop.name, "links": list(loop.bodies), "points": [(p * METRE).tolist() for p in loop.points]}
        for loop in multibody.loops
    ]
    head = {"schema": "parakin.loops/1", "machine": machine.name, "drives": list(machine.joints)}
    return {**head, "home": home, "loops": loops}


def _split_ball(joint: BodyJoint) -> list[BodyJoint]:
    """Split a ball joint into three hinges; other joints stay."""
    if joint.kind != "ball":
        return [joint]
    names = [joint.name, f"{joint.name}_y", f"{joint.name}_z"]
    return [
        replace(joint, name=name, kind="hinge", axis=axis, low=-inf, high=inf)
        for name, axis in zip(names, np.eye(3), strict=True)
    ]


def _place_joints(body: Body, joints: list[BodyJoint]) -> list[Array]:
    """Place each joint's frame (3, 4) in the one before, with the joint's zero where parakin has it, mm.

    A link stands where its hinge's pivot is; what follows is placed from there.
    """
    before = np.eye(4)
    before[:3, :3], before[:3, 3] = body.rotation, body.origin
    frames = []
    for joint in joints:
        placed, after = np.eye(4), np.eye(4)
        if joint.kind == "slide":
            placed[:3, 3] = -joint.value * joint.axis
        elif joint.kind == "hinge":
            placed[:3, :3], placed[:3, 3] = _rotate_about(joint.axis, -joint.value), joint.pivot
            after[:3, 3] = -joint.pivot
        frames.append((before @ placed)[:3])
        before = after
    return frames


def _rotate_about(axis: Points, angle: float) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix())


def _add_joint(root: Element, joint: BodyJoint, kind: str, links: tuple[str, str], frame: Array) -> None:
    from scipy.spatial.transform import Rotation

    is_endless = kind == "revolute" and not (isfinite(joint.low) and isfinite(joint.high))
    element = SubElement(root, "joint", {"name": joint.name, "type": "continuous" if is_endless else kind})
    turns = Rotation.from_matrix(frame[:, :3]).as_euler("xyz")
    SubElement(element, "origin", {"xyz": _format(frame[:, 3] * METRE), "rpy": _format(turns)})
    SubElement(element, "parent", link=links[0])
    SubElement(element, "child", link=links[1])
    if kind in ("prismatic", "revolute"):
        SubElement(element, "axis", xyz=_format(joint.axis))
        unit, wide = (METRE, 1e6) if kind == "prismatic" else (1.0, pi)
        low, high = (joint.low if isfinite(joint.low) else -wide), (joint.high if isfinite(joint.high) else wide)
        speed = joint.drive.speed if joint.drive is not None and isfinite(joint.drive.speed) else 1e3
        limits = {"lower": f"{low * unit:.12g}", "upper": f"{high * unit:.12g}"} if not is_endless else {}
        SubElement(element, "limit", {**limits, "effort": f"{_EFFORT:g}", "velocity": f"{speed * unit:.12g}"})


def _add_link(root: Element, name: str, seen: tuple[Body, float, BodyMass] | None) -> None:
    """Add a link with a body's bars as cylinders and balls of a radius, and its mass; a joint's own has nothing."""
    link = SubElement(root, "link", name=name)
    if seen is None:
        _add_inertia(link, NOTHING)
        return
    body, radius, mass = seen
    for start, end in body.bars:
        a, b = start * METRE, end * METRE
        length = float(np.linalg.norm(b - a))
        visual = SubElement(link, "visual")
        if length < radius * METRE:
            along, shape, sizes = np.array([0.0, 0.0, 1.0]), "sphere", {}
        else:
            along, shape, sizes = (b - a) / length, "cylinder", {"length": f"{length:.9g}"}
        SubElement(visual, "origin", {"xyz": _format(0.5 * (a + b)), "rpy": _format(_find_angles(along))})
        SubElement(SubElement(visual, "geometry"), shape, {"radius": f"{radius * METRE:.6g}", **sizes})
    _add_inertia(link, mass)


def _add_inertia(link: Element, mass: BodyMass) -> None:
    inertia = mass.inertia * METRE**2 + _LEAST_INERTIA * np.eye(3)
    element = SubElement(link, "inertial")
    SubElement(element, "origin", xyz=_format(mass.centre * METRE))
    SubElement(element, "mass", value=f"{max(mass.mass, _LEAST_MASS):.9g}")
    pairs = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    SubElement(element, "inertia", {key: f"{inertia[pair]:.9g}" for key, pair in pairs.items()})


def _find_angles(along: Points) -> Points:
    """Find roll, pitch and yaw that turn Z along a unit vector."""
    return np.array([0.0, np.arccos(np.clip(along[2], -1.0, 1.0)), np.arctan2(along[1], along[0])])


def _format(values: Points) -> str:
    return " ".join(f"{value + 0.0:.15g}" for value in np.asarray(values).tolist())
