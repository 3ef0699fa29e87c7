"""The motion is the pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ...algebra import (
    IDENTITY,
    Mat,
    Scalar,
    Vec,
    add,
    apply,
    atan2,
    dot,
    product,
    sincos,
    sub,
    transpose,
)
from ...algebra import make_axis_rotation as turned
from ...errors import DescriptionError
from ..chain import UNIT, compose_chain, compute_fixed_axis_angles, make_small_rotation, transform_to_local
from ..elements import ROTATIONS, TRANSLATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import LETTERS, PlatformPlacement, Structure


class Free(Structure):
    """The motion is the pose: translations, and no, one or three turns. Tool and mounting are fixed frames.

    Its small turns are about the machine frame's axes: ``wx``, ``wy``, ``wz``, as many as it has.
    """

    def __init__(self, spec: Spec):
        super().__init__(spec)
        words = set(spec.motion)
        turns = [w for w in spec.motion if w in ROTATIONS]
        if len(turns) == 2 or len(words) != len(spec.motion):
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: a free motion has no, one or three turns, and each word once"
            )
        if len(turns) == 3 and len(words) != 6:
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: with three turns a free motion has three translations"
            )
        across = [word for word in TRANSLATIONS if word not in words]
        if len(turns) == len(across) == 1 and turns[0][1] != across[0][1]:
            raise DescriptionError(
                "motion",
                f"{' '.join(spec.motion)}: the turn of a motion in a plane is about the plane's normal, "
                f"expected r{across[0][1]}",
            )
        if len(turns) < 3 and spec.mounting:
            if not words >= set(TRANSLATIONS):
                raise DescriptionError(
                    "mounting", "a planar machine is mounted by the words of its motion (tx tz: upright)"
                )
            if turns and any(step.axis in ROTATIONS and step.value for step in spec.mounting):
                raise DescriptionError("mounting", "a machine that turns about one axis only can't be inclined")
        self.coordinates = tuple(word for word in (*TRANSLATIONS, *ROTATIONS) if word in words)
        self.axes = tuple(LETTERS[word] for word in self.coordinates)
        self.turns = tuple(f"w{word[1]}" for word in self.coordinates if word in ROTATIONS)
        self.tool, self.tip = compose_chain(spec.head, ())
        self.assembly_method = self._assembly_method()

    def bound_platform_way(self, ways: Sequence[Scalar]) -> Scalar | None:
        return None if self.turns else dot(ways, ways)

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        rotation, origin = self.frame(pose)
        return PlatformPlacement(rotation, origin, list(pose), [])

    def _assembly_method(self) -> Literal["planar", "lambda"] | None:
        legs, turns = self.spec.legs, [word for word in self.coordinates if word in ROTATIONS]
        in_plane = len(self.coordinates) == 3 and len(turns) == 1 and f"t{turns[0][1]}" not in self.coordinates
        if in_plane and all(leg.sphere([0.0] * len(leg.drives)) is not None for leg in legs):
            return "planar"
        rails = [np.array([find_nominal_value(x) for x in leg.rail]) for leg in self.lambda_legs]
        parallel = len(rails) == len(legs) == 3 and all(np.allclose(rail, rails[0], atol=1e-12) for rail in rails)
        return "lambda" if parallel else None

    @property
    def middle_turn(self) -> int | None:
        return 4 if len(self.axes) == 6 else None

    @property
    def tool_rotation(self) -> Mat:
        return product(self.mount, self.tool)

    @property
    def tool_axis(self) -> Vec:
        return apply(self.mount, apply(self.tool, UNIT["tz"]))

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        return self._frame(coordinates, ())

    def _frame(self, coordinates: Sequence[Scalar], turn: Sequence[Scalar]) -> tuple[Mat, Vec]:
        given = dict(zip(self.axes, coordinates, strict=True))
        rotation = IDENTITY
        for letter, word in (("C", "rz"), ("B", "ry"), ("A", "rx")):
            if letter in given:
                rotation = product(rotation, turned(word, *sincos(given[letter])))
        if turn:
            rotation = product(self._make_small_rotation(turn), rotation)
        if len(self.axes) == 6:  # the tool's frame is posed; the platform's follows
            rotation = product(product(transpose(self.mount), rotation), transpose(self.tool))
        tip = transform_to_local(self.mount, self.base, tuple(given.get(letter, 0.0) for letter in "XYZ"))
        origin = sub(tip, apply(rotation, self.tip))
        return rotation, tuple(o if letter in given else 0.0 for o, letter in zip(origin, "XYZ", strict=True))

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        """Compute the pose of a platform's frame; of three turns B is in [-90°, 90°]."""
        tip = add(apply(self.mount, add(origin, apply(rotation, self.tip))), self.base)
        if len(self.turns) < 3:
            return [tip["XYZ".index(letter)] for letter in self.axes if letter in "XYZ"] + [
                atan2(rotation[(i + 2) % 3][(i + 1) % 3], rotation[(i + 1) % 3][(i + 1) % 3])
                for i in ("xyz".index(turn[1]) for turn in self.turns)
            ]
        r = product(product(self.mount, rotation), self.tool)
        return [*tip, *compute_fixed_axis_angles(r)]

    def coordinates_at(self, origin: Vec) -> list[Scalar]:
        tip = add(apply(self.mount, add(origin, self.tip)), self.base)
        return [tip["XYZ".index(letter)] for letter in self.axes]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        return list(coordinates)

    def _make_small_rotation(self, turn: Sequence[Scalar]) -> Mat:
        """Compute the rotation by small angles about the axes that the platform turns about."""
        given = dict(zip(self.turns, turn, strict=True))
        return make_small_rotation([given.get(name, 0.0) for name in ("wx", "wy", "wz")])

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        return (*self._frame(pose, turn), [])
