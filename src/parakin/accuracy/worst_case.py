"""The guaranteed worst case of the tip's error: Krawczyk's test over intervals of poses and of sizes together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..algebra import Scalar, derivative
from ..arguments import check_arguments, parse_range
from ..arrays import Array, AxisRange, Flags
from ..budget import SECONDS, Budget
from ..errors import PoseError, suggest
from ..kernels.batch import evaluate_tape
from ..kernels.intervals import IntervalProgram
from .accuracy import Accuracy
from .tolerances import SizedJumpFreeTrace, ToleranceFamily

_ROUNDS = 8  # of widening a box until it holds its own image
_WIDER = 1.1
_SPARE = 1e-9  # relative, and mm: far more than the rounding of the sums below
_GAP = 0.05  # between what is proved and what is attained, relative, where the search ends
_AT_ONCE = 512
_CELLS = 8  # of a lattice of directions, along an edge of a cube


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

    The motion's coordinates y of a machine with other sizes are a zero of its closures, so they lie in a box that
    Krawczyk's operator maps into itself, and nowhere else in it. The tip then follows by its derivatives over that box
    (mean value theorem). Boxes of poses are halved until bound and attained error are within 5 %, or time is up.

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
    bounds = enclosure.bound(lows, highs)
    attained, pose = enclosure.attain(0.5 * (lows + highs))
    while not bounds.max() <= (1.0 + _GAP) * attained and not budget.is_spent() and (highs > lows).any():
        open_ = np.flatnonzero(~(bounds <= (1.0 + _GAP) * attained))
        open_ = open_[np.argsort(-bounds[open_], kind="stable")][:_AT_ONCE]
        new_lows, new_highs = _halve(lows[open_], highs[open_], high - low)
        new_bounds = enclosure.bound(new_lows, new_highs)
        budget.used += len(new_lows)
        error, at = enclosure.attain(0.5 * (new_lows + new_highs))
        if error > attained:
            attained, pose = error, at
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


def list_directions(size: int) -> tuple[Array, float]:
    """List unit vectors (m, size), one of each pair of opposites, and the cosine of the angle that one is within.

    They point to a lattice on the faces of a cube of half edge one. What a convex body reaches along each of them, over
    that cosine, is no less than its greatest distance from the middle.
    """
    lines = [np.linspace(-1.0, 1.0, _CELLS + 1)] * (size - 1)
    face = np.stack(np.meshgrid(*lines), -1).reshape(-1, size - 1) if size > 1 else np.zeros((1, 0))
    points = np.vstack([np.insert(face, axis, 1.0, axis=1) for axis in range(size)])
    gap = np.sqrt(size - 1.0) / _CELLS  # half a cell's diagonal
    return points / np.linalg.norm(points, axis=1)[:, None], 1.0 - 0.5 * gap**2


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
        closures = equations.scaled_closures(y, joints)
        tip_axes = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
        tip = [equations.structure.pose(y, equations.list_serial(joints))[i] for i in tip_axes]
        self.tip, self.count = len(tip), len(trace.sizes)
        outputs: list[Scalar] = []
        for rows in (closures, tip):
            outputs += [derivative(row, x) for row in rows for x in changes]
            outputs += [derivative(row, x) for row in rows for x in trace.sizes]
        self.directions, self.cosine = list_directions(self.tip)
        self.family, self.program = family, IntervalProgram(trace, outputs)
        self.inputs = n + self.width + self.count

    def _split(self, values: Array) -> list[Array]:
        """Split outputs into closures' slopes by coordinates and sizes, and the tip's."""
        w, k, t = self.width, self.count, self.tip
        sizes = [(w, w), (w, k), (t, w), (t, k)]
        edges = np.cumsum([rows * columns for rows, columns in sizes])[:-1]
        return [v.reshape(-1, *size) for v, size in zip(np.split(values, edges, axis=1), sizes, strict=True)]

    def _enclose(self, low: Array, high: Array, change: Array) -> tuple[list[Array], list[Array]]:
        """Enclose the slopes over boxes of poses, changes within ± (N, w), and all sizes: middles and radii."""
        nominal = np.broadcast_to(self.family.nominal, (len(low), self.count))
        down, up = self.program(
            np.hstack([low, -change, nominal - self.halves]), np.hstack([high, change, nominal + self.halves])
        )
        with np.errstate(invalid="ignore"):
            middle, radius = 0.5 * (down + up), 0.5 * (up - down)
        return self._split(middle), self._split(radius * (1.0 + _SPARE))

    def bound(self, low: Array, high: Array) -> Array:
        """Bound the tip's error over boxes of poses (N, axes), (N,) mm; infinite where Krawczyk's test fails."""
        nothing = np.zeros((len(low), self.width))
        middle = 0.5 * (low + high)
        inputs = np.hstack([middle, nothing, np.broadcast_to(self.family.nominal, (len(low), self.count))])
        at_middle = evaluate_tape(self.program.tape, inputs, np.empty((len(low), self.program.tape.outputs)))
        with np.errstate(all="ignore"):
            slopes = self._split(at_middle)[0]
            good: Flags = np.isfinite(at_middle).all(1) & (np.abs(np.linalg.det(np.nan_to_num(slopes))) > 0.0)
            inverse = np.zeros_like(slopes)
            inverse[good] = np.linalg.inv(slopes[good])
            (_, by_sizes, _, _), (_, by_sizes_off, _, _) = self._enclose(low, high, nothing)
            image, image_off = inverse @ by_sizes, np.abs(inverse) @ by_sizes_off
            first = (np.abs(image) + image_off) @ self.halves
            box, holds = first * _WIDER + _SPARE, np.zeros(len(low), np.bool_)
            result = np.full(len(low), np.inf)
            for _ in range(_ROUNDS):
                middles, radii = self._enclose(low, high, box)
                left = np.abs(np.eye(self.width) - inverse @ middles[0]) + np.abs(inverse) @ radii[0]
                rest = np.einsum("nij,nj->ni", left, box)
                mapped = (first + rest) * (1.0 + _SPARE)
                fits: Flags = good & (mapped < box).all(1) & ~holds
                along = middles[3] - middles[2] @ image
                off = radii[3] + radii[2] @ (np.abs(image) + image_off) + np.abs(middles[2]) @ image_off
                spread = off @ self.halves + np.einsum("nij,nj->ni", np.abs(middles[2]) + radii[2], rest)
                rows = np.flatnonzero(fits)
                seen = np.abs(self.directions @ along[rows]) @ self.halves + spread[rows] @ np.abs(self.directions).T
                result[rows] = seen.max(1) / self.cosine * (1.0 + _SPARE) + _SPARE
                holds |= fits
                if holds.all():
                    break
                box = np.maximum(box, mapped) * _WIDER
        return np.where(np.isfinite(result), result, np.inf)

    def attain(self, poses: Array) -> tuple[float, Array]:
        """Find the greatest error of the tip at poses (N, axes), of machines with all numbers at ends, and its pose."""
        machine = self.family.machine
        joints = machine.inverse(poses)
        rates = self.family.twist_rates(poses, joints, self.family.nominal).compute_size_rates()[:, : self.tip]
        weighed = np.nan_to_num(rates) * self.halves
        widths = np.abs(self.directions @ weighed).sum(2)
        signs = np.sign(np.einsum("ni,nik->nk", self.directions[widths.argmax(1)], weighed))
        tips = [i for i, axis in enumerate(machine.axes) if axis in "XYZ"]
        best, at = 0.0, poses[0]
        for sign in (1.0, -1.0):
            sizes = self.family.nominal + sign * signs * self.halves
            moved = self.family.forward(joints, sizes, near=poses).poses
            errors = np.nan_to_num(np.linalg.norm((moved - poses)[:, tips], axis=1))
            if errors.max() > best:
                best, at = float(errors.max()), poses[int(errors.argmax())]
        return best, at
