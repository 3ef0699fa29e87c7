"""The coordinate systems of a G-code program: work systems, G92 offsets, tool length offsets.

Six coordinates, X to C, mm and degrees. W is the system that the tool path is given in: the first work system in
force. LinuxCNC's machine coordinates are

    machine = Rz(rotation) (program + local) + origin + tool,

with ``local`` the offsets of G92 and G52. What no word of the file tells is NaN.
"""

import math
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from .codes import G54

COUNT = 9  # work systems, G54 to G59.3
_UNKNOWN = np.array([math.nan] * 3 + [0.0] * 3)


class SystemFrame(NamedTuple):
    """How program coordinates lead to those of W: rotate about Z by ``rotation`` (degrees), then add ``shift``."""

    rotation: float
    shift: tuple[float, ...]


class WorkSystems:
    """The systems and offsets in force.

    current : the number of the work system in force, 1 (G54) to 9 (G59.3)
    base : (6,) where the origin of W lies in the machine
    origin, shift : (10, 6) by number, a system's origin in the machine and in W
    rotation : (10,) degrees about Z
    local : (6,) the offsets of G92 or G52 in force
    kept : (6,) those that G92.3 restores
    tool : (3,) the tool length offset in force, in the machine's X, Y and Z
    """

    def __init__(self, workpiece: Array | None):
        self.base = _UNKNOWN.copy()
        if workpiece is not None:
            self.base[:3] = workpiece[:, 3]
        self.current = 1
        self.origin = np.tile(_UNKNOWN, (COUNT + 1, 1))
        self.shift = np.tile(_UNKNOWN, (COUNT + 1, 1))
        self.rotation = np.zeros(COUNT + 1)
        self.local, self.kept = np.zeros(6), np.zeros(6)
        self.tool = np.zeros(3)
        self.shift[1] = 0.0
        self.stated: set[int] = set()  # the numbers that G10 has set
        self._resolve()

    def _resolve(self) -> None:
        """Complete origins and shifts by one another where the base is known."""
        self.shift = np.where(np.isnan(self.shift), self.origin - self.base, self.shift)
        self.origin = np.where(np.isnan(self.origin), self.base + self.shift, self.origin)

    @staticmethod
    def number(code: int) -> int:
        """Return a work system's number by its G code in tenths."""
        return (code - G54) // 10 + 1 if code <= 590 else code - 584

    def make_first(self, number: int) -> None:
        """Let W be another work system, before any motion."""
        self.shift[self.current] = _UNKNOWN
        self.origin[self.current] = _UNKNOWN
        self.current = number
        self.shift[number] = 0.0
        self._resolve()

    def has_shift(self, number: int) -> bool:
        """Tell whether a system's place in W is known."""
        return bool(np.isfinite(self.shift[number]).all())

    def place(self, number: int, k: int, value: float, *, moved: bool) -> bool:
        """Set a system's origin along an axis, in the machine; return whether the system's place in W remains known.

        moved : whether there was motion before, so that W can no longer be defined
        """
        if math.isnan(self.base[k]) and number == self.current and not moved and self.shift[number, k] == 0.0:
            self.base[k] = value  # the file says itself where W lies
        else:
            self.shift[number, k] = math.nan
        self.origin[number, k] = value
        self._resolve()
        return not math.isnan(self.shift[number, k])

    def set_shift(self, number: int, k: int, value: float) -> None:
        """Set a system's origin along an axis, in W."""
        self.shift[number, k], self.origin[number, k] = value, math.nan
        self._resolve()

    def to_work(self, point: list[float]) -> list[float]:
        """Convert program coordinates to W."""
        moved = [p + q for p, q in zip(point, self.local.tolist(), strict=True)]
        turned = rotate_point(moved, float(self.rotation[self.current]))
        return [p + q for p, q in zip(turned, self.shift[self.current].tolist(), strict=True)]

    def from_work(self, point: list[float]) -> list[float]:
        """Convert coordinates in W to the program's."""
        moved = [p - q for p, q in zip(point, self.shift[self.current].tolist(), strict=True)]
        turned = rotate_point(moved, -float(self.rotation[self.current]))
        return [p - q for p, q in zip(turned, self.local.tolist(), strict=True)]

    def offset_in_machine(self, k: int) -> float:
        """Return what the machine's coordinate along an axis exceeds W's by; NaN if not known."""
        return float(self.base[k]) + (float(self.tool[k]) if k < 3 else 0.0)

    def frame(self) -> SystemFrame:
        """Return how program coordinates lead to W now."""
        return SystemFrame(float(self.rotation[self.current]), tuple(self.to_work([0.0] * 6)))


def rotate_point(point: list[float], degrees: float) -> list[float]:
    """Rotate X and Y about Z."""
    if degrees == 0.0:
        return point
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    x, y = point[:2]
    return [cosine * x - sine * y, sine * x + cosine * y, *point[2:]]


def apply_frames(columns: Array, frames: list[tuple[int, SystemFrame]]) -> None:
    """Convert the coordinates of rows (6, n) from the program's to W's, in place.

    frames : the first row of each and its frame, in order
    """
    for k, (first, frame) in enumerate(frames):
        last = frames[k + 1][0] if k + 1 < len(frames) else columns.shape[1]
        if last <= first or (frame.rotation == 0.0 and not any(frame.shift)):
            continue
        block = columns[:6, first:last]
        if frame.rotation != 0.0:
            sine, cosine = math.sin(math.radians(frame.rotation)), math.cos(math.radians(frame.rotation))
            block[:2] = cosine * block[0] - sine * block[1], sine * block[0] + cosine * block[1]
        block += np.array(frame.shift)[:, None]
