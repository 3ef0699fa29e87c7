"""``ring``: a strut of variable length whose platform joint runs on a ring about the tool's axis (pentapods)."""

from __future__ import annotations

from dataclasses import dataclass

from ...algebra import Mat, Scalar, Vec, add, apply, dot, move_along, norm, sub
from ..elements import Size
from .base import Link
from .length import Length


@dataclass(frozen=True)
class Ring(Length):
    """A strut on a fixed foot, hinged to a ring that turns freely about the platform's z.

    ``platform`` is the ring's centre, ``radius`` its hinge's distance from there. The hinge lies along the ring, so
    that the strut stays in the plane of foot and tool axis, and the platform's turn about that axis changes nothing.
    """

    kind = "ring"
    family = "struts of variable length on rings about the tool"
    platform_parameters = "z"

    radius: Size

    def place_joint(self, rotation: Mat, origin: Vec) -> Vec:
        centre, axis = add(origin, apply(rotation, self.platform)), tuple(row[2] for row in rotation)
        along = sub(self.foot, centre)
        across = move_along(along, axis, -dot(along, axis))
        return move_along(centre, across, self.radius / norm(across))

    def find_fixed_joint(self) -> Vec | None:
        return None

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar] | None:
        return None

    def torus(self, joints: list[Scalar]) -> tuple[Scalar, Scalar]:
        return self.radius, joints[0]

    def bound_platform(self, joints: list[Scalar]) -> tuple[Vec, Scalar]:
        return self.foot, joints[0] + self.radius

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        ball, strut = super().links(point, joints)
        return [ball, Link("slide", strut.start, strut.end, strut.axis, drive=0, carrier=0, meets="ring")]
