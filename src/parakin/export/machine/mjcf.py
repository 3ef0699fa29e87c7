"""A machine as a MuJoCo model: bodies with masses, loops closed by constraints, limits, and a servo for each drive.

MuJoCo counts in metres and kilograms. The model stands as at home where it is loaded, and a joint that is driven has
parakin's value, in metres or rad. The sensors ``tool_position`` and ``tool_orientation`` are the tool's frame in the
workpiece's, which is what a pose tells.
"""

from __future__ import annotations

from math import isfinite
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np

from ...arrays import Array
from ...dynamics.inverse_dynamics import GRAVITY
from ...dynamics.masses import DENSITIES, DISC, TONNE, BodyMass, compute_masses, find_radius
from ...dynamics.multibody import METRE, WORLD, Body, BodyJoint, Multibody, build_multibody
from ...dynamics.polygon import Points
from ...machine import Machine
from ...version import __version__
from .solids import LOOKS

_TIME_STEP = "0.0005"  # s
_STIFF = {"solref": "0.001 1", "solimp": "0.999 0.9999 0.001 0.5 2"}  # of loops: two time steps, nearly rigid
_SERVO = {"slide": 1e6, "hinge": 1e5}  # N/m and N m/rad of a drive: far stiffer than these weights ask for
_ARMATURE = {"slide": "1", "hinge": "0.1"}  # kg and kg m² of a drive, which alone swings at 1000 rad/s
_DAMPING = {"ball": "0.05", "hinge": "0.05", "slide": "5"}  # N m s/rad and N s/m, of joints that no drive moves


def render_mjcf(machine: Machine) -> str:
    """Render a machine as a MuJoCo model, XML."""
    multibody = build_multibody(machine)
    masses = compute_masses(multibody)
    root = Element("mujoco", model=machine.name)
    root.append(Comment(f" {machine.spec.title}; by parakin {__version__}. Metres, kilograms, radians. "))
    SubElement(root, "compiler", angle="radian", autolimits="true")
    solver = {"integrator": "implicitfast", "iterations": "200", "tolerance": "1e-12"}
    SubElement(root, "option", {"timestep": _TIME_STEP, "gravity": f"0 0 {-GRAVITY * METRE:.9g}", **solver})
    _add_defaults(root)
    world = SubElement(root, "worldbody")
    SubElement(world, "light", pos=_format(np.array([0.0, 0.0, 2.0 * multibody.size * METRE])), directional="true")
    elements = {WORLD: world}
    for body in multibody.bodies:
        elements[body.name] = _add_body(
            elements[body.carrier], body, masses[body.name], find_radius(multibody, body.kind)
        )
    for name, (carrier, rotation, origin) in multibody.frames.items():
        SubElement(elements[carrier], "site", name=name, pos=_format(origin * METRE), quat=_format_turn(rotation))
    _add_table_disc(elements, multibody)
    _add_loops(root, elements, multibody)
    _add_drives(root, multibody)
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _add_defaults(root: Element) -> None:
    """Add what all bodies of a kind share: no contacts, density and colour."""
    default = SubElement(root, "default")
    SubElement(default, "geom", contype="0", conaffinity="0")
    SubElement(default, "equality", _STIFF)
    for kind, density in DENSITIES.items():
        of_kind = SubElement(default, "default", {"class": kind})
        SubElement(of_kind, "geom", density=f"{density:g}", rgba=_format_colour(LOOKS[kind].colour))


def _add_body(carrier: Element, body: Body, mass: BodyMass, radius: float) -> Element:
    placed = {"pos": _format(body.origin * METRE), "quat": _format_turn(body.rotation)}
    element = SubElement(carrier, "body", {"name": body.name, **placed})
    for joint in body.joints:
        _add_joint(element, joint)
    if body.bars:
        _add_inertia(element, mass)
    for start, end in body.bars:
        look = {"class": body.kind}
        if np.linalg.norm(end - start) < radius:
            SubElement(element, "geom", look, type="sphere", size=f"{radius * METRE:.16g}", pos=_format(start * METRE))
        else:
            ends = _format(np.concatenate([start, end]) * METRE)
            SubElement(element, "geom", look, type="capsule", size=f"{radius * METRE:.16g}", fromto=ends)
    return element


def _add_inertia(element: Element, mass: BodyMass) -> None:
    j = mass.inertia * METRE**2
    numbers = np.array([j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2]])
    given = {"pos": _format(mass.centre * METRE), "mass": f"{mass.mass:.16g}", "fullinertia": _format(numbers)}
    SubElement(element, "inertial", given)


def _add_joint(body: Element, joint: BodyJoint) -> None:
    if joint.kind == "free":
        SubElement(body, "freejoint", name=joint.name)
        return
    given = {"name": joint.name, "type": joint.kind}
    if joint.drive is None:
        given["damping"] = _DAMPING[joint.kind]
    else:
        stated = joint.drive.inertia * TONNE * (1.0 if joint.kind == "slide" else METRE**2)
        given["armature"] = f"{stated:.16g}" if stated else _ARMATURE[joint.kind]
    if joint.kind != "ball":
        unit = METRE if joint.kind == "slide" else 1.0
        given |= {
            "axis": _format(joint.axis),
            "pos": _format(joint.pivot * METRE),
            "ref": f"{joint.value * unit:.16g}",
        }
        if isfinite(joint.low) and isfinite(joint.high):
            given["range"] = f"{joint.low * unit:.12g} {joint.high * unit:.12g}"
    SubElement(body, "joint", given)


def _add_table_disc(elements: dict[str, Element], multibody: Multibody) -> None:
    body, rotation, origin = multibody.frames["workpiece"]
    if body == WORLD:
        return
    half = find_radius(multibody, "table") * METRE
    place = {"pos": _format(origin * METRE - rotation[:, 2] * half), "quat": _format_turn(rotation)}
    disc = f"{DISC * multibody.size * METRE:.16g} {half:.16g}"
    SubElement(elements[body], "geom", {"class": "table", "type": "cylinder", "size": disc, **place})


def _add_loops(root: Element, elements: dict[str, Element], multibody: Multibody) -> None:
    equality = SubElement(root, "equality")
    for loop in multibody.loops:
        sites = [f"{loop.name}_a", f"{loop.name}_b"]
        for body, site, point in zip(loop.bodies, sites, loop.points, strict=True):
            SubElement(elements[body], "site", name=site, pos=_format(point * METRE), size="0.001")
        SubElement(equality, "connect", name=loop.name, site1=sites[0], site2=sites[1])


def _add_drives(root: Element, multibody: Multibody) -> None:
    """Add a servo for each drive, in the order of the joint vector, the pose's sensors, and home."""
    actuator, home = SubElement(root, "actuator"), []
    driven = {joint.name: joint for body in multibody.bodies for joint in body.joints if joint.drive is not None}
    for name in multibody.drives:
        joint = driven[name]
        given = {"name": name, "joint": name, "kp": f"{_SERVO[joint.kind]:g}", "dampratio": "1"}
        if isfinite(joint.low) and isfinite(joint.high):
            given["inheritrange"] = "1"
        SubElement(actuator, "position", given)
        home.append(joint.value * (METRE if joint.kind == "slide" else 1.0))
    sensor = SubElement(root, "sensor")
    frame = {"objtype": "site", "objname": "tool", "reftype": "site", "refname": "workpiece"}
    SubElement(sensor, "framepos", {"name": "tool_position", **frame})
    SubElement(sensor, "framequat", {"name": "tool_orientation", **frame})
    SubElement(SubElement(root, "keyframe"), "key", name="home", ctrl=_format(np.array(home)))


def _format(values: Points) -> str:
    """Format numbers in full, without a sign of zero."""
    return " ".join(f"{value + 0.0:.16g}" for value in values.tolist())


def _format_colour(colour: str) -> str:
    shares = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    return " ".join(f"{share:.3g}" for share in [*shares, 1.0])


def _format_turn(rotation: Array) -> str:
    """Format a rotation as a unit quaternion w x y z."""
    from scipy.spatial.transform import Rotation

    return _format(np.roll(Rotation.from_matrix(rotation).as_quat(), 1))
