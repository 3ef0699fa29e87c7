"""``column``: a carriage on a circular rail, a vertical slide on it, and a link in its radial plane (Eclipse)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...algebra import ORIGIN, Scalar, Vec, sincos, sqrt
from ..elements import Signs, Size, Unit
from ..turning_angles import measure_turn
from .base import Inverse, Leg, Link, Reach, close_rod

_UP: Vec = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Column(Leg):
    """Joints: the carriage's angle on the rail, then the slide's height. The rail's axis is the base frame's Z."""

    kind = "column"
    family = "columns on a circular rail"
    units: ClassVar[tuple[Unit, ...]] = ("rad", "mm")
    has_carriers = True
    branches = "-"

    radius: Size  # of the circular rail
    rod: Size
    branch: Signs = Signs("-")  # "-": the slide is below the platform's joint

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        s, c = sincos(joints[0])
        foot = (self.radius * c, self.radius * s, joints[1])
        # The link's revolute joint keeps the platform's joint in the radial plane.
        return [self.radius * (point[1] * c - point[0] * s), close_rod(foot, point, self.rod**2)]

    def assembly_margins(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, ...]:
        s, c = sincos(joints[0])
        return (point[0] * c + point[1] * s,)  # on the carriage's side of the rail's axis

    def inverse(self, point: Vec, signs: str) -> Inverse:
        x, y, z = point
        out = self.radius - sqrt(x * x + y * y)
        reach = self.rod**2 - out * out
        root = sqrt(reach)
        height = z - root if signs == "-" else z + root
        return Inverse([measure_turn(self.drives[0], y, x), height], (Reach(reach, self.rod),))

    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        s, c = sincos(joints[0])
        return [((self.radius * c, self.radius * s, joints[1]), point)]

    def carry(self, foot: Vec, joints: list[Scalar], drive: int) -> Vec:
        s, c = sincos(joints[0])
        x, y, z = foot
        return (c * x - s * y, s * x + c * y, z + joints[1] if drive == 1 else z)

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        s, c = sincos(joints[0])
        foot = (self.radius * c, self.radius * s, joints[1])
        return [
            Link("hinge", ORIGIN, (self.radius * c, self.radius * s, 0.0), _UP, drive=0),
            Link("slide", foot, foot, _UP, drive=1, carrier=0),
            Link("hinge", foot, point, (-s, c, 0.0), carrier=1, meets="platform"),
        ]
