"""What is answered of all assemblies of one joint vector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...arrays import Array, Flags, Indices, find_finite_rows, split_rows
from ...model.traces import Model
from ..assembly_side import bound_determinant, find_angle_signs
from ..closure_roots import compute_closure_tolerance, compute_poses, find_roots
from ..inverse import SINGULAR
from ..limit_margins import find_broken_limits
from ..wrist.pole_thresholds import is_upright
from .closed_forms import LONGEST, ClosedForm, find_closed_form, solve_closed_form
from .homotopy_roots import find_coordinates, find_real_roots, make_closure_system
from .root_boxes import prove_roots

_OPEN = 1e-6  # of the greatest leg: a root of the leading closures that leaves others farther open is no pose
_AT_ONCE = 256  # rows of joints: some thousands of solutions
CLOSED_FORM = "proved (closed form)"
ALL_PATHS = "all paths accounted for"
NOT_COMPLETE = "not complete"


@dataclass(frozen=True)
class Assemblies:
    """Every real pose of one joint vector.

    poses : (k, axes), mm and rad
    residuals : (k,) the greatest closure, mm
    radii : (k, 2) within what distance of its pose's the exact platform's origin lies, mm, and its turn, rad, by
        Krawczyk's test; NaN where there is no proof, as at a singularity, where two poses meet
    sides : (k,) the sign of det A, 0 at a singularity
    within_limits : (k,) where the pose keeps every limit
    complete : ``proved (closed form)``, ``all paths accounted for`` (of a homotopy), or ``not complete``
    complex_count : solutions that are not real; None of a closed form
    infinite_count : paths that ended at infinity; None of a closed form
    lost_count : paths that could not be followed, for these joints or for any, as of a platform that is nearly singular
        everywhere; None of a closed form
    untold_count : real solutions that no pose of this machine tells: its platform hangs there the other way round, its
        constraints hold it in another of their own solutions, or a strut ends on its ring's far side
    """

    poses: Array
    residuals: Array
    radii: Array
    sides: Array
    within_limits: Flags
    complete: str
    complex_count: int | None = None
    infinite_count: int | None = None
    lost_count: int | None = None
    untold_count: int = 0

    def __len__(self) -> int:
        return len(self.poses)

    def __repr__(self) -> str:
        return f"<{len(self)} assemblies, {self.complete}>"


def find_assemblies(model: Model, joints: Array) -> list[Assemblies]:
    """Find every real pose of each row of joints (N, joints).

    Machines that only translate on three (two) rods have two: the common points of spheres (circles). Three rods in a
    plane have up to six, three Lambda legs on parallel shafts up to twelve. All others are systems of quadrics in
    Study's parameters, whose roots are those of a generic one, tracked to it. With more drives than freedoms all roots
    of the leading closures are found, as many as there are freedoms, and those kept at which the others close too.

    Raises :class:`NoMethodError` for a continuum of poses.
    """
    return [answer for rows in split_rows(len(joints), _AT_ONCE) for answer in _find_in_block(model, joints[rows])]


def _find_in_block(model: Model, joints: Array) -> list[Assemblies]:
    """Find every real pose of some rows of joints, whose systems and solutions are in memory together."""
    method = find_closed_form(model)
    near = np.asarray((np.abs(joints) < LONGEST).all(1))
    if method is not None:
        return _describe(model, joints, [_solve_near(model, method, row[None]) for row in joints], CLOSED_FORM)
    answers = _describe(model, joints, [_make_empty_coordinates(model)] * len(joints), CLOSED_FORM)
    rows = np.flatnonzero(near)
    roots = find_real_roots(model, joints[rows])
    coordinates = [find_coordinates(model, own.points, given) for own, given in zip(roots, joints[rows], strict=True)]
    if model.is_redundant:
        coordinates = [_drop_open(model, own, given) for own, given in zip(coordinates, joints[rows], strict=True)]
    with_pose = [find_finite_rows(own) for own in coordinates]
    kept = [own[has_pose] for own, has_pose in zip(coordinates, with_pose, strict=True)]
    described = _describe(model, joints[rows], kept, ALL_PATHS)
    for row, own, has_pose, answer in zip(rows.tolist(), roots, with_pose, described, strict=True):
        answers[row] = replace(
            answer,
            complete=NOT_COMPLETE if own.lost_count else answer.complete,
            complex_count=own.complex_count,
            infinite_count=own.infinite_count,
            lost_count=own.lost_count,
            untold_count=answer.untold_count + int((~has_pose).sum()),
        )
    return answers


def _drop_open(model: Model, coordinates: Array, joints: Array) -> Array:
    """Drop coordinates (k, m) at which closures besides the leading ones are open, for one row of joints (joints,)."""
    given = np.ascontiguousarray(np.broadcast_to(joints, (len(coordinates), len(joints))))
    residual = find_roots(model, coordinates, given, most=0, poses=False).residual
    return coordinates[~(residual > _OPEN * max(model.sizes))]


def _make_empty_coordinates(model: Model) -> Array:
    return np.empty((0, len(model.structure.coordinates)))


def _solve_near(model: Model, method: ClosedForm, joints: Array) -> Array:
    """Solve one row of joints (1, joints) in closed form; farther than any machine reaches there is no pose."""
    if not (np.abs(joints) < LONGEST).all():
        return _make_empty_coordinates(model)
    return solve_closed_form(model, method, joints)


def _describe(model: Model, joints: Array, coordinates: Sequence[Array], complete: str) -> list[Assemblies]:
    """Polish coordinates (k, m) of every row's solutions, and tell all that is known of them."""
    owners = np.repeat(np.arange(len(joints)), [len(own) for own in coordinates])
    given = np.ascontiguousarray(joints[owners])
    roots = find_roots(
        model, np.ascontiguousarray(np.concatenate([_make_empty_coordinates(model), *coordinates])), given, poses=False
    )
    residuals = roots.residual
    closed = residuals <= compute_closure_tolerance(model)
    poses = compute_poses(model, np.ascontiguousarray(roots.rows), given)
    has_pose = np.isfinite(poses).all(1)
    direction = model.structure.direction
    if direction is not None:
        poses[is_upright(poses[:, direction.b]), direction.c] = 0.0
    kept = np.flatnonzero(closed & has_pose)
    kept = kept[np.lexsort((*poses[kept].T[::-1], owners[kept]))]
    poses, given = np.ascontiguousarray(poses[kept]), np.ascontiguousarray(given[kept])
    radii = _prove_poses(model, joints, roots.rows[kept], owners[kept])
    sides = _find_signs(model, poses, given)
    within_limits = find_broken_limits(model, poses, given, model.mode) == 0
    open_counts = np.bincount(owners[~closed], minlength=len(joints))
    untold_counts = np.bincount(owners[closed & ~has_pose], minlength=len(joints))
    bounds = np.searchsorted(owners[kept], np.arange(len(joints) + 1))
    answers = []
    for row, (first, last) in enumerate(pairwise(bounds.tolist())):
        of_row = slice(first, last)
        known = complete == CLOSED_FORM or not open_counts[row]
        answers.append(
            Assemblies(
                poses[of_row],
                residuals[kept][of_row],
                radii[of_row],
                sides[of_row],
                within_limits[of_row],
                complete if known else NOT_COMPLETE,
                untold_count=int(untold_counts[row]),
            )
        )
    return answers


def _find_signs(model: Model, poses: Array, joints: Array) -> Array:
    """Find the sign of det A at poses with these joints, 0 at a singularity."""
    determinants = find_roots(model, poses, joints, most=0, side=np.ones(1)).turned
    determinants[~(np.abs(determinants) > SINGULAR * bound_determinant(model))] = 0.0
    return np.sign(determinants * find_angle_signs(model, poses))


def _prove_poses(model: Model, joints: Array, coordinates: Array, owners: Indices) -> Array:
    """Bound how far poses of the motion's coordinates (k, m) are from exact ones, as :attr:`Assemblies.radii`.

    owners : (k,) the row of joints (N, joints) of each
    """
    if not len(coordinates):
        return np.empty((0, 2))
    system = make_closure_system(model)
    with np.errstate(divide="ignore", invalid="ignore"):  # of a tool axis the other way round the axis alone is told
        rotation, origin = model.structure.frame(list(coordinates.T))
    entries = np.stack(
        np.broadcast_arrays(*(entry for row in rotation for entry in row), *origin, coordinates[:, 0]), 1
    )
    points = system.compute_points(entries[:, :9].reshape(-1, 3, 3), entries[:, 9:12])
    widths = prove_roots(system.make_systems(joints).real[owners], points) * np.sqrt(points.shape[1])
    return system.bound_moves(points, widths)
