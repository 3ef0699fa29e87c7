"""A free motion in the order in which the file writes its words."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import (
    IDENTITY,
    ORIGIN,
    Mat,
    Scalar,
    Vec,
    add,
    apply,
    atan2,
    dot,
    product,
    scale,
    sincos,
    sqrt,
    transpose,
)
from ...algebra import make_axis_rotation as turned
from ...errors import DescriptionError
from ..chain import UNIT
from ..elements import ROTATIONS, TRANSLATIONS
from ..spec import Spec
from .base import PlatformPlacement
from .free import Free

POSE_ORDER = ("rz", "ry", "rx")  # of the turns C, B and A of a pose


def has_pose_order(motion: Sequence[str]) -> bool:
    """Tell whether a motion's words move the platform as a pose's coordinates do: translations, then C, B and A."""
    turns = [word for word in motion if word in ROTATIONS]
    first = motion[: len(motion) - len(turns)]
    return all(word in TRANSLATIONS for word in first) and (len(turns) < 3 or tuple(turns) == POSE_ORDER)


class OrderedMotion(Free):
    """A free motion whose coordinates are its elementary transforms in the order written, from the base on.

    The pose is as ever, with R = Rz(C)·Ry(B)·Rx(A). Of three turns the middle one is within ±90°; the motion is
    singular there, and not where a pose's B is ±90°.
    """

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self._check_order(spec.motion)
        self.coordinates = tuple(spec.motion)
        self.turn_words = tuple(word for word in spec.motion if word in ROTATIONS)
        self.assembly_method = None

    @staticmethod
    def _check_order(motion: Sequence[str]) -> None:
        shifts = [i for i, word in enumerate(motion) if word in TRANSLATIONS]
        if shifts and shifts[-1] - shifts[0] >= len(shifts):
            raise DescriptionError("motion", f"{' '.join(motion)}: its translations stand together")
        turns = [word for word in motion if word in ROTATIONS]
        across = [word for word in TRANSLATIONS if word in motion and word[1] != turns[0][1]]
        if len(turns) == 1 and len(across) == 1:
            raise DescriptionError(
                "motion",
                f"{' '.join(motion)}: a turn before one translation across it leads along a circle",
            )

    @property
    def middle_turn(self) -> int | None:
        return None

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        rotation, origin = self._frame(pose, ())
        return PlatformPlacement(rotation, origin, self.coordinates_of(rotation, origin), [])

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        rotation, origin = IDENTITY, ORIGIN
        for word, value in zip(self.coordinates, coordinates, strict=True):
            if word in TRANSLATIONS:
                origin = add(origin, apply(rotation, scale(UNIT[word], value)))
            else:
                rotation = product(rotation, turned(word, *sincos(value)))
        return rotation, origin

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        return super().coordinates_of(*self.frame(coordinates))

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        angles = dict(zip(self.turn_words, self._find_angles(rotation), strict=True))
        before = IDENTITY
        values: dict[str, Scalar] = dict(angles)
        for word in self.coordinates:
            if word in TRANSLATIONS:
                values[word] = dot(apply(transpose(before), origin), UNIT[word])
            else:
                before = product(before, turned(word, *sincos(angles[word])))
        return [values[word] for word in self.coordinates]

    def _find_angles(self, rotation: Mat) -> list[Scalar]:
        """Find the turns of a rotation in their order; of three the middle one is in [-90°, 90°]."""
        i, *others = ("xyz".index(word[1]) for word in self.turn_words)
        if not others:
            j, k = (i + 1) % 3, (i + 2) % 3
            return [atan2(rotation[k][j], rotation[j][j])]
        j, k = others
        sign = 1.0 if j == (i + 1) % 3 else -1.0
        across = sqrt(rotation[i][i] * rotation[i][i] + rotation[i][j] * rotation[i][j])
        return [
            atan2(-sign * rotation[j][k], rotation[k][k]),
            atan2(sign * rotation[i][k], across),
            atan2(-sign * rotation[i][j], rotation[i][i]),
        ]

    def list_coordinate_margins(self, coordinates: Sequence[Scalar]) -> list[Scalar]:
        if len(self.turn_words) < 3:
            return []
        return [sincos(coordinates[self.coordinates.index(self.turn_words[1])])[1]]
