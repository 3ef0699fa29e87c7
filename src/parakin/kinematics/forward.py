"""The direct problem: poses for joints, never a silent wrong answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Flags
from ..errors import NoMethodError, PoseError
from ..kernels.batch import NewtonSteps, Roots, evaluate_tape, evaluate_tape_with_residual, solve_by_newton
from ..model.traces import Model
from .inverse import solve_inverse
from .tapes import collect_newton_tapes
from .wrist import TURN, bring_within_poles, is_upright

CLOSED = 1e-9  # greatest closure error of an answer, mm in a machine of a metre
MOST_STEPS = 24
WITHIN_A_TURN = 6  # steps of half a radian at most, which can't leave the start's turn
CONTINUATIONS = (8, 64)  # parts of the way from a known pose, where Newton's method in one go fails


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged; C of an upright tool is the near pose's, else 0
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close and the pose is of the same assembly mode as the start
    steps : (...,) Newton's steps; 0 in closed form
    """

    poses: Array
    residual: Array
    converged: Any
    steps: Any


def solve_forward(model: Model, joints: Array, starts: Array | None, method: str | None = None) -> Solution:
    """Solve the direct problem of rows of joints (N, joints), from rows of poses (N, axes) or from home.

    Parameters and errors as of :meth:`parakin.Machine.forward`; every field of the solution has N rows.

    Newton's answer counts only if it lies in the start's assembly mode: where the determinant of A changes sign on the
    way the answer is sought once more along the joints' straight line from the start, and refused if that fails too.
    """
    if method is None:
        method = "closed" if model.by_spheres else "newton"
    if method == "closed":
        solution = _solve_by_spheres(model, joints, starts)
    elif method == "newton":
        solution = _solve_by_newton(model, joints, starts)
    elif method == "constant":
        solution = _solve_by_constant_jacobian(model, joints, starts)
    else:
        raise PoseError(f'method {method!r}: "closed", "newton" or "constant" expected')
    poses, converged, steps = solution.poses, solution.converged, solution.steps
    if not converged.all():
        poses[~converged] = np.nan
    direction = model.structure.direction
    if direction is not None:
        along_z = is_upright(poses[:, direction.b])
        poses[along_z, direction.c] = 0.0 if starts is None else starts[along_z, direction.c]
    elif steps.max(initial=0) > WITHIN_A_TURN:
        _count_turns(model, poses, np.array(model.home) if starts is None else starts)
    return solution


def _count_turns(model: Model, poses: Array, near: Array) -> None:
    """Bring the angles of a free platform to B within ±90° and within half a turn of those near by; in place."""
    columns = [i for i, axis in enumerate(model.axes) if axis in "ABC"]
    if len(columns) == 3:
        poses[:, columns] = bring_within_poles(poses[:, columns])
        del columns[1]
    for i in columns:
        poses[:, i] -= TURN * np.round((poses[:, i] - near[..., i]) / TURN)


def compute_closure_tolerance(model: Model) -> float:
    """Return the greatest closure error of an answer, mm: rounding grows with the machine."""
    return CLOSED * max(1.0, max(model.sizes) / 1000.0)


def compute_poses(model: Model, coordinates: Array, joints: Array) -> Array:
    """Compute poses from the motion's coordinates and the joints of head and table."""
    return evaluate_tape(model.end_tape(), coordinates, np.empty((len(joints), len(model.axes))), joints)


def find_roots(
    model: Model,
    near: Array,
    joints: Array,
    *,
    most: int = MOST_STEPS,
    poses: bool = True,
    side: Array | None = None,
) -> Roots:
    """Solve the closures by Newton's method from ``near`` (1 or N rows), and return what kind of rows it was given.

    poses : ``near`` and the roots are poses, else the motion's coordinates
    most : steps; zero only evaluates the start
    side : of the singularities to end on, as :func:`find_sides` gives it; by default that of the start
    """
    size = max(model.sizes)
    # A step goes at most a third of the legs' size or half a radian.
    caps = np.array([size / 3.0 if word.startswith("t") else 0.5 for word in model.structure.coordinates])
    tapes = collect_newton_tapes(model, poses)
    steps = NewtonSteps(caps, min(model.sizes), most)
    return solve_by_newton(tapes, steps, np.ascontiguousarray(near), joints, np.empty(0) if side is None else side)


def _solve_by_spheres(model: Model, joints: Array, starts: Array | None) -> Solution:
    if not model.by_spheres:
        raise NoMethodError(f"{model.spec.name}: no closed form of the direct problem; use method='newton'")
    poses = np.empty((len(joints), len(model.axes)))
    if starts is None:
        residual = _choose_by_working_mode(model, joints, poses)
    else:
        residual = evaluate_tape_with_residual(model.spheres_tape(None), joints, poses, starts)
    return Solution(poses, residual, residual <= compute_closure_tolerance(model), np.zeros(len(joints), np.int32))


def _choose_by_working_mode(model: Model, joints: Array, poses: Array) -> Array:
    """Fill ``poses`` with the common point on home's side, and return the residuals, mm.

    Where only the other common point has these joints in the machine's own working mode, that one is taken.
    """
    nothing = np.empty((len(joints), 0))
    residual = evaluate_tape_with_residual(model.spheres_tape(model.home_side), joints, poses, nothing)
    if not model.has_modes:
        return residual

    def is_out_of_mode(poses: Array, joints: Array) -> Flags:
        off = np.abs(solve_inverse(model, poses, model.mode) - joints)[:, : model.leg_count].max(1)
        fits: Flags = off <= 1e3 * compute_closure_tolerance(model)
        return ~fits

    lost = np.flatnonzero(is_out_of_mode(poses, joints) & np.isfinite(residual))
    if len(lost):
        others, their_joints = np.empty((len(lost), poses.shape[1])), joints[lost]
        other_tape = model.spheres_tape(-model.home_side)
        their_residual = evaluate_tape_with_residual(other_tape, their_joints, others, nothing[lost])
        fit = ~is_out_of_mode(others, their_joints)
        poses[lost[fit]], residual[lost[fit]] = others[fit], their_residual[fit]
    return residual


def find_sides(model: Model, poses: Array) -> Array:
    """Compute the determinant of the closures' derivatives at poses, (N,); its sign tells the assembly mode."""
    return find_roots(model, poses, solve_inverse(model, poses, model.mode), most=0, side=np.ones(1)).turned


def _solve_by_newton(model: Model, joints: Array, starts: Array | None) -> Solution:
    near = np.array(model.home)[None, :] if starts is None else starts
    result = find_roots(model, near, joints, side=find_sides(model, near) if starts is None else None)
    good = (result.residual <= compute_closure_tolerance(model)) & (result.turned > 0.0)
    if not good.all():
        _continue_from_starts(model, near, joints, result, good)
    return Solution(result.rows, result.residual, good, result.steps)


def _continue_from_starts(model: Model, near: Array, joints: Array, result: Roots, good: Flags) -> None:
    """Continue along the joints' straight line from the start where Newton's method in one go failed; in place."""
    whole = np.isfinite(joints).all(1) & np.isfinite(near).all(1)
    for parts in CONTINUATIONS:
        lost = np.flatnonzero(~good & whole)
        if not len(lost):
            return
        walk = np.broadcast_to(near if len(near) == 1 else near[lost], (len(lost), near.shape[1]))
        begin = solve_inverse(model, walk, model.mode)
        side = find_sides(model, np.ascontiguousarray(walk))
        with np.errstate(invalid="ignore", over="ignore"):
            for part in range(1, parts + 1):
                step = find_roots(model, walk, begin + (part / parts) * (joints[lost] - begin), side=side)
                walk = step.rows
                result.steps[lost] += step.steps
            fine = (step.residual <= compute_closure_tolerance(model)) & (step.turned > 0.0)
        result.rows[lost[fine]], result.residual[lost[fine]] = walk[fine], step.residual[fine]
        good[lost[fine]] = True


def _solve_by_constant_jacobian(model: Model, joints: Array, starts: Array | None) -> Solution:
    """Iterate x ← x + J⁻¹·(d - d(x)) with the start's Jacobian, to 1 µm in every leg; FME Transactions 41, (31)."""
    legs, m = model.leg_count, len(model.structure.coordinates)
    tape = model.legs_tape(model.mode)
    given = np.array(model.home)[None, :] if starts is None else starts
    wide = np.ascontiguousarray(np.broadcast_to(given, (len(joints), given.shape[1])))
    y = evaluate_tape(model.begin_tape(), wide, np.empty((len(joints), m)), joints)
    both = evaluate_tape(tape, y, np.empty((len(y), legs + legs * m)))
    singular = ~np.isfinite(both).all(1)
    matrices = both[:, legs:].reshape(-1, legs, m).copy()
    matrices[singular] = np.eye(m)
    inverse = np.linalg.pinv(matrices)
    steps = np.zeros(len(y), np.int32)
    with np.errstate(invalid="ignore", over="ignore"):
        for _ in range(200):
            off = joints[:, :legs] - both[:, :legs]
            going = np.abs(off).max(1, initial=0.0) > 1e-3
            if not going.any():
                break
            y[going] += np.einsum("nij,nj->ni", inverse[going], off[going])
            steps[going] += 1
            both = evaluate_tape(tape, y, np.empty((len(y), legs + legs * m)))
        for _ in range(40):  # on to rounding, uncounted: the verdict is the same for every method
            y += np.einsum("nij,nj->ni", inverse, joints[:, :legs] - both[:, :legs])
            both = evaluate_tape(tape, y, np.empty((len(y), legs + legs * m)))
    residual = find_roots(model, y, joints, most=0, poses=False).residual
    return Solution(compute_poses(model, y, joints), residual, residual <= compute_closure_tolerance(model), steps)
