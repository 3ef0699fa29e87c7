"""How much of every limit's range a path uses, and the least margin it leaves; all from the machine's own margins."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from ...arrays import Array, Indices
from ...machine import Machine
from ...model.limits import Limit
from .margin_blocks import split_margins
from .posted import Posted


@dataclass
class RangeUse:
    """A bounded quantity, or a joint without bounds: its allowed range and the range that a path uses, mm or rad.

    name, subject, unit : of the quantity
    low, high : the allowed range
    least, most : the range used
    margin : the least over the path, negative where a bound is broken
    record : where the margin is the least
    lost : how many records have no such quantity because a leg can't close
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
        """Half the allowed range, or the size of its one bound: what a margin is relative to."""
        if isfinite(self.low) and isfinite(self.high):
            return 0.5 * (self.high - self.low)
        bound = self.low if isfinite(self.low) else self.high
        return abs(bound) or 1.0

    def widen(self, values: Array) -> None:
        """Widen the range used by values (k,); NaN does not count."""
        real = values[~np.isnan(values)]
        if len(real):
            self.least, self.most = min(self.least, float(real.min())), max(self.most, float(real.max()))

    def add_margins(self, limit: Limit, margins: Array, start: int) -> None:
        """Count in the margins (k,) of one of the two limits, at the records from ``start`` on."""
        missing = np.isnan(margins)
        if limit.side == "max" or not isfinite(self.high):
            self.lost += int(missing.sum())
        if missing.all():
            return
        self.widen(limit.bound - margins if limit.side == "max" else limit.bound + margins)
        tightest = int(np.where(missing, inf, margins).argmin())
        if margins[tightest] < self.margin:
            self.margin, self.record = float(margins[tightest]), start + tightest


def list_ranges(machine: Machine) -> tuple[list[RangeUse], Indices]:
    """List the machine's quantities, joints first, and for every limit the index of its quantity; -1 for a reach."""
    uses = [RangeUse(name, name, unit) for name, unit in zip(machine.joints, machine.joint_units, strict=True)]
    index = {use.name: i for i, use in enumerate(uses)}
    quantities = np.full(len(machine.limits), -1)
    for number, limit in enumerate(machine.limit_definitions):
        if limit.side == "reach":
            continue
        name = limit.name.removesuffix(f".{limit.side}")
        if name not in index:
            index[name] = len(uses)
            uses.append(RangeUse(name, limit.subject, limit.unit))
        use = uses[index[name]]
        quantities[number] = index[name]
        if limit.side == "min":
            use.low = limit.bound
        else:
            use.high = limit.bound
    return uses, quantities


def compute_relative_margin(machine: Machine, margins: Array) -> Array:
    """Compute the least margin of every record (n,), each over half its range: zero at a limit.

    margins : (n, limits)

    It is NaN where a leg can't close, and one where the machine has no ranges and every leg closes.
    """
    uses, quantities = list_ranges(machine)
    has_range = quantities >= 0
    closes = (margins[:, ~has_range] >= 0.0).all(axis=1)
    if not has_range.any():
        return np.where(closes, 1.0, np.nan)
    spans = np.array([uses[i].span for i in quantities[has_range]])
    least: Array = (margins[:, has_range] / spans).min(axis=1)  # NaN goes through
    return np.where(closes, least, np.nan)


def measure_range_use(posted: Posted) -> tuple[list[RangeUse], Array]:
    """Measure how a path uses every quantity, and the least relative margin of every record, (n,)."""
    machine = posted.machine
    uses, quantities = list_ranges(machine)
    relative = np.empty(len(posted.poses))
    for block, margins in split_margins(machine, posted.poses, posted.joints, posted.mode):
        relative[block] = compute_relative_margin(machine, margins)
        for use, q in zip(uses, posted.joints[block].T, strict=False):
            use.widen(q)
        for number, limit in enumerate(machine.limit_definitions):
            if quantities[number] >= 0:
                uses[quantities[number]].add_margins(limit, margins[:, number], block.start)
    return uses, relative


def find_tightest_limit(posted: Posted, record: int) -> str:
    """Find the limit with the least relative margin at a record of a path that the machine can reach."""
    machine = posted.machine
    uses, quantities = list_ranges(machine)
    margins = machine.margins(posted.poses[record], posted.joints[record], posted.mode)
    relative = [margin / uses[i].span if i >= 0 else inf for i, margin in zip(quantities, margins, strict=True)]
    return machine.limits[int(np.argmin(relative))] if relative else ""
