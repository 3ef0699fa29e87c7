"""A tool of which only tip and axis count: axes X Y Z B C."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Mat, Scalar, Vec, atan2, dot, move_along, sincos, sqrt
from .base import DirectionColumns, Structure

_DIRECTION = DirectionColumns(3, 4)


def compute_tool_axis(b: Scalar, c: Scalar) -> tuple[Vec, Vec, Vec]:
    """Compute the tool's axis k = Rz(C)·Ry(B)·z, and two directions at right angles to it."""
    sb, cb = sincos(b)
    sc, cc = sincos(c)
    return (sb * cc, sb * sc, cb), (cb * cc, cb * sc, -sb), (-sc, cc, 0.0)


def compute_axis_angles(k: Vec) -> list[Scalar]:
    """Compute B in [0, π] and C of a tool axis (FME Transactions 41, (8) and (9)); C is 0 where it is free."""
    return [atan2(sqrt(k[0] * k[0] + k[1] * k[1]), k[2]), atan2(k[1], k[0])]


def turn_tool_axis(pose: Sequence[Scalar], turn: Sequence[Scalar] = ()) -> tuple[Vec, Vec, Vec]:
    """Turn a pose's tool axis k and its two directions by small angles towards these."""
    k, e1, e2 = compute_tool_axis(*pose[_DIRECTION.pair])
    if not turn:
        return k, e1, e2
    first, second = turn
    return move_along(move_along(k, e1, first), e2, second), move_along(e1, k, -first), move_along(e2, k, -second)


def make_least_rotation(z: Vec) -> Mat:
    """Compute the least rotation that turns the z axis to a unit vector; there is none to the vector opposite."""
    x, y, w = z
    inverse = 1.0 / (1.0 + w)
    across = -(x * y) * inverse
    return ((1.0 - x * x * inverse, across, x), (across, 1.0 - y * y * inverse, y), (-x, -y, w))


class FiveAxis(Structure):
    """A tool of which only tip and axis count: axes X Y Z B C.

    Its small turns move the axis k as a growing B does (``w1``), and as a growing C does (``w2``).
    """

    axes = ("X", "Y", "Z", "B", "C")
    turns = ("w1", "w2")
    branches = "+"
    direction = _DIRECTION

    def _tilt_rows(self, pose: Sequence[Scalar], turn: Sequence[Scalar], k: Vec) -> list[Scalar]:
        _, e1, e2 = turn_tool_axis(pose, turn)
        return [dot(e1, k), dot(e2, k)]
