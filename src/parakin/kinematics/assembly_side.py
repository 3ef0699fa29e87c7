"""On which side of the parallel singularities a pose lies: the sign of the determinant of the tool's twist."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Flags
from ..kernels.batch import evaluate_tape, evaluate_tape_with_residual
from ..model.elements import MOTION_UNITS
from ..model.traces import Model
from .closure_roots import find_roots
from .inverse import SINGULAR, solve_inverse
from .turns import wrap_angle
from .wrist.pole_crossing import flip_mode


def find_sides(model: Model, poses: Array, mode: str | None = None, joints: Array | None = None) -> Array:
    """Compute the determinant of the twist at poses, (N,), but for its size.

    Its sign tells the assembly mode, and zero is a singularity; a redundant machine's has no sign. Its closures are
    those of the poses' own joints in a working mode; where these do not exist, of ``joints`` (1 or N rows), if given.
    """
    mode = model.mode if mode is None else mode
    own = solve_inverse(model, poses, mode)
    if joints is not None and model.structure.branches:  # with the head or table as it is given
        nearer = _is_in_other_head_mode(model, poses, joints, mode)
        own[nearer] = solve_inverse(model, poses[nearer], flip_mode(mode))
    if joints is not None:
        own = np.where(np.isfinite(own).all(1, keepdims=True), own, joints)
    sides = find_roots(model, poses, own, most=0, side=np.ones(1)).turned
    lost = np.isnan(sides) & np.isfinite(own).all(1)  # no pivot was left
    sides[lost | (np.abs(sides) <= SINGULAR * bound_determinant(model))] = 0.0
    return sides * find_angle_signs(model, poses)


def find_angle_signs(model: Model, poses: Array) -> Array | float:
    """Find the sign by which the determinant of the pose's rates differs from the twist's, at poses or for all.

    The volume of a redundant machine has no sign.
    """
    column = model.structure.middle_turn
    if column is None or model.is_redundant:
        return 1.0
    turns = poses[:, column]
    if np.abs(turns).max(initial=0.0) < 0.5 * np.pi:  # false for NaN
        return 1.0
    with np.errstate(invalid="ignore"):
        return np.sign(np.cos(turns))


def bound_determinant(model: Model) -> float:
    """Return the greatest determinant that closures' derivatives of home's sizes can have, by Hadamard.

    Of a redundant machine the columns bound it, of others the rows.
    """
    home, tape = np.array(model.home)[None, :], model.newton_tape(True)
    joints, count = solve_inverse(model, home, model.mode), len(model.structure.coordinates)
    coordinates = evaluate_tape(model.begin_tape(), home, np.empty((1, count)), joints)
    slopes = evaluate_tape(tape, coordinates, np.empty((1, tape.outputs)), joints)[0, model.leg_count :]
    scales = np.array(
        [max(model.sizes) if MOTION_UNITS[word] == "rad" else 1.0 for word in model.structure.coordinates]
    )
    sizes = np.linalg.norm(slopes.reshape(-1, count) / scales, axis=0 if model.is_redundant else 1)
    return float(sizes.prod() * scales.prod())


def find_own_sides(model: Model, joints: Array, starts: Array, mode: str) -> Array:
    """Find on which side of their own spheres' centres starts lie, (N, 1), by its sign; NaN out of reach."""
    sides = evaluate_tape(model.own_side_tape(mode), starts, np.empty((len(starts), 1)))
    if model.structure.branches:
        common = np.empty_like(starts)  # either common point: head and table alone turn the tool
        evaluate_tape_with_residual(model.spheres_tape(None), joints, common, starts)
        nearer = _is_in_other_head_mode(model, common, joints, mode)
        others = evaluate_tape(model.own_side_tape(flip_mode(mode)), starts, np.empty((len(starts), 1)))
        sides[nearer] = others[nearer]
    return sides


def _is_in_other_head_mode(model: Model, poses: Array, joints: Array, mode: str) -> Flags:
    """Tell at which poses head and table's joints are nearer to the given ones in the other of their modes."""
    serial = slice(model.leg_count, None)
    own, other = (solve_inverse(model, poses, choice) for choice in (mode, flip_mode(mode)))
    far = [np.abs(wrap_angle((turned - joints)[:, serial])).max(1, initial=0.0) for turned in (own, other)]
    return np.asarray(far[1] < far[0])
