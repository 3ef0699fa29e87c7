"""Legs of deltas, from the sizes that firmwares have of them."""

from __future__ import annotations

from math import radians

from ...model.chain import compute_exact_sincos
from ...model.elements import Direction, Drive, Point, Signs, Size
from ...model.legs.crank import Crank
from ...model.legs.slider import Slider

_UP = Direction((0.0, 0.0, 1.0))
_MIDDLE = Point((0.0, 0.0, 0.0))


def build_tower(drive: Drive, radius: float, angle: float, rod: float, offset: float = 0.0) -> Slider:
    """Build a tower's leg: its carriage counts height from ``offset`` below the base; ``angle`` is in degrees."""
    s, c = compute_exact_sincos(radians(angle))
    foot = Point((radius * c, radius * s, -offset))
    return Slider((drive,), _MIDDLE, foot, _UP, Size(rod), Signs("+"))


def build_arm(drive: Drive, shoulder: Point, angle: float, arm: float, rod: float, foot: float, side: int) -> Crank:
    """Build an arm that swings outward, upward for positive joints; ``angle`` is in degrees.

    foot : the radius of the platform's joint
    side : where the platform is, 1 above the shoulders, -1 below
    """
    s, c = compute_exact_sincos(radians(angle))
    pivot = Point((shoulder[0] * c, shoulder[0] * s, shoulder[2]))
    platform = Point((foot * c, foot * s, 0.0))
    branch = Signs("+" if side > 0 else "-")
    return Crank(
        (drive,), platform, pivot, Direction((s, -c, 0.0)), Direction((c, s, 0.0)), Size(arm), Size(rod), branch
    )
