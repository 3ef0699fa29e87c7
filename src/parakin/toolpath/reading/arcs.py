"""Arcs to points: circular, helical and slightly spiral interpolation, mm and radians.

Errors name no file and no line; the reader adds both.
"""

import math

import numpy as np

from ...arrays import Array
from ..programmed_path import OPPOSITE
from .text import refuse

ON_CIRCLE = 0.01  # mm: further off its circle an arc's start or end is an error; covers coordinates of 3 decimals
CLOSED = 1e-6  # mm: an end this near the start is a full circle
_MOST_POINTS = 200_000  # greatest number of points of one arc
_WIDEST_STEP = math.pi / 4  # rad between two points, however coarse the tolerance
_ONE_DIAMETER = 1e-3  # sine of the angle between two radii; below this they lie on one diameter
_ALONG = 0.1  # cosine of the angle between tangent and circle; below this the tangent does not tell the way round


def find_arc_normal(start: Array, end: Array, centre: Array, tangent: Array) -> Array:
    """Find the unit normal (3,) of the circle through start and end about centre, for a motion along the tangent.

    The motion is right-handed about the normal and starts along the tangent.

    start, end, centre, tangent : (3,)
    """
    out = start - centre
    radius, length = float(np.linalg.norm(out)), float(np.linalg.norm(tangent))
    if radius == 0.0 or length == 0.0:
        refuse("a circle of radius zero, or INDIRV of length zero")
    out, along = out / radius, tangent / length
    normal = np.cross(out, (end - centre) / radius)
    # two rounded points fix the plane better than a rounded tangent, unless they lie on one diameter
    if np.linalg.norm(normal) < _ONE_DIAMETER:
        normal = np.cross(out, along)
    norm = float(np.linalg.norm(normal))
    forward = np.cross(normal, out) / norm if norm > _ONE_DIAMETER else np.zeros(3)
    agreement = float(forward @ along)
    if not abs(agreement) >= _ALONG:
        refuse("INDIRV does not point along the circle at the arc's start")
    return np.asarray(normal / norm * math.copysign(1.0, agreement))


def interpolate_arc(
    start: Array,
    end: Array,
    centre: Array,
    radius: float,
    normal: Array,
    tolerance: float,
    *,
    helix: bool,
    turns: int = 0,
) -> tuple[Array, Array]:
    """Divide an arc into points (k, 3) after its start, with the fraction of the turn at each (k,).

    The last one is ``end`` itself. The points between lie on the circle of the given centre and radius exactly.

    start, end, centre : (3,); normal : (3,) unit, the motion is right-handed about it
    tolerance : largest distance of a chord from the arc
    helix : whether start and end may lie at different heights along the normal; the height then grows with the turn
    turns : full turns before the arc's own
    """
    if not radius > 0.0:
        refuse(f"a circle of radius {radius:g}; expected a radius above zero")
    a, b = start - centre, end - centre
    height_a, height_b = float(a @ normal), float(b @ normal)
    a, b = a - height_a * normal, b - height_b * normal
    for name, flat, height in (("start", a, height_a), ("end", b, height_b)):
        off = math.hypot(float(np.linalg.norm(flat)) - radius, 0.0 if helix else height)
        if not off <= ON_CIRCLE:
            refuse(f"the arc's {name} lies {off:.4g} mm off its circle of radius {radius:.6g} mm")
    if not helix:
        height_a = height_b = 0.0
    u = a / np.linalg.norm(a)
    v = np.cross(normal, u)
    turn = math.atan2(float(b @ v), float(b @ u))
    turn = 2.0 * math.pi if abs(turn) * radius <= CLOSED else turn % (2.0 * math.pi)
    turn += 2.0 * math.pi * turns
    return interpolate_spiral(centre, (u, v, normal), (radius, radius), (height_a, height_b), turn, tolerance, end)


def interpolate_spiral(
    centre: Array,
    basis: tuple[Array, Array, Array],
    radii: tuple[float, float],
    heights: tuple[float, float],
    turn: float,
    tolerance: float,
    end: Array,
) -> tuple[Array, Array]:
    """Divide a circle, helix or slight spiral into points (k, 3), with the fraction of the turn at each (k,).

    They come after its start; the last one is ``end`` itself.

    basis : unit vectors (3,) at right angles: towards the start, along the motion there, along the axis of the turn
    radii, heights : at start and end; both grow with the turn
    turn : rad, above zero; more than one turn too
    tolerance : largest distance of a chord from the arc
    """
    u, v, normal = basis
    (radius, radius_end), (height, height_end) = radii, heights
    # a chord over the angle t is off by r (1 - cos(t/2)) = 2 r sin(t/4)^2; the sine keeps its digits for small t
    step = 4.0 * math.asin(min(math.sqrt(tolerance / (2.0 * max(radii))), math.sin(_WIDEST_STEP / 4)))
    if turn > step * _MOST_POINTS:
        refuse(f"an arc of more than {_MOST_POINTS} points at a tolerance of {tolerance:g} mm; expected a coarser one")
    count = max(1, math.ceil(turn / step))
    fraction = np.arange(1, count + 1) / count
    angle = (turn * fraction)[:, None]
    out = (radius + (radius_end - radius) * fraction)[:, None]
    points = centre + out * (np.cos(angle) * u + np.sin(angle) * v)
    points += (height + (height_end - height) * fraction)[:, None] * normal
    points[-1] = end
    return points, fraction


def interpolate_axis(first: Array, last: Array, fraction: Array) -> Array:
    """Turn a tool axis on the great circle from first to last, (3,) each: unit vectors (k, 3) at the fractions (k,)."""
    across = last - (first @ last) * first
    sine = float(np.linalg.norm(np.cross(first, last)))
    angle = math.atan2(sine, float(first @ last))
    if angle > math.pi - OPPOSITE:
        refuse("the tool axis turns round by 180 degrees on an arc; expected a definite way to turn it")
    if sine == 0.0:
        return np.repeat(last[None], len(fraction), axis=0)
    across /= np.linalg.norm(across)
    t = (angle * fraction)[:, None]
    axes = np.cos(t) * first + np.sin(t) * across
    axes[-1] = last
    return np.asarray(axes)
