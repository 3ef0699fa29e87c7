"""Legs of deltas, from the sizes that firmwares have of them."""

from __future__ import annotations

from math import radians
from typing import NamedTuple

from ...model.chain import compute_exact_sincos
from ...model.elements import Direction, Drive, Point, Signs, Size, Vector
from ...model.legs.crank import Crank
from ...model.legs.slider import Slider

_UP = Direction((0.0, 0.0, 1.0))
_MIDDLE = Point((0.0, 0.0, 0.0))


class ArmSizes(NamedTuple):
    """Sizes of a rotary delta's leg, mm; ``foot`` is from the platform's middle to its joint."""

    arm: float
    rod: float
    foot: float


def build_tower(drive: Drive, radius: float, angle: float, rod: float, offset: float = 0.0) -> Slider:
    """Build a tower's leg: its carriage counts height from ``offset`` below the base; ``angle`` is in degrees."""
    s, c = compute_exact_sincos(radians(angle))
    foot = Point((radius * c, radius * s, -offset))
    return Slider((drive,), _MIDDLE, foot, _UP, Size(rod), Signs("+"))


def build_arm(drive: Drive, pivot: Vector, angle: float, sizes: ArmSizes, rises: bool, platform_above: bool) -> Crank:
    """Build an arm that points outward where its joint is zero, and whose knee stays outside.

    pivot : of an arm in the plane of X and Z; it is turned about Z by ``angle``, in degrees
    rises : positive joints raise the knee, else they lower it
    """
    s, c = compute_exact_sincos(radians(angle))
    place, platform = Point((pivot[0] * c, pivot[0] * s, pivot[2])), Point((sizes.foot * c, sizes.foot * s, 0.0))
    axis = Direction((s, -c, 0.0) if rises else (-s, c, 0.0))
    branch = Signs("+" if rises == platform_above else "-")
    return Crank((drive,), platform, place, axis, Direction((c, s, 0.0)), Size(sizes.arm), Size(sizes.rod), branch)
