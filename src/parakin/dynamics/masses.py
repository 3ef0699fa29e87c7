"""The masses of a machine's bodies, from densities, and from thicknesses where the machine's file states none.

A body without stated sizes is as thick as it is drawn: bars are capsules, joints and carriages are balls.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..machine import Machine
from ..model.elements import BodyBuild
from .multibody import METRE, Body, Multibody, build_multibody
from .polygon import Points

# Densities, kg/m³: rods and carriages of steel, what they carry of aluminium.
DENSITIES = {"rod": 7850.0, "carriage": 7850.0, "platform": 2700.0, "head": 2700.0, "table": 2700.0}
# Radii over the machine's size, as drawn.
THICKNESS = {"base": 0.0055, "rod": 0.0060, "carriage": 0.0125, "platform": 0.0070, "head": 0.0110, "table": 0.0060}
DISC = 0.12  # of the machine's size: the radius of the disc on a driven table


class BodyMass(NamedTuple):
    """How a body resists acceleration.

    mass : kg
    centre : (3,) mm in the body's frame
    inertia : (3, 3) kg mm², about the centre, in the body's axes
    """

    mass: float
    centre: Points
    inertia: Array


_AS_DRAWN = BodyBuild()
TONNE = 1e3  # kg
NOTHING = BodyMass(0.0, np.zeros(3), np.zeros((3, 3)))


def compute_masses(multibody: Multibody) -> dict[str, BodyMass]:
    """Compute the mass of every body by its name."""
    return {body.name: _compute_mass(body, multibody) for body in multibody.bodies}


def sum_masses(machine: Machine) -> dict[str, float]:
    """Sum the masses of all bodies that move, kg, by their kind: rod, carriage, platform, head, table."""
    multibody = build_multibody(machine)
    masses = compute_masses(multibody)
    totals: dict[str, float] = {}
    for body in multibody.bodies:
        if masses[body.name].mass:
            totals[body.kind] = totals.get(body.kind, 0.0) + masses[body.name].mass
    return totals


def find_radius(multibody: Multibody, kind: str) -> float:
    """Find the radius of the bars of bodies of a kind, mm: as stated, else as drawn."""
    build = multibody.builds.get(kind, _AS_DRAWN)
    return THICKNESS[kind] * multibody.size if build.diameter is None else 0.5 * build.diameter


def _compute_mass(body: Body, multibody: Multibody) -> BodyMass:
    if not body.bars:
        return NOTHING
    build = multibody.builds.get(body.kind, _AS_DRAWN)
    density = DENSITIES[body.kind] * METRE**3 if build.density is None else build.density * TONNE  # kg/mm³
    radius = find_radius(multibody, body.kind)
    solids = [_weigh_bar(start, end, radius, density) for start, end in body.bars]
    if build.wall is not None:
        inner = radius - build.wall
        solids += [_weigh_hole(start, end, inner, density) for start, end in body.bars]
    carrier, rotation, origin = multibody.frames["workpiece"]
    if carrier == body.name:
        solids.append(_weigh_disc(rotation[:, 2], origin, DISC * multibody.size, radius, density))
    joined = _join(solids)
    factor = build.rods if build.mass is None else build.mass * TONNE / joined.mass
    return BodyMass(factor * joined.mass, joined.centre, factor * joined.inertia)


def _weigh_bar(start: Points, end: Points, radius: float, density: float) -> BodyMass:
    """Weigh a capsule between two points, or a ball where they are nearer than its radius."""
    length = float(np.linalg.norm(end - start))
    ball = density * 4.0 / 3.0 * pi * radius**3
    spin = 0.4 * ball * radius**2
    if length < radius:
        return BodyMass(ball, start, spin * np.eye(3))
    bar = density * pi * radius**2 * length
    swing = bar * (length**2 / 12.0 + radius**2 / 4.0) + spin + ball * (length**2 / 4.0 + 0.375 * length * radius)
    spin += 0.5 * bar * radius**2
    return BodyMass(bar + ball, 0.5 * (start + end), _turn_inertia((end - start) / length, spin, swing))


def _weigh_hole(start: Points, end: Points, radius: float, density: float) -> BodyMass:
    """Weigh what a tube lacks between its ends, negative; its balls stay full."""
    length = float(np.linalg.norm(end - start))
    mass = -density * pi * radius**2 * length
    if not mass:
        return BodyMass(0.0, start, np.zeros((3, 3)))
    axis = (end - start) / length
    inertia = _turn_inertia(axis, 0.5 * mass * radius**2, mass * (length**2 / 12.0 + radius**2 / 4.0))
    return BodyMass(mass, 0.5 * (start + end), inertia)


def _weigh_disc(axis: Points, origin: Points, radius: float, half: float, density: float) -> BodyMass:
    """Weigh a disc whose upper side's middle is ``origin``; it is twice ``half`` thick."""
    mass = density * pi * radius**2 * 2.0 * half
    swing = mass * (radius**2 / 4.0 + half**2 / 3.0)
    return BodyMass(mass, origin - half * axis, _turn_inertia(axis, 0.5 * mass * radius**2, swing))


def _turn_inertia(axis: Points, spin: float, swing: float) -> Array:
    """Make the inertia of a body that is round about a unit axis."""
    inertia: Array = swing * np.eye(3) + (spin - swing) * np.outer(axis, axis)
    return inertia


def _join(solids: list[BodyMass]) -> BodyMass:
    """Join solids to one body (Steiner)."""
    mass = sum(solid.mass for solid in solids)
    centre = sum((solid.mass * solid.centre for solid in solids), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for solid in solids:
        off = solid.centre - centre
        inertia += solid.inertia + solid.mass * (off @ off * np.eye(3) - np.outer(off, off))
    return BodyMass(mass, centre, inertia)
