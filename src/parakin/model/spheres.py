"""Intersection of three spheres, or of two circles in a coordinate plane.

This is the direct problem, in closed form, of machines that only translate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..algebra import Scalar, Vec, add, copysign, cross, dot, scale, sqrt, sub

CENTRES_NEEDED = (2, 3)
_UPRIGHT = 0.05  # least area that three centres span at right angles to the rails, of their edges' product


def find_common_point(
    centres: Sequence[Vec], radii: Sequence[Scalar], plane: Sequence[int], side: Scalar | None, near: Vec | None
) -> Vec:
    """Find the point at ``radii`` from ``centres`` (mm); NaN where there is none.

    plane : the coordinates in which the point moves: two for circles, which the plane where the third coordinate is 0
        cuts from the spheres; all three for spheres
    side : of the two points, the one on this side of the plane (line) through the centres: ±1, or a term of that sign
    near : with ``side`` None, the one on the side of this point
    """
    foot = _find_foot(centres, radii, plane)
    height = foot.height
    if side is None and near is not None:
        side = dot(sub(near, foot.first), foot.normal)
    height = height * side if isinstance(side, float) else copysign(height, side)
    return add(add(foot.first, foot.offset), scale(foot.normal, height - foot.back))


def compute_square_determinant(centres: Sequence[Vec], radii: Sequence[Scalar], plane: Sequence[int]) -> Scalar:
    """Compute the square of the rods' determinant at the common point, mm⁶ (mm⁴): of :func:`measure_side` there."""
    foot = _find_foot(centres, radii, plane)
    return foot.square * dot(foot.normal, foot.normal) * foot.scale**2


def compute_square_height(centres: Sequence[Vec], radii: Sequence[Scalar], plane: Sequence[int]) -> Scalar:
    """Compute the square of the common point's distance from the centres' plane (line), mm²."""
    return _find_foot(centres, radii, plane).square


class _Foot(NamedTuple):
    """Where the common points lie: on the line through the ``first`` centre + ``offset`` along the ``normal``.

    back : how far that place is in front of the points' middle, in units of the normal
    height : from the middle to either point, in units of the normal
    scale : of the normal, by which it is u × v of the edges from the first centre (the edge turned by 90°)
    square : of the height, mm²

    There is one quotient, 1 over the normal's square, for that costs as much as six products.
    """

    first: Vec
    offset: Vec
    back: Scalar
    normal: Vec
    height: Scalar
    scale: float
    square: Scalar


def _find_foot(centres: Sequence[Vec], radii: Sequence[Scalar], plane: Sequence[int]) -> _Foot:
    if len(centres) == 2:
        return _find_foot_of_circles(centres, radii, plane)
    first = centres[0]
    u, v = sub(centres[1], first), sub(centres[2], first)
    normal = cross(u, v)
    squares = [r * r for r in radii]
    a = 0.5 * (squares[0] - squares[1] + dot(u, u))
    b = 0.5 * (squares[0] - squares[2] + dot(v, v))
    rails = [k for k in range(3) if _is_constant_across(u, v, normal, k)]
    if rails:
        k = max(rails, key=lambda k: abs(normal[k]))
        return _find_foot_along(first, squares[0], (u, v), (a, b), normal, k)
    inverse = 1.0 / _replace_zero(dot(normal, normal))
    foot = add(scale(cross(v, normal), a * inverse), scale(cross(normal, u), b * inverse))
    square = squares[0] - dot(foot, foot)
    return _Foot(first, foot, 0.0, normal, sqrt(square * inverse), 1.0, square)


def _find_foot_of_circles(centres: Sequence[Vec], radii: Sequence[Scalar], plane: Sequence[int]) -> _Foot:
    i, j = plane
    out = 3 - i - j
    across: Vec = tuple(1.0 if c == out else 0.0 for c in range(3))
    u: Vec = tuple(0.0 if c == out else x for c, x in enumerate(sub(centres[1], centres[0])))
    normal = cross(across, u)
    size = _replace_zero(dot(normal, normal))
    inverse = 1.0 / size
    first = tuple(0.0 if c == out else x for c, x in enumerate(centres[0]))
    squares = [r * r - c[out] * c[out] for r, c in zip(radii, centres, strict=True)]
    foot = scale(u, 0.5 * (squares[0] - squares[1] + size) * inverse)
    square = squares[0] - dot(foot, foot)
    return _Foot(first, foot, 0.0, normal, sqrt(square * inverse), 1.0, square)


def _is_constant_across(u: Vec, v: Vec, normal: Vec, k: int) -> bool:
    """Tell whether centres move along coordinate k alone, and stand well apart across it."""
    edges = [edge[i] for edge in (u, v) for i in range(3) if i != k]
    if not isinstance(normal[k], int | float) or not all(isinstance(x, int | float) for x in edges):
        return False
    return bool(abs(normal[k]) > _UPRIGHT * math.hypot(*edges[:2]) * math.hypot(*edges[2:]))


def _find_foot_along(
    first: Vec, square: Scalar, edges: tuple[Vec, Vec], rights: tuple[Scalar, Scalar], normal: Vec, k: int
) -> _Foot:
    """Find the foot from where the normal through it crosses the first centre's height k, in constants of the rails.

    square : of the first radius
    rights : what the products of that place with both edges are

    Along the normal the points are roots of a quadratic equation, whose own root does not wait for the quotient.
    """
    (u, v), (a, b) = edges, rights
    i, j = (k + 1) % 3, (k + 2) % 3
    crossing = [0.0, 0.0, 0.0]
    crossing[i] = a * (v[j] / normal[k]) - b * (u[j] / normal[k])
    crossing[j] = b * (u[i] / normal[k]) - a * (v[i] / normal[k])
    unit = abs(normal[k])
    direction = scale(normal, 1.0 / unit)
    size = dot(direction, direction)
    inverse = 1.0 / size
    along = dot(crossing, direction)
    under_root = along * along - size * (dot(crossing, crossing) - square)
    return _Foot(
        first,
        tuple(crossing),
        along * inverse,
        direction,
        sqrt(under_root) * inverse,
        unit,
        under_root * inverse,
    )


def _replace_zero(size: Scalar) -> Scalar:
    """Turn a zero into NaN: centres in one place, or on one line, determine no point."""
    return math.nan if isinstance(size, int | float) and size == 0.0 else size


def measure_side(centres: Sequence[Vec], plane: Sequence[int], point: Vec) -> Scalar:
    """Measure how far a point is from the centres' plane (line), times its normal's size.

    The sign is the side as :func:`find_common_point` counts it, and that of the rods' determinant.
    """
    first = centres[0]
    if len(centres) == 2:
        out = 3 - sum(plane)
        across = tuple(1.0 if c == out else 0.0 for c in range(3))
        normal = cross(across, sub(centres[1], first))
    else:
        normal = cross(sub(centres[1], first), sub(centres[2], first))
    return dot(sub(point, first), normal)
