"""What was measured of a machine: the tool's pose, some of its coordinates, its distance from a point or a plane."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from ..arguments import RowsLike, check_arguments, check_range, read_rows, read_vector
from ..arrays import Array, Indices
from ..errors import PoseError, quote, suggest
from ..machine import Machine

LETTERS = "XYZ"
_MOST_NOISE = 1e6  # mm and rad: beyond all that is measured
MeasuringFrame = Literal["machine", "instrument"]


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured and of what drives say.

    length, angle : of measured lengths, mm, and angles, rad
    slide, turn : of what drives say of lengths, mm, and of angles, rad
    """

    length: float = 0.01
    angle: float = 2e-5
    slide: float = 0.0
    turn: float = 0.0


@dataclass(frozen=True, eq=False)
class MeasuringSetup:
    """What is known of where things were measured.

    frame : of the coordinates: the machine's, or an instrument's own, which is found with the rest
    centre : (3,) mm, the point of measured distances; None: not known, and found with the rest
    pinned : whether the tip was held in one place, which is found with the rest
    """

    frame: MeasuringFrame = "machine"
    centre: RowsLike | None = None
    pinned: bool = False


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured at joint vectors.

    joints : (N, joints) mm and rad
    axes : the measured coordinates of the pose: all of them, or some of X, Y and Z
    values : (N, axes) mm and rad
    distances : (N,) mm, of the tool's tip from one fixed point, as of a ball bar; None: not measured
    heights : (N,) mm, of the tip over one plane, which is found with the rest; None: not measured
    frame : the coordinates' frame, the machine's or an instrument's own, which is found with the rest
    centre : (3,) the distances' point, mm; None: not known, and found with the rest
    pinned : whether the tip was held in one place, which is found with the rest
    noise : by which rows are weighed
    """

    joints: Array
    axes: tuple[str, ...]
    values: Array
    distances: Array | None = None
    heights: Array | None = None
    frame: MeasuringFrame = "machine"
    centre: Array | None = None
    pinned: bool = False
    noise: Noise = Noise()

    def __repr__(self) -> str:
        return f"<parakin {self.describe()}>"

    def describe(self) -> str:
        """Describe what was measured: ``57 measurements of X Y Z``."""
        others = {
            "distance": self.distances is not None,
            "height": self.heights is not None,
            "one place": self.pinned,
        }
        what = " ".join([*self.axes, *(name for name, is_measured in others.items() if is_measured)])
        return f"{len(self.joints)} measurements of {what}{' in an own frame' * (self.frame != 'machine')}"

    @property
    def width(self) -> int:
        """How many numbers were measured at each joint vector."""
        return len(self.axes) + (self.distances is not None) + (self.heights is not None) + 3 * self.pinned

    def take(self, rows: Indices) -> Measurements:
        """Take some of the measurements.

        rows : their indices
        """
        distances, heights = (None if one is None else one[rows] for one in (self.distances, self.heights))
        return replace(self, joints=self.joints[rows], values=self.values[rows], distances=distances, heights=heights)


@check_arguments
def make_measurements(
    machine: Machine,
    joints: RowsLike,
    values: RowsLike | None = None,
    axes: str | None = None,
    distances: RowsLike | None = None,
    heights: RowsLike | None = None,
    setup: MeasuringSetup | None = None,
    noise: Noise | None = None,
) -> Measurements:
    """Make measurements of a machine.

    machine : which was measured
    joints : (N, joints) mm and rad
    values : (N, axes) measured coordinates, mm and rad
    axes : which they are: names of all axes (by default), or some of X, Y and Z
    distances : (N,) mm, of the tip from a fixed point
    heights : (N,) mm, of the tip over an unknown plane: 0 where it touches a flat artefact
    setup : whose frame the coordinates are in, and the distances' point; by default the machine's, and unknown
    noise : standard deviations, of :class:`Noise` by default

    Raises :class:`PoseError` where nothing was measured, rows are not as many as joint vectors, or the axes, frame or
    noise are none that a calibration takes.
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
    lengths, over = (
        None if one is None else _read_lengths(what, one, len(rows))
        for what, one in (("distances", distances), ("heights", heights))
    )
    setup = MeasuringSetup() if setup is None else setup
    if values is None and lengths is None and over is None and not setup.pinned:
        raise PoseError("values: measured coordinates, distances or heights expected")
    if measured.ndim != 2 or len(measured) != len(rows) or not np.isfinite(measured).all():
        raise _refuse_rows("values", len(rows))
    if not np.isfinite(rows).all():
        raise PoseError("joints: finite numbers expected")
    point = None if setup.centre is None else read_vector("centre", setup.centre, tuple(LETTERS))
    _check_setup(machine, setup, names, over)
    noise = Noise() if noise is None else noise
    check_noise(noise)
    return Measurements(rows, names, measured, lengths, over, setup.frame, point, setup.pinned, noise)


def _check_setup(machine: Machine, setup: MeasuringSetup, names: tuple[str, ...], heights: Array | None) -> None:
    """Refuse a frame or a plane that such measurements can't tell."""
    if setup.frame not in get_args(MeasuringFrame):
        raise PoseError(f"frame: machine or instrument expected, not {quote(str(setup.frame))}")
    spatial = set(LETTERS) <= set(machine.axes)
    if setup.frame == "instrument" and names != tuple(LETTERS):
        given = " ".join(names) or "none"
        raise PoseError(f"frame: an instrument's own frame is found from X Y Z of the tip, not from {given}")
    if (heights is not None or setup.pinned) and not spatial:
        what = "heights: a plane" if heights is not None else "pinned: a place"
        raise PoseError(f"{what} is found for machines with X, Y and Z, not for {' '.join(machine.axes)}")


def check_measured_axes(machine: Machine, names: tuple[str, ...]) -> None:
    """Refuse measured coordinates that are neither all axes nor some of X, Y and Z."""
    for name in names:
        if name not in machine.axes:
            raise PoseError(f"axes: unknown {name}{suggest(name, machine.axes)}")
    if len(set(names)) != len(names):
        raise PoseError(f"axes: {' '.join(names)}, each once expected")
    turning = [name for name in names if name not in LETTERS]
    if turning and len(names) != len(machine.axes):
        raise PoseError(f"axes: {' '.join(machine.axes)} or some of X Y Z expected, not {' '.join(names)}")


def _read_lengths(what: str, values: RowsLike, count: int) -> Array:
    """Read one length for each row of joints, (N,) or (N, 1); returns (N,)."""
    lengths = read_rows({"d": values}, ("d",), ("mm",), lambda: np.empty(1), what)
    if lengths.shape not in ((count, 1), (count, 1, 1)) or not np.isfinite(lengths).all():
        raise _refuse_rows(what, count)
    return lengths.reshape(count)


def _refuse_rows(what: str, count: int) -> PoseError:
    return PoseError(f"{what}: {count} rows of finite numbers expected, one a row of joints")


def check_noise(noise: Noise) -> None:
    """Refuse standard deviations that are not positive (of what drives say: not negative)."""
    for name in ("length", "angle"):
        check_range(f"noise {name}", getattr(noise, name), 1e-9, _MOST_NOISE)
    for name in ("slide", "turn"):
        check_range(f"noise {name}", getattr(noise, name), 0.0, _MOST_NOISE)
