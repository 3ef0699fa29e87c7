"""The methods by which ``parakin workspace`` finds a workspace, and which options each takes."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Literal

from ..budget import SECONDS
from ..errors import InputError
from .options import tell_options

if TYPE_CHECKING:
    from ..arrays import Progress
    from ..workspaces.certified.region import Region
    from ..workspaces.certified.workspace import Workspace
    from ..workspaces.sampled.sampling import SampledWorkspace

Method = Literal["certified", "grid", "polar", "drives"]

GAP = 0.01
_STEPS = {"grid": {1: 10_000, 2: 1000, 3: 200}, "polar": {2: 1000, 3: 400}}  # along the longest edge, by dimension
_PLANES = 50  # planes of a polar sweep along the longest edge
_CELLS = {2: 512, 3: 64}  # cells of each drive's range, by the number of drives


@dataclass(frozen=True)
class Effort:
    """The options that say how precisely to work, mm and s; None for one that is not given."""

    gap: float | None
    cell: float | None
    time: float | None
    step: float | None

    @property
    def seconds(self) -> float:
        """The time, s, for each question."""
        return SECONDS if self.time is None else self.time


def find_workspace(method: Method, region: Region, effort: Effort, progress: Progress) -> Workspace | SampledWorkspace:
    """Find the workspace of a region by a method; refuse options that the method does not take."""
    if method == "certified":
        return _certify_workspace(region, effort, progress)
    for option in ("gap", "cell"):
        if getattr(effort, option) is not None:
            raise InputError(f"--method {method} has none, only certified has", f"--{option}")
    with tell_options(seconds="--time"):
        if method == "drives":
            return _sweep_drives(region, effort, progress)
        return _sample_positions(method, region, effort, progress)


def _certify_workspace(region: Region, effort: Effort, progress: Progress) -> Workspace:
    from ..workspaces.certified.workspace import workspace

    gap = GAP if effort.gap is None else effort.gap
    if not 0.0 < gap < float("inf"):
        raise InputError("expected a number above 0", "--gap")
    return workspace(region, gap, effort.cell, effort.seconds, progress)


def _sample_positions(method: Method, region: Region, effort: Effort, progress: Progress) -> SampledWorkspace:
    from ..workspaces.sampled.grid import sample_grid
    from ..workspaces.sampled.polar_sweep import sweep_polar
    from ..workspaces.sampled.sampling import find_bounding_box

    box = find_bounding_box(region)
    edge = 1.0 if box is None else float((box[1] - box[0]).max())
    size = edge / _STEPS[method].get(len(region.free_axes), 1) if effort.step is None else effort.step
    if method == "grid":
        return sample_grid(region, size, progress=progress, seconds=effort.seconds)
    return sweep_polar(region, size, planes=max(size, edge / _PLANES), progress=progress, seconds=effort.seconds)


def _sweep_drives(region: Region, effort: Effort, progress: Progress) -> SampledWorkspace:
    from ..workspaces.sampled.drive_sweep import sweep_drives

    machine = region.machine
    if region.kind != "constant" or region.without or any(axis in region.fixed_axes for axis in "XYZ"):
        raise InputError("drives sweeps the whole workspace: no --at, --every, --some or --without", "--method")
    if effort.step is None:
        cells = _CELLS.get(len(machine.joints), 1)
    else:
        cells = max(1, *(ceil((drive.high - drive.low) / effort.step) for drive in machine.drives))
    return sweep_drives(region, cells, progress, effort.seconds)
