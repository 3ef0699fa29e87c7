"""A wrist on a platform that planes of its own turn as it moves."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Mat, Scalar, Vec, add, apply, move_along, product, transpose
from ...errors import DescriptionError
from ..chain import UNIT, Pointing, compose_chain, transform_to_local
from ..elements import ROTATIONS, TRANSLATIONS
from ..nominal_values import find_nominal_value
from ..spec import Spec
from .base import PlatformPlacement
from .constraint_rates import list_rates
from .five_axis import FiveAxis, compute_axis_angles, turn_tool_axis
from .parasitic import TurnedByPlanes, has_planes_of, list_independent_words
from .wrist_centre import find_wrist_centre

_ZERO = 1e-12  # of a length: what is less is rounding


class WristOnGuidedPlatform(FiveAxis):
    """Planes of the platform turn it as its origin moves; the axes of a wrist meet in that origin."""

    pointing: Pointing
    carries_pole = True
    serial_order = (0, 1)

    def __init__(self, spec: Spec):
        super().__init__(spec)
        self.coordinates = list_independent_words(spec)
        if self.coordinates != TRANSLATIONS or not has_planes_of(spec, "platform"):
            raise DescriptionError(
                "constraints", "with a driven head their planes are of the platform, and rz ry rx are parasitic"
            )
        if spec.table:
            raise DescriptionError("table", "a guided platform with a wrist has its turning axes in the head")
        self.pointing = Pointing.from_steps(spec.head, "head")
        centre, self.reach = find_wrist_centre(spec.head)
        if max(abs(find_nominal_value(c)) for c in centre) > _ZERO * (1.0 + abs(find_nominal_value(self.reach))):
            raise DescriptionError("head", "its axes must meet in the platform's origin")
        self.turned = TurnedByPlanes(spec)
        home = [spec.home.get(letter, 0.0) for letter in self.axes]
        self.turned.choose_branches(self._centre(home, turn_tool_axis(home)[0]))

    def _centre(self, pose: Sequence[Scalar], k: Vec) -> Vec:
        return transform_to_local(self.mount, self.base, move_along(tuple(pose[:3]), k, self.reach))

    def place(self, pose: Sequence[Scalar], branch: str, first: Scalar | None = None) -> PlatformPlacement:
        k, _, _ = turn_tool_axis(pose)
        guided = self.turned.find_frame(self._centre(pose, k))
        along = apply(transpose(guided.rotation), apply(transpose(self.mount), k))
        wrist = self.pointing.solve(along, branch, first)
        return PlatformPlacement(
            guided.rotation,
            guided.origin,
            list(guided.origin),
            list(wrist.joints),
            wrist.reach,
            wrist.freedom,
            wrist.off_axis,
            guided.reach,
        )

    def turn_first_axis(self, pose: Sequence[Scalar]) -> Mat:
        return product(self.mount, self.place(pose, self.branches).rotation)

    def frame(self, coordinates: Sequence[Scalar]) -> tuple[Mat, Vec]:
        guided = self.turned.find_frame(tuple(coordinates))
        return guided.rotation, guided.origin

    def pose(self, coordinates: Sequence[Scalar], serial: Sequence[Scalar]) -> list[Scalar]:
        rotation, origin = self.frame(coordinates)
        head, tip = compose_chain(self.spec.head, serial)
        world = add(apply(self.mount, add(origin, apply(rotation, tip))), self.base)
        return [*world, *compute_axis_angles(self._point(rotation, head))]

    def _point(self, rotation: Mat, head: Mat) -> Vec:
        return apply(self.mount, apply(rotation, apply(head, UNIT["tz"])))

    def closure(
        self, pose: Sequence[Scalar], serial: Sequence[Scalar], turn: Sequence[Scalar] = ()
    ) -> tuple[Mat, Vec, list[Scalar]]:
        k, _, _ = turn_tool_axis(pose, turn)
        rotation, origin = self.frame(self._centre(pose, k))
        head, _ = compose_chain(self.spec.head, serial)
        return rotation, origin, self._tilt_rows(pose, turn, self._point(rotation, head))

    def list_constraint_rates(self, pose: Sequence[Scalar], rotation: Mat, origin: Vec) -> list[list[Scalar]]:
        return list_rates(self.spec, rotation, origin, [UNIT[word] for word in ROTATIONS])
