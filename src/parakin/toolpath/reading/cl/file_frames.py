"""Frames of a CL file: directions, the workpiece's frame in the machine, and the way from the file's numbers to mm."""

import math
from dataclasses import dataclass, field

import numpy as np

from ....arrays import Array
from ..text import refuse

AXIS_TOLERANCE = 1e-3  # an axis further off unit length earns a note; a frame's axes may be so far off right angles
SMALLEST_SQUARE = 1e-12  # an axis of a smaller squared length has no direction
_SHORTEST = 1e-6  # a direction of a smaller length is none
_ROUNDED = 1e-12  # a rotation closer to orthogonal than this is left as it is

Triple = tuple[float, float, float]
UPRIGHT: Triple = (0.0, 0.0, 1.0)  # the tool axis along Z


@dataclass(frozen=True)
class Frame:
    """A frame in the machine: rotation (3, 3) and origin (3,) in the file's unit."""

    rotation: Array
    origin: Array

    def scale_origin(self, factor: float) -> "Frame":
        """Return the frame with its origin in another unit."""
        return Frame(self.rotation, self.origin * factor)

    def equals(self, other: "Frame") -> bool:
        """Tell whether two frames are equal, except for the last digits of the origin."""
        near = np.abs(self.origin - other.origin) <= 1e-12 * np.maximum(1.0, np.abs(other.origin))
        return np.array_equal(self.rotation, other.rotation) and bool(near.all())


MACHINE = Frame(np.eye(3), np.zeros(3))


@dataclass
class FileTransform:
    """The way from the file's numbers to the first workpiece frame in mm: x -> turn (scale (x - origin)) + shift.

    scale : mm in the file's unit
    origin : (3,) the point that ORIGIN makes zero, in the file's unit
    turn, shift : (3, 3) or None for no turn, and (3,) mm
    """

    scale: float = 1.0
    origin: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array | None = None
    shift: Array = field(default_factory=lambda: np.zeros(3))

    def apply(self, tip: Array, axis: Array) -> None:
        """Transform rows of (n, 3) in place."""
        if self.origin.any():
            tip -= self.origin
        if self.scale != 1.0:
            tip *= self.scale
        if self.turn is not None:
            tip[:] = tip @ self.turn.T
            axis[:] = axis @ self.turn.T
        if self.shift.any():
            tip += self.shift

    def invert(self, tip: Array) -> Array:
        """Bring one point (3,) back to the file's numbers."""
        local = tip - self.shift
        if self.turn is not None:
            local = self.turn.T @ local
        return np.asarray(local / self.scale + self.origin)


def normalise_direction(ijk: list[float]) -> Triple:
    """Scale a vector to unit length; one without length is refused."""
    norm = math.hypot(*ijk)
    if not norm > _SHORTEST:
        refuse("a direction without length; expected a unit vector")
    return ijk[0] / norm, ijk[1] / norm, ijk[2] / norm


def build_frame(origin: list[float], x: list[float], y: list[float]) -> Frame:
    """Build a frame from its origin and the directions of X and Y, which must be orthogonal; Z is their product."""
    ex, ey = np.array(normalise_direction(x)), np.array(normalise_direction(y))
    if abs(float(ex @ ey)) > AXIS_TOLERANCE:
        refuse("the X and Y directions of MSYS are not at right angles")
    ez = np.cross(ex, ey)
    ez /= np.linalg.norm(ez)
    return Frame(np.column_stack([ex, np.cross(ez, ex), ez]), np.array(origin))


def build_frame_from_matrix(rows: list[list[float]], word: str = "$$*CATIA0") -> Frame:
    """Build a frame from the three rows of a 3 by 4 matrix; the SVD frees its rotation from rounding."""
    matrix = np.array(rows)
    rotation = matrix[:, :3]
    error = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if not error < AXIS_TOLERANCE or np.linalg.det(rotation) < 0.0:
        refuse(f"the matrix of {word} is no right-handed rotation; expected unit columns at right angles")
    if error > _ROUNDED:
        left, _, right = np.linalg.svd(rotation)
        rotation = left @ right
    return Frame(rotation, matrix[:, 3])


class WorkZeros:
    """The control's work systems that a file chooses without telling where they are, by the word that does."""

    def __init__(self) -> None:
        self._chosen: dict[str, list[str]] = {}

    def keep(self, word: str, args: list[str], *, in_motion: bool) -> None:
        """Keep what a word chooses; refuse another one behind the first motion."""
        if in_motion and self._chosen.get(word, args) != args:
            refuse("another work system, whose place the file does not tell; expected one throughout")
        self._chosen[word] = args
