"""The point in which a head's two axes and the tool's axis meet."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Scalar, Vec, apply, dot, move_along, norm, sub
from ...errors import DescriptionError
from ..chain import UNIT, compose_chain
from ..elements import Step
from ..nominal_values import find_nominal_value

_ONE_POINT = 1e-9  # of the head's size: what is less is rounding


def find_wrist_centre(head: Sequence[Step]) -> tuple[Vec, Scalar]:
    """Find (w, l): the platform's point w, mm, lies at the tip + l·k in every position of the head.

    Raises :class:`DescriptionError` where there is no such point.
    """
    poses = [(0.0, 0.0), (0.7, 0.4), (-1.1, 0.9), (0.3, -1.3)]
    driven = sum(step.drive is not None for step in head)
    frames = [compose_chain(head, angles[2 - driven :]) for angles in poses]
    tips = [tip for _, tip in frames]
    axes = [apply(rotation, UNIT["tz"]) for rotation, _ in frames]
    change = sub(axes[1], axes[0])
    length = -dot(sub(tips[1], tips[0]), change) / dot(change, change)
    centres = [move_along(tip, k, length) for tip, k in zip(tips, axes, strict=True)]
    off = [norm([find_nominal_value(x) for x in sub(c, centres[0])]) for c in centres]
    size = norm([find_nominal_value(x) for x in (*centres[0], length)])
    if max(off) > _ONE_POINT * (1.0 + size):
        raise DescriptionError("head", "its axes must meet in one point on the tool's axis")
    return centres[0], length
