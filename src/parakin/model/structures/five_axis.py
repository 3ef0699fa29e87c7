"""A tool of which only tip and axis count: axes X Y Z B C."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Scalar, Vec, atan2, dot, sincos, sqrt
from .base import Structure


def tool_axis(b: Scalar, c: Scalar) -> tuple[Vec, Vec, Vec]:
    """The tool's axis k = Rz(C)·Ry(B)·z, and two directions at right angles to it."""
    sb, cb = sincos(b)
    sc, cc = sincos(c)
    return (sb * cc, sb * sc, cb), (cb * cc, cb * sc, -sb), (-sc, cc, 0.0)


def axis_angles(k: Vec) -> list[Scalar]:
    """B in [0, π] and C of a tool axis (FME Transactions 41, (8) and (9)); C is 0 where it is free."""
    return [atan2(sqrt(k[0] * k[0] + k[1] * k[1]), k[2]), atan2(k[1], k[0])]


class FiveAxis(Structure):
    """A tool of which only tip and axis count: axes X Y Z B C."""

    axes = ("X", "Y", "Z", "B", "C")
    branches = "+"

    def _tilt_rows(self, pose: Sequence[Scalar], k: Vec) -> list[Scalar]:
        _, e1, e2 = tool_axis(pose[3], pose[4])
        return [dot(e1, k), dot(e2, k)]
