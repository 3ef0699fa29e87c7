"""What the sweeping methods share: the first limit broken at very many places, and the frame of their results.

They look at single places and prove nothing; beside them :mod:`parakin.workspaces.certified.workspace` does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import ceil, floor, isfinite, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import PoseError
from ...kernels.batch import evaluate_tape, freeze, run_in_threads
from ...kernels.staged import stage_margins
from ...machine import Machine
from ..certified.region import Region

Codes = NDArray[Any]  # unsigned: 0 allowed, else 1 + the index in Region.limits of the first limit broken

TURNS_STEP = np.deg2rad(5.0)
MOST_TURNS = 1_000_000
_FINE = 16  # cells along the longest side of the box about a region
_AT_ONCE, _AT_ONCE_IN_TURNS = 1 << 24, 1 << 18


@dataclass(frozen=True, eq=False)
class Swept:
    """A region looked at place by place: ``estimate`` of its volume, mm³ (in the plane mm²), found with ``step``, mm.

    ``parameters`` are enough to run it again.
    """

    region: Region
    method: str
    estimate: float
    step: float
    parameters: Mapping[str, Any]

    @property
    def machine(self) -> Machine:
        return self.region.machine

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes of a place."""
        return self.region.free_axes

    @property
    def unit(self) -> str:
        return ("mm", "mm²", "mm³")[len(self.axes) - 1]


def positive(name: str, value: float, unit: str) -> float:
    """``value``, refused with :class:`PoseError` unless above 0."""
    if not (isfinite(value) and value > 0.0):
        raise PoseError(f"{name}: a number above 0 {unit} expected, not {value:g}")
    return float(value)


def turn_samples(asked: Region, step: float | None) -> Array:
    """Every combination of samples of the turns, (S, s) rad: at most ``step`` apart, both ends of each range included.

    Those that tell most come first: for every turn the corners of the ranges, for some turn their middle.
    """
    step = TURNS_STEP if step is None else positive("turns_step", step, "rad")
    spans = list(asked.swept_axes.values())
    counts = [ceil((high - low) / step - 1e-9) + 1 for low, high in spans]
    if prod(counts) > MOST_TURNS:
        raise PoseError(f"turns_step: {prod(counts):,} turns, at most {MOST_TURNS:,} go")
    samples = [np.linspace(low, high, n) for n, (low, high) in zip(counts, spans, strict=True)]
    rows = np.array(list(product(*samples)), float).reshape(prod(counts), len(spans))
    low, high = (np.array([span[i] for span in spans], float) for i in (0, 1))
    off = (((rows - 0.5 * (low + high)) / np.where(high > low, high - low, 1.0)) ** 2).sum(1).round(9)
    return np.asarray(rows[np.argsort(-off if asked.every_orientation else off, kind="stable")])


def surroundings(asked: Region) -> tuple[Array, Array] | None:
    """A box that holds the region with little room to spare; None for a region proved empty.

    Raises :class:`PoseError` if the limits leave it unbounded.
    """
    if asked.swept_axes and asked.every_orientation:  # what every turn allows, the middle one does
        middle = {axis: 0.5 * (low + high) for axis, (low, high) in asked.swept_axes.items()}
        asked = asked.fix(middle)
    box = asked.extent
    if box is None:
        return None
    return asked.subdivide(*box).tighten(1.0 / _FINE)


def centres(low: float, high: float, step: float) -> Array:
    """Odd multiples of half a step between two numbers: the middles of a lattice's cells, the same in every box."""
    first, last = ceil(low / step - 0.5 - 1e-9), floor(high / step - 0.5 + 1e-9)
    return np.asarray((np.arange(first, last + 1) + 0.5) * step, np.float64)


class FirstBroken:
    """The first limit broken at many places: 0 where none is, else 1 + its index in ``asked.limits``.

    With every turn it is the first one broken in the first turn sample that breaks one; with some turn, where all
    samples break one, it is that of the sample nearest the middle.
    """

    def __init__(self, asked: Region, turns_step: float | None = None):
        self.asked = asked
        self.turns = turn_samples(asked, turns_step)
        margins = [constraint.margin for constraint in asked.constraints if not constraint.implied]
        inputs = asked.slice.inputs
        staged = stage_margins(inputs[0].trace, margins, len(asked.free_axes), len(asked.swept_axes))
        self._program = staged.program
        rows = np.hstack([np.zeros((len(self.turns), len(asked.free_axes))), self.turns])
        fixed = np.empty((len(rows), staged.fixed.outputs))
        self._fixed = evaluate_tape(staged.fixed, rows, fixed, whole=False)
        self._type = np.uint8 if len(asked.limits) < 255 else np.uint16

    def at(self, places: Array) -> Codes:
        """At places (N, d) -> (N,)."""
        from ...kernels.sweep import sweep_turns

        codes, every = np.zeros(len(places), self._type), True
        undecided, start = np.arange(len(places)), 0
        while start < len(self.turns) and len(undecided):
            stop = 4 * start or 1
            now, some = np.ascontiguousarray(places[undecided]), codes[undecided]
            args = (self._program, freeze(now), freeze(self._fixed[start:stop]), every, some)
            run_in_threads(len(now), lambda a, b: sweep_turns(*args, a, b))  # noqa: B023  done within the loop's turn
            codes[undecided] = some
            every, start = self.asked.every_orientation, stop
            undecided = np.flatnonzero((codes == 0) == every)
        return codes

    def on_grid(self, coordinates: Sequence[Array], progress: Callable[[float], None] | None = None) -> Codes:
        """At every place of a grid, given each axis's coordinates -> (n, ...) as many as axes."""
        from ...kernels.sweep import sweep_grid

        shape = tuple(len(column) for column in coordinates)
        codes = np.empty(shape, self._type)
        flat = codes.reshape(-1)
        grid = (np.concatenate(coordinates), np.array(shape))
        at_once = _AT_ONCE if not self.asked.swept_axes else _AT_ONCE_IN_TURNS
        for start, stop in pairwise([*range(0, len(flat), at_once), len(flat)]):
            if self.asked.swept_axes:
                index = np.unravel_index(np.arange(start, stop), shape)
                flat[start:stop] = self.at(np.stack([x[i] for x, i in zip(coordinates, index, strict=True)], 1))
            else:
                args = (self._program, *grid, flat)
                run_in_threads(stop - start, lambda a, b: sweep_grid(*args, start + a, start + b))  # noqa: B023
            if progress:
                progress(stop / len(flat))
        return codes
