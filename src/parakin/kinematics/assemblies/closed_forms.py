"""All assembly modes of one joint vector in closed form, for machines that have one."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...arrays import Array
from ...errors import NoMethodError
from ...model.chain import make_rotation_about
from ...model.limits import group_joints_by_leg
from ...model.traces import Model
from ..planar_rpr import CONTINUUM, solve_planar_rpr

_ON_ONE_LINE = 1e-9  # of the size: nearer to a line, centres are on it
LONGEST = 1e8  # mm; machine files take lengths up to 1e6

ClosedForm = Literal["spheres", "planar", "lambda"]


def find_closed_form(model: Model) -> ClosedForm | None:
    """Find the closed form of a machine's direct problem, if there is one."""
    if model.is_redundant:
        return None
    return "spheres" if model.by_spheres else model.structure.assembly_method


def solve_closed_form(model: Model, method: ClosedForm, joints: Array) -> Array:
    """Find the motion's coordinates (k, m) of all poses of one row of joints (1, joints); k may be zero.

    Some may close no better than a double root's rounding allows.

    Raises :class:`NoMethodError` for a continuum of poses.
    """
    methods = {"spheres": _find_common_points, "planar": _solve_planar, "lambda": _solve_lambdas}
    coordinates: Array = methods[method](model, joints)
    return coordinates


def _find_common_points(model: Model, joints: Array) -> Array:
    """Find both common points of the legs' spheres."""
    _refuse_continuum(model, joints)
    given = joints[0].tolist()
    points: Array = np.array([model.spheres(given, side) for side in (model.home_side, -model.home_side)], float)
    points = points[np.isfinite(points).all(1)]
    return points[:1] if len(points) == 2 and np.array_equal(points[0], points[1]) else points


def _refuse_continuum(model: Model, joints: Array) -> None:
    """Refuse spheres (circles) with centres on one line (in one place) that share a circle, or more.

    Their radical planes 2·(c - c0)·p = |c - c0|² - r² + r0² meet in a line or a plane then, which cuts a sphere.
    """
    centres, radii, plane = model.find_spheres(joints[0].tolist())
    points, r = np.array(centres, float), np.array(radii, float)
    out = [i for i in range(3) if i not in plane]
    squares = r * r - (points[:, out] ** 2).sum(1)
    normals = points[1:, plane] - points[0, plane]
    size = max(float(np.abs(points).max()), float(np.abs(r).max()), 1e-300)
    if not np.isfinite(normals).all() or np.linalg.matrix_rank(normals, tol=_ON_ONE_LINE * size) == len(plane) - 1:
        return
    right = 0.5 * ((normals * normals).sum(1) - squares[1:] + squares[0])
    nearest = np.linalg.lstsq(normals, right, rcond=_ON_ONE_LINE)[0]
    meets = np.abs(normals @ nearest - right).max() <= _ON_ONE_LINE * size * size
    if meets and squares[0] - nearest @ nearest > _ON_ONE_LINE * size * size:
        raise NoMethodError(f"{model.spec.name}: {CONTINUUM}")


def _solve_planar(model: Model, joints: Array) -> Array:
    """Solve a platform on three rods that moves in a plane as a planar 3-RPR."""
    words = model.structure.coordinates
    # The plane's two directions, so ordered that the turn is right-handed: x y for rz, z x for ry, y z for rx.
    plane = {"rz": [0, 1], "ry": [2, 0], "rx": [1, 2]}[words[2]]
    out = 3 - sum(plane)
    centres, radii = [], []
    for leg, q in zip(model.spec.legs, group_joints_by_leg(model.spec, joints[0].tolist()), strict=True):
        sphere = leg.sphere(q)
        assert sphere is not None
        height = sphere[0][out] - leg.platform[out]
        centres.append([sphere[0][i] for i in plane])
        radii.append(np.sqrt(max(float(sphere[1]) ** 2 - float(height) ** 2, 0.0)))
    structure = model.structure
    # The pose is of the tip; a fixed tool only shifts the corners.
    corners = np.array([[leg.platform[i] - structure.tip[i] for i in plane] for leg in model.spec.legs])
    solutions = solve_planar_rpr(np.array(centres, float), np.array(radii), corners)
    letters = ["tx", "ty", "tz"]
    order = [[letters[i] for i in plane].index(word) for word in words[:2]]
    return solutions[:, [*order, 2]]


def _solve_lambdas(model: Model, joints: Array) -> Array:
    """Solve three Lambda legs on parallel shafts: the heights give the tilt, the distances a planar 3-RPR."""
    structure = model.structure
    legs = structure.lambda_legs
    axis = np.array(legs[0].rail)
    side = np.linalg.svd(axis[None, :])[2][1:]
    if np.dot(np.cross(side[0], side[1]), axis) < 0.0:
        side = side[::-1]
    feet = np.array([leg.foot for leg in legs])
    corners = np.array([leg.platform for leg in legs])
    with np.errstate(invalid="ignore", divide="ignore"):
        # NumPy's numbers: where both sliders meet, a gap of 0 gives NaN
        given: Array = np.array(group_joints_by_leg(model.spec, joints[0].tolist()))
        measures = np.array([leg.height_and_distance(list(q)) for leg, q in zip(legs, given, strict=True)])
    if not np.isfinite(measures).all():
        return np.empty((0, 6))
    heights, distances = measures[:, 0] + feet @ axis, measures[:, 1]
    edges = corners[1:] - corners[0]
    normal = np.cross(edges[0], edges[1])
    normal = normal / np.linalg.norm(normal)
    # The heights give the part of the shafts' direction in the platform's plane; the rest has either sign.
    inside = np.linalg.lstsq(edges, heights[1:] - heights[0], rcond=None)[0]
    rest = 1.0 - inside @ inside
    if rest < 0.0:
        return np.empty((0, 6))
    up = 1.0 if normal @ _turn_into_platform(model, axis) >= 0.0 else -1.0
    poses: list[Array] = []
    for sign in (up, -up) if rest > 0.0 else (up,):
        seen = inside + sign * np.sqrt(rest) * normal
        tilt = _find_rotation_between(seen, axis)
        flat = corners @ tilt.T @ side.T
        height = heights[0] - axis @ (tilt @ corners[0])
        for x, y, turn in solve_planar_rpr(feet @ side.T, distances, flat):
            spin: Array = np.array(make_rotation_about(axis.tolist(), np.sin(turn), np.cos(turn)))
            origin = side.T @ np.array([x, y]) + height * axis
            poses.append(np.array(structure.coordinates_of((spin @ tilt).tolist(), origin.tolist())))
    return np.array(poses).reshape(-1, 6)


def _turn_into_platform(model: Model, axis: Array) -> Array:
    """Turn a direction of the base into the platform's frame at home."""
    rotation, _ = model.structure.frame(model.home)
    seen: Array = np.array(rotation, float).T @ axis
    return seen


def _find_rotation_between(start: Array, end: Array) -> Array:
    """Find a rotation that takes the unit vector ``start`` to ``end``."""
    middle = start + end
    size = middle @ middle
    if size < 1e-12:  # opposite: half a turn about anything at right angles
        axis: Array = np.linalg.svd(start[None, :])[2][1]
    else:
        axis = middle / np.sqrt(size)
    turned: Array = 2.0 * np.outer(axis, axis) - np.eye(3)  # half a turn about it takes start to end
    return turned
