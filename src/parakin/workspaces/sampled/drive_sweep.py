"""The sweep of the drives, after the HBG80 paper (section 3): some drives run while the others stand at a limit.

Forward kinematics maps them to contours, to the net of the shell, and to the volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from math import isfinite

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Progress
from ...budget import SECONDS, Budget
from ...errors import NoMethodError, PoseError
from ...machine import Machine
from ..certified.region import Region
from .sampling import TOO_SLOW, SampledWorkspace

NOTE = (
    "contours and nets show what the drives' limits bound; where another limit does (reach, cones, clearance) they "
    "end, and that part of the shell is missing"
)
MOST_CELLS = 1_000_000_000
_AT_ONCE = 1 << 18
_SAME = 1e-6  # mm or rad: how closely the inverse must give the drives back


@dataclass(frozen=True)
class DriveStrategy:
    """Which drives run while the others stand.

    runs : names of drives
    stands : of the others, name and limit, ``min`` or ``max``
    """

    runs: tuple[str, ...]
    stands: tuple[tuple[str, str], ...]

    @property
    def name(self) -> str:
        """Like ``Xhbg runs, Yhbg at max``."""
        running = f"{' and '.join(self.runs)} {'runs' if len(self.runs) == 1 else 'run'}"
        return ", ".join([running, *[f"{drive} at {end}" for drive, end in self.stands]])


@dataclass(frozen=True, eq=False)
class DriveImage:
    """Where a strategy moves the tool, with the platform on one side of the legs' centres.

    strategy : which drives run
    side : ``home`` where the platform is on the side it has at home, else ``other``
    joints, positions : mm and rad, and mm: (n, d) for one drive that runs, (n, n, d) for two; positions are NaN where
        they are not allowed
    """

    strategy: DriveStrategy
    side: str
    joints: Array
    positions: Array

    @property
    def pieces(self) -> list[Array]:
        """A contour's parts without gaps, each (k, d)."""
        allowed = ~np.isnan(self.positions).any(-1)
        edges = np.flatnonzero(np.diff(allowed.astype(np.int8), prepend=0, append=0))
        return [self.positions[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]

    def __repr__(self) -> str:
        return f"<parakin image of {' '.join(self.strategy.runs)}: {self.side}, shape {self.joints.shape}>"


@dataclass(frozen=True, eq=False, repr=False)
class DriveWorkspace(SampledWorkspace):
    """A workspace as the drives reach it: ``estimate`` is |det J| summed over the drives' box, J = A⁻¹B.

    contours, nets : where one drive runs, and where two do; images that are not allowed anywhere are left out
    note : what the method does not find
    step : the greatest step of a drive, mm or rad
    """

    contours: tuple[DriveImage, ...]
    nets: tuple[DriveImage, ...]
    note: str = NOTE


def list_strategies(machine: Machine, running: int) -> list[DriveStrategy]:
    """List all ways to run ``running`` drives while each other one stands at a limit."""
    strategies = []
    for runs in combinations(machine.joints, running):
        others = [name for name in machine.joints if name not in runs]
        for ends in product(("min", "max"), repeat=len(others)):
            strategies.append(DriveStrategy(runs, tuple(zip(others, ends, strict=True))))
    return strategies


@check_arguments
def sweep_drives(
    region: Region, cells: int = 64, progress: Progress | None = None, seconds: float | None = SECONDS
) -> DriveWorkspace:
    """Sample the whole workspace of a machine from its drives: cut their ranges into cells and map these forward.

    Contours and nets are those of the paper on the HBG80 (Zivanovic, about 2000), section 3. A pose counts where its
    own inverse in the working mode gives the same drives back and every limit holds. Both common points of the legs'
    spheres (circles) are tried where all components count, else home's.

    Parameters
    ----------
    region : everything that a machine reaches whose platform does not turn and that has as many drives as axes:
        no axis is fixed, all limits count
    cells : into so many equal parts each drive's range is cut; the volume is summed over their middles
    progress : called with the fraction done
    seconds : the time in which all must be sampled; None for no end

    Raises :class:`NoMethodError` for other machines and drives without limits, :class:`PoseError` for other regions
    and invalid numbers.
    """
    machine = region.machine
    _refuse_others(machine)
    if region.fixed_axes or region.without:
        raise PoseError("region: a sweep of the drives takes the whole workspace, no fixed axes and all limits")
    d = len(machine.joints)
    if cells < 1 or cells**d > MOST_CELLS:
        raise PoseError(f"cells: 1 to {int(MOST_CELLS ** (1.0 / d) + 1e-9)} parts of each drive expected, not {cells}")
    step = max((drive.high - drive.low) / cells for drive in machine.drives)
    parameters = {**region.parameters, "method": "drives", "cells": cells}
    volume = _sum_volume(region, cells, progress, Budget(seconds))
    contours, nets = (_map_strategies(region, list_strategies(machine, running), cells) for running in (1, 2))
    return DriveWorkspace(region, "drives", volume, step, parameters, contours, nets)


def _refuse_others(machine: Machine) -> None:
    why = ""
    if machine.turning_columns:
        why = "its tool turns"
    elif not machine.has_closed_forward or len(machine.joints) != len(machine.axes):
        why = "it has not one rod for each axis"
    elif free := [drive.name for drive in machine.drives if not isfinite(drive.high - drive.low)]:
        why = f"{free[0]} has no limit to stand at"
    if why:
        raise NoMethodError(f"{machine.name}: no sweep of the drives, {why}")


def _find_poses(machine: Machine, joints: Array, side: float, mode: str) -> Array:
    """Find the poses on one side of the legs' centres for joints, (N, d) each; NaN where one does not count."""
    poses, residual = machine.common_points(joints, side)
    with np.errstate(invalid="ignore"):
        counts = (residual <= machine.closure_tolerance) & (abs(machine.inverse(poses, mode) - joints) <= _SAME).all(1)
    # The joints as they stand: those of the inverse lie a rounding beyond the limits.
    counts &= machine.check(poses, joints, mode) == 0
    poses[~counts] = np.nan
    return poses


def _list_sides(region: Region) -> list[tuple[str, float]]:
    sides = [("home", region.machine.home_side), ("other", -region.machine.home_side)]
    return sides if region.components == "all" else sides[:1]


def _map_strategies(region: Region, strategies: Sequence[DriveStrategy], cells: int) -> tuple[DriveImage, ...]:
    """Map the drives of each strategy forward, on the sides that count."""
    machine, mode = region.machine, region.mode
    images = []
    for strategy in strategies:
        stands = dict(strategy.stands)
        columns = []
        for drive in machine.drives:
            if drive.name in strategy.runs:
                columns.append(np.linspace(drive.low, drive.high, cells + 1))
            else:
                columns.append(np.array([drive.low if stands[drive.name] == "min" else drive.high]))
        joints = np.stack(np.meshgrid(*columns, indexing="ij"), -1)
        shape = (*[cells + 1] * len(strategy.runs), len(columns))
        for name, side in _list_sides(region):
            poses = _find_poses(machine, np.ascontiguousarray(joints.reshape(-1, len(columns))), side, mode)
            if not np.isnan(poses).all():
                images.append(DriveImage(strategy, name, joints.reshape(shape), poses.reshape(shape)))
    return tuple(images)


def _sum_volume(region: Region, cells: int, progress: Progress | None, budget: Budget) -> float:
    """Sum |det J| over the middles of the drives' cells, on the sides that count."""
    machine, mode = region.machine, region.mode
    low, high = (np.array([getattr(drive, end) for drive in machine.drives]) for end in ("low", "high"))
    size, d = (high - low) / cells, len(low)
    total = 0.0
    for start in range(0, cells**d, _AT_ONCE):
        if budget.is_spent():
            raise PoseError(TOO_SLOW)
        stop = min(start + _AT_ONCE, cells**d)
        index = np.stack(np.unravel_index(np.arange(start, stop), (cells,) * d), 1)
        joints = low + (index + 0.5) * size
        for _, side in _list_sides(region):
            poses = _find_poses(machine, joints, side, mode)
            a, b = machine.jacobians(poses[~np.isnan(poses).any(1)], mode)
            total += float(abs(np.linalg.det(b) / np.linalg.det(a)).sum())
        if progress:
            progress(stop / cells**d)
    return total * float(size.prod())
