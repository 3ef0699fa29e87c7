"""The arcs of G2 and G3: centre, turn and points. mm and radians; errors name no file and no line."""

import math
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....units import INCH
from ..arcs import CLOSED, interpolate_spiral
from ..text import refuse
from .codes import G17, G18, G19

# first and second axis, and the one that the turn is about; G3 is right-handed about it
PLANES = {G17: (0, 1, 2), G18: (2, 0, 1), G19: (1, 2, 0)}

# RS274/NGC as LinuxCNC has it: how far the radii at start and end may differ, and half a chord exceed its radius
_SPIRAL, _SPIRAL_INCH = 0.02 * math.sqrt(2.0), 0.002 * math.sqrt(2.0) * INCH  # mm
_SPIRAL_SHARE, _SPIRAL_MOST = 1e-3, 100.0  # of the radius; times the tolerance above
_SHORT = 5e-5 * INCH  # mm

Flat = tuple[float, float]  # a point in the plane


class ArcMotion(NamedTuple):
    """How an arc runs.

    centre : mm, in the plane's two axes
    plane : first and second axis, and the one that the turn is about
    clockwise : G2
    turns : how often the arc is begun: 1 for one that ends where it first meets its end
    """

    centre: Flat
    plane: tuple[int, int, int]
    clockwise: bool
    turns: int


def find_arc_centre(start: Flat, end: Flat, radius: float, clockwise: bool) -> Flat:
    """Find the centre of an arc given by R: less than half a turn for a radius above zero, more for one below."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(dx, dy)
    if chord <= CLOSED:
        refuse("a full circle by R has no definite centre; expected I, J or K")
    half, size = chord / 2.0, abs(radius)
    if not half - size <= _SHORT:
        refuse(
            f"an arc of radius {size:.6g} mm, but its end lies {chord:.6g} mm off its start; "
            f"expected a radius of {half:.6g} mm or more"
        )
    height = math.sqrt(max((size - half) * (size + half), 0.0))
    left = height if (radius > 0.0) != clockwise else -height  # of the chord, along the motion
    return (start[0] + end[0]) / 2.0 - left * dy / chord, (start[1] + end[1]) / 2.0 + left * dx / chord


def interpolate_g_arc(
    start: list[float], end: list[float], arc: ArcMotion, *, inches: bool, tolerance: float
) -> tuple[Array, Array]:
    """Divide an arc into points (k, 3) after its start, with the fraction of the turn at each (k,).

    The last one is ``end`` itself.

    start, end : X, Y, Z in mm; the one along the plane's axis may be unknown (NaN), and is so in the points then
    inches : whether the programmed unit is the inch, for what RS274/NGC tolerates
    tolerance : mm, of the chords
    """
    first, second, along = arc.plane
    ax, ay = start[first] - arc.centre[0], start[second] - arc.centre[1]
    bx, by = end[first] - arc.centre[0], end[second] - arc.centre[1]
    radius, radius_end = math.hypot(ax, ay), math.hypot(bx, by)
    _check_radii(radius, radius_end, inches)
    sense = -1.0 if arc.clockwise else 1.0
    turn = math.atan2(sense * (ax * by - ay * bx), ax * bx + ay * by)
    closed = abs(turn) * radius <= CLOSED
    turn = 2.0 * math.pi * arc.turns if closed else turn % (2.0 * math.pi) + 2.0 * math.pi * (arc.turns - 1)
    middle, u, v, normal = np.zeros((4, 3))
    middle[[first, second]] = arc.centre
    u[[first, second]] = ax / radius, ay / radius
    v[[first, second]] = -sense * ay / radius, sense * ax / radius
    normal[along] = 1.0
    low, high = start[along], end[along]
    known = low == low
    heights = (low, high) if known else (0.0, 0.0)
    points, fraction = interpolate_spiral(
        middle, (u, v, normal), (radius, radius_end), heights, turn, tolerance, np.where(np.isnan(end), 0.0, end)
    )
    if not known:
        points[:, along] = math.nan
    return points, fraction


def _check_radii(radius: float, radius_end: float, inches: bool) -> None:
    radii = f"the radius is {radius:.6g} mm at the start and {radius_end:.6g} mm at the end"
    if radius < _SHORT or radius_end < _SHORT:
        refuse(f"an arc without a radius: {radii}; expected I, J and K to lead from the start to the centre")
    off = abs(radius - radius_end)
    most = _SPIRAL_INCH if inches else _SPIRAL
    if off > most * _SPIRAL_MOST or (off > most and off > _SPIRAL_SHARE * max(radius, radius_end)):
        refuse(f"the arc's end is off its circle: {radii}; expected them to be equal")
