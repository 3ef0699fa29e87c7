"""Serial chains of elementary transforms, and the closed-form inverse of two turning axes for the tool's axis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..algebra import (
    IDENTITY,
    ORIGIN,
    Mat,
    Scalar,
    Vec,
    add,
    along,
    apply,
    atan2,
    cross,
    dot,
    norm,
    product,
    scale,
    sincos,
    sqrt,
    transposed,
    turn,
)
from ..errors import DescriptionError
from .parts import ROTATIONS, TRANSLATIONS, Step

UNIT: dict[str, Vec] = {
    word: tuple(1.0 if word[1] == letter else 0.0 for letter in "xyz") for word in (*TRANSLATIONS, *ROTATIONS)
}


def fixed_sincos(angle: float) -> tuple[float, float]:
    """Sine and cosine of a machine's own angle, exact at multiples of 30° and 90° where they are 0, ±1/2 or ±1."""
    s, c = float(np.sin(angle)), float(np.cos(angle))
    return tuple(round(2.0 * v) / 2.0 if abs(2.0 * v - round(2.0 * v)) < 1e-15 else v for v in (s, c))  # type: ignore[return-value]


def frame(steps: Iterable[Step], joints: Sequence[Scalar]) -> tuple[Mat, Vec]:
    """Rotation and origin of the last frame in the first; ``joints`` are those of the driven steps, in order."""
    rotation, origin = IDENTITY, ORIGIN
    given = iter(joints)
    for step in steps:
        value: Scalar = step.value if step.drive is None else step.value + step.sign * next(given)
        if step.axis in TRANSLATIONS:
            origin = along(origin, apply(rotation, UNIT[step.axis]), value)
        else:
            s, c = fixed_sincos(value) if step.drive is None else sincos(value)
            rotation = product(rotation, turn(step.axis, s, c))
    return rotation, origin


def inverse_rotations(steps: Sequence[Step]) -> list[Step]:
    """The rotations of the inverted chain."""
    return [Step(s.axis, -s.value, s.drive, -s.sign) for s in reversed(steps) if s.axis in ROTATIONS]


@dataclass(frozen=True)
class Angles:
    """What :meth:`Pointing.solve` found: both joint values, and sin² of the tool axis against the first axis."""

    joints: tuple[Scalar, Scalar]
    freedom: Scalar  # 0 where the first angle is free
    reach: tuple[Scalar, ...]  # negative where the axes can't point there
    turns: tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]  # sine and cosine: times freedom, times ``second_size``
    second_size: float


@dataclass(frozen=True)
class Pointing:
    """Two turning axes that point a direction: turn(first)·turn(second)·``start`` = v.

    The general two-axis problem (Paden and Kahan's second), so tilted and nutating heads and tables are no special
    case. ``signs`` are those of the joints in the turns.
    """

    first: Vec
    second: Vec
    start: Vec
    signs: tuple[float, float] = (1.0, 1.0)

    @classmethod
    def of(cls, steps: Iterable[Step], part: str) -> Pointing:
        """From the rotations of a chain with two driven ones, acting on +z of its last frame."""
        rotation, axes, signs = IDENTITY, [], []
        for step in steps:
            if step.axis in TRANSLATIONS:
                continue
            if step.drive is not None:
                axes.append(apply(rotation, UNIT[step.axis]))
                signs.append(step.sign)
            rotation = product(rotation, turn(step.axis, *fixed_sincos(step.value)))
        if len(axes) != 2:
            raise DescriptionError(part, f"{len(axes)} driven turns point the tool, two are needed")
        pointing = cls(axes[0], axes[1], apply(rotation, UNIT["tz"]), (signs[0], signs[1]))
        if norm(cross(axes[0], axes[1])) < 1e-6:
            raise DescriptionError(part, "its two axes are parallel and can't point the tool")
        if norm(cross(pointing.second, pointing.start)) < 1e-6:
            raise DescriptionError(part, "its second axis lies along the tool and can't point it")
        return pointing

    @property
    def level(self) -> bool:
        """The direction at rest stands (more than not) on both axes: one solution is near rest, one far beyond."""
        normal = cross(self.first, self.second)
        return bool(abs(dot(self.start, normal)) > abs(dot(self.second, cross(self.start, normal))))

    def solve(self, v: Vec, branch: str, first: Scalar | None = None) -> Angles:
        """Joints that point to the unit vector ``v``.

        Branch "+" is the solution with the greater second joint, or, where the direction at rest stands on both axes
        (a fork that turns about X, then Y), the one whose second turn is nearer to rest.
        ``first`` gives the first joint where it is free.
        """
        a1, a2, w = self.first, self.second, self.start
        a, beta, alpha = float(dot(a1, a2)), float(dot(w, a2)), dot(v, a1)
        normal = cross(a1, a2)
        n2 = float(dot(normal, normal))
        around = cross(a1, v)
        freedom = dot(around, around)
        lam = (alpha - a * beta) / n2
        mu = (beta - a * alpha) / n2
        reach: tuple[Scalar, ...] = ()
        if a == 0.0 and beta == 0.0:
            nu = sqrt(freedom)  # without the cancellation of 1 - α²
        else:
            square = (1.0 - lam * lam - mu * mu - 2.0 * a * (lam * mu)) / n2
            reach = (square,)
            nu = sqrt(square)
        greater = float(dot(w, normal) if self.level else dot(a2, cross(w, normal)) * self.signs[1])
        if (greater < 0.0) == (branch == "+"):
            nu = -nu
        middle = add(add(scale(a1, lam), scale(a2, mu)), scale(normal, nu))  # v before the first turn
        off = add(add(scale(a1, lam - alpha), scale(a2, mu)), scale(normal, nu))  # its part at right angles to a1
        turns = (
            (dot(off, cross(v, a1)), dot(off, v)),
            (dot(middle, cross(a2, w)), dot(middle, w) - beta * beta),
        )
        angles = [sign * atan2(s, c) for sign, (s, c) in zip(self.signs, turns, strict=True)]
        joints = (angles[0] if first is None else first, angles[1])
        return Angles(joints, freedom, reach, turns, 1.0 - beta * beta)


def rotation_about(axis: Vec, s: Scalar, c: Scalar) -> Mat:
    """Rotation about a fixed unit axis by the angle of sine s and cosine c (Rodrigues)."""
    x, y, z = axis
    skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    return tuple(
        tuple((1.0 if i == j else 0.0) * c + skew[i][j] * s + axis[i] * axis[j] * (1.0 - c) for j in range(3))
        for i in range(3)
    )


def back(rotation: Mat, origin: Vec, point: Vec) -> Vec:
    """A point of the outer frame in the frame (rotation, origin)."""
    return apply(transposed(rotation), tuple(p - o for p, o in zip(point, origin, strict=True)))
