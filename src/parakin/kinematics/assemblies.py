"""All assembly modes of one joint vector, by complete methods."""

from __future__ import annotations

import numpy as np

from ..algebra import Trace, derivative
from ..arrays import Array
from ..errors import NoMethodError
from ..kernels.batch import evaluate_tape_with_residual
from ..kernels.intervals import IntervalProgram
from ..model.chain import make_rotation_about
from ..model.traces import Model
from .closure_roots import compute_closure_tolerance, compute_poses, find_roots
from .planar_rpr import CONTINUUM, solve_planar_rpr
from .root_isolation import isolate_roots

_ON_ONE_LINE = 1e-9  # of the size: nearer to a line, centres are on it
LONGEST = 1e8  # mm; machine files take lengths up to 1e6


def find_assemblies(model: Model, joints: Array) -> Array:
    """Find every real pose of one row of joints (1, joints), as rows (k, axes); k may be zero.

    Machines that only translate on three (two) rods have two: the common points of spheres (circles). Three rods in a
    plane have up to six. With three Lambda legs on parallel shafts the heights give the platform's tilt, face up or
    face down, and each leaves the planar problem: up to twelve, face up first. A passive central leg is solved by
    bisection within the limits of its passive joints.

    Raises :class:`NoMethodError` for other machines: they have no complete method here.
    """
    if not (np.abs(joints) < LONGEST).all():
        return np.empty((0, len(model.axes)))
    if model.by_spheres:
        return _find_common_points(model, joints)
    methods = {"central leg": _solve_central_leg, "planar": _solve_planar, "lambda": _solve_lambdas}
    if model.structure.assembly_method is None:
        raise NoMethodError(
            f"{model.spec.name}: no complete method for all its assemblies; forward(near=...) finds single ones"
        )
    coordinates = methods[model.structure.assembly_method](model, joints)
    given = np.ascontiguousarray(np.broadcast_to(joints, (len(coordinates), joints.shape[1])))
    good = find_roots(model, coordinates, given, most=0, poses=False).residual <= compute_closure_tolerance(model)
    coordinates, given = coordinates[good], given[good]
    poses = compute_poses(model, np.ascontiguousarray(coordinates), given)
    return poses[np.isfinite(poses).all(1)]


def _find_common_points(model: Model, joints: Array) -> Array:
    """Find both common points of the legs' spheres, as poses."""
    _refuse_continuum(model, joints)
    poses, residual = np.empty((2, len(model.axes))), np.empty(2)
    for i, side in enumerate((model.home_side, -model.home_side)):
        tape, pose = model.spheres_tape(side), poses[i : i + 1]
        residual[i] = evaluate_tape_with_residual(tape, joints, pose, np.empty((1, 0)))[0]
    poses = poses[residual <= compute_closure_tolerance(model)]
    return poses[:1] if len(poses) == 2 and np.array_equal(poses[0], poses[1]) else poses


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


def _split_by_leg(model: Model, joints: Array) -> list[list[float]]:
    """Split one row of joints into each leg's own."""
    by_name = dict(zip([drive.name for drive in model.drives], joints[0].tolist(), strict=True))
    return [[by_name[drive.name] for drive in leg.drives] for leg in model.spec.legs]


def _solve_central_leg(model: Model, joints: Array) -> Array:
    """Isolate all roots within the passive joints' limits by bisection, and polish them."""
    words = model.structure.coordinates
    bounds = {bound.name: (bound.low, bound.high) for bound in model.spec.limits.passive}
    far = 0.0
    for leg, q in zip(model.spec.legs, _split_by_leg(model, joints), strict=True):
        sphere = leg.sphere(q)
        if sphere is None:
            raise NoMethodError(f"{model.spec.name}: no complete method for all assemblies of legs of kind {leg.kind}")
        far = max(far, float(np.linalg.norm(np.array(sphere[0])) + abs(sphere[1]) + np.linalg.norm(leg.platform)))
    slide = (0.0, far) if model.structure.sign > 0 else (-far, 0.0)
    box = [bounds.get(word, slide if word == "tz" else (-np.pi / 2, np.pi / 2)) for word in words]
    low, high = (np.array([side[i] for side in box]) for i in (0, 1))
    low = np.where(np.isfinite(low), low, [-np.pi / 2, -np.pi / 2, slide[0]])
    high = np.where(np.isfinite(high), high, [np.pi / 2, np.pi / 2, slide[1]])
    trace = Trace()
    inputs = trace.inputs(len(words))
    f = model.scaled_closures(inputs, joints[0].tolist())
    starts = isolate_roots(IntervalProgram(trace, f + [derivative(row, y) for row in f for y in inputs]), low, high)
    return _polish_roots(model, joints, starts, low, high)


def _polish_roots(model: Model, joints: Array, starts: Array, low: Array, high: Array) -> Array:
    """Polish starts by Newton's method, and keep the distinct roots within the box."""
    given = np.ascontiguousarray(np.broadcast_to(joints, (len(starts), joints.shape[1])))
    roots = find_roots(model, starts, given, poses=False)
    y, slack = roots.rows, 1e-9 * (high - low)
    good = (roots.residual <= compute_closure_tolerance(model)) & (y >= low - slack).all(1) & (y <= high + slack).all(1)
    kept: list[Array] = []
    for root in y[good]:
        if not any((np.abs(root - other) <= 1e-6 * (high - low)).all() for other in kept):
            kept.append(root)
    return np.array(kept).reshape(-1, y.shape[1])


def _solve_planar(model: Model, joints: Array) -> Array:
    """Solve a platform on three rods that moves in a plane as a planar 3-RPR."""
    words = model.structure.coordinates
    # The plane's two directions, so ordered that the turn is right-handed: x y for rz, z x for ry, y z for rx.
    plane = {"rz": [0, 1], "ry": [2, 0], "rx": [1, 2]}[words[2]]
    out = 3 - sum(plane)
    centres, radii = [], []
    for leg, q in zip(model.spec.legs, _split_by_leg(model, joints), strict=True):
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
        given = np.array(_split_by_leg(model, joints))  # NumPy's numbers: where both sliders meet, a gap of 0 gives NaN
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
