"""The programmed path between its records: straight lines of the tip, great circles of the axis or even turns."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Flags, Indices
from ..errors import PoseError
from .path import ToolPath

OPPOSITE = 1e-6  # rad: axes as near to opposite as this don't tell the great circle between them


class ProgrammedPath:
    """Tool tips and axes anywhere on a programmed path, in the frame that ``frame`` (3, 4) leads to from W.

    The tip goes straight from record to record, and the axis evenly on the great circle; where the path gives turns,
    A, B and C go evenly instead. A motion is named by the record that it leads to, 1 or more, and a point on it by its
    share of the motion, from 0 to 1.

    Tips are those of the machine's own tool; where the path's tool is longer, it is that one's tip that goes straight.
    """

    def __init__(self, path: ToolPath, frame: Array | None = None):
        self.path = path
        self.rotation = np.eye(3) if frame is None else np.ascontiguousarray(frame[:, :3])
        self.tip, self.axis, self.extension = path.tip, path.axis, path.extension
        if frame is not None:
            self.tip, self.axis = path.tip @ self.rotation.T + frame[:, 3], path.axis @ self.rotation.T

    def interpolate(self, record: Indices, share: Array) -> tuple[Array, Array]:
        """Interpolate tips (m, 3), mm, and axes (m, 3) at shares (m,) of the motions to ``record`` (m,).

        Raises :class:`PoseError` for a motion between opposite axes: any great circle leads from one to the other.
        """
        s = share[:, None]
        begin = self.tip[record - 1]
        tip = begin + s * (self.tip[record] - begin)
        turns = self.interpolate_turns(record, share)
        axis = self._interpolate_axes(record, share) if turns is None else compute_tool_axes(turns) @ self.rotation.T
        if self.extension is None:
            return tip, axis
        # the longer tool's own tip goes straight, and the machine's tip is up the axis from it
        first, last = (self.extension[at][:, None] * self.axis[at] for at in (record - 1, record))
        return tip - (first + s * (last - first)) + self.interpolate_extension(record, share)[:, None] * axis, axis

    def interpolate_extension(self, record: Indices, share: Array) -> Array:
        """Interpolate how much longer the tool is than the machine's own (m,), mm."""
        if self.extension is None:
            return np.zeros(len(record))
        begin = self.extension[record - 1]
        extension: Array = begin + share * (self.extension[record] - begin)
        return extension

    def get_extension(self, record: Indices) -> Array:
        """Return how much longer the tool is than the machine's own at ``record`` (m,), mm."""
        return np.zeros(len(record)) if self.extension is None else self.extension[record]

    def interpolate_turns(self, record: Indices, share: Array) -> Array | None:
        """Interpolate A, B, C (m, 3), rad, of a path that gives them; None for another."""
        turns = self.path.turns
        if turns is None:
            return None
        begin = turns[record - 1]
        return begin + share[:, None] * (turns[record] - begin)

    def measure_motions(self, record: Indices) -> tuple[Array, Array]:
        """Measure the motions to ``record`` (m,): mm of the tip, and rad of the axis or of A, B and C together."""
        length = compute_norms(self.tip[record] - self.tip[record - 1])
        turns = self.path.turns
        if turns is not None:
            return length, np.abs(turns[record] - turns[record - 1]).sum(1)
        chord = compute_norms(self.axis[record] - self.axis[record - 1])
        return length, 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))

    def find_opposite(self, record: Indices) -> Flags:
        """Find the motions to ``record`` (m,) between opposite axes, where no turns say which way the axis goes."""
        if self.path.turns is not None:
            return np.zeros(len(record), np.bool_)
        a, b = self.axis[record - 1], self.axis[record]
        opposite: Flags = compute_norms(a + b) < OPPOSITE
        return opposite

    def _interpolate_axes(self, record: Indices, share: Array) -> Array:
        """Interpolate axes on great circles."""
        a, b = self.axis[record - 1], self.axis[record]
        opposite = self.find_opposite(record)
        if opposite.any():
            line = int(self.path.line[record[opposite.argmax()]])
            raise PoseError(
                f"{self.path.source}:{line}: the tool axis turns to its opposite, and nothing says which way"
            )
        return interpolate_great_circle(a, b, share)


def interpolate_great_circle(a: Array, b: Array, share: Array) -> Array:
    """Interpolate unit vectors (m, 3) on great circles (slerp) from a to b, exact for small angles too."""
    d = b - a
    across = d - compute_dots(d, a)[:, None] * a  # the part of b at right angles to a
    sine = compute_norms(across)
    angle = share * np.arctan2(sine, compute_dots(a, b))
    along = np.divide(np.sin(angle), sine, out=np.zeros_like(sine), where=sine > 0.0)
    axes: Array = np.cos(angle)[:, None] * a + along[:, None] * across
    return axes


def compute_tool_axes(turns: Array) -> Array:
    """Compute the tool axes Rz(C)·Ry(B)·Rx(A)·z, unit vectors (m, 3), of turns A, B, C (m, 3) in rad."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
    return np.column_stack([cc * sb * ca + sc * sa, sc * sb * ca - cc * sa, cb * ca])


def compute_dots(a: Array, b: Array) -> Array:
    """Compute the dot products of rows (n, k): (n,)."""
    dots: Array = np.einsum("ij,ij->i", a, b)
    return dots


def compute_norms(rows: Array) -> Array:
    """Compute the Euclidean norms of rows (n, k): (n,)."""
    return np.sqrt(compute_dots(rows, rows))
