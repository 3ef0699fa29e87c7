"""The direct problem: poses for joints, never a silent wrong answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Flags
from ..errors import NoMethodError, PoseError
from ..kernels.batch import (
    ClosureLimits,
    Roots,
    Settling,
    evaluate_closed_rows,
    evaluate_tape,
    evaluate_tape_with_residual,
)
from ..model.traces import Model
from .assembly_side import bound_determinant, find_angle_signs, find_own_sides, find_sides
from .closure_roots import (
    MOST_STEPS,
    compare_with_mode,
    compute_closure_tolerance,
    compute_poses,
    find_in_mode,
    find_roots,
)
from .inverse import SINGULAR, solve_inverse
from .settling import compile_settling_end, compile_settling_spheres
from .solution import (
    ANSWERED,
    IN_DISAGREEMENT,
    ON_ANOTHER_SIDE,
    OPEN,
    OTHER_MODE,
    SINGULAR_ANSWER,
    SINGULAR_START,
    SINGULAR_WAY,
    Answers,
    Solution,
    put_rows,
    take_rows,
)
from .start_modes import answer_in_modes_of_starts, is_beside
from .turns import count_nearest_turns
from .wrist.pole_thresholds import is_upright
from .wrist.pose_angles import bring_within_poles

WITHIN_A_TURN = 6  # steps of half a radian at most, which can't leave the start's turn
STEADY = 0.2  # by which the determinant may change and still tell the start's own side, where the mode is open
NOT_FALLEN = 0.999  # by which it may change before the answer may be a singularity itself
FIRST_STRIDE, LEAST_STRIDE = 1.0 / 8.0, 1e-5  # of the way in joints that a step of the continuation takes
MOST_STRIDES = 400  # steps of the continuation
_NEXT_STRIDES = 10.0  # least strides within which a determinant that falls to zero has ended a continuation
OF_AGREEMENT = 10.0  # so far joints that disagree may be from those of the pose that they tell
NEAR_STEPS = 6  # of Newton's method for a step of the continuation; one that needs more is halved


def solve_forward(
    model: Model,
    joints: Array,
    starts: Array | None,
    method: str | None = None,
    mode: str | None = None,
    agreement: float = 0.0,
) -> Solution:
    """Solve the direct problem of rows of joints (N, joints), from rows of poses (N, axes) or from home.

    Parameters and errors as of :meth:`parakin.Machine.forward`; every field of the solution has N rows.

    An answer counts only if its inverse in the working mode is the given joints, and if it lies on the start's side of
    the parallel singularities, told by the determinant of the twist with the start's own joints. Where Newton's method
    fails that in one go, the answer is continued along the joints' straight line from the start.
    """
    if method is None:
        method = "closed" if model.by_spheres else "newton"
    if method not in _METHODS:
        raise PoseError(f'method {method!r}: "closed", "newton" or "constant" expected')
    solve = _METHODS[method]
    answers = solve(model, joints, starts, model.mode if mode is None else mode)
    rest, in_other_mode = np.flatnonzero(~answers.settled), np.zeros(len(joints), np.bool_)
    if len(rest):
        looked_at = take_rows(answers, rest)
        own_starts = None if starts is None else starts[rest]
        if mode is None and own_starts is not None and model.has_modes:
            in_other_mode[rest] = answer_in_modes_of_starts(model, looked_at, joints[rest], own_starts, solve)
        _accept_disagreement(model, looked_at, joints[rest], model.mode if mode is None else mode, agreement)
        _find_singular_starts(model, looked_at, own_starts, model.mode if mode is None else mode)
        _finish_poses(model, looked_at, own_starts)
        put_rows(answers, rest, looked_at)
    converged = answers.why == ANSWERED
    return Solution(answers.poses, answers.residual, converged, answers.steps, answers.why, in_other_mode)


def _accept_disagreement(model: Model, answers: Answers, joints: Array, mode: str, agreement: float) -> None:
    """Accept the poses of least squares of joints that disagree by no more than ``agreement``, mm; in place."""
    rows = np.flatnonzero((answers.why == IN_DISAGREEMENT) & (answers.residual <= agreement))
    if len(rows):
        tolerance = OF_AGREEMENT * agreement
        off = np.abs(compare_with_mode(model, answers.poses[rows], joints[rows], mode)).max(1)
        with np.errstate(invalid="ignore"):
            answers.why[rows] = np.where(off <= tolerance, ANSWERED, OTHER_MODE)


def _find_singular_starts(model: Model, answers: Answers, starts: Array | None, mode: str) -> None:
    """Say where there is no answer because the start is a parallel singularity; in place."""
    rows = np.flatnonzero(np.isin(answers.why, (OPEN, ON_ANOTHER_SIDE, SINGULAR_WAY)))
    if len(rows):
        singular = find_sides(model, np.array(model.home)[None, :] if starts is None else starts[rows], mode) == 0.0
        answers.why[rows[np.broadcast_to(singular, rows.shape)]] = SINGULAR_START


def _finish_poses(model: Model, answers: Answers, starts: Array | None) -> None:
    """Write NaN where there is no answer, and of several ways to write an orientation the start's; in place."""
    poses, direction = answers.poses, model.structure.direction
    poses[answers.why != ANSWERED] = np.nan
    if direction is not None:
        along_z = is_upright(poses[:, direction.b])
        poses[along_z, direction.c] = 0.0 if starts is None else starts[along_z, direction.c]
    elif answers.steps.max(initial=0) > WITHIN_A_TURN:
        _count_turns(model, poses, np.array(model.home) if starts is None else starts)


def _count_turns(model: Model, poses: Array, near: Array) -> None:
    """Bring the angles of a free platform to B within ±90° and within half a turn of those near by; in place."""
    columns = model.turning_columns.copy()
    if len(columns) == 3:
        poses[:, columns] = bring_within_poles(poses[:, columns])
        del columns[1]
    count_nearest_turns(poses, np.atleast_2d(near), columns)


def _judge(model: Model, roots: Roots, joints: Array, mode: str | None) -> NDArray[np.int8]:
    """Tell why roots are no answers, as indices of :data:`REASONS`; zero where they are.

    Joints of a redundant machine whose least squares are found, and not zero, do not agree with each other.
    """
    turned = roots.turned * find_angle_signs(model, roots.rows)
    with np.errstate(invalid="ignore"):
        why = np.where(find_in_mode(model, roots.rows, joints, mode), ANSWERED, OTHER_MODE).astype(np.int8)
        why[~(turned > 0.0)] = ON_ANOTHER_SIDE
        closed = roots.residual <= compute_closure_tolerance(model)
    why[~closed] = OPEN
    if model.is_redundant:
        why[~closed & _find_least_squares(roots, MOST_STEPS)] = IN_DISAGREEMENT
    return why


def _find_least_squares(roots: Roots, most: int) -> Flags:
    """Find the rows where the Gauss-Newton method came to its end, whether or not all closures are zero there."""
    return np.asarray((roots.steps < most) & np.isfinite(roots.residual) & (roots.turned > 0.0))


def _solve_by_spheres(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Answers:
    """Take, of both common points, the one in the working mode on the start's own side, or on home's side."""
    if not model.by_spheres:
        raise NoMethodError(f"{model.spec.name}: no closed form of the direct problem; use method='newton'")
    count = len(joints)
    if mode is None:
        return _choose_common_points(model, joints, starts, mode)
    tape, poses = compile_settling_spheres(model, mode, starts is not None), np.empty((count, len(model.axes)))
    given = np.empty((count, 0)) if starts is None else starts
    limits = ClosureLimits(model.leg_count, compute_closure_tolerance(model))
    closed = evaluate_closed_rows(tape, limits, joints, given, poses)
    answers = Answers(poses, closed.residual, np.zeros(count, np.int32), np.zeros(count, np.int8), closed.settled)
    rest = np.flatnonzero(~closed.settled)
    if len(rest):
        own_starts = None if starts is None else starts[rest]
        put_rows(answers, rest, _choose_common_points(model, joints[rest], own_starts, mode))
    return answers


def _choose_common_points(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Answers:
    """Take, of both common points, the one in the working mode on the start's own side, or on home's side.

    On the start's side where that has no joints of its own, or the mode is open. Nothing of it counts as settled.
    """
    count = len(joints)
    first, second = np.empty((count, len(model.axes))), np.empty((count, len(model.axes)))
    if starts is None:
        nothing = np.empty((count, 0))
        residual = evaluate_tape_with_residual(model.spheres_tape(model.home_side), joints, first, nothing)
    else:
        unknown = np.full((count, 1), np.nan)
        sides = unknown if mode is None else find_own_sides(model, joints, starts, mode)
        residual = evaluate_tape_with_residual(model.spheres_on_side_tape(), joints, first, sides)
        lost = np.flatnonzero(np.isnan(sides[:, 0]))  # such a start has no joints of its own, and no side
        if len(lost):
            nearest = second[lost]
            residual[lost] = evaluate_tape_with_residual(model.spheres_tape(None), joints[lost], nearest, starts[lost])
            first[lost] = nearest
    why = np.where(residual <= compute_closure_tolerance(model), ANSWERED, OPEN).astype(np.int8)
    if model.has_modes:
        lost = np.flatnonzero((why == ANSWERED) & ~find_in_mode(model, first, joints, mode))
        why[lost] = OTHER_MODE
        for side in (model.home_side, -model.home_side) if len(lost) else ():
            given, others, tape = joints[lost], second[lost], model.spheres_tape(side)
            open_by = evaluate_tape_with_residual(tape, given, others, np.empty((len(lost), 0)))
            fit = (open_by <= compute_closure_tolerance(model)) & find_in_mode(model, others, given, mode)
            why[lost[fit]] = ON_ANOTHER_SIDE  # the common point in the mode is not the one on the start's side
    return Answers(first, residual, np.zeros(count, np.int32), why, np.zeros(count, np.bool_))


def _solve_by_newton(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Answers:
    """Solve the closures from the starts; what that does not settle is judged, and continued where it failed.

    Legs that stand in a mode have other joints at the start than the given ones, and there a determinant of their own.
    However little it changes with the pose from start to root, the joints alone can turn its sign.
    """
    near = np.array(model.home)[None, :] if starts is None else starts
    end = compile_settling_end(model, mode, starts is not None)
    if starts is None:
        settling = Settling(0.0, NOT_FALLEN, MOST_STEPS)
        roots = find_roots(model, near, joints, side=find_sides(model, near, mode), end=end, settling=settling)
    else:
        least = (SINGULAR * bound_determinant(model)) ** 2
        own_joints = model.has_modes and mode is not None
        sides = find_sides(model, near, mode, joints) if own_joints else None
        settling = Settling(least, STEADY if model.has_modes and not own_joints else NOT_FALLEN, WITHIN_A_TURN)
        roots = find_roots(model, near, joints, side=sides, end=end, settling=settling)
    answers = Answers(roots.rows, roots.residual, roots.steps, np.zeros(len(joints), np.int8), roots.settled)
    rest = np.flatnonzero(~roots.settled)
    if len(rest):
        own = Roots._make(field[rest] for field in roots)
        own_starts = near if starts is None else starts[rest]
        if starts is not None and sides is None:
            _take_own_sides(model, own, own_starts, joints[rest], mode)
        why = _judge(model, own, joints[rest], mode)
        if (why != ANSWERED).any():
            _continue_from_starts(model, own_starts, joints[rest], (own, why), mode)
        _refuse_singular_answers(model, own, joints[rest], why, mode)
        put_rows(answers, rest, Answers(own.rows, own.residual, own.steps, why, own.settled))
    return answers


def _refuse_singular_answers(
    model: Model, roots: Roots, joints: Array, why: NDArray[np.int8], mode: str | None
) -> None:
    """Refuse roots that are parallel singularities themselves, one pose of a continuum of them; in place.

    Newton's method ends before a singularity where two roots meet, but not before one where the platform is free. The
    determinant that it leaves is that of a step before.
    """
    rows = np.flatnonzero(why == ANSWERED)
    if len(rows):
        why[rows[find_sides(model, roots.rows[rows], mode, joints[rows]) == 0.0]] = SINGULAR_ANSWER


def _take_own_sides(model: Model, roots: Roots, near: Array, joints: Array, mode: str | None) -> None:
    """Multiply the roots' determinants by those of the starts with their own joints, not with the given ones; in place.

    The determinant of struts of any length is the same. Where the legs may stand in any mode it counts as the same
    where it differs little from the root's; only where it does not, the starts' own joints are looked for.
    """
    roots.turned[:] *= find_angle_signs(model, near)
    if not model.has_modes:
        roots.turned[roots.turned <= (SINGULAR * bound_determinant(model)) ** 2] = 0.0
        return
    tiny = roots.turned <= (SINGULAR * bound_determinant(model)) ** 2
    at_start = find_roots(model, near, joints, most=0, side=np.ones(1)).turned
    with np.errstate(all="ignore"):
        steady = (np.abs(roots.turned / at_start**2 - 1.0) <= STEADY) & is_beside(model, roots.rows, near)
    if not steady.all():
        rows = np.flatnonzero(~steady)
        starts, given = (np.ascontiguousarray(np.broadcast_to(near, roots.rows.shape)[rows]), joints[rows])
        sides = find_sides(model, starts, mode, given)
        roots.turned[rows] = find_roots(model, roots.rows[rows], given, most=0, side=sides).turned
    roots.turned[tiny & steady] = 0.0


def _continue_from_starts(
    model: Model, near: Array, joints: Array, into: tuple[Roots, NDArray[np.int8]], mode: str | None
) -> None:
    """Continue along the joints' straight line from the start where Newton's method in one go failed; in place.

    Steps are halved where Newton's method does not converge at once, on the same side and in the working mode, and
    doubled where it does. A row that can't be continued keeps the reason of its last step, but where the determinant
    falls to zero there: beside a singularity, where a root meets another, its square falls evenly along the line. On
    the line the joints of a redundant machine do not agree, and the poses on the way are those of least squares.
    """
    roots, why = into
    walk = np.broadcast_to(near, (len(joints), near.shape[1]))
    begin = solve_inverse(model, walk, model.mode if mode is None else mode)
    rows = np.flatnonzero((why != ANSWERED) & np.isfinite(joints).all(1) & np.isfinite(begin).all(1))
    if not len(rows):
        return
    walk, begin, goal = np.ascontiguousarray(walk[rows]), begin[rows], joints[rows]
    side = find_sides(model, walk, mode)
    gone, stride = np.zeros(len(rows)), np.full(len(rows), FIRST_STRIDE)
    square, falling = np.full((2, len(rows)), np.nan)  # of the determinant, and the way along which it falls by one
    most = MOST_STEPS if model.is_redundant else NEAR_STEPS  # least squares that leave something are come to slowly
    for _ in range(MOST_STRIDES):
        going = np.flatnonzero((gone < 1.0) & (stride >= LEAST_STRIDE))
        if not len(going):
            break
        share = np.minimum(1.0, gone[going] + stride[going])
        given = begin[going] + share[:, None] * (goal[going] - begin[going])
        step = find_roots(model, walk[going], given, most=most, side=side[going])
        reason = _judge(model, step, given, mode)
        roots.steps[rows[going]] += step.steps
        fine = np.asarray(reason == ANSWERED)
        if model.is_redundant:
            fine |= (share < 1.0) & _find_least_squares(step, most)
        kept = going[fine]
        now = step.turned[fine] ** 2
        with np.errstate(all="ignore"):
            falling[kept] = (share[fine] - gone[kept]) / (square[kept] - now)
        walk[kept], gone[kept], square[kept] = step.rows[fine], share[fine], now
        stride[kept] *= 2.0
        stride[going[~fine]] *= 0.5
        why[rows[going]] = reason
        done = kept[gone[kept] >= 1.0]
        at_end = np.flatnonzero(fine & (share >= 1.0))
        roots.rows[rows[done]], roots.residual[rows[done]] = step.rows[at_end], step.residual[at_end]
    with np.errstate(all="ignore"):
        ends = (falling > 0.0) & (falling * square < _NEXT_STRIDES * LEAST_STRIDE)
    stopped = np.flatnonzero((gone < 1.0) & np.isin(why[rows], (ANSWERED, OPEN)))
    why[rows[stopped]] = np.where(ends[stopped], SINGULAR_WAY, OPEN)


def _solve_by_constant_jacobian(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Answers:
    """Iterate x ← x + J⁻¹·(d - d(x)) with the start's Jacobian, to 1 µm in every leg; FME Transactions 41, (31)."""
    legs, m = model.leg_count, len(model.structure.coordinates)
    tape = model.legs_tape(model.mode)
    given = np.array(model.home)[None, :] if starts is None else starts
    wide = np.ascontiguousarray(np.broadcast_to(given, (len(joints), given.shape[1])))
    y = evaluate_tape(model.begin_tape(), wide, np.empty((len(joints), m)), joints)
    both = evaluate_tape(tape, y, np.empty((len(y), legs + legs * m)))
    singular = ~np.isfinite(both).all(1)
    matrices = both[:, legs:].reshape(-1, legs, m).copy()
    matrices[singular] = np.eye(legs, m)
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
    poses = compute_poses(model, y, joints)
    sides = find_sides(model, given, mode, None if starts is None else joints)
    roots = find_roots(model, y, joints, most=0, poses=False, side=np.ones(1))
    with np.errstate(invalid="ignore"):
        roots.turned[np.abs(roots.turned) <= SINGULAR * bound_determinant(model)] = 0.0
    roots.turned[:] *= sides
    why = _judge(model, roots._replace(rows=poses), joints, mode)
    _refuse_singular_answers(model, roots._replace(rows=poses), joints, why, mode)
    return Answers(poses, roots.residual, steps, why, np.zeros(len(why), np.bool_))


_METHODS = {"closed": _solve_by_spheres, "newton": _solve_by_newton, "constant": _solve_by_constant_jacobian}
