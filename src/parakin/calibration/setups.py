"""What measures the tip, and what is unknown of it: a frame, a point, a place, a plane.

The unknown numbers are found with the machine's.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Array
from .measurements import LETTERS, Measurements

_SMALL = 1e-6  # rad: of turns below it a series has no more than rounding


class Prediction(NamedTuple):
    """What would be measured of tips, and its derivatives.

    values : (N, r) mm
    by_tips : (N, r, 3) by the tips
    by_unknown : (N, r, u) by the setup's unknown numbers
    """

    values: Array
    by_tips: Array
    by_unknown: Array


class Setup(Protocol):
    """What measures the tip.

    begin : (u,) the unknown numbers, about
    turns : (u,) which of them are angles
    """

    begin: Array
    turns: Array

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        """Predict what is measured.

        tips : (N, 3) mm, in the machine's frame
        unknown : (u,) the unknown numbers, mm and rad
        """
        ...


class MachineFrame:
    """Some coordinates of the tip in the machine's frame; nothing is unknown."""

    begin, turns = np.empty(0), np.empty(0, bool)

    def __init__(self, axes: Sequence[str]):
        self.rows = np.eye(3)[[LETTERS.index(axis) for axis in axes]].reshape(-1, 3)

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        by_tips = np.broadcast_to(self.rows, (len(tips), *self.rows.shape))
        return Prediction(tips @ self.rows.T, by_tips, np.zeros((*by_tips.shape[:2], 0)))


class InstrumentFrame:
    """The tip's coordinates v in an instrument's own frame, as of a laser tracker: tip = R v + o.

    o (mm) and the vector of the turn R are unknown.
    """

    turns = np.array([False] * 3 + [True] * 3)

    def __init__(self, tips: Array, values: Array):
        turn, _ = Rotation.align_vectors(tips - tips.mean(0), values - values.mean(0))
        self.begin = np.concatenate([tips.mean(0) - turn.apply(values.mean(0)), turn.as_rotvec()])

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        origin, turn = unknown[:3], Rotation.from_rotvec(unknown[3:])
        back = turn.as_matrix().T
        values = (tips - origin) @ back.T
        crosses = np.array([_make_cross(value) for value in values])
        by_unknown = np.concatenate(
            [np.broadcast_to(-back, crosses.shape), crosses @ _compute_turn_rates(unknown[3:])], axis=2
        )
        return Prediction(values, np.broadcast_to(back, crosses.shape), by_unknown)


def build_instrument_frame(unknown: Array) -> Array:
    """Build the transform (3, 4) from an instrument's frame to the machine's."""
    return np.column_stack([Rotation.from_rotvec(unknown[3:]).as_matrix(), unknown[:3]])


def _make_cross(vector: Array) -> Array:
    """Make the matrix (3, 3) of a cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _compute_turn_rates(vector: Array) -> Array:
    """Compute how a turn's own small turn follows from a change of its vector, (3, 3): the right Jacobian of SO(3)."""
    angle, cross = float(np.linalg.norm(vector)), _make_cross(vector)
    if angle < _SMALL:
        return np.eye(3) - 0.5 * cross
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) - first * cross + second * cross @ cross)


class FixedPoint:
    """The tip's distance from a fixed point, as of a ball bar; the point is unknown unless given."""

    def __init__(self, tips: Array, distances: Array, centre: Array | None):
        self.centre = centre
        self.begin = _find_centre(tips, distances) if centre is None else np.empty(0)
        self.turns = np.zeros(len(self.begin), bool)

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        offsets = tips - (unknown if self.centre is None else self.centre)
        lengths = np.linalg.norm(offsets, axis=1)
        along = (offsets / lengths[:, None])[:, None]
        return Prediction(lengths[:, None], along, -along[:, :, : len(self.begin)])


def _find_centre(tips: Array, distances: Array) -> Array:
    """Find the point of distances, about: the differences of their squares are linear in it."""
    matrix = np.hstack([2.0 * tips, np.ones((len(tips), 1))])
    return np.asarray(np.linalg.lstsq(matrix, (tips * tips).sum(1) - distances**2, rcond=None)[0][:3])


class PinnedPlace:
    """One place in which the tip was held while the tool turned about it, as in a ball socket; it is unknown."""

    turns = np.zeros(3, bool)

    def __init__(self, tips: Array):
        self.begin = tips.mean(0)

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        every = np.broadcast_to(np.eye(3), (len(tips), 3, 3))
        return Prediction(tips - unknown, every, -every)


class UnknownPlane:
    """The tip's height over a plane, as where it touches a flat artefact: n·tip - d.

    The plane is unknown: d, mm, and two turns of n out of a first guess.
    """

    turns = np.array([False, True, True])

    def __init__(self, tips: Array, heights: Array):
        middle = tips.mean(0)
        guesses = [np.linalg.svd(tips - middle)[2][2], np.linalg.lstsq(tips - middle, heights - heights.mean())[0]]
        normals = [sign * n / np.linalg.norm(n) for n in guesses if np.linalg.norm(n) > 0.0 for sign in (1.0, -1.0)]
        off = [np.ptp((tips @ normal) - heights) for normal in normals]
        self.normal = normals[int(np.argmin(off))]
        self.across = np.linalg.svd(self.normal[None])[2][1:]
        self.begin = np.array([(tips @ self.normal - heights).mean(), 0.0, 0.0])

    def find_normal(self, unknown: Array) -> Array:
        """Find n, (3,)."""
        leaning = self.normal + unknown[1:] @ self.across
        return np.asarray(leaning / np.linalg.norm(leaning))

    def predict(self, tips: Array, unknown: Array) -> Prediction:
        normal = self.find_normal(unknown)
        size = np.linalg.norm(self.normal + unknown[1:] @ self.across)
        leans = (self.across - np.outer(self.across @ normal, normal)) / size
        by_unknown = np.hstack([np.full((len(tips), 1), -1.0), tips @ leans.T])[:, None]
        by_tips = np.broadcast_to(normal, (len(tips), 1, 3))
        return Prediction((tips @ normal - unknown[0])[:, None], by_tips, by_unknown)


def make_setups(measured: Measurements, tips: Array) -> list[tuple[Setup, Array]]:
    """Make what measured the tips (N, 3), about, each with what it measured, (N, r)."""
    setups: list[tuple[Setup, Array]] = []
    if measured.axes and measured.frame == "instrument":
        setups.append((InstrumentFrame(tips, measured.values), measured.values))
    elif measured.axes:
        setups.append((MachineFrame(measured.axes), measured.values))
    if measured.distances is not None:
        point = FixedPoint(tips, measured.distances, measured.centre)
        setups.append((point, measured.distances[:, None]))
    if measured.heights is not None:
        setups.append((UnknownPlane(tips, measured.heights), measured.heights[:, None]))
    if measured.pinned:
        setups.append((PinnedPlace(tips), np.zeros_like(tips)))
    return setups
