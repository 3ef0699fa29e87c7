"""``lambda``: two sliders on one shaft; the long rod goes to the platform, the short one is hinged to the long one."""

from __future__ import annotations

from dataclasses import dataclass

from ...algebra import Scalar, Vec, dot, move_along, scale, sqrt, sub
from ..elements import Direction, Point, Signs, Size
from .base import Inverse, Leg, Link, Reach


@dataclass(frozen=True)
class Lambda(Leg):
    """Joints: the long rod's slider, then the short rod's (IJEEC 6, 2022, equations (6) to (11), rederived)."""

    kind = "lambda"
    family = "two slides on a rail for each leg"
    units = ("mm", "mm")
    has_carriers = True
    branches = "-+"

    foot: Point  # of both sliders at q = 0
    rail: Direction
    long: Size
    short: Size
    hinge: Size  # from the platform's joint to the hinge, along the long rod
    branch: Signs = Signs("-+")  # long slider before ("-") or past the platform's joint; short one past ("+") the hinge

    @property
    def _lower(self) -> float:
        return self.long - self.hinge

    def closures(self, point: Vec, joints: list[Scalar]) -> list[Scalar]:
        first, second = joints
        u = sub(point, move_along(self.foot, self.rail, first))
        gap = second - first
        height = (self._lower / self.long) * dot(u, self.rail)  # of the hinge over the long rod's slider
        return [
            0.5 * (dot(u, u) - self.long**2),
            0.5 * (gap * gap - self.short**2 + self._lower**2) - gap * height,
        ]

    def inverse(self, point: Vec, signs: str) -> Inverse:
        w = sub(point, self.foot)
        s = dot(w, self.rail)
        off = move_along(w, self.rail, -s)
        reach = self.long**2 - dot(off, off)
        rise = sqrt(reach) if signs[0] == "-" else -sqrt(reach)
        height = (self._lower / self.long) * rise
        hinge_reach = height * height + (self.short**2 - self._lower**2)
        root = sqrt(hinge_reach)
        first = s - rise
        return Inverse(
            [first, first + height + (root if signs[1] == "+" else -root)],
            (Reach(reach, self.long), Reach(hinge_reach)),
        )

    def branch_margins(self, point: Vec, joints: list[Scalar], signs: str) -> list[Scalar]:
        first, second = joints
        rise = dot(sub(point, self.foot), self.rail) - first
        past = second - first - (self._lower / self.long) * rise  # the hinge
        return [rise if signs[0] == "-" else -rise, past if signs[1] == "+" else -past]

    def struts(self, point: Vec, joints: list[Scalar]) -> list[tuple[Vec, Vec]]:
        start = move_along(self.foot, self.rail, joints[0])
        rod = scale(sub(point, start), self._lower / self.long)
        hinge = (start[0] + rod[0], start[1] + rod[1], start[2] + rod[2])
        return [(start, point), (move_along(self.foot, self.rail, joints[1]), hinge)]

    def carry(self, foot: Vec, joints: list[Scalar], drive: int) -> Vec:
        return move_along(foot, self.rail, joints[drive])

    def links(self, point: Vec, joints: list[Scalar]) -> list[Link]:
        (first, _), (second, hinge) = self.struts(point, joints)
        return [
            Link("slide", first, first, self.rail, drive=0),
            Link("ball", first, point, carrier=0, meets="platform"),
            Link("slide", second, second, self.rail, drive=1),
            Link("ball", second, hinge, carrier=2, meets=1),
        ]

    def height_and_distance(self, joints: list[Scalar]) -> tuple[Scalar, Scalar]:
        """Compute how far the platform's joint is along the rail and from it, mm: the direct problem in closed form.

        The short rod's triangle has the sides gap, lower part of the long rod and short rod.
        """
        first, second = joints
        gap = second - first
        cosine = (gap * gap + (self._lower**2 - self.short**2)) / (2.0 * self._lower * gap)
        return first + self.long * cosine, self.long * sqrt(1.0 - cosine * cosine)
