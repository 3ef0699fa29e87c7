"""Homotopies between members of a family, and where their paths end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Flags
from ...kernels.batch import run_in_threads
from .quadric_family import Complex

_CLOSE = 1e-8  # 1 - cos of the angle of two points of projective space that may be the same
_SAME = 1e-7  # rad: a regular root is known better than this, and two that are farther apart are two
_PATHS_A_THREAD = 16
_MOST_PHASES = 8
_ENOUGH = 1e-3  # of a closure of length one: the length of its steady entries from which they tell its scale

LENIENT = 1e-4  # tolerances of the last terms of a path's series: usual, and where paths met
STRICT = 1e-9


class PathEnds(NamedTuple):
    """Where paths ended.

    points : (systems, paths, n) complex, of length one
    reached : (systems, paths) the last t; 1 at a regular root of the last system
    """

    points: Complex
    reached: Array


def align_members(first: Complex, last: Complex, fixed: int) -> tuple[Complex, Complex]:
    """Combine the closures of both systems so that they differ little: the same roots, and shorter paths.

    Each system's closures become orthonormal; the first one's are turned onto the last one's (Procrustes). The systems
    between are members of the whole family, so ``first`` must have as many roots as a generic one.

    first : (n - 1, n, n); last : (systems, n - 1, n, n)
    fixed : how many quadrics of each come first and stay as they are
    """
    count, n = last.shape[1] - fixed, last.shape[2]
    rows = np.linalg.qr(first[fixed:].reshape(count, -1).T)[0].T
    goal = np.linalg.qr(last[:, fixed:].reshape(len(last), count, -1).swapaxes(1, 2))[0].swapaxes(1, 2)
    left, _, right = np.linalg.svd(goal @ rows.conj().T)
    begin, end = np.empty_like(last), np.empty_like(last)
    begin[:, :fixed], end[:, :fixed] = first[:fixed], last[:, :fixed]
    begin[:, fixed:] = ((left @ right) @ rows).reshape(-1, count, n, n)
    end[:, fixed:] = goal.reshape(-1, count, n, n)
    return begin, end


def align_closures(first: Complex, last: Complex, fixed: int, steady: Flags) -> tuple[Complex, Complex]:
    """Scale each closure of ``first`` so that it differs little from that of ``last``: same roots, shorter paths.

    Every closure between is one of the same leg, so that ``first`` may be generic among one machine's systems alone.
    The entries that no joint changes become the same, and the others alone change on the way.

    first : (n - 1, n, n); last : (systems, n - 1, n, n), both with closures of length one
    fixed : how many quadrics of each come first and stay as they are
    steady : (n - 1, n, n) where joints change an entry by no more than the whole closure's scale
    """
    kept = np.where(steady, first, 0.0)
    squares = (np.abs(kept) ** 2).sum((1, 2))
    known = squares > _ENOUGH**2
    own = np.where(known[:, None, None], kept, first)
    products = np.einsum("rij,srij->sr", own.conj(), last)
    factors = products / np.where(known, squares, np.maximum(np.abs(products), 1e-300))
    factors[:, :fixed] = 1.0
    aligned = factors[..., None, None] * first
    return np.where(steady & known[:, None, None], last, aligned), last


def track_members(first: Complex, last: Complex, starts: Complex, tolerance: float = LENIENT) -> PathEnds:
    """Track all paths from the roots ``starts`` (paths, n) of ``first`` to ``last`` (systems, n - 1, n, n).

    first : (systems, n - 1, n, n)

    Where two paths of a system end in one regular root, one has jumped onto the other; both are tracked once more in
    shorter steps.
    """
    from ...kernels.homotopy import list_entries, track_paths

    shape = (len(last), *starts.shape)
    ends = PathEnds(np.empty(shape, np.complex128), np.empty(shape[:2]))
    ends.points[:] = starts
    entries, changes = list_entries(last), list_entries(last - first)
    run_in_threads(
        shape[0] * shape[1], lambda a, b: track_paths(entries, changes, tolerance, ends, a, b), _PATHS_A_THREAD
    )
    if tolerance > STRICT:
        for system in np.flatnonzero(find_meetings(ends).any(1)):
            again = track_members(first[system : system + 1], last[system : system + 1], starts, STRICT)
            ends.points[system], ends.reached[system] = again.points[0], again.reached[0]
    return ends


def find_regular_roots(first: Complex, last: Complex, starts: Complex, fixed: int) -> tuple[Complex, int]:
    """Track ``starts`` to regular roots of one system, along homotopies that differ by a phase, until one finds all.

    A path that is lost, or jumps onto another one, is so on one of them: what is left out here would be missing in all
    answers that begin at these roots. Paths that lead to no regular root are lost on every homotopy; the other number
    is of those that are lost on some only, however often that is tried: they lead to roots that are nearly singular.

    first, last : (1, n - 1, n, n), whose first ``fixed`` quadrics stay as they are
    """
    roots = np.empty((0, starts.shape[1]), np.complex128)
    for number in range(_MOST_PHASES):
        turned = first.copy()
        turned[:, fixed:] *= np.exp(1j * number)
        ends = track_members(turned, last, starts, STRICT if number else LENIENT)
        again = join_roots(roots[:0], ends.points[0][ends.reached[0] == 1.0])
        before = len(roots)
        roots = join_roots(roots, again)
        if len(roots) == len(starts) or (number and len(again) == len(roots) == before):
            return roots, 0
    return roots, len(starts) - len(roots)


def join_roots(roots: Complex, more: Complex) -> Complex:
    """Join roots (k, n) with those of others that are not among them, whatever their phases."""
    for point in more:
        if not (np.abs(roots.conj() @ point) > 1.0 - _CLOSE).any():
            roots = np.vstack([roots, point])
    return roots


def find_meetings(ends: PathEnds) -> Flags:
    """Find paths (systems, paths) that end in the same regular root as another one of their system."""
    close = np.abs(ends.points.conj() @ ends.points.swapaxes(1, 2)) >= 1.0 - _CLOSE
    regular = ends.reached == 1.0
    close &= regular[:, :, None] & regular[:, None, :]
    system, one, other = np.nonzero(np.triu(close, 1))
    same = measure_angles(ends.points[system, one], ends.points[system, other]) < _SAME
    meetings = np.zeros(regular.shape, np.bool_)
    meetings[system[same], one[same]] = meetings[system[same], other[same]] = True
    return meetings


def measure_angles(points: Array | Complex, others: Array | Complex) -> Array:
    """Measure small angles between points (k, n) of length one and others, whatever their phases: (k,) rad."""
    along = (others.conj() * points).sum(1, keepdims=True)
    return np.asarray(np.linalg.norm(points - along * others, axis=1))
