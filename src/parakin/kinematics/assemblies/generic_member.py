"""A generic member of a family and all its roots, found by monodromy and proved complete by the trace test.

Along a loop in the space of members the roots of one come back in another order, so that from one root all others of an
irreducible family are reached. They are all there when the sum of a closure over them depends linearly on where the
last closure's parallel slices lie (Leykin, Rodriguez and Sottile, Trace test, 2018).

The members of the shipped machines' motions are stored, in Study's coordinates, by ``scripts/generic_members.py``.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...errors import NoMethodError
from .path_tracking import join_roots, track_members
from .quadric_family import Complex, QuadricFamily, draw_complex, make_family

_SEED = 2
_QUIET_LOOPS = 4  # without a new root, before the trace test
_MOST_LOOPS = 60
_LINEAR = 1e-8  # of the trace's size
_STORED = "generic_members.npz"
_ROUNDING = 1e-10  # by how much a stored member may differ from one of the family computed here


class GenericMember(NamedTuple):
    """A member with generic complex numbers, and its roots.

    system : (n - 1, n, n)
    roots : (k, n) of length one
    lost_count : how many paths lead to it that may end at roots besides these
    """

    system: Complex
    roots: Complex
    lost_count: int = 0


@cache
def find_generic_member(motion: tuple[str, ...]) -> GenericMember:
    """Find one member of a motion's family with all its roots, the stored one or by monodromy."""
    return read_stored_member(motion) or search_generic_member(motion)


def read_stored_member(motion: tuple[str, ...]) -> GenericMember | None:
    """Read the stored member of a motion's family; None where there is none, or none of the family made here.

    A motion's quadrics are combined from a basis that other versions of LAPACK choose otherwise.
    """
    family, name = make_family(motion), "_".join(motion)
    with (files(__package__) / _STORED).open("rb") as file, np.load(file) as stored:
        if name not in stored:
            return None
        quadrics, points = stored[name], stored[f"{name}_roots"]
    system, roots = family.hull @ quadrics @ family.hull.T, points @ family.hull.T
    count, n = len(family.fixed), len(family.hull)
    fixed, closures = system[:count].reshape(-1, n * n), system[count:].reshape(-1, n * n)
    own, basis = family.fixed.reshape(-1, n * n), family.closures.reshape(-1, n * n)
    aligned = np.abs((fixed.conj() * own).sum(1))
    differs = aligned < (1.0 - _ROUNDING) * np.linalg.norm(fixed, axis=1) * np.linalg.norm(own, axis=1)
    outside = np.abs(closures - closures @ basis.conj().T @ basis).max()
    if differs.any() or outside > _ROUNDING:
        return None
    system[:count] = family.fixed
    return GenericMember(np.ascontiguousarray(system), np.ascontiguousarray(roots))


def search_generic_member(motion: tuple[str, ...]) -> GenericMember:
    """Find one member of a motion's family with all its roots by monodromy."""
    family = make_family(motion)
    rng = np.random.default_rng(_SEED)
    root = family.sample.astype(np.complex128)
    values = np.einsum("i,kij,j->k", root, family.closures, root)
    weights = draw_complex(rng, family.freedoms, len(values))
    weights -= np.outer(weights @ values, values.conj()) / (values @ values.conj())  # so that the sample is a root
    system = family.make_member(np.tensordot(weights, family.closures, 1))
    roots = (root / np.linalg.norm(root))[None]
    quiet = 0
    for _ in range(_MOST_LOOPS):
        more = _go_round(family, system, roots, rng)
        quiet = quiet + 1 if len(more) == len(roots) else 0
        roots = more
        if quiet >= _QUIET_LOOPS and measure_trace(family, GenericMember(system, roots), rng) < _LINEAR:
            return GenericMember(system, roots)
    raise NoMethodError(f"{' '.join(motion)}: monodromy found {len(roots)} roots, and the trace test fails")


def _draw_member(family: QuadricFamily, rng: np.random.Generator) -> Complex:
    """Draw a member with generic complex numbers."""
    return family.make_member(
        np.tensordot(draw_complex(rng, family.freedoms, len(family.closures)), family.closures, 1)
    )


def _go_round(family: QuadricFamily, system: Complex, roots: Complex, rng: np.random.Generator) -> Complex:
    """Track roots along a triangle of members, and join those that come back to those that left."""
    corners = [system, _draw_member(family, rng), _draw_member(family, rng), system]
    points = roots
    for first, last in pairwise(corners):
        ends = track_members(first[None], last[None], points)
        points = ends.points[0][ends.reached[0] == 1.0]
    return join_roots(roots, points)


def measure_trace(family: QuadricFamily, member: GenericMember, rng: np.random.Generator) -> float:
    """Measure how far a trace is from linear, of its size: zero where the member has no other roots.

    The last closure's slices are moved by multiples of a quadric that also divides the traced one.
    """
    moved, traced = (np.tensordot(draw_complex(rng, len(family.closures)), family.closures, 1) for _ in range(2))
    sums = []
    for slice_ in (0.0, 1.0, 2.0):
        system = member.system.copy()
        system[-1] += slice_ * moved
        points = member.roots
        if slice_:
            ends = track_members(member.system[None], system[None], points)
            if not (ends.reached == 1.0).all():
                return np.inf
            points = ends.points[0]
        above, below = (np.einsum("ki,ij,kj->k", points, q, points) for q in (traced, moved))
        sums.append((above / below).sum())
    return float(np.abs(sums[0] - 2.0 * sums[1] + sums[2]) / (np.abs(sums).max() + 1e-300))
