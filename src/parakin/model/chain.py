"""Serial chains of elementary transforms, and the closed-form inverse of two turning axes that point the tool."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..algebra import (
    IDENTITY,
    ORIGIN,
    Mat,
    Scalar,
    Term,
    Vec,
    add,
    apply,
    atan2,
    cross,
    dot,
    make_axis_rotation,
    move_along,
    norm,
    product,
    scale,
    sincos,
    sqrt,
    transpose,
)
from ..errors import DescriptionError
from .elements import ROTATIONS, TRANSLATIONS, Drive, Step
from .turning_angles import find_turn_middle, measure_angle_near

UNIT: dict[str, Vec] = {
    word: tuple(1.0 if word[1] == letter else 0.0 for letter in "xyz") for word in (*TRANSLATIONS, *ROTATIONS)
}
_ROUNDING = 1e-15  # cosine of the angle between two axes; below this they are at right angles
_PARALLEL = 1e-6  # sine of the angle between two axes; below this they are parallel


def compute_exact_sincos(angle: Scalar) -> tuple[Scalar, Scalar]:
    """Compute sine and cosine of a fixed angle, exact where they are 0, ±1/2 or ±1 (multiples of 30° and 90°)."""
    if isinstance(angle, Term):
        return sincos(angle)
    s, c = float(np.sin(angle)), float(np.cos(angle))
    return tuple(round(2.0 * v) / 2.0 if abs(2.0 * v - round(2.0 * v)) < 1e-15 else v for v in (s, c))  # type: ignore[return-value]


def compose_chain(steps: Iterable[Step], joints: Sequence[Scalar]) -> tuple[Mat, Vec]:
    """Compose a chain: rotation and origin of the last frame in the first. ``joints`` are those of driven steps."""
    rotation, origin = IDENTITY, ORIGIN
    driven = iter(joints)
    for step in steps:
        value: Scalar = step.value if step.drive is None else step.value + step.sign * next(driven)
        if step.axis in TRANSLATIONS:
            origin = move_along(origin, apply(rotation, UNIT[step.axis]), value)
        else:
            s, c = compute_exact_sincos(value) if step.drive is None else sincos(value)
            rotation = product(rotation, make_axis_rotation(step.axis, s, c))
    return rotation, origin


def make_small_rotation(turn: Vec) -> Mat:
    """Make the rotation by small angles about the axes x, y and z, to the first order."""
    x, y, z = turn
    return ((1.0, -z, y), (z, 1.0, -x), (-y, x, 1.0))


def invert_rotations(steps: Sequence[Step]) -> list[Step]:
    """List the rotations of the inverted chain."""
    return [Step(s.axis, -s.value, s.drive, -s.sign) for s in reversed(steps) if s.axis in ROTATIONS]


@dataclass(frozen=True)
class PointingAngles:
    """The solution of :meth:`Pointing.solve`: both joint values, and sin² of the tool axis against the first axis."""

    joints: tuple[Scalar, Scalar]
    freedom: Scalar  # 0 where the first angle is free
    off_axis: Vec  # first axis × direction, whose square is ``freedom``
    reach: tuple[Scalar, ...]  # negative where the axes can't point so
    turns: tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]  # sine and cosine: times freedom, times ``second_size``
    second_size: float


@dataclass(frozen=True)
class Pointing:
    """Two turning axes that point a direction: turn(first)·turn(second)·``start`` = v.

    This is the general two-axis problem (Paden and Kahan's second); tilted and nutating heads and tables are no
    special case. ``signs`` are those of the joints in the turns, ``drives`` what moves them:
    their ranges tell on which turn the joints are.
    """

    first: Vec
    second: Vec
    start: Vec
    signs: tuple[float, float] = (1.0, 1.0)
    drives: tuple[Drive | None, Drive | None] = (None, None)

    @classmethod
    def from_steps(cls, steps: Iterable[Step], key: str) -> Pointing:
        """Build it from the rotations of a chain, two of them driven, which act on +z of its last frame.

        ``key`` is the chain's name in errors.
        """
        rotation, axes, signs, drives = IDENTITY, [], [], []
        for step in steps:
            if step.axis in TRANSLATIONS:
                continue
            if step.drive is not None:
                axes.append(apply(rotation, UNIT[step.axis]))
                signs.append(step.sign)
                drives.append(step.drive)
            rotation = product(rotation, make_axis_rotation(step.axis, *compute_exact_sincos(step.value)))
        if len(axes) != 2:
            turns = f"{len(axes)} driven turn{'s' * (len(axes) != 1)}"
            raise DescriptionError(key, f"{turns}, expected two, which point the tool")
        pointing = cls(axes[0], axes[1], apply(rotation, UNIT["tz"]), (signs[0], signs[1]), (drives[0], drives[1]))
        if norm(cross(axes[0], axes[1])) < _PARALLEL:
            raise DescriptionError(key, "its two axes are parallel and can't point the tool")
        if norm(cross(pointing.second, pointing.start)) < _PARALLEL:
            raise DescriptionError(key, "its second axis lies along the tool and can't point it")
        return pointing

    @property
    def level(self) -> bool:
        """Whether the direction at rest is nearer to the normal of both axes than to their plane.

        Then one of the two solutions is near rest, the other far from it.
        """
        normal = cross(self.first, self.second)
        return bool(abs(dot(self.start, normal)) > abs(dot(self.second, cross(self.start, normal))))

    def solve(self, v: Vec, branch: str, first: Scalar | None = None) -> PointingAngles:
        """Solve for the joints that point to the unit vector ``v``.

        branch : "+" is the solution with the greater second joint, or, where :attr:`level` (a fork that turns about X,
            then Y), the one whose second turn is nearer to rest
        first : the first joint where it is free: the second one then turns in its plane, over the pole too, whatever
            the branch
        """
        a1, a2, w = self.first, self.second, self.start
        a, beta = (x if abs(x) > _ROUNDING else 0.0 for x in (float(dot(a1, a2)), float(dot(w, a2))))
        alpha = dot(v, a1)
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
        if first is not None:
            sine, cosine = sincos(first)
            back = make_rotation_about(a1, -self.signs[0] * sine, cosine)
            nu = dot(apply(back, v), normal) / n2
        middle = add(add(scale(a1, lam), scale(a2, mu)), scale(normal, nu))  # v before the first turn
        off = add(add(scale(a1, lam - alpha), scale(a2, mu)), scale(normal, nu))  # its part at right angles to a1
        turns = (
            (dot(off, cross(v, a1)), dot(off, v)),
            (dot(middle, cross(a2, w)), dot(middle, w) - beta * beta),
        )
        angles = []
        for sign, drive, (s, c) in zip(self.signs, self.drives, turns, strict=True):
            zero = 0.0 if drive is None else sign * find_turn_middle(drive)
            angles.append(sign * measure_angle_near(zero, s, c))
        joints = (angles[0] if first is None else first, angles[1])
        return PointingAngles(joints, freedom, around, reach, turns, 1.0 - beta * beta)


def make_rotation_about(axis: Vec, s: Scalar, c: Scalar) -> Mat:
    """Compute the rotation about a unit axis by the angle of sine s and cosine c (Rodrigues)."""
    x, y, z = axis
    skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    return tuple(
        tuple((1.0 if i == j else 0.0) * c + skew[i][j] * s + axis[i] * axis[j] * (1.0 - c) for j in range(3))
        for i in range(3)
    )


def compute_fixed_axis_angles(r: Mat) -> tuple[Scalar, Scalar, Scalar]:
    """Compute the turns of a rotation about the fixed axes x, y and z, in this order; the second in [-90°, 90°]."""
    b = atan2(-r[2][0], sqrt(r[0][0] * r[0][0] + r[1][0] * r[1][0]))
    return atan2(r[2][1], r[2][2]), b, atan2(r[1][0], r[0][0])


def transform_to_local(rotation: Mat, origin: Vec, point: Vec) -> Vec:
    """Transform a point of the outer frame into the frame (rotation, origin)."""
    return apply(transpose(rotation), tuple(p - o for p, o in zip(point, origin, strict=True)))
