"""``slider``: a rod of fixed length whose foot runs on a straight rail (Orthoglide, linear Delta, Hexaglide).

A pair of equal rods on a platform that only translates (a parallelogram) is one such rod, the mean one.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...algebra import Scalar, Vec, dot, move_along, sqrt, sub
from ..elements import Direction, Point, Signs, Size
from .base import Inverse, Leg, Link, Reach, close_rod


@dataclass(frozen=True)
class Slider(Leg):
    kind = "slider"
    family = "rods on straight slides"
    units = ("mm",)
    has_carriers = True
    branches = "-"
    # The branch margin is r, with r² = L² - s². The rod changes by d across the rail, and along it by |r' - r|, less
    # than (2·s·d + d²) / r; and r + 2·s ≤ √5·L.
    sway = 2.5

    foot: Point  # at q = 0
    rail: Direction  # q counts along it
    rod: Size
    branch: Signs = Signs("-")  # "+": the foot is farther along the rail than the platform's joint

    def _foot(self, q: Scalar) -> Vec:
        return move_along(self.foot, self.rail, q)

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        return [close_rod(self._foot(joints[0]), point, self.rod**2)]

    def inverse(self, point: Vec, signs: str) -> Inverse:
        w = sub(point, self.foot)
        s = dot(w, self.rail)
        off = move_along(w, self.rail, -s)  # from the rail, at right angles
        reach = self.rod**2 - dot(off, off)
        root = sqrt(reach)
        return Inverse([s - root if signs == "-" else s + root], (Reach(reach, self.rod),))

    def branch_margins(self, point: Vec, joints: list[Scalar], signs: str) -> list[Scalar]:
        ahead = joints[0] - dot(sub(point, self.foot), self.rail)
        return [-ahead if signs == "-" else ahead]

    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        return [(self._foot(joints[0]), point)]

    def carry(self, foot: Vec, joints: list[Scalar], drive: int) -> Vec:
        return move_along(foot, self.rail, joints[drive])

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        foot = self._foot(joints[0])
        return [
            Link("slide", foot, foot, self.rail, drive=0),
            Link("ball", foot, point, carrier=0, meets="platform"),
        ]

    def sphere(self, joints: list[Scalar]) -> tuple[Vec, Scalar]:
        return self._foot(joints[0]), self.rod
