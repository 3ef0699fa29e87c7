"""What was measured of a machine: the tool's pose, some of its coordinates, or its distance from a point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ..arguments import RowsLike, check_arguments, check_range, read_rows, read_vector
from ..arrays import Array, Indices
from ..errors import PoseError, suggest
from ..machine import Machine

_LETTERS = "XYZ"


@dataclass(frozen=True)
class Noise:
    """Standard deviations of measured lengths and angles, and of what drives say of lengths and angles; mm and rad."""

    length: float = 0.01
    angle: float = 2e-5
    slide: float = 0.0
    turn: float = 0.0


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured at joint vectors.

    joints : (N, joints) mm and rad
    axes : the measured coordinates of the pose: all of them, or some of X, Y and Z
    values : (N, axes) mm and rad, in the machine frame
    distances : (N,) mm, of the tool's tip from one fixed point, as of a ball bar; None: not measured
    centre : (3,) that point, mm; None: not known, and found with the rest
    """

    joints: Array
    axes: tuple[str, ...]
    values: Array
    distances: Array | None = None
    centre: Array | None = None
    noise: Noise = Noise()

    def __repr__(self) -> str:
        return f"<parakin {self.describe()}>"

    def describe(self) -> str:
        """Describe what was measured: ``57 measurements of X Y Z``."""
        what = [*self.axes, *(["distance"] if self.distances is not None else [])]
        return f"{len(self.joints)} measurements of {' '.join(what)}"

    @property
    def width(self) -> int:
        """How many numbers were measured at each joint vector."""
        return len(self.axes) + (self.distances is not None)

    def take(self, rows: Indices) -> Measurements:
        """Take some of the measurements."""
        distances = None if self.distances is None else self.distances[rows]
        return replace(self, joints=self.joints[rows], values=self.values[rows], distances=distances)


@check_arguments
def make_measurements(
    machine: Machine,
    joints: RowsLike,
    values: RowsLike | None = None,
    axes: str | None = None,
    distances: RowsLike | None = None,
    centre: RowsLike | None = None,
    noise: Noise | None = None,
) -> Measurements:
    """Make measurements of a machine.

    joints : (N, joints) mm and rad
    values : (N, axes) measured coordinates in the machine frame, mm and rad
    axes : which they are: names of all axes (by default), or some of X, Y and Z
    distances, centre : (N,) mm, of the tip from a fixed point (3,), which may be unknown
    noise : standard deviations

    Raises :class:`PoseError`.
    """
    rows, lead = machine.rows(joints, machine.joints, "joints")
    if len(lead) != 1:
        raise PoseError(f"joints: rows of shape (N, {len(machine.joints)}) expected")
    names = tuple((axes or " ".join(machine.axes)).split()) if values is not None else ()
    check_measured_axes(machine, names)
    measured = np.empty((len(rows), 0))
    if values is not None:
        units = [unit for axis, unit in zip(machine.axes, machine.axis_units, strict=True) if axis in names]
        measured = read_rows(values, names, units, lambda: np.full(len(names), np.nan), "values")
    lengths = None if distances is None else np.asarray(read_rows(distances, ("d",), ("mm",), lambda: np.empty(1), "d"))
    if values is None and lengths is None:
        raise PoseError("values: measured coordinates or distances expected")
    for what, array in (("values", measured), ("distances", lengths)):
        if array is not None and (array.ndim != 2 or len(array) != len(rows) or not np.isfinite(array).all()):
            raise PoseError(f"{what}: {len(rows)} rows of finite numbers expected, one a row of joints")
    if not np.isfinite(rows).all():
        raise PoseError("joints: finite numbers expected")
    point = None if centre is None else read_vector("centre", centre, tuple(_LETTERS))
    lengths = None if lengths is None else lengths[:, 0]
    noise = Noise() if noise is None else noise
    check_noise(noise)
    return Measurements(rows, names, measured, lengths, point, noise)


def check_measured_axes(machine: Machine, names: tuple[str, ...]) -> None:
    """Refuse measured coordinates that are neither all axes nor some of X, Y and Z."""
    for name in names:
        if name not in machine.axes:
            raise PoseError(f"axes: unknown {name}{suggest(name, machine.axes)}")
    if len(set(names)) != len(names):
        raise PoseError(f"axes: {' '.join(names)}, each once expected")
    turning = [name for name in names if name not in _LETTERS]
    if turning and len(names) != len(machine.axes):
        raise PoseError(f"axes: {' '.join(machine.axes)} or some of X Y Z expected, not {' '.join(names)}")


def check_noise(noise: Noise) -> None:
    """Refuse standard deviations that are not positive (of what drives say: not negative)."""
    for name in ("length", "angle"):
        check_range(f"noise {name}", getattr(noise, name), 1e-9, inf)
    for name in ("slide", "turn"):
        check_range(f"noise {name}", getattr(noise, name), 0.0, inf)
