"""``length``: a strut of variable length on a fixed foot (hexapods, Tricept)."""

from __future__ import annotations

from dataclasses import dataclass

from ...algebra import Scalar, Vec, norm, scale, sub
from ..elements import Point
from ..nominal_values import find_nominal_value
from .base import Inverse, Leg, Link, close_rod


@dataclass(frozen=True)
class Length(Leg):
    kind = "length"
    family = "struts of variable length on fixed feet"
    units = ("mm",)

    foot: Point

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        return [close_rod(self.foot, point, joints[0] * joints[0])]

    def inverse(self, point: Vec, signs: str) -> Inverse:
        return Inverse([norm(sub(point, self.foot))])

    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        return [(self.foot, point)]

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        along = scale(sub(point, self.foot), 1.0 / norm(sub(point, self.foot)))
        return [
            Link("ball", self.foot, self.foot, along),
            Link("slide", self.foot, point, along, drive=0, carrier=0, meets="platform"),
        ]

    def assembly_margins(self, point: Vec, joints: list[Scalar]) -> tuple[Scalar, ...]:
        return (joints[0],)

    def fixed_foot(self) -> Vec:
        return self.foot

    def size(self, at_home: float) -> float:
        return max(0.25 * at_home, min(find_nominal_value(self.drives[0].low), at_home))

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar] | None:
        return self.foot, joints[0]
