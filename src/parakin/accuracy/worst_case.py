"""The guaranteed worst case of the tip's error: Taylor forms in the sizes, and Krawczyk's test, over boxes of poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..algebra import Term, derivative
from ..arguments import check_arguments, parse_range
from ..arrays import Array, AxisRange, Flags
from ..budget import SECONDS, Budget
from ..errors import PoseError, suggest
from ..families.family import solve_each
from ..kernels.intervals import IntervalProgram
from .accuracy import Accuracy
from .tolerances import SizedJumpFreeTrace, ToleranceFamily

_CLIMBS = 3  # from one machine to a worse one
_ROUNDS = 4  # of widening a box until it holds its own image
_STEPS = 8  # of finding that image
_WIDER = 1.1
_SPARE = 1e-9  # relative, and mm: far more than the rounding of the sums below
_GAP = 0.05  # between what is proved and what is attained, relative, where the search ends
_AT_ONCE = 512
_CELLS = 8  # of a lattice of directions, along an edge of a cube
_FINER = 4  # likewise of a cell, where the bound is greatest
_ROOM = 400_000  # numbers of second derivatives at a time, which a processor's cache holds


@dataclass(frozen=True, eq=False)
class WorstCase:
    """The greatest error of the tip over poses, of every machine within tolerances.

    bound : mm, no machine's tip is off by more; infinite if the proof closed for some poses at no number
    attained : mm, the error of one machine at one of the poses
    pose : (axes,) that one
    boxes : how many were examined
    unproved : (axes,) the middle of a box of poses for which the proof did not close; None if the bound is finite
    """

    bound: float
    attained: float
    pose: Array
    boxes: int
    unproved: Array | None

    def __repr__(self) -> str:
        return f"<parakin worst case: {1e3 * self.attained:.4g} to {1e3 * self.bound:.4g} um>"


@check_arguments
def bound_worst_case(accuracy: Accuracy, ranges: Mapping[str, AxisRange], seconds: float = SECONDS) -> WorstCase:
    """Bound the tip's error over a box of poses and all machines within tolerances, whose joints are the nominal ones.

    accuracy : of :func:`analyse_accuracy`; its machine and tolerances count
    ranges : of axes, mm and rad, or texts with their unit; the others are at home
    seconds : after which halving ends

    The motion's coordinates of a machine with other sizes are a zero of its closures, so they lie in a box that
    Krawczyk's operator maps into itself, and nowhere else in it. The tip follows by a Taylor form: linear and quadratic
    in the sizes with a remainder from second derivatives over that box. Numbers along which it grows all over their
    tolerances stand at their ends. Boxes of poses are halved until bound and attained error are within 5 %, or time is
    up.

    Raises :class:`PoseError` for an unknown axis or an empty range, :class:`NoMethodError` for a machine with more
    drives than freedoms, whose pose is no zero of its closures.
    """
    machine, budget = accuracy.machine, Budget(seconds)
    machine.refuse_redundancy("proved worst case")
    low, high = machine.home.copy(), machine.home.copy()
    for axis, ends in ranges.items():
        if axis not in machine.axes:
            raise PoseError(f"ranges: unknown axis {axis}{suggest(axis, machine.axes)}")
        k = machine.axes.index(axis)
        low[k], high[k] = parse_range(f"ranges: {axis}", ends, machine.axis_units[k])
        if not -np.inf < low[k] <= high[k] < np.inf:
            raise PoseError(f"ranges: {axis} is empty or not finite")
    enclosure = _Enclosure(accuracy.tolerances)
    lows, highs = low[None], high[None]
    attained, pose = enclosure.attain(0.5 * (lows + highs))
    bounds = enclosure.bound(lows, highs, attained)
    while not bounds.max() <= (1.0 + _GAP) * attained and not budget.is_spent() and (highs > lows).any():
        open_ = np.flatnonzero(~(bounds <= (1.0 + _GAP) * attained))
        open_ = open_[np.argsort(-bounds[open_], kind="stable")][:_AT_ONCE]
        new_lows, new_highs = _halve(lows[open_], highs[open_], high - low)
        error, at = enclosure.attain(0.5 * (new_lows + new_highs))
        if error > attained:
            attained, pose = error, at
        new_bounds = enclosure.bound(new_lows, new_highs, (1.0 + _GAP) * attained)
        budget.used += len(new_lows)
        kept = np.setdiff1d(np.arange(len(bounds)), open_)
        lows, highs = np.vstack([lows[kept], new_lows]), np.vstack([highs[kept], new_highs])
        bounds = np.concatenate([bounds[kept], new_bounds])
    worst = int(bounds.argmax())
    unproved = None if np.isfinite(bounds[worst]) else 0.5 * (lows[worst] + highs[worst])
    return WorstCase(float(bounds[worst]), attained, pose, budget.used + 1, unproved)


def _halve(low: Array, high: Array, whole: Array) -> tuple[Array, Array]:
    """Halve boxes across the side that is longest in fractions of the whole."""
    with np.errstate(invalid="ignore", divide="ignore"):
        side = np.where(whole > 0.0, (high - low) / whole, 0.0).argmax(1)
    rows = np.arange(len(low))
    middle = 0.5 * (low[rows, side] + high[rows, side])
    lower, upper = high.copy(), low.copy()
    lower[rows, side] = upper[rows, side] = middle
    return np.vstack([low, upper]), np.vstack([lower, high])


def list_directions(size: int, finer: int = 1) -> tuple[Array, float]:
    """List unit vectors (m, finer^(size - 1), size), one of each pair of opposites, and the cosine to the nearest.

    They point to a lattice on the faces of a cube of half edge one, each cell's edges divided once more. What a convex
    body reaches along each of them, over that cosine, is no less than its greatest distance from the middle.
    """
    lines = [np.linspace(-1.0, 1.0, _CELLS + 1)] * (size - 1)
    face = np.stack(np.meshgrid(*lines), -1).reshape(-1, 1, size - 1) if size > 1 else np.zeros((1, 1, 0))
    shifts = [(2.0 * np.arange(finer) + 1.0 - finer) / (finer * _CELLS)] * (size - 1)
    inner = np.stack(np.meshgrid(*shifts), -1).reshape(-1, size - 1) if size > 1 else np.zeros((1, 0))
    points = np.vstack([np.insert(face + inner, axis, 1.0, axis=2) for axis in range(size)])
    gap = np.sqrt(size - 1.0) / (_CELLS * finer)  # half a cell's diagonal
    return points / np.linalg.norm(points, axis=2, keepdims=True), 1.0 - 0.5 * gap**2


def _is_contracting(matrices: Array) -> Flags:
    """Tell which matrices without negative elements have a spectral radius below one: D x < x for one x > 0."""
    x = solve_each(np.eye(matrices.shape[1]) - matrices, np.ones((*matrices.shape[:2], 1)))
    result: Flags = np.logical_and.reduce((x > 0.0) & (matrices @ x * (1.0 + _SPARE) < x), axis=(1, 2))
    return result


def _maximise(linear: Array, quadratic: Array, halves: Array) -> Array:
    """Bound gᵀd + dᵀQd/2 over d within ± halves, (m, k) and (m, k, k) -> (m,).

    A number along which it rises or falls all over the box stands at its end; the others add what they can.
    """
    weighed, bends = linear * halves, quadratic * halves[:, None] * halves
    ends = np.zeros_like(weighed)
    for _ in range(2):  # what stands at an end may decide others
        free = ends == 0.0
        rates = weighed + (bends @ ends[..., None])[..., 0]
        sure = np.abs(rates) > (np.abs(bends) @ free[..., None].astype(float))[..., 0]
        ends = np.where(free & sure, np.sign(rates), ends)
    free = (ends == 0.0).astype(float)
    rates = weighed + (bends @ ends[..., None])[..., 0]
    result: Array = ((rates + weighed) * 0.5 * ends + np.abs(rates) * free).sum(1)
    result += 0.5 * (free[:, None] @ np.abs(bends) @ free[..., None])[:, 0, 0]
    return result


class _Ways(NamedTuple):
    """How the tip may move over boxes of poses: linear and quadratic in the sizes' changes d, and what is left.

    linear : (N, tip, k); quadratic : (N, tip, k, k) of half of dᵀQd; left : (N, tip) mm, infinite where it is not known
    """

    linear: Array
    quadratic: Array
    left: Array


class _Enclosure:
    """Traces of a family about its nominal machine: inputs are the pose, the coordinates' changes, the sizes."""

    def __init__(self, tolerances: ToleranceFamily):
        family, self.halves = tolerances.family, tolerances.halves
        machine = family.machine
        n, self.width = len(machine.axes), len(machine.structure.coordinates)
        trace = SizedJumpFreeTrace(n + self.width, family.nominal.tolist())
        pose, changes = trace.inputs(n), trace.inputs(self.width, n)
        joints, placed, _ = machine.trace_equations({}).invert(pose, machine.mode)
        equations = family.trace_equations(trace.sizes)
        y = [start + change for start, change in zip(placed.coordinates, changes, strict=True)]
        placed_tip = equations.structure.pose(y, equations.list_serial(joints))
        tip = [value for value, axis in zip(placed_tip, machine.axes, strict=True) if axis in "XYZ"]
        rows, variables = [*equations.scaled_closures(y, joints), *tip], [*changes, *trace.sizes]
        slopes = [[derivative(row, x) for x in variables] for row in rows]
        bends = {
            (i, a, b): derivative(slope, variables[b])
            for i, row in enumerate(slopes)
            for a, slope in enumerate(row)
            if isinstance(slope, Term)
            for b in range(a, len(variables))
        }
        bends = {place: bend for place, bend in bends.items() if isinstance(bend, Term) or bend != 0.0}
        self.places = np.array(list(bends), np.int64).reshape(-1, 3)
        self.tip, self.count = len(tip), len(trace.sizes)
        self.coarse, self.fine = list_directions(self.tip), list_directions(self.tip, _FINER)
        self.family = family
        self.slopes = IntervalProgram(trace, [slope for row in slopes for slope in row])
        self.bends = IntervalProgram(trace, list(bends.values()))

    def _enclose(self, program: IntervalProgram, boxes: tuple[Array, Array], within: Array) -> tuple[Array, Array]:
        """Enclose outputs over boxes of poses, changes and sizes within ± (N, w + k): middles and radii."""
        middle = np.hstack([np.zeros(self.width), self.family.nominal])
        down, up = program(np.hstack([boxes[0], middle - within]), np.hstack([boxes[1], middle + within]))
        return 0.5 * (down + up), 0.5 * (up - down) * (1.0 + _SPARE)

    def _enclose_bends(self, boxes: tuple[Array, Array], within: Array) -> tuple[Array, Array]:
        """Enclose second derivatives (N, rows, w + k, w + k): middles and radii."""
        i, a, b = self.places.T
        result = []
        for values in self._enclose(self.bends, boxes, within):
            full = np.zeros((len(values), self.width + self.tip, within.shape[1], within.shape[1]))
            full[:, i, a, b] = full[:, i, b, a] = values
            result.append(full)
        return result[0], result[1]

    def enclose(self, low: Array, high: Array) -> _Ways:
        """Enclose the tip's ways over boxes of poses (N, axes), in three steps.

        Middles of the slopes tell how coordinates move with sizes to the first order, M d. Carried by the inverse of
        the closures' slopes, second derivatives over coordinates within M d ± room tell how far a solution may be from
        it. It stays in the room, and is the only one there, if Krawczyk's operator maps the room into itself and
        contracts.
        """
        w, h, count = self.width, self.halves, len(low)
        shape = (count, w + self.tip, w + self.count)
        slopes, off = (x.reshape(shape) for x in self._enclose(self.slopes, (low, high), np.zeros((count, shape[2]))))
        good: Flags = np.isfinite(np.concatenate([slopes, off], 2)).all((1, 2))
        square = np.where(good[:, None, None], slopes[:, :w, :w], 0.0)
        good &= np.abs(np.linalg.det(square)) > 0.0
        square[~good] = np.eye(w)
        inverse, tip = np.linalg.inv(square), slopes[:, w:, :w]
        carry = np.zeros((count, w + self.tip, w + self.tip))  # from closures and tip to coordinates and tip
        carry[:, :w, :w], carry[:, w:, :w], carry[:, w:, w:] = -inverse, -tip @ inverse, np.eye(self.tip)
        moved = -inverse @ slopes[:, :w, w:]
        spare = np.abs(np.eye(w) - inverse @ square)  # the inverse's rounding
        spare = np.hstack([spare, np.abs(tip) @ spare])
        first = np.abs(moved) @ h
        by_pose = np.abs(carry) @ (off @ np.hstack([first, np.tile(h, (count, 1))])[..., None])
        by_pose += spare @ first[..., None]
        room = 1.5 * by_pose[:, :w, 0] + 0.1 * first + _SPARE
        left, quadratic = np.full((count, self.tip), np.inf), np.zeros((count, self.tip, self.count, self.count))
        open_ = np.flatnonzero(good)
        for _ in range(_ROUNDS):
            if not len(open_):
                break
            z, m = carry[open_], moved[open_][:, None]
            ways = np.hstack([first[open_] + room[open_], np.tile(h, (len(open_), 1))])
            middles, radii = self._enclose_bends((low[open_], high[open_]), ways)
            bends = (z @ middles.reshape(*middles.shape[:2], -1)).reshape(middles.shape)
            own, mixed = bends[..., :w, :w], bends[..., :w, w:]
            squares = np.swapaxes(m, 2, 3) @ (mixed + 0.5 * (own @ m))
            squares += np.swapaxes(squares, 2, 3) + bends[..., w:, w:]
            pulled = (radii @ ways[:, None, :, None])[..., 0]
            fixed = (by_pose[open_] + 0.5 * np.abs(z) @ pulled @ ways[..., None])[..., 0]
            curved = 0.5 * (np.abs(squares[:, :w]) @ h) @ h
            rates = np.abs(z) @ off[open_][:, :, :w] + spare[open_] + np.abs(own @ m + mixed) @ h
            rest = np.zeros((len(open_), w))
            for _ in range(_STEPS):
                box = rest * _WIDER + _SPARE
                bent = (np.abs(own) @ box[:, None, :, None])[..., 0]
                remainder = (fixed + ((rates + 0.5 * bent) @ box[..., None])[..., 0]) * (1.0 + _SPARE)
                rest = remainder[:, :w] + curved
            slack = (rates + bent)[:, :w] + np.abs(z[:, :w]) @ pulled[..., :w]
            fits = (rest < box).all(1) & (box <= room[open_]).all(1) & _is_contracting(slack)
            left[open_[fits]], quadratic[open_[fits]] = remainder[fits, w:], squares[fits, w:]
            room[open_] = np.maximum(room[open_], _WIDER * box)
            open_ = open_[~fits & np.isfinite(rest).all(1)]
        return _Ways(slopes[:, w:, w:] + tip @ moved, quadratic, left)

    def bound(self, low: Array, high: Array, enough: float) -> Array:
        """Bound the tip's error over boxes of poses (N, axes), (N,) mm; closer than roughly where above enough."""
        with np.errstate(all="ignore"):
            count = max(1, _ROOM // ((self.width + self.tip) * (self.width + self.count) ** 2))
            starts = range(0, len(low), count)
            return np.concatenate([self._bound(low[i : i + count], high[i : i + count], enough) for i in starts])

    def _bound(self, low: Array, high: Array, enough: float) -> Array:
        ways, h = self.enclose(low, high), self.halves
        coarse, cosine = self.coarse[0][:, 0], self.coarse[1]
        fine, fine_cosine = self.fine
        bent = 0.5 * np.einsum("nikl,k,l->ni", np.abs(ways.quadratic), h, h, optimize=True)
        linear = np.abs(coarse @ ways.linear) @ h
        reached = (linear + (bent + ways.left) @ np.abs(coarse).T) / cosine
        result = np.where(np.isnan(reached), np.inf, reached).max(1)
        least = linear.max(1)
        for i in np.flatnonzero((result > enough) & (ways.left.max(1) < _GAP * least)):
            half = fine[reached[i] > least[i]].reshape(-1, self.tip)
            along = np.vstack([half, -half])
            quadratic = np.tensordot(along, ways.quadratic[i], 1)
            values = _maximise(along @ ways.linear[i], quadratic, h) + np.abs(along) @ ways.left[i]
            result[i] = max(least[i], values.max() / fine_cosine)
        return np.asarray(result * (1.0 + _SPARE) + _SPARE)

    def attain(self, poses: Array) -> tuple[float, Array]:
        """Find the greatest error of the tip at poses (N, axes), of machines with all numbers at ends, and its pose."""
        machine, nominal = self.family.machine, self.family.nominal
        joints, tips = machine.inverse(poses), [axis in "XYZ" for axis in machine.axes]
        weighed = self._weigh_sizes(poses, joints, nominal)
        directions = self.coarse[0][:, 0]
        along = directions[(np.abs(directions @ weighed)).sum(2).argmax(1)]
        best, at = 0.0, poses[0]
        for sign in (1.0, -1.0):
            toward, slopes = sign * along, weighed
            for _ in range(_CLIMBS):
                sizes = nominal + np.sign(np.einsum("ni,nik->nk", toward, slopes)) * self.halves
                moved = self.family.forward(joints, sizes, near=poses).poses
                shifts = np.nan_to_num(moved - poses)[:, tips]
                errors = np.linalg.norm(shifts, axis=1)
                if errors.max() > best:
                    best, at = float(errors.max()), poses[int(errors.argmax())]
                toward = shifts / np.maximum(errors, _SPARE)[:, None]
                slopes = self._weigh_sizes(moved, joints, sizes)
        return best, at

    def _weigh_sizes(self, poses: Array, joints: Array, sizes: Array) -> Array:
        """Compute how far each number's tolerance moves the tip, (N, tip, k) mm; zero where that is not known."""
        rates = self.family.twist_rates(np.nan_to_num(poses), joints, sizes).compute_size_rates()[:, : self.tip]
        weighed: Array = np.nan_to_num(rates) * self.halves
        return weighed
