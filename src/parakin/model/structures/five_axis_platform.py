"""A free platform of which the tool's tip and axis count: its turn about the tool is not controlled."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Mat, Scalar, Vec, add, apply, product, scale, sincos, sub, transpose
from ...algebra import make_axis_rotation as turned
from ...errors import DescriptionError
from ..chain import UNIT, Pointing, compose_chain, transform_to_local
from ..elements import TRANSLATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import PlatformPlacement
from .five_axis import FiveAxis, compute_axis_angles, make_least_rotation, turn_tool_axis


class FiveAxisPlatform(FiveAxis):
    """A free platform whose joints are on rings about the tool: tip and tool axis tell all joints.

    The motion is the platform's origin and two tilts. Its frame is turned least from the base's, as good as any other
    frame about the same axis.
    """

    branches = ""

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.tilt_words = spec.motion[3:]
        if set(spec.motion[:3]) != set(TRANSLATIONS) or sorted(self.tilt_words) != ["rx", "ry"]:
            raise DescriptionError(
                "motion", f"{' '.join(spec.motion)}: five axes on a free platform are tx ty tz rx ry, or tx ty tz ry rx"
            )
        self.coordinates = (*TRANSLATIONS, *self.tilt_words)
        head, self.tip = compose_chain(spec.head, ())
        aside = (*self.tip[:2], *sub(tuple(row[2] for row in head), UNIT["tz"]))
        if any(find_nominal_value(x) for x in aside):
            raise DescriptionError("head", "the rings turn about the platform's z: the tool stands on it")
        first, second = self.tilt_words
        self.tilts = Pointing(UNIT[first], UNIT[second], UNIT["tz"])

    def _find_frame(self, pose: Sequence[Scalar], k: Vec) -> tuple[Mat, Vec]:
        z = apply(transpose(self.mount), k)
        tip = transform_to_local(self.mount, self.base, tuple(pose[:3]))
        return make_least_rotation(z), sub(tip, scale(z, self.tip[2]))

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        rotation, origin = self._find_frame(pose, turn_tool_axis(pose)[0])
        return PlatformPlacement(rotation, origin, self.coordinates_of(rotation, origin), [])

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        tilts = zip(self.tilt_words, coordinates[3:], strict=True)
        first, second = (turned(word, *sincos(tilt)) for word, tilt in tilts)
        z = tuple(row[2] for row in product(first, second))
        return make_least_rotation(z), tuple(coordinates[:3])

    def coordinates_of(self, rotation: Mat, origin: Vec) -> list[Scalar]:
        return [*origin, *self.tilts.solve(tuple(row[2] for row in rotation), "+").joints]

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        z = tuple(row[2] for row in rotation)
        tip = add(apply(self.mount, add(origin, scale(z, self.tip[2]))), self.base)
        return [*tip, *compute_axis_angles(apply(self.mount, z))]

    def list_coordinate_margins(self, coordinates: Sequence[Scalar]) -> list[Scalar]:
        return [sincos(coordinates[4])[1]]

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        return (*self._find_frame(pose, turn_tool_axis(pose, turn)[0]), [])


def check_rings(spec: Spec) -> None:
    """Refuse joints on rings where the platform's turn about them is told, and others where it is not."""
    moving = [leg.find_fixed_joint() is None for leg in spec.legs]
    free = len(spec.motion) == 5
    if any(moving) and not free:
        raise DescriptionError("legs", "joints on rings need a free platform of five axes, motion tx ty tz rx ry")
    if free and not all(moving):
        raise DescriptionError("legs", "a free platform of five axes has all its legs on rings about the tool")
    for leg in spec.legs:
        if free and any(find_nominal_value(x) for x in leg.platform[:2]):
            raise DescriptionError(
                "legs", f"{leg.drives[0].name}: its ring is about the platform's z, platform [0, 0, z]"
            )
    if free and any(cone.at == "platform" and cone.axis is None for cone in spec.limits.cones):
        raise DescriptionError("limits", "a cone at joints on rings has an axis: [0, 0, 1] is the tool's")
