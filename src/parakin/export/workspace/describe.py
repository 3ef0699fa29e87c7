"""Describe a workspace in words."""

from __future__ import annotations

from math import ceil, floor, log10
from typing import TypeAlias

from ...workspaces.certified.region import Region
from ...workspaces.certified.workspace import Volume, Workspace
from ...workspaces.sampled.drive_sweep import DriveWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace
from ...workspaces.sampled.sampling import SampledWorkspace
from ..number_format import format_bound

AnyWorkspace: TypeAlias = Workspace | SampledWorkspace

_KINDS = {
    "constant": "constant orientation",
    "total": "total orientation",
    "inclusive": "inclusive orientation",
    "dexterous": "dexterous",
}
_METHODS = {"grid": " by a dense grid", "polar": " by a polar sweep", "drives": " by a sweep of the drives"}
_FEW = 4  # names that are written out
_UNITS = {
    1: (("m", 1e3), ("mm", 1.0)),
    2: (("m²", 1e6), ("cm²", 1e2), ("mm²", 1.0)),
    3: (("m³", 1e9), ("litres", 1e6), ("cm³", 1e3), ("mm³", 1.0)),
}


def describe_workspace(workspace: AnyWorkspace) -> str:
    """Describe the question that a workspace answers: ``tricept: workspace, constant orientation, B = 0°, C = 0°``."""
    method = _METHODS[workspace.method] if isinstance(workspace, SampledWorkspace) else ""
    return f"{workspace.machine.name}: workspace{method}, {describe_region(workspace.region)}"


def describe_size(workspace: AnyWorkspace) -> str:
    """Describe how large it is: ``19.9 litres, proved between 19.84 and 19.97 litres``, or that no place is proved."""
    d = len(workspace.axes)
    if isinstance(workspace, SampledWorkspace):
        return f"{format_volume(workspace.estimate, d)}, an estimate"
    volume = workspace.volume
    if volume.inner == 0.0 < volume.outer:
        least = f"{format_volume(volume.estimate, d)} by samples, " if volume.estimate > 0.0 else ""
        return f"{least}no place proved, at most {' '.join(_round_outward(volume, d)[1:])}"
    return f"{format_volume(volume.estimate, d)}, proved between {format_bracket(volume, d)}"


def find_note(workspace: SampledWorkspace) -> str:
    """Find the note on what a method can't see; empty if it sees everything."""
    return workspace.note if isinstance(workspace, PolarWorkspace | DriveWorkspace) else ""


def describe_region(region: Region) -> str:
    """Describe a region: ``total orientation, A -15° to 15°, C = 30°``, and the limits that do not count."""
    phrases = [_KINDS[region.kind]]
    if region.kind != "dexterous":
        spans = region.swept_axes.items()
        phrases += [f"{axis} {format_bound(low, 'rad')} to {format_bound(high, 'rad')}" for axis, (low, high) in spans]
    units = dict(zip(region.machine.axes, region.machine.axis_units, strict=True))
    for axis, value in region.fixed_axes.items():
        phrases.append(f"{axis} = {format_bound(value, units[axis])}{' mm' * (units[axis] == 'mm')}")
    if region.without:
        few = len(region.without) <= _FEW
        phrases.append(f"without {' '.join(region.without) if few else f'{len(region.without)} of the limits'}")
    if region.mode != region.machine.mode:
        phrases.append(f"mode {region.mode}")
    return ", ".join(phrases)


def format_volume(value: float, dimension: int) -> str:
    """Format a volume in mm³ (an area in mm², a length in mm) by the largest fitting unit: ``19.9 litres``."""
    unit, size = _choose_unit(value, dimension)
    digits = max(0, 3 - len(f"{value / size:.0f}"))
    return f"{value / size:,.{digits}f} {unit}"


def format_bracket(volume: Volume, dimension: int) -> str:
    """Format the proved bracket, rounded outward, with enough digits to part its ends: ``19.84 and 19.97 litres``."""
    low, high, unit = _round_outward(volume, dimension)
    return f"{low} and {high} {unit}"


def _round_outward(volume: Volume, dimension: int) -> tuple[str, str, str]:
    """Round the ends of a bracket outward, with enough digits to part them; return them and their unit."""
    unit, size = _choose_unit(volume.estimate or volume.outer, dimension)
    gap = (volume.outer - volume.inner) / size
    scale = 10 ** min(9, max(0, 2 - ceil(log10(gap)))) if gap > 0.0 else 1000
    low, high = floor(volume.inner / size * scale) / scale, ceil(volume.outer / size * scale) / scale
    digits = len(str(scale)) - 1
    return f"{low:,.{digits}f}", f"{high:,.{digits}f}", unit


def _choose_unit(value: float, dimension: int) -> tuple[str, float]:
    """Choose the largest unit in which the value is at least one; return its name and its size."""
    return next((pair for pair in _UNITS[dimension] if value >= pair[1]), _UNITS[dimension][-1])
