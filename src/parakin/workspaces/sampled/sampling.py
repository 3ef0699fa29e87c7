"""Sampled workspaces: the first limit broken at very many positions, and the frame of the sampling methods' results.

Samples prove nothing; :mod:`parakin.workspaces.certified.workspace` does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import ceil, floor, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arguments import check_positive
from ...arrays import Array, Progress
from ...budget import Budget
from ...errors import PoseError
from ...kernels.batch import evaluate_tape
from ...kernels.staged import stage_margins
from ...kernels.sweep import sweep_grid, sweep_turns
from ..certified.region import Region
from ..certified.region_result import RegionResult

LimitCodes = NDArray[Any]  # unsigned: 0 allowed, else 1 + the index in Region.limits of the first limit broken

TURNS_STEP = np.deg2rad(5.0)  # between samples of a swept axis, rad
MOST_TURNS = 1_000_000  # samples of all swept axes together
_FINE = 16  # cells along the longest side of the box about a region
_TESTS = 1 << 26  # positions times orientations that are tested at a time
TOO_SLOW = "seconds: the time is up before all places are sampled; a coarser step or more time is needed"
_AT_ONCE, _AT_ONCE_SWEPT = 1 << 24, 1 << 18  # positions of a grid, without and with swept axes


@dataclass(frozen=True, eq=False)
class SampledWorkspace(RegionResult):
    """A region, estimated by samples of its positions.

    method : by which, in a word
    estimate : of its volume, mm³ (in the plane mm²)
    step : between samples, mm
    parameters : enough to run it again
    """

    method: str
    estimate: float
    step: float
    parameters: Mapping[str, Any]

    def __repr__(self) -> str:
        return (
            f"<parakin {self.method} workspace of {self.machine.name}: "
            f"about {self.estimate:.6g} {self.unit}, step {self.step:.6g}>"
        )


def sample_orientations(region: Region, step: float | None) -> Array:
    """Sample the swept axes: every combination, (S, s) rad, at most ``step`` apart, both ends of each range included.

    Those that decide most often come first: the corners of the ranges if all orientations count, else their middle.
    """
    step = TURNS_STEP if step is None else check_positive("turns_step", step, "rad")
    spans = list(region.swept_axes.values())
    counts = [ceil((high - low) / step - 1e-9) + 1 for low, high in spans]
    if prod(counts) > MOST_TURNS:
        raise PoseError(f"turns_step: {prod(counts):,} turns, at most {MOST_TURNS:,} go")
    samples = [np.linspace(low, high, n) for n, (low, high) in zip(counts, spans, strict=True)]
    rows = np.array(list(product(*samples)), float).reshape(prod(counts), len(spans))
    low, high = region.swept_bounds
    off = (((rows - 0.5 * (low + high)) / np.where(high > low, high - low, 1.0)) ** 2).sum(1).round(9)
    return np.asarray(rows[np.argsort(-off if region.every_orientation else off, kind="stable")])


def find_bounding_box(region: Region, budget: Budget | None = None) -> tuple[Array, Array] | None:
    """Find a box that holds the region closely, (d,) mm each corner; None for a region proved empty.

    Raises :class:`PoseError` if the limits leave it unbounded, or if the budget is spent.
    """
    if region.swept_axes and region.every_orientation:  # what every orientation allows, the middle one does
        region = region.fix({axis: 0.5 * (low + high) for axis, (low, high) in region.swept_axes.items()})
    box = region.find_extent(budget)
    if box is None:
        return None
    closer = region.subdivide(*box).tighten(1.0 / _FINE, budget)
    if budget is not None and budget.is_spent():
        raise PoseError(TOO_SLOW)
    return closer


def list_cell_middles(low: float, high: float, step: float) -> Array:
    """List the odd multiples of half a step between two numbers: a lattice's cell middles, the same in every box."""
    first, last = ceil(low / step - 0.5 - 1e-9), floor(high / step - 0.5 + 1e-9)
    return np.asarray((np.arange(first, last + 1) + 0.5) * step, np.float64)


class BrokenLimitFinder:
    """Finds the first limit broken at many positions: 0 where none is, else 1 + its index in ``region.limits``.

    If all orientations count, it is the first one broken at the first sampled orientation that breaks one; if one is
    enough and all samples break one, it is that of the sample nearest the middle.

    Raises :class:`PoseError` where the budget is spent before all is sampled, for the rest is not known.
    """

    def __init__(self, region: Region, turns_step: float | None = None, budget: Budget | None = None):
        self.region, self.budget = region, budget or Budget(None)
        self.orientations = sample_orientations(region, turns_step)
        margins = [constraint.margin for constraint in region.constraints if not constraint.implied]
        trace = region.traced_pose.inputs[0].trace
        staged = stage_margins(trace, margins, len(region.free_axes), len(region.swept_axes))
        self._program = staged.program
        rows = np.hstack([np.zeros((len(self.orientations), len(region.free_axes))), self.orientations])
        fixed = np.empty((len(rows), staged.fixed.outputs))
        self._fixed = evaluate_tape(staged.fixed, rows, fixed, whole=False)
        self._type = np.uint8 if len(region.limits) < 255 else np.uint16

    def find_at(self, positions: Array) -> LimitCodes:
        """Find it at positions (N, d) -> (N,)."""
        codes, every = np.zeros(len(positions), self._type), True
        undecided, start = np.arange(len(positions)), 0
        while start < len(self.orientations) and len(undecided):
            if self.budget.is_spent():
                raise PoseError(TOO_SLOW)
            stop = min(4 * start or 1, start + max(1, _TESTS // len(undecided)))
            turns = self._fixed[start:stop]
            codes[undecided] = sweep_turns(self._program, positions[undecided], turns, every, codes[undecided])
            every, start = self.region.every_orientation, stop
            undecided = np.flatnonzero((codes == 0) == every)
        return codes

    def find_on_grid(self, coordinates: Sequence[Array], progress: Progress | None = None) -> LimitCodes:
        """Find it at every position of a grid, given each axis's coordinates -> (n, ...) as many as axes."""
        shape = tuple(len(column) for column in coordinates)
        codes = np.empty(shape, self._type)
        flat = codes.reshape(-1)
        at_once = _AT_ONCE if not self.region.swept_axes else _AT_ONCE_SWEPT
        for start, stop in pairwise([*range(0, len(flat), at_once), len(flat)]):
            if self.budget.is_spent():
                raise PoseError(TOO_SLOW)
            if self.region.swept_axes:
                index = np.unravel_index(np.arange(start, stop), shape)
                flat[start:stop] = self.find_at(np.stack([x[i] for x, i in zip(coordinates, index, strict=True)], 1))
            else:
                sweep_grid(self._program, coordinates, flat[start:stop], start)
            if progress:
                progress(stop / len(flat))
        return codes
