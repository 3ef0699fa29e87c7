"""Parasitic motions in closed form: what the constraints leave of a platform's frame for its independent coordinates.

A constraint is a point of one body in a plane of the other. Two families are linear in what is unknown:

- planes of the base, some translations and one turn unknown: :class:`TurnInBasePlanes`;
- planes of the platform, two of them parallel, and all three turns unknown: :class:`TurnsInPlatformPlanes`.

Each has two solutions; the machine is assembled in the one that is nearer to no turn at home.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...algebra import ORIGIN, Mat, Scalar, Vec, add, apply, cross, dot, norm, product, scale, sqrt, sub, transpose
from ...errors import DescriptionError
from ..chain import UNIT, make_rotation_about
from ..elements import ROTATIONS, TRANSLATIONS, PlaneConstraint
from ..nominal_values import find_nominal_value
from ..spec import Spec

_FEW = 1e-9  # of the greatest singular value: normals that tell no more
_ZERO = 1e-15  # constants of the sizes of unit vectors: what is less is rounding


@dataclass(frozen=True)
class FoundFrame:
    """The platform's frame, and margins without unit: ≥ 0 where the constraints can be kept."""

    rotation: Mat
    origin: Vec
    reach: tuple[Scalar, ...]


def find_direction(first: Vec, a: Scalar, second: Vec, b: Scalar, side: float) -> tuple[Vec, Scalar]:
    """Find the unit vector v with first·v = a and second·v = b, on one side (±1) of the plane of both vectors.

    Also a margin without unit: 1 - sin² of how far the two lead, ≥ 0 where there is such a vector; it is NaN elsewhere.
    """
    normal = cross(first, second)
    size = dot(normal, normal)
    within = add(scale(cross(second, normal), a), scale(cross(normal, first), b))  # times the size
    inverse = 1.0 / size
    middle = scale(within, inverse)
    margin = 1.0 - dot(middle, middle)
    return add(middle, scale(normal, side * sqrt(margin * inverse))), margin


class TurnInBasePlanes:
    """Points of the platform in planes of the base; some translations and one turn are unknown."""

    def __init__(self, constraints: Sequence[PlaneConstraint], translations: Sequence[str], middle: Vec = ORIGIN):
        """Prepare it; ``middle`` is the platform's point, mm, whose place is solved for."""
        self.constraints = constraints
        self.points = [sub(constraint.platform, middle) for constraint in constraints]
        self.translations = [TRANSLATIONS.index(word) for word in translations]
        normals = np.array([constraint.normal for constraint in constraints])[:, self.translations]
        values = np.linalg.svd(normals)[1] if normals.size else np.ones(1)
        if len(self.translations) and values[-1] <= _FEW * values[0]:
            raise DescriptionError(
                "constraints", f"their planes do not tell {' '.join(translations)}, which parasitic names"
            )
        left = np.linalg.svd(normals.T)[2][-1] if normals.size else np.ones(1)  # weights free of the translations
        self.weights = [0.0 if abs(w) < _ZERO else float(w) for w in left]
        self.solving = np.where(np.abs(inverse := np.linalg.pinv(normals)) < _ZERO, 0.0, inverse).tolist()

    def solve(self, turned: Mat, axis: str, known: Vec, branch: float, before: Mat | None = None) -> FoundFrame:
        """Find the frame turned·Rot(axis, ψ)·before, its middle where it is ``known`` but for the translations."""
        cosines, sines, rests = [], [], []
        direction = UNIT[axis]
        for constraint, own in zip(self.constraints, self.points, strict=True):
            point = own if before is None else apply(before, own)
            normal = apply(transpose(turned), constraint.normal)
            along = scale(direction, dot(point, direction))
            cosines.append(dot(normal, sub(point, along)))
            sines.append(dot(normal, cross(direction, point)))
            rests.append(dot(constraint.normal, sub(known, constraint.foot)) + dot(normal, along))
        a, b, c = (dot(self.weights, column) for column in (cosines, sines, rests))
        size = a * a + b * b
        inverse = 1.0 / size
        margin = 1.0 - c * c * inverse
        root = branch * sqrt(size * margin)
        cosine, sine = (b * root - a * c) * inverse, (-b * c - a * root) * inverse
        rotation = product(turned, make_rotation_about(direction, sine, cosine))
        open_by = [p * cosine + q * sine + r for p, q, r in zip(cosines, sines, rests, strict=True)]
        origin = list(known)
        for column, row in zip(self.translations, self.solving, strict=True):
            origin[column] = origin[column] - dot(row, open_by)
        return FoundFrame(rotation if before is None else product(rotation, before), tuple(origin), (margin,))


def _list_parallel_planes(constraints: Sequence[PlaneConstraint]) -> list[tuple[int, int, int]]:
    """List the orders of three planes in which the first two have one normal."""
    return [
        pair
        for pair in ((0, 1, 2), (0, 2, 1), (1, 2, 0))
        if norm(cross(constraints[pair[0]].normal, constraints[pair[1]].normal)) < _FEW
        and dot(constraints[pair[0]].normal, constraints[pair[1]].normal) > 0.0
    ]


class TurnsInPlatformPlanes:
    """Points of the base in planes of the platform, two of which are parallel; all three turns are unknown."""

    def __init__(self, constraints: Sequence[PlaneConstraint]):
        parallel = _list_parallel_planes(constraints)
        if not parallel:
            raise DescriptionError(
                "constraints", "of three planes of the platform two must have one normal: else no closed form is known"
            )
        self.first, self.second, self.third = (constraints[i] for i in parallel[0])
        v, u = self.first.normal, self.third.normal
        self.cosine = 0.0 if abs(dot(u, v)) < _ZERO else float(dot(u, v))
        third = cross(v, u)
        self.size = float(norm(third))
        if self.size < _FEW:
            raise DescriptionError("constraints", "all planes of the platform are parallel and leave it free to turn")
        self.axes = (v, scale(cross(third, v), 1.0 / self.size), scale(third, 1.0 / self.size))

    def solve(self, origin: Vec, branches: tuple[float, float]) -> FoundFrame:
        """Find the frame whose origin is given (base frame, mm)."""
        across = sub(self.first.foot, self.second.foot)
        offsets = [dot(c.normal, c.platform) for c in (self.first, self.second, self.third)]
        v, first_margin = find_direction(
            across, offsets[0] - offsets[1], sub(self.first.foot, origin), offsets[0], branches[0]
        )
        u, second_margin = find_direction(v, self.cosine, sub(self.third.foot, origin), offsets[2], branches[1])
        third = scale(cross(v, u), 1.0 / self.size)
        columns = (v, cross(third, v), third)
        rotation = product(transpose(columns), self.axes)
        return FoundFrame(rotation, tuple(origin), (first_margin, second_margin))


def has_planes_of(spec: Spec, body: str) -> bool:
    """Tell whether all constraints are planes of a body."""
    return all(isinstance(each, PlaneConstraint) and each.plane_of == body for each in spec.constraints)


def has_parallel_planes(spec: Spec) -> bool:
    """Tell whether all three constraints are planes of the platform, two of them with one normal."""
    return has_planes_of(spec, "platform") and bool(_list_parallel_planes(list_planes(spec)))


def list_planes(spec: Spec) -> list[PlaneConstraint]:
    """List the constraints that are planes."""
    return [constraint for constraint in spec.constraints if isinstance(constraint, PlaneConstraint)]


def list_independent_words(spec: Spec) -> tuple[str, ...]:
    """List the words of the motion that are not parasitic, translations first."""
    return tuple(word for word in (*TRANSLATIONS, *ROTATIONS) if word not in spec.parasitic)


def choose_branch(cosine: Scalar) -> float:
    """Choose the solution nearer to no turn at home, by the cosine of the turn of the first one."""
    return 1.0 if find_nominal_value(cosine) > 0.0 else -1.0


class TurnedByPlanes:
    """Three turns that planes of the platform tell for the platform's origin."""

    def __init__(self, spec: Spec):
        self.spec, self.planes = spec, TurnsInPlatformPlanes(list_planes(spec))
        self.branches = 1.0, 1.0

    def choose_branches(self, origin: Vec) -> None:
        """Choose the solution that turns the platform least at home."""
        both = ((a, b) for a in (1.0, -1.0) for b in (1.0, -1.0))
        self.branches = max(both, key=lambda branches: self._measure_trace(origin, branches))

    def _measure_trace(self, origin: Vec, branches: tuple[float, float]) -> float:
        with np.errstate(invalid="ignore", divide="ignore"):
            rotation = self.planes.solve(origin, branches).rotation
        return float(np.nan_to_num(find_nominal_value(sum(rotation[i][i] for i in range(3))), nan=-9.0))

    def find_frame(self, origin: Vec) -> FoundFrame:
        return self.planes.solve(origin, self.branches)


def check_parasitic_words(motion: Sequence[str], parasitic: Sequence[str], count: int) -> None:
    """Refuse parasitic words that are not of the motion, and other than as many as the constraints are."""
    for word in parasitic:
        if word not in motion:
            raise DescriptionError("parasitic", f"{word} is not in the motion {' '.join(motion)}")
    if sorted(motion) != sorted((*TRANSLATIONS, *ROTATIONS)):
        raise DescriptionError(
            "motion", f"{' '.join(motion)}: with constraints it has all six words, each once: tx ty tz rz ry rx"
        )
    if len(set(parasitic)) != count or len(parasitic) != count:
        raise DescriptionError(
            "constraints", f"{count} of them, and {len(parasitic)} parasitic words: as many are needed, each once"
        )
