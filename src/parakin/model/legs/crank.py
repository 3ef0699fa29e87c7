"""``crank``: a rod of fixed length whose foot turns on an arm (rotary Delta, Hexa)."""

from __future__ import annotations

from dataclasses import dataclass

from ...algebra import Scalar, Vec, add, cross, dot, scale, sincos, sqrt, sub
from ..elements import Direction, Point, Signs, Size
from ..turning_angles import measure_turn
from .base import Inverse, Leg, Link, Reach, close_rod


@dataclass(frozen=True)
class Crank(Leg):
    kind = "crank"
    family = "rods on arms that turn"
    units = ("rad",)
    has_carriers = True
    branches = "+"

    pivot: Point
    axis: Direction  # the arm turns about it, right-handed
    zero: Direction  # where the arm points at q = 0, at right angles to the axis
    arm: Size
    rod: Size
    branch: Signs = Signs("+")

    def _foot(self, q: Scalar) -> Vec:
        s, c = sincos(q)
        side = cross(self.axis, self.zero)
        return add(self.pivot, add(scale(self.zero, self.arm * c), scale(side, self.arm * s)))

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        return [close_rod(self._foot(joints[0]), point, self.rod**2)]

    def inverse(self, point: Vec, signs: str) -> Inverse:
        # |w - arm·(zero c + side s)| = rod gives x c + y s = m, with (x, y) the point in the arm's plane.
        w = sub(point, self.pivot)
        x, y = dot(w, self.zero), dot(w, cross(self.axis, self.zero))
        m = (dot(w, w) + (self.arm**2 - self.rod**2)) / (2.0 * self.arm)
        reach = x * x + y * y - m * m
        root = sqrt(reach) if signs == "+" else -sqrt(reach)
        return Inverse([measure_turn(self.drives[0], y, x, root, m)], (Reach(reach),))

    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        foot = self._foot(joints[0])
        return [(foot, point), (self.pivot, foot)]

    def carry(self, foot: Vec, joints: list[Scalar], drive: int) -> Vec:
        s, c = sincos(joints[0])
        arm = sub(foot, self.pivot)
        along = scale(self.axis, dot(self.axis, arm))
        across = add(scale(sub(arm, along), c), scale(cross(self.axis, arm), s))
        return add(self.pivot, add(along, across))

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        foot = self._foot(joints[0])
        return [
            Link("hinge", self.pivot, foot, self.axis, drive=0),
            Link("ball", foot, point, carrier=0, meets="platform"),
        ]

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar]:
        return self._foot(joints[0]), self.rod
