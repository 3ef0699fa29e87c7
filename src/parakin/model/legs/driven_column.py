"""``driven_column``: a column whose link is driven too, about the tangent of the rail (Eclipse with more drives)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...algebra import Scalar, Vec, sincos
from ..turning_angles import measure_turn
from .base import Inverse, Link
from .column import Column


@dataclass(frozen=True)
class DrivenColumn(Column):
    """Joints: a column's, then the link's angle over the horizontal, 0 where it points to the rail's axis."""

    kind = "driven_column"
    units = ("rad", "mm", "rad")

    def _measure_link(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, Scalar]:
        """Measure how far along the driven link and across it, upwards, the platform's joint is, mm."""
        s, c = sincos(joints[0])
        inward, up = self.radius - (point[0] * c + point[1] * s), point[2] - joints[1]
        sine, cosine = sincos(joints[2])
        return inward * cosine + up * sine, up * cosine - inward * sine

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        return [*super().closures(point, joints), self.rod * self._measure_link(point, joints)[1]]

    def assembly_margins(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, ...]:
        return (*super().assembly_margins(point, joints), self._measure_link(point, joints)[0])

    def inverse(self, point: Vec, signs: str) -> Inverse:
        column = super().inverse(point, signs)
        x, y, z = point
        s, c = sincos(column.joints[0])
        up, inward = z - column.joints[1], self.radius - (x * c + y * s)
        return replace(column, joints=[*column.joints, measure_turn(self.drives[2], up, inward)])

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        carriage, slide, link = super().links(point, joints)
        return [carriage, slide, replace(link, drive=2)]
