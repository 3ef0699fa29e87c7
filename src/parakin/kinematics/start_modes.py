"""Working modes that starts tell: an answer in another mode than the default where the start's own legs stand in it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product

import numpy as np

from ..arrays import Array, Flags, Indices
from ..kernels.batch import find_first_negative
from ..model.traces import Model
from .assembly_side import find_sides
from .closure_roots import compare_with_mode, find_in_mode
from .solution import ANSWERED, ON_ANOTHER_SIDE, Answers, put_rows, take_rows
from .turns import wrap_angle
from .wrist.pose_angles import point_direction

STANDS_IN = 0.5  # of the way to another mode: how near joints must be to tell that a pose's legs stand in a mode
NEARER = 0.1  # of the way to the answer in the default mode: one in another mode that is nearer is taken instead
STANDS_AT = 0.1  # of the legs: how near these joints must be
BESIDE = 0.0125  # of the legs: an answer in another mode than the default counts only if it is as near to its start
SETTLED = 0.0125  # of the legs, and rad: so near to its start an answer in the default mode is accepted


def answer_in_modes_of_starts(
    model: Model, solution: Answers, joints: Array, starts: Array, solve: Callable[..., Answers]
) -> Flags:
    """Put answers in another mode than the default where the start tells that mode, and the answer is beside it.

    Returns which rows (N,) are answered in another mode.
    """
    in_other_mode = np.zeros(len(joints), np.bool_)
    beside = BESIDE * max(model.sizes)
    open_rows = np.flatnonzero(~_is_settled(model, solution, starts))
    for other, which in _group_by_mode(model, starts[open_rows], joints[open_rows]).items():
        rows = open_rows[which]
        answers, own = solve(model, joints[rows], starts[rows], other), take_rows(solution, rows)
        way = _measure_way(model, answers, starts[rows])
        with np.errstate(invalid="ignore"):
            nearer = way < NEARER * _measure_way(model, own, starts[rows])
            better = (answers.why == ANSWERED) & (way <= beside) & (nearer | (own.why != ANSWERED))
        put_rows(solution, rows[better], take_rows(answers, better))
        in_other_mode[rows[better]] = True
    lost = np.flatnonzero(solution.why != ANSWERED)
    if len(lost):  # where the start does not tell the mode, an answer next to it counts in any
        answers = solve(model, joints[lost], starts[lost], None)
        with np.errstate(invalid="ignore"):
            accepted = (answers.why == ANSWERED) & (_measure_way(model, answers, starts[lost]) <= beside)
        accepted &= ~find_in_mode(model, answers.poses, joints[lost], model.mode)  # refused there: another side
        next_to = np.flatnonzero(accepted)
        across = next_to[_find_across(model, answers.poses[next_to], starts[lost[next_to]], joints[lost[next_to]])]
        accepted[across], solution.why[lost[across]] = False, ON_ANOTHER_SIDE
        put_rows(solution, lost[accepted], take_rows(answers, accepted))
        in_other_mode[lost[accepted]] = True
    return in_other_mode


def _find_across(model: Model, poses: Array, starts: Array, joints: Array) -> Flags:
    """Find answers (N,) on another side than their starts, each with its own joints in the answer's mode."""
    across = np.zeros(len(poses), np.bool_)
    for mode, rows in _group_by_mode(model, poses, joints).items():
        start, answer = (find_sides(model, each[rows], mode, joints[rows]) for each in (starts, poses))
        across[rows] = start * answer < 0.0
    return across


def _is_settled(model: Model, solution: Answers, starts: Array) -> Flags:
    """Tell which rows are answered next to their starts, (N,)."""
    return np.asarray(is_beside(model, solution.poses, starts) & (solution.why == ANSWERED))


def is_beside(model: Model, poses: Array, starts: Array) -> Flags:
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
    off = np.stack([np.abs(compare_with_mode(model, poses, joints, mode)) for mode in modes])
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


def _measure_way(model: Model, solution: Answers, starts: Array) -> Array:
    """Measure how far answers lie from their starts, mm, a turn counted as the greatest leg."""
    turning, direction = model.turning_columns, model.structure.direction
    way = solution.poses - starts
    way[:, turning] = wrap_angle(way[:, turning])
    if direction is not None:  # how far apart the tool's axes point, however B and C are written
        one, other = (point_direction(*poses[:, direction.pair].T) for poses in (solution.poses, starts))
        way[:, direction.b], way[:, direction.c] = np.linalg.norm(one - other, axis=1), 0.0
    way[:, turning] *= max(model.sizes)
    length: Array = np.linalg.norm(way, axis=1)
    return length
