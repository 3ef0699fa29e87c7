"""The direct problem: poses for joints, never a silent wrong answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from ..arrays import Array, Flags, Indices
from ..errors import NoMethodError, PoseError
from ..kernels.batch import (
    NewtonSteps,
    Roots,
    evaluate_tape,
    evaluate_tape_with_residual,
    find_first_negative,
    solve_by_newton,
)
from ..model.traces import Model
from .inverse import SINGULAR, solve_inverse
from .tapes import collect_newton_tapes
from .turns import count_nearest_turns, wrap_angle
from .wrist import SAME_MODE, bring_within_poles, flip_mode, is_upright

CLOSED = 1e-9  # greatest closure error of an answer, mm in a machine of a metre
MOST_STEPS = 24
WITHIN_A_TURN = 6  # steps of half a radian at most, which can't leave the start's turn
STANDS_IN = 0.5  # of the way to another mode: how near joints must be to tell that a pose's legs stand in a mode
NEARER = 0.1  # of the way to the answer in the default mode: one in another mode that is nearer is taken instead
STANDS_AT = 0.1  # of the legs: how near these joints must be
BESIDE = 0.0125  # of the legs: an answer in another mode than the default counts only if it is as near to its start
SETTLED = 0.0125  # of the legs, and rad: so near to its start an answer in the default mode is taken
STEADY = 0.2  # by which the determinant may change from start to answer and still tell the start's own side
FIRST_PART, LEAST_PART = 1.0 / 8.0, 1e-5  # of the way in joints that a step of the continuation takes
MOST_PARTS = 400  # steps of the continuation
NEAR_STEPS = 6  # of Newton's method for a step of the continuation; one that needs more is halved

# Why there is no answer.
ANSWERED, OPEN, ON_ANOTHER_SIDE, OTHER_MODE, SINGULAR_START = range(5)
REASONS = (
    "",
    "the legs do not close near the start",
    "a parallel singularity lies between the start and the joints",
    "the legs close in another working mode only",
    "the start is a parallel singularity, so it lies on no side",
)


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses with what is known of them; all have the joints' leading shape.

    poses : (..., axes), NaN where not converged; C of an upright tool is the near pose's, else 0
    residual : (...,) the greatest distance by which a leg fails to close there, mm
    converged : (...,) True where the legs close, in the working mode asked for and the start's assembly mode
    steps : (...,) Newton's steps; 0 in closed form
    why : (...,) why there is no answer, an index of :data:`REASONS`; 0 where there is one
    """

    poses: Array
    residual: Array
    converged: Any
    steps: Any
    why: Any

    def __repr__(self) -> str:
        return f"<parakin solution: {np.count_nonzero(self.converged)} of {np.size(self.converged)} poses found>"


def solve_forward(
    model: Model, joints: Array, starts: Array | None, method: str | None = None, mode: str | None = None
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
    solution = solve(model, joints, starts, model.mode if mode is None else mode)
    if mode is None and starts is not None and model.has_modes:
        _take_modes_of_starts(model, solution, joints, starts, solve)
    _find_singular_starts(model, solution, starts, model.mode if mode is None else mode)
    poses, steps = solution.poses, solution.steps
    poses[solution.why != ANSWERED] = np.nan
    direction = model.structure.direction
    if direction is not None:
        along_z = is_upright(poses[:, direction.b])
        poses[along_z, direction.c] = 0.0 if starts is None else starts[along_z, direction.c]
    elif steps.max(initial=0) > WITHIN_A_TURN:
        _count_turns(model, poses, np.array(model.home) if starts is None else starts)
    return replace(solution, converged=solution.why == ANSWERED)


def _find_singular_starts(model: Model, solution: Solution, starts: Array | None, mode: str) -> None:
    """Say where there is no answer because the start is a parallel singularity; in place."""
    rows = np.flatnonzero((solution.why == OPEN) | (solution.why == ON_ANOTHER_SIDE))
    if len(rows):
        singular = find_sides(model, np.array(model.home)[None, :] if starts is None else starts[rows], mode) == 0.0
        solution.why[rows[np.broadcast_to(singular, rows.shape)]] = SINGULAR_START


def _take_modes_of_starts(
    model: Model, solution: Solution, joints: Array, starts: Array, solve: Callable[..., Solution]
) -> None:
    """Put answers in another mode than the default where the start tells that mode, and the answer is beside it."""
    beside = BESIDE * max(model.sizes)
    open_rows = np.flatnonzero(~_is_settled(model, solution, starts))
    for other, which in _group_by_mode(model, starts[open_rows], joints[open_rows]).items():
        rows = open_rows[which]
        answers, own = solve(model, joints[rows], starts[rows], other), _take_rows(solution, rows)
        way = _measure_way(model, answers, starts[rows])
        with np.errstate(invalid="ignore"):
            nearer = way < NEARER * _measure_way(model, own, starts[rows])
            better = (answers.why == ANSWERED) & (way <= beside) & (nearer | (own.why != ANSWERED))
        _put_rows(solution, rows[better], _take_rows(answers, better))
    lost = np.flatnonzero(solution.why != ANSWERED)
    if len(lost):  # where the start does not tell the mode, an answer next to it counts in any
        answers = solve(model, joints[lost], starts[lost], None)
        with np.errstate(invalid="ignore"):
            taken = (answers.why == ANSWERED) & (_measure_way(model, answers, starts[lost]) <= beside)
        taken &= ~find_in_mode(model, answers.poses, joints[lost], model.mode)  # it is refused there: on another side
        _put_rows(solution, lost[taken], _take_rows(answers, taken))


def _is_settled(model: Model, solution: Solution, starts: Array) -> Flags:
    """Tell which rows are answered next to their starts, (N,)."""
    return np.asarray(_is_beside(model, solution.poses, starts) & (solution.why == ANSWERED))


def _is_beside(model: Model, poses: Array, starts: Array) -> Flags:
    """Tell which poses are next to their starts, (N,): in every coordinate, turns not counted."""
    return np.asarray(find_first_negative(model.beside_tape(SETTLED), poses, starts) == 0)


def _group_by_mode(model: Model, poses: Array, joints: Array) -> dict[str, Indices]:
    """Group rows by the working mode other than the default whose joints at the poses are near to the given ones.

    Each leg's joints must be near to the given ones in that mode, and nearer than in any other.
    """
    if not len(poses):
        return {}
    near = STANDS_AT * max(model.sizes)
    signs = [len(leg.branches) for leg in model.spec.legs]
    columns = np.cumsum([0, *(len(leg.drives) for leg in model.spec.legs)])
    head, row_signs = model.mode[sum(signs) :], np.full(len(poses), "", dtype=object)
    choices = ["".join(choice) for choice in product("+-", repeat=max(signs))]
    modes = ["".join(choice[:count] for count in signs) + head for choice in choices]
    off = np.stack([np.abs(_compare_with_mode(model, poses, joints, mode)) for mode in modes])
    off = np.where(np.isfinite(off), off, np.inf)
    clear = np.ones(len(poses), np.bool_)
    for (first, last), count in zip(pairwise(columns), signs, strict=True):
        own = off[:: 2 ** (max(signs) - count), :, first:last].max(2)  # choices that differ in this leg's signs
        ordered = np.sort(own, 0)
        clear &= ordered[0] <= near
        if count:
            clear &= ordered[0] <= STANDS_IN * ordered[1]
        names = np.array([choice[:count] for choice in choices[:: 2 ** (max(signs) - count)]], dtype=object)
        row_signs += names[own.argmin(0)]
    groups: dict[str, list[int]] = {}
    for row in np.flatnonzero(clear).tolist():
        groups.setdefault(row_signs[row] + head, []).append(row)
    groups.pop(model.mode, None)
    return {mode: np.array(members) for mode, members in groups.items()}


def _measure_way(model: Model, solution: Solution, starts: Array) -> Array:
    """Measure how far answers lie from their starts, mm, a turn counted as the greatest leg."""
    turning, direction = model.turning_columns, model.structure.direction
    way = solution.poses - starts
    way[:, turning] = wrap_angle(way[:, turning])
    if direction is not None:  # how far apart the tool's axes point, however B and C are written
        one, other = (_compute_tool_axis(*poses[:, direction.pair].T) for poses in (solution.poses, starts))
        way[:, direction.b], way[:, direction.c] = np.linalg.norm(one - other, axis=1), 0.0
    way[:, turning] *= max(model.sizes)
    length: Array = np.linalg.norm(way, axis=1)
    return length


def _compute_tool_axis(b: Array, c: Array) -> Array:
    """Compute the directions Rz(C)·Ry(B)·z, (N, 3)."""
    return np.stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], -1)


def _take_rows(solution: Solution, rows: Indices | Flags) -> Solution:
    return Solution(
        solution.poses[rows], solution.residual[rows], solution.converged[rows], solution.steps[rows],
        solution.why[rows],
    )  # fmt: skip


def _put_rows(solution: Solution, rows: Indices, other: Solution) -> None:
    """Put another solution in place of some rows of one."""
    for name in ("poses", "residual", "steps", "why"):
        getattr(solution, name)[rows] = getattr(other, name)


def _count_turns(model: Model, poses: Array, near: Array) -> None:
    """Bring the angles of a free platform to B within ±90° and within half a turn of those near by; in place."""
    columns = model.turning_columns.copy()
    if len(columns) == 3:
        poses[:, columns] = bring_within_poles(poses[:, columns])
        del columns[1]
    count_nearest_turns(poses, np.atleast_2d(near), columns)


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
    steps = NewtonSteps(caps, min(model.sizes), most, compute_closure_tolerance(model))
    return solve_by_newton(tapes, steps, np.ascontiguousarray(near), joints, np.empty(0) if side is None else side)


def find_in_mode(model: Model, poses: Array, joints: Array, mode: str | None) -> Flags:
    """Find rows whose legs' joints are those of the inverse at a pose (n, axes) in a working mode, or in any (None).

    Turns do not count. Head and table take the joints as given: they may stand in either of their modes.
    """
    if mode is None or not model.has_modes:
        return np.ones(len(poses), np.bool_)
    off = evaluate_tape_with_residual(model.mode_tape(mode), poses, np.empty((len(poses), 0)), joints)
    return np.asarray(off <= SAME_MODE * max(1.0, max(model.sizes) / 1000.0))


def _compare_with_mode(model: Model, poses: Array, joints: Array, mode: str) -> Array:
    """Subtract the given joints from the legs' joints in a working mode, leg by leg, mm."""
    return evaluate_tape(model.mode_tape(mode), poses, np.empty((len(poses), model.leg_count)), joints)


def _judge(model: Model, roots: Roots, joints: Array, mode: str | None) -> Indices:
    """Tell why roots are no answers, as indices of :data:`REASONS`; zero where they are."""
    turned = roots.turned * _find_angle_signs(model, roots.rows)
    with np.errstate(invalid="ignore"):
        why = np.where(find_in_mode(model, roots.rows, joints, mode), ANSWERED, OTHER_MODE)
        why[~(turned > 0.0)] = ON_ANOTHER_SIDE
        why[~(roots.residual <= compute_closure_tolerance(model))] = OPEN
    return why


def _find_angle_signs(model: Model, poses: Array) -> Array | float:
    """Find the sign by which the determinant of the pose's rates differs from the twist's, at poses or for all."""
    column = model.structure.middle_turn
    if column is None:
        return 1.0
    turns = poses[:, column]
    if np.abs(turns).max(initial=0.0) < 0.5 * np.pi:  # false for NaN
        return 1.0
    with np.errstate(invalid="ignore"):
        return np.sign(np.cos(turns))


def _solve_by_spheres(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Solution:
    """Take, of both common points, the one in the working mode that is nearer to the start, or on home's side."""
    if not model.by_spheres:
        raise NoMethodError(f"{model.spec.name}: no closed form of the direct problem; use method='newton'")
    count = len(joints)
    first, second = np.empty((count, len(model.axes))), np.empty((count, len(model.axes)))
    if starts is None:
        nothing = np.empty((count, 0))
        residual = evaluate_tape_with_residual(model.spheres_tape(model.home_side), joints, first, nothing)
    else:
        unknown = np.full((count, 1), np.nan)
        sides = unknown if mode is None else _find_own_sides(model, joints, starts, mode)
        residual = evaluate_tape_with_residual(model.spheres_on_side_tape(), joints, first, sides)
        lost = np.flatnonzero(np.isnan(sides[:, 0]))  # such a start has no joints of its own, and no side
        if len(lost):
            nearest = second[lost]
            residual[lost] = evaluate_tape_with_residual(model.spheres_tape(None), joints[lost], nearest, starts[lost])
            first[lost] = nearest
    why = np.where(residual <= compute_closure_tolerance(model), ANSWERED, OPEN)
    if model.has_modes:
        lost = np.flatnonzero((why == ANSWERED) & ~find_in_mode(model, first, joints, mode))
        why[lost] = OTHER_MODE
        if starts is None and len(lost):
            given, others, tape = joints[lost], second[lost], model.spheres_tape(-model.home_side)
            open_by = evaluate_tape_with_residual(tape, given, others, np.empty((len(lost), 0)))
            fit = (open_by <= compute_closure_tolerance(model)) & find_in_mode(model, others, given, mode)
            first[lost[fit]], residual[lost[fit]], why[lost[fit]] = others[fit], open_by[fit], ANSWERED
    return Solution(first, residual, why == ANSWERED, np.zeros(count, np.int32), why)


def _find_own_sides(model: Model, joints: Array, starts: Array, mode: str) -> Array:
    """Find on which side of their own spheres' centres starts lie, (N, 1), by its sign; NaN out of reach."""
    sides = evaluate_tape(model.own_side_tape(mode), starts, np.empty((len(starts), 1)))
    if model.structure.branches:
        some = np.empty_like(starts)  # either common point: head and table alone turn the tool
        evaluate_tape_with_residual(model.spheres_tape(None), joints, some, starts)
        nearer = _is_in_other_head_mode(model, some, joints, mode)
        others = evaluate_tape(model.own_side_tape(flip_mode(mode)), starts, np.empty((len(starts), 1)))
        sides[nearer] = others[nearer]
    return sides


def _is_in_other_head_mode(model: Model, poses: Array, joints: Array, mode: str) -> Flags:
    """Tell at which poses head and table's joints are nearer to the given ones in the other of their modes."""
    serial = slice(model.leg_count, None)
    own, other = (solve_inverse(model, poses, choice) for choice in (mode, flip_mode(mode)))
    far = [np.abs(wrap_angle((turned - joints)[:, serial])).max(1, initial=0.0) for turned in (own, other)]
    return np.asarray(far[1] < far[0])


def find_sides(model: Model, poses: Array, mode: str | None = None, joints: Array | None = None) -> Array:
    """Compute the determinant of the twist at poses, (N,), but for its size.

    Its sign tells the assembly mode, and zero is a singularity. Its closures are those of the poses' own joints in a
    working mode; where these do not exist, of ``joints`` (1 or N rows), if given.
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
    sides[lost | (np.abs(sides) <= SINGULAR * _bound_determinant(model))] = 0.0
    return sides * _find_angle_signs(model, poses)


def _bound_determinant(model: Model) -> float:
    """Return the greatest determinant that closures' derivatives of home's sizes can have, by Hadamard."""
    home, tape = np.array(model.home)[None, :], model.newton_tape(True)
    joints, count = solve_inverse(model, home, model.mode), len(model.structure.coordinates)
    coordinates = evaluate_tape(model.begin_tape(), home, np.empty((1, count)), joints)
    slopes = evaluate_tape(tape, coordinates, np.empty((1, tape.outputs)), joints)[0, model.leg_count :]
    scales = np.array([max(model.sizes) if word.startswith("r") else 1.0 for word in model.structure.coordinates])
    return float(np.linalg.norm(slopes.reshape(-1, count) / scales, axis=1).prod() * scales.prod())


def _solve_by_newton(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Solution:
    near = np.array(model.home)[None, :] if starts is None else starts
    if starts is None:
        roots = find_roots(model, near, joints, side=find_sides(model, near, mode))
        why = _judge(model, roots, joints, mode)
    else:
        roots = find_roots(model, near, joints)
        _take_own_sides(model, roots, near, joints, mode)
        why = _judge(model, roots, joints, mode)
    if (why != ANSWERED).any():
        _continue_from_starts(model, near, joints, (roots, why), mode)
    return Solution(roots.rows, roots.residual, why == ANSWERED, roots.steps, why)


def _take_own_sides(model: Model, roots: Roots, near: Array, joints: Array, mode: str | None) -> None:
    """Multiply the roots' determinants by those of the starts with their own joints, not with the given ones; in place.

    The determinant of struts of any length is the same. Else it differs little where it differs little from the
    root's; only where it does not, the starts' own joints are looked for.
    """
    roots.turned[:] *= _find_angle_signs(model, near)
    if not model.has_modes:
        roots.turned[roots.turned <= (SINGULAR * _bound_determinant(model)) ** 2] = 0.0
        return
    tiny = roots.turned <= (SINGULAR * _bound_determinant(model)) ** 2
    with np.errstate(all="ignore"):
        steady = (np.abs(roots.turned / roots.first**2 - 1.0) <= STEADY) & _is_beside(model, roots.rows, near)
    if not steady.all():
        rows = np.flatnonzero(~steady)
        starts, given = (np.ascontiguousarray(np.broadcast_to(near, roots.rows.shape)[rows]), joints[rows])
        sides = find_sides(model, starts, mode, given)
        roots.turned[rows] = find_roots(model, roots.rows[rows], given, most=0, side=sides).turned
    roots.turned[tiny & steady] = 0.0


def _continue_from_starts(
    model: Model, near: Array, joints: Array, into: tuple[Roots, Indices], mode: str | None
) -> None:
    """Continue along the joints' straight line from the start where Newton's method in one go failed; in place.

    Steps are halved where Newton's method does not converge at once, on the same side and in the working mode, and
    doubled where it does. A row that can't be continued keeps the reason of its last step.
    """
    roots, why = into
    walk = np.broadcast_to(near, (len(joints), near.shape[1]))
    begin = solve_inverse(model, walk, model.mode if mode is None else mode)
    rows = np.flatnonzero((why != ANSWERED) & np.isfinite(joints).all(1) & np.isfinite(begin).all(1))
    if not len(rows):
        return
    walk, begin, goal = np.ascontiguousarray(walk[rows]), begin[rows], joints[rows]
    side = find_sides(model, walk, mode)
    gone, part = np.zeros(len(rows)), np.full(len(rows), FIRST_PART)
    for _ in range(MOST_PARTS):
        going = np.flatnonzero((gone < 1.0) & (part >= LEAST_PART))
        if not len(going):
            break
        share = np.minimum(1.0, gone[going] + part[going])
        given = begin[going] + share[:, None] * (goal[going] - begin[going])
        step = find_roots(model, walk[going], given, most=NEAR_STEPS, side=side[going])
        reason = _judge(model, step, given, mode)
        roots.steps[rows[going]] += step.steps
        fine = np.asarray(reason == ANSWERED)
        kept = going[fine]
        walk[kept], gone[kept] = step.rows[fine], share[fine]
        part[kept] *= 2.0
        part[going[~fine]] *= 0.5
        why[rows[going]] = reason
        done = kept[gone[kept] >= 1.0]
        at_end = np.flatnonzero(fine & (share >= 1.0))
        roots.rows[rows[done]], roots.residual[rows[done]] = step.rows[at_end], step.residual[at_end]
    why[rows[gone < 1.0]] = np.where(why[rows[gone < 1.0]] == ANSWERED, OPEN, why[rows[gone < 1.0]])


def _solve_by_constant_jacobian(model: Model, joints: Array, starts: Array | None, mode: str | None) -> Solution:
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
    poses = compute_poses(model, y, joints)
    sides = find_sides(model, given, mode, None if starts is None else joints)
    roots = find_roots(model, y, joints, most=0, poses=False, side=sides)
    bound = SINGULAR * _bound_determinant(model)
    with np.errstate(invalid="ignore"):
        roots.turned[np.abs(roots.first) <= bound] = 0.0
    why = _judge(model, roots._replace(rows=poses), joints, mode)
    return Solution(poses, roots.residual, why == ANSWERED, steps, why)


_METHODS = {"closed": _solve_by_spheres, "newton": _solve_by_newton, "constant": _solve_by_constant_jacobian}
