"""The tool's path as a curve: straight motions between the records, with corners rounded or stopped at."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from ...arrays import Array, Flags, Indices
from ...errors import PoseError
from ...kernels.batch import run_in_threads
from ...kinematics.wrist.pole_thresholds import PRINTED, RIM, RIM_WIDTH
from ...machine import Machine
from ..posting.posted import Posted
from .kernels.rounded_corners import SLIVER, blend_poses

Corners: TypeAlias = Literal["round", "stop"]

LEVER = 100.0  # mm/rad: the weight of a turn beside a motion of the tip in the path's length
CORNER = np.deg2rad(1.0)  # a path that turns by no more is not stopped at
_SAME = 1e-6  # mm: records no farther apart are one corner
_TIGHT = 1e-4  # mm of reach for each rad (mm/mm) of turn: a corner passed so slowly is as well stopped at
_BESIDE = 0.05  # a rounding ends at a piece's end, or at least this fraction of the piece from it
_BENT = 1e-9  # rad/mm and mm/mm: what is rounding
_FARTHER = 1.5  # a rounding reaches over whole pieces if it may reach so many times farther than the longer one
_ALIKE = 4.0  # and the longer one is no longer than so many times the other
_UNSTEADY = 0.5  # of two neighbours' second derivatives: what changes by as much is no steady bend
_ABOUT = 4  # corners about one at which a bend is steady
_KEPT = 0.995  # fraction of the tolerances that corners use; the rest is for the error of the joints' splines


class Curve(NamedTuple):
    """A tool path as a curve over its length s, c corners.

    s counts mm of the tip and, for turns of the pose's angles, LEVER mm a rad (root of the sum of squares). A piece
    leads from corner to corner. On it the pose is a straight line in s, with second derivatives that fall linearly
    behind the corner where it begins and rise before the one where it ends, so two derivatives are continuous.

    Where the tolerances ask for it, that is within ``reach`` mm on either side, and the pose is nowhere farther from
    the polyline than at the corners, |turn|·reach/6. Where roundings may reach over whole pieces, the curve is a cubic
    B-spline with its knots at the corners. Its vertices then lie ahead of the corners or behind them as their knots
    ask for, and beside them by what takes the curve through the corners, if the path bends steadily there.

    corner : (c, axes) poses, mm and rad
    begin : (c - 1, axes) the pose on each piece's straight line where the piece begins
    length : (c - 1,) of the pieces
    slope : (c - 1, axes) the pose's derivative by s on the straight lines
    bend : (c, axes) the pose's second derivative by s at each corner; 0 where the corner is not rounded
    sharpness : (c,) the size of the change of slope, angles counted as in s; 0 where the corner is not rounded
    rise, fall : (c,) mm of s over which the second derivative rises before a corner and falls behind it
    parted : (c,) where the derivatives are not continuous: start, end, and corners that are not rounded
    corner_of_record : (n,) the corner at which each record lies
    record_of_piece : (c - 1,) the record that each piece leads to
    """

    corner: Array
    begin: Array
    length: Array
    slope: Array
    bend: Array
    sharpness: Array
    rise: Array
    fall: Array
    parted: Flags
    corner_of_record: Indices
    record_of_piece: Indices

    def poses(self, segment: Indices, offset: Array) -> Array:
        """Compute the poses (k, axes) on pieces ``segment``, ``offset`` mm from their start."""
        poses = np.empty((len(segment), self.corner.shape[1]))
        run_in_threads(len(segment), lambda start, stop: blend_poses(self, segment, offset, poses, start, stop))
        return poses

    def __repr__(self) -> str:
        return f"<parakin curve: {len(self.length)} pieces, {self.length.sum():.6g} mm>"


def round_corners(
    posted: Posted, corners: Corners, tolerance: float, axis_tolerance: float, stops: Flags, smooth: bool
) -> Curve:
    """Round the corners of a posted path, each as far as the tolerances and its pieces allow.

    tolerance, axis_tolerance : mm and rad that a rounded corner may take tip and axis off the straight pieces
    stops : (n,) records where the curve is parted in any case
    smooth : whether corners are rounded at all; if not, the curve is parted at every corner
    """
    poses = posted.poses
    angles = np.array(posted.machine.axis_units) == "rad"
    scale = np.where(angles, LEVER, 1.0)
    lengths = _compute_norms(np.diff(poses, axis=0) * scale)
    moved = np.concatenate([[True], lengths > _SAME])
    corner_of_record = np.cumsum(moved) - 1
    record_of_piece = np.flatnonzero(moved)[1:]
    corner = np.ascontiguousarray(poses[moved])
    motion = np.diff(corner, axis=0)
    length = _compute_norms(motion * scale)
    chord = motion / length[:, None]
    turn = _measure_turns(chord)
    parted = np.zeros(len(corner), bool)
    parted[corner_of_record[stops]] = True
    parted[[0, -1]] = True
    if not smooth:
        parted[:] = True
    elif corners == "stop":
        parted |= _compute_norms(turn * scale) > 2.0 * np.sin(0.5 * CORNER)
    parted |= _find_bends_on_pole(posted.machine, corner, turn)

    def bound_reach() -> Array:
        tip_turn, axis_turn = _compute_norms(turn * ~angles), _bound_axis_turn(posted.machine, corner, turn)
        with np.errstate(divide="ignore"):
            return np.asarray(_KEPT * np.minimum(6.0 * tolerance / tip_turn, 6.0 * axis_tolerance / axis_turn))

    steadiness = _measure_steadiness(turn * scale, length)
    whole = ~parted & (steadiness > 0.0) & _find_whole_roundings(bound_reach(), length)
    vertex, ahead = _place_vertices(corner, chord, length, np.where(whole, steadiness, 0.0))
    slope = np.diff(vertex, axis=0) / (length + np.diff(ahead))[:, None]
    turn = _measure_turns(slope)
    sharpness = _compute_norms(turn * scale)
    reach = bound_reach()
    reach[1:-1] = _clear_short_rests(np.minimum(reach[1:-1], np.minimum(length[:-1], length[1:])), length)
    parted |= ~whole & (reach < _TIGHT * sharpness)
    rise, fall = np.where(whole, np.append(0.0, length), reach), np.where(whole, np.append(length, 0.0), reach)
    turn[parted] = sharpness[parted] = rise[parted] = fall[parted] = 0.0
    bend = 2.0 * turn / np.where(parted, 1.0, rise + fall)[:, None]
    begin = vertex[:-1] - slope * ahead[:-1, None]
    return Curve(corner, begin, length, slope, bend, sharpness, rise, fall, parted, corner_of_record, record_of_piece)


def _measure_turns(slope: Array) -> Array:
    """Measure the change of slope (c - 1, axes) at each corner, (c, axes); zero at both ends."""
    turn = np.zeros((len(slope) + 1, slope.shape[1]))
    turn[1:-1] = np.diff(slope, axis=0)
    return turn


def _find_whole_roundings(reach: Array, length: Array) -> Flags:
    """Find the corners (c,) whose roundings may reach over both pieces: ``reach`` (c,) mm is what tolerances allow."""
    whole = np.zeros(len(reach), np.bool_)
    short, long = np.minimum(length[:-1], length[1:]), np.maximum(length[:-1], length[1:])
    whole[1:-1] = (reach[1:-1] > _FARTHER * long) & (long < _ALIKE * short)
    return whole


def _place_vertices(corner: Array, chord: Array, length: Array, steadiness: Array) -> tuple[Array, Array]:
    """Place the vertices of the B-spline: the poses (c, axes), and how far ahead of the corners they lie, (c,) mm of s.

    A spline through the corners of a parabola has that parabola's second derivative whatever the pieces' lengths; one
    whose vertices are the corners trembles where lengths change.

    steadiness : (c,) how much of that a corner's vertex is led aside; zero where it is the corner
    """
    left, right = length[:-1, None], length[1:, None]
    vertex, ahead = corner.copy(), np.zeros(len(corner))
    ahead[1:-1] = np.where(steadiness[1:-1] > 0.0, (length[1:] - length[:-1]) / 3.0, 0.0)
    slope = (right * chord[:-1] + left * chord[1:]) / (left + right)
    aside = left * right * np.diff(chord, axis=0) / (3.0 * (left + right))
    vertex[1:-1] += ahead[1:-1, None] * slope - steadiness[1:-1, None] * aside
    return vertex, ahead


def _measure_steadiness(turn: Array, length: Array) -> Array:
    """Measure how steadily a polyline that turns by (c, axes) bends about its corners: (c,), from 0 to 1.

    Where the corners themselves tremble, as by the last digit of a file, or the path begins to bend, it is 0.
    """
    if len(turn) < 4:
        return np.zeros(len(turn))
    curvature = turn[1:-1] / (0.5 * (length[:-1] + length[1:]))[:, None]
    size = _compute_norms(curvature)
    change = _compute_norms(np.diff(curvature, axis=0)) / np.maximum(size[1:] + size[:-1], _BENT)
    steady = np.pad(np.clip(2.0 * (1.0 - change / _UNSTEADY), 0.0, 1.0), 1, constant_values=1.0)
    least = np.pad(np.minimum(steady[:-1], steady[1:]), _ABOUT, mode="edge")
    near = [least[_ABOUT + by : _ABOUT + by + len(size)] + abs(by) / _ABOUT for by in range(-_ABOUT, _ABOUT + 1)]
    return np.pad(np.min(near, axis=0).clip(0.0, 1.0), 1)


def _find_bends_on_pole(machine: Machine, corner: Array, turn: Array) -> Flags:
    """Find corners (c,) on a wrist's pole that, if they were rounded, would lead the tool beside it, with a swing.

    Also those where a controller begins to let the first joint stand still, or ends to. The tool goes on over the pole
    of B and C as long as C does not change; a central leg's pole moves with the tip.
    """
    wrist = machine.wrist
    if wrist is None:
        return np.zeros(len(corner), np.bool_)
    moving = np.abs(turn[:, wrist.direction.c])
    if machine.structure.carries_pole:
        moving = np.maximum(moving, np.abs(turn).max(1))
    on_rim = wrist.find_free(corner, RIM + RIM_WIDTH) & ~wrist.find_free(corner, RIM - RIM_WIDTH)
    bends: Flags = (wrist.find_free(corner, PRINTED) | on_rim) & (moving > _BENT)
    return bends


def _clear_short_rests(reach: Array, length: Array) -> Array:
    """Shorten reaches that end just before a piece's end: rows close together make second derivatives inexact."""
    shortened = (1.0 - _BESIDE) * np.minimum(length[:-1], length[1:])
    for side in (length[:-1], length[1:]):
        beside = (reach > (1.0 - _BESIDE) * side) & (reach < (1.0 - SLIVER) * side)
        reach = np.where(beside, shortened, reach)
    return reach


def _compute_norms(rows: Array) -> Array:
    """Compute the Euclidean norm of each row."""
    norms: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norms


def _bound_axis_turn(machine: Machine, corner: Array, turn: Array) -> Array:
    """Bound the change of the tool axis's slope, (c,) rad/mm, where the pose's slope changes by ``turn`` (c, axes).

    The axis turns no faster than all angles together. A turn of C moves it by sin B only, where A does not turn it.
    """
    columns = machine.turning_columns
    rates = {i: np.abs(turn[:, i]) for i in columns}
    direction = machine.direction
    if direction is not None:
        lean = np.abs(corner[:, direction.b])
        near = np.pad(lean, 2, mode="edge")  # over a piece the pose lies amid the two corners before and behind
        most = np.max([near[i : i + len(lean)] for i in range(5)], axis=0)
        rates[direction.c] = rates[direction.c] * np.minimum(most, 1.0)
    return np.sum(list(rates.values()), axis=0) if columns else np.zeros(len(corner))


def check_tolerance(tolerance: float, what: str) -> float:
    """Return a tolerance above zero; raises :class:`PoseError` for others."""
    if not 0.0 < tolerance < np.inf:
        raise PoseError(f"{what}: more than 0 expected, not {tolerance!r}")
    return float(tolerance)
