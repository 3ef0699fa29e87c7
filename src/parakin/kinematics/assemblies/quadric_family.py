"""The family of quadric systems that a motion and its legs make: what all machines of one motion have in common.

A motion's points span a linear subspace of Study's space and lie on quadrics of their own; both are found from sampled
points, so any order of turns and translations will do. A leg's closure puts a platform point on a sphere or a plane, so
it is one more quadric, and linear in its numbers: all closures span a linear space. A member of the family is the
motion's own quadrics with as many closures as the motion has freedoms.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...model.chain import compose_chain
from ...model.elements import Step
from .study import compute_study_points, make_closure_quadrics

Complex = NDArray[np.complex128]

_SEED = 1
_SAMPLES = 150  # more than the 36 products of eight coordinates
_WIDE = 1.5  # sampled turns, rad, and translations, in the machine's size
_INDEPENDENT = 1e-9  # of the greatest singular value


class QuadricFamily(NamedTuple):
    """All systems of one motion, in n homogeneous coordinates y with x = y·hull.

    hull : (n, 8) orthonormal rows, the linear span of the motion's points
    fixed : (n - 1 - freedoms, n, n) quadrics that hold the motion
    closures : (s, n, n) orthonormal quadrics, the span of all closures of points on the motion
    sample : (n,) a point of the motion
    freedoms : the number of the motion's freedoms
    """

    hull: Array
    fixed: Complex
    closures: Array
    sample: Array
    freedoms: int

    def make_member(self, closures: Complex) -> Complex:
        """Join the motion's quadrics and closures (..., freedoms, n, n) to systems (..., n - 1, n, n)."""
        fixed = np.broadcast_to(self.fixed, (*closures.shape[:-3], *self.fixed.shape))
        return np.ascontiguousarray(np.concatenate([fixed, closures], -3))


def draw_complex(rng: np.random.Generator, *shape: int) -> Complex:
    """Draw complex numbers, normally distributed with variance one."""
    drawn: Complex = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2.0)
    return drawn


@cache
def make_family(motion: tuple[str, ...]) -> QuadricFamily:
    """Make the family of a motion, given by its words in order."""
    rng = np.random.default_rng(_SEED)
    frames = [
        compose_chain([Step(word, value) for word, value in zip(motion, values, strict=True)], ())
        for values in rng.uniform(-_WIDE, _WIDE, (_SAMPLES, len(motion))).tolist()
    ]
    points = compute_study_points(np.array([f[0] for f in frames], float), np.array([f[1] for f in frames], float))
    hull = _find_hull(points)
    inside = points @ hull.T
    own: Array | Complex = _find_quadrics(inside)
    n, freedoms = len(hull), len(motion)
    count = n - 1 - freedoms
    if len(own) > count:  # more than are independent along the motion: combinations cut it out near every point of it
        own = np.tensordot(draw_complex(rng, count, len(own)), own, 1)
    legs = np.concatenate([make_closure_quadrics(p) for p in rng.uniform(-1.0, 1.0, (12, 3))])
    closures = (hull @ legs @ hull.T).reshape(-1, n * n)
    if len(own):
        basis = np.linalg.qr(_find_quadrics(inside).reshape(-1, n * n).T)[0]
        closures = closures - closures @ basis @ basis.T
    return QuadricFamily(hull, own.astype(np.complex128), _find_span(closures).reshape(-1, n, n), inside[0], freedoms)


def _find_hull(points: Array) -> Array:
    """Find orthonormal rows that span points (N, 8): where these span all, the coordinates, whose zeros are kept."""
    hull = _find_span(points)
    return np.eye(points.shape[1]) if len(hull) == points.shape[1] else hull


def _find_span(rows: Array) -> Array:
    """Find an orthonormal basis of the span of rows."""
    _, values, basis = np.linalg.svd(rows, full_matrices=False)
    return np.ascontiguousarray(basis[values > _INDEPENDENT * values[0]])


def _find_quadrics(points: Array) -> Array:
    """Find all quadrics through points (N, n), (k, n, n) symmetric, orthonormal as vectors."""
    n = points.shape[1]
    rows, columns = np.triu_indices(n)
    weights = np.where(rows == columns, 1.0, np.sqrt(2.0))  # so that vectors have the length of their matrices
    _, values, basis = np.linalg.svd(points[:, rows] * points[:, columns] * weights)
    rank = int((values > _INDEPENDENT * values[0]).sum())
    quadrics = np.zeros((len(basis) - rank, n, n))
    for quadric, vector in zip(quadrics, basis[rank:], strict=True):
        quadric[rows, columns] = vector / weights
        quadric[columns, rows] = vector / weights
    return quadrics
