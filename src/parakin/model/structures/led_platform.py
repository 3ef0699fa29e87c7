"""A passive central leg without a wrist: the platform leans as the leg points."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import (
    IDENTITY,
    Mat,
    Scalar,
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
    sub,
    transpose,
)
from ...errors import DescriptionError
from ..chain import UNIT, Pointing, compose_chain, make_rotation_about, transform_to_local
from ..elements import ROTATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import LETTERS, PlatformPlacement, Structure


class LedPlatform(Structure):
    """A central leg of two or three turns and a slide, and a tool on its line, without drives in head or table.

    Axes X Y Z, and with a third turn about the leg (``rz ry rz tz``) C: with the tip's place it tells A and B, as the
    tool lies along the leg. Newton's coordinates are the platform's origin and C, which are regular where the leg hangs
    straight and its own first turn is free. The small turn ``wz`` is a growth of C.
    """

    has_central_leg = True
    writes_frames_once = False

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.words = tuple(word for word in spec.motion if word in ROTATIONS)
        if spec.motion[-1] != "tz" or len(self.words) != len(spec.motion) - 1 or len(self.words) not in (2, 3):
            raise DescriptionError("motion", f"{' '.join(spec.motion)}: a central leg is two or three turns, then tz")
        if len(self.words) == 3 and self.words != ("rz", "ry", "rz"):
            raise DescriptionError(
                "motion",
                f"{' '.join(spec.motion)}: without a driven head a central leg's three turns are rz ry rz",
            )
        if spec.table:
            raise DescriptionError("table", "a central leg without a driven head has no table")
        self.coordinates = ("tx", "ty", "tz", "rz")[: len(spec.motion)]
        self.axes = tuple(LETTERS[word] for word in self.coordinates)
        self.turns = ("wz",) if len(self.words) == 3 else ()
        head, self.tip = compose_chain(spec.head, ())
        if any(find_nominal_value(x) for x in (*self.tip[:2], *sub(head[2], UNIT["tz"]))):
            raise DescriptionError("head", "without a driven head the tool stands on the central leg's line")
        home = tuple(spec.home.get(letter, 0.0) for letter in "XYZ")
        place = transform_to_local(self.mount, self.base, home)
        self.sign = 1.0 if find_nominal_value(place[2]) > 0.0 else -1.0
        length = self.sign * find_nominal_value(norm(place)) - find_nominal_value(self.tip[2])
        self.way = 1.0 if length > 0.0 else -1.0  # of the platform's z from the base's joint to the platform
        first, second = (UNIT[word] for word in self.words[:2])
        self.tilts = Pointing(first, second, UNIT["tz"])

    def _find_rotation(self, z: Vec, pose_turn: Scalar) -> Mat:
        """Find the platform's rotation in the base from its z axis there, and the pose's C where there is one."""
        if len(self.words) == 3:
            k = apply(self.mount, z)
            s, c = sincos(pose_turn)
            back = apply(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)), k)  # Ry(B)·Rx(A)·z
            inverse = 1.0 / sqrt(back[0] * back[0] + back[2] * back[2])
            x = (back[2] * inverse, 0.0, -back[0] * inverse)
            leaning = transpose((x, cross(back, x), back))
            return product(transpose(self.mount), product(make_axis_rotation("rz", s, c), leaning))
        turns = self.tilts.solve(z, "+")
        rotation = IDENTITY
        scales = 1.0 / turns.freedom, 1.0 / turns.second_size
        for axis, (s, c), size in zip((self.tilts.first, self.tilts.second), turns.turns, scales, strict=True):
            rotation = product(rotation, make_rotation_about(axis, s * size, c * size))
        return rotation

    def _find_frame(self, pose: Sequence[Scalar], turn: Sequence[Scalar]) -> tuple[Mat, Vec]:
        x, y, z, *turns = pose
        tip = transform_to_local(self.mount, self.base, (x, y, z))
        axis = scale(tip, self.sign / norm(tip))
        turned = sum((*turns, *turn), 0.0)
        return self._find_rotation(axis, turned), move_along(tip, axis, -self.tip[2])

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        rotation, origin = self._find_frame(pose, ())
        _, _, _, *turns = pose
        return PlatformPlacement(rotation, origin, [*origin, *turns], [])

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        origin = tuple(coordinates[:3])
        z = scale(origin, self.way / norm(origin))
        return self._find_rotation(z, coordinates[3] if self.turns else 0.0), origin

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        turned = product(self.mount, rotation)
        return [*origin, *([atan2(turned[1][0], turned[0][0])] if self.turns else [])]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        tip = add(origin, apply(rotation, self.tip))
        return [*add(apply(self.mount, tip), self.base), *coordinates[3:]]

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        return (*self._find_frame(pose, turn), [])

    def list_motion(self, placement: PlatformPlacement) -> list[tuple[str, Scalar]]:
        rotation, length = placement.rotation, dot(placement.origin, [row[2] for row in placement.rotation])
        if len(self.words) == 3:
            x, y, z = (row[2] for row in rotation)
            first, second = atan2(y, x), atan2(sqrt(x * x + y * y), z)
            turned = product(make_axis_rotation("rz", *sincos(first)), make_axis_rotation("ry", *sincos(second)))
            rolled = product(transpose(turned), rotation)
            angles: tuple[Scalar, ...] = first, second, atan2(rolled[1][0], rolled[0][0])
        else:
            angles = self.tilts.solve([row[2] for row in rotation], "+").joints
        return [*zip(self.words, angles, strict=True), ("tz", length)]
