"""How much of every limit's range a path uses, and the least margin it leaves; all from the machine's own margins."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from ...machine import Machine
from ..path import Floats
from .posted import Posted

_BLOCK = 1 << 16  # records at a time: all margins of a long path would not fit


@dataclass
class RangeUse:
    """One bounded quantity, or a joint without bounds: its range allowed and the range used, mm or rad.

    ``margin`` is the least over the path, negative where a bound is broken, at ``record``; ``lost`` counts the
    records where the quantity does not exist because a leg can't close.
    """

    name: str
    subject: str
    unit: str
    low: float = -inf
    high: float = inf
    least: float = inf
    most: float = -inf
    margin: float = inf
    record: int = -1
    lost: int = 0

    @property
    def span(self) -> float:
        """Half the range allowed, or the size of its one bound: what a margin is relative to."""
        if isfinite(self.low) and isfinite(self.high):
            return 0.5 * (self.high - self.low)
        bound = self.low if isfinite(self.low) else self.high
        return abs(bound) or 1.0


def list_ranges(machine: Machine) -> tuple[list[RangeUse], NDArray[np.int64]]:
    """The machine's quantities, joints first, and for every limit the index of its quantity; -1 for a mere reach."""
    uses = [RangeUse(name, name, unit) for name, unit in zip(machine.joints, machine.joint_units, strict=True)]
    index = {use.name: i for i, use in enumerate(uses)}
    of = np.full(len(machine.limits), -1)
    for number, limit in enumerate(machine.limit_parts):
        if limit.side == "reach":
            continue
        name = limit.name.removesuffix(f".{limit.side}")
        if name not in index:
            index[name] = len(uses)
            uses.append(RangeUse(name, limit.subject, limit.unit))
        use = uses[index[name]]
        of[number] = index[name]
        if limit.side == "min":
            use.low = limit.bound
        else:
            use.high = limit.bound
    return uses, of


def compute_relative_margin(machine: Machine, margins: Floats) -> Floats:
    """(n,): the least of all margins, each over half its range; 0 is at a limit, NaN where a leg can't close."""
    uses, of = list_ranges(machine)
    kept = of >= 0
    if not kept.any():
        return np.where((margins >= 0.0).all(axis=1), 1.0, np.nan)
    spans = np.array([uses[i].span for i in of[kept]])
    least: Floats = (margins[:, kept] / spans).min(axis=1)  # NaN goes through
    return np.where((margins[:, ~kept] >= 0.0).all(axis=1), least, np.nan)


def measure_range_use(posted: Posted) -> tuple[list[RangeUse], Floats]:
    """Every quantity with its use over the path, and the least relative margin of every record, (n,)."""
    machine = posted.machine
    uses, of = list_ranges(machine)
    relative = np.empty(len(posted.poses))
    for start in range(0, len(relative), _BLOCK):
        rows = slice(start, start + _BLOCK)
        joints = posted.joints[rows]
        margins = machine.margins(posted.poses[rows], joints, posted.mode)
        relative[rows] = compute_relative_margin(machine, margins)
        for use, q in zip(uses, joints.T, strict=False):
            _widen(use, q)
        for number, limit in enumerate(machine.limit_parts):
            if of[number] >= 0:
                _take(uses[of[number]], limit.side, limit.bound, margins[:, number], start)
    return uses, relative


def _widen(use: RangeUse, values: Floats) -> None:
    real = values[~np.isnan(values)]
    if len(real):
        use.least, use.most = min(use.least, float(real.min())), max(use.most, float(real.max()))


def _take(use: RangeUse, side: str, bound: float, margins: Floats, start: int) -> None:
    gone = np.isnan(margins)
    if side == "max" or not isfinite(use.high):
        use.lost += int(gone.sum())
    if gone.all():
        return
    _widen(use, bound - margins if side == "max" else bound + margins)
    at = int(np.where(gone, inf, margins).argmin())
    if margins[at] < use.margin:
        use.margin, use.record = float(margins[at]), start + at
