"""Between the records of a tool path: the programmed path itself, and the path with more records on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import PoseError
from ...kinematics.wrist import find_nearest_direction
from ..path import Floats, ToolPath

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]
_OPPOSITE = 1e-6  # rad: axes as near to opposite as this don't tell the great circle between them


class Programmed:
    """Tool tips and axes anywhere on a programmed path, in the frame that ``frame`` (3, 4) leads to from W.

    The tip goes straight from record to record, and the axis evenly on the great circle; where the path gives turns,
    A, B and C go evenly instead. A motion is told by the record that it leads to, 1 or more, and a point on it by its
    share, from 0 to 1.
    """

    def __init__(self, path: ToolPath, frame: Floats | None = None):
        self.path = path
        self.rotation = np.eye(3) if frame is None else np.ascontiguousarray(frame[:, :3])
        self.tip, self.axis = path.tip, path.axis
        if frame is not None:
            self.tip, self.axis = path.tip @ self.rotation.T + frame[:, 3], path.axis @ self.rotation.T

    def at(self, record: Indices, share: Floats) -> tuple[Floats, Floats]:
        """Tips (m, 3), mm, and axes (m, 3) at shares (m,) of the motions to ``record`` (m,).

        Raises :class:`PoseError` for a motion between opposite axes: any great circle leads from one to the other.
        """
        s = share[:, None]
        begin = self.tip[record - 1]
        tip = begin + s * (self.tip[record] - begin)
        turns = self.turns(record, share)
        return tip, self._turned(record, share) if turns is None else axis_of_turns(turns) @ self.rotation.T

    def turns(self, record: Indices, share: Floats) -> Floats | None:
        """A, B, C (m, 3), rad, of a path that gives them."""
        turns = self.path.turns
        if turns is None:
            return None
        begin = turns[record - 1]
        return begin + share[:, None] * (turns[record] - begin)

    def extent(self, record: Indices) -> tuple[Floats, Floats]:
        """How far the motions to ``record`` (m,) go: mm of the tip, and rad of the axis or of the turns together."""
        length = _norm(self.tip[record] - self.tip[record - 1])
        turns = self.path.turns
        if turns is not None:
            return length, np.abs(turns[record] - turns[record - 1]).sum(1)
        return length, 2.0 * np.arcsin(np.minimum(1.0, 0.5 * _norm(self.axis[record] - self.axis[record - 1])))

    def _turned(self, record: Indices, share: Floats) -> Floats:
        a, b = self.axis[record - 1], self.axis[record]
        d = b - a
        cosine = _dot(a, b)
        across = d - _dot(d, a)[:, None] * a  # of b, at right angles to a: exact for small angles too
        sine = _norm(across)
        lost = (cosine < 0.0) & (sine < _OPPOSITE)
        if lost.any():
            line = int(self.path.line[record[lost.argmax()]])
            raise PoseError(
                f"{self.path.source}:{line}: the tool axis turns to its opposite, and nothing says which way"
            )
        angle = share * np.arctan2(sine, cosine)
        along = np.divide(np.sin(angle), sine, out=np.zeros_like(sine), where=sine > 0.0)
        return np.cos(angle)[:, None] * a + along[:, None] * across


def axis_of_turns(turns: Floats) -> Floats:
    """Rz(C)·Ry(B)·Rx(A)·z for A, B, C (m, 3)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(turns.T), np.cos(turns.T)
    return np.column_stack([cc * sb * ca + sc * sa, sc * sb * ca - cc * sa, cb * ca])


def denser(path: ToolPath, motion: Indices, share: Floats) -> ToolPath:
    """The path with records put into its motions, of which each keeps its line, feed and what else its record says.

    Parameters
    ----------
    path : n records; ``frame`` and ``notes`` are kept
    motion, share : (m,) where: motions in ascending order, told by the record they lead to, and shares in ascending
        order within each

    The time of a motion is divided in proportion; events stand before the motion as before.
    """
    if not len(motion):
        return path
    between = Programmed(path)
    tip, axis = between.at(motion, share)
    turns = between.turns(motion, share)
    source = np.insert(np.arange(len(path)), motion, motion)
    added = np.insert(np.zeros(len(path), bool), motion, True)
    before = np.cumsum(np.bincount(motion, minlength=len(path) + 1))  # new records ahead of each old one
    first = np.arange(len(path) + 1) + np.concatenate([[0], before[:-1]])  # where the motion to a record begins
    seconds = path.seconds
    if seconds is not None:
        upto = np.insert(np.ones(len(path)), motion, share)
        since = np.where(np.append(False, source[1:] == source[:-1]), np.append(0.0, upto[:-1]), 0.0)
        seconds = seconds[source] * (upto - since)
    return replace(
        path,
        tip=_filled(path.tip, source, added, tip),
        axis=_filled(path.axis, source, added, axis),
        line=path.line[source],
        rapid=path.rapid[source],
        feed=path.feed[source],
        spindle=path.spindle[source],
        events=tuple(event._replace(record=int(first[event.record])) for event in path.events),
        turns=None if path.turns is None or turns is None else _filled(path.turns, source, added, turns),
        seconds=seconds,
    )


def pointed(path: ToolPath, record: Indices, axis: Floats) -> ToolPath:
    """The path with the tool axes (m, 3), in W, of some of its records replaced.

    Turns that the path gives change with them: B and C, the nearest that point there; A has to be 0.
    """
    axes, turns = path.axis.copy(), path.turns
    axes[record] = axis
    if turns is not None:
        turns = turns.copy()
        turns[record] = find_nearest_direction(axis, turns[record])
    return replace(path, axis=axes, turns=turns)


def _filled(rows: Floats, source: Indices, added: Flags, new: Floats) -> Floats:
    result = rows[source]
    result[added] = new
    return result


def _dot(a: Floats, b: Floats) -> Floats:
    result: Floats = np.einsum("ij,ij->i", a, b)
    return result


def _norm(rows: Floats) -> Floats:
    return np.sqrt(_dot(rows, rows))
