"""A workspace told: in words for people, as one object for programs."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, degrees, floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Array
from ...workspaces.certified.region import Region
from ...workspaces.certified.workspace import Volume, Workspace
from ...workspaces.sampled.drive_sweep import DriveWorkspace
from ...workspaces.sampled.grid import GridWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace
from ...workspaces.sampled.sampling import SampledWorkspace
from ..ranges import edge
from .curves import curves

if TYPE_CHECKING:
    from ...workspaces.sampled.cross_sections import CrossSection

KINDS = {
    "constant": "constant orientation",
    "total": "total orientation",
    "inclusive": "inclusive orientation",
    "dexterous": "dexterous",
}
METHODS = {"grid": " by a dense grid", "polar": " by a polar sweep", "drives": " by a sweep of the drives"}
FEW = 4  # names that are written out
_UNITS = {
    1: (("m", 1e3), ("mm", 1.0)),
    2: (("m²", 1e6), ("cm²", 1e2), ("mm²", 1.0)),
    3: (("m³", 1e9), ("litres", 1e6), ("cm³", 1e3), ("mm³", 1.0)),
}


# For people.


def heading(found: Workspace | SampledWorkspace) -> str:
    """``tricept: workspace, constant orientation, B = 0°, C = 0°``."""
    method = METHODS[found.method] if isinstance(found, SampledWorkspace) else ""
    return f"{found.machine.name}: workspace{method}, {asked(found.region)}"


def size(found: Workspace | SampledWorkspace) -> str:
    """``19.9 litres, proved between 19.84 and 19.97 litres``."""
    d = len(found.axes)
    if isinstance(found, SampledWorkspace):
        return f"{amount(found.estimate, d)}, an estimate"
    return f"{amount(found.volume.estimate, d)}, proved between {between(found.volume, d)}"


def note(found: SampledWorkspace) -> str:
    """What a method does not see; empty if it sees all."""
    return found.note if isinstance(found, PolarWorkspace | DriveWorkspace) else ""


def asked(region: Region) -> str:
    """What was asked: ``total orientation, A -15° to 15°, C = 30°``; without what does not count."""
    parts = [KINDS[region.kind]]
    if region.kind != "dexterous":
        parts += [
            f"{axis} {edge(low, 'rad')} to {edge(high, 'rad')}" for axis, (low, high) in region.swept_axes.items()
        ]
    units = dict(zip(region.machine.axes, region.machine.axis_units, strict=True))
    for axis, value in region.fixed_axes.items():
        parts.append(f"{axis} = {edge(value, units[axis])}{' mm' * (units[axis] == 'mm')}")
    if region.without:
        few = len(region.without) <= FEW
        parts.append(f"without {' '.join(region.without) if few else f'{len(region.without)} of the limits'}")
    if region.mode != region.machine.mode:
        parts.append(f"mode {region.mode}")
    return ", ".join(parts)


def amount(value: float, dimension: int) -> str:
    """A volume of some mm³ (or area, or length) for people: ``19.9 litres``."""
    unit, size = _unit(value, dimension)
    digits = max(0, 3 - len(f"{value / size:.0f}"))
    return f"{value / size:,.{digits}f} {unit}"


def between(volume: Volume, dimension: int) -> str:
    """The proved bracket, rounded outward, with digits enough to tell its ends apart: ``19.84 and 19.97 litres``."""
    unit, size = _unit(volume.estimate, dimension)
    gap = (volume.outer - volume.inner) / size
    scale = 10 ** min(9, max(0, 2 - ceil(log10(gap)))) if gap > 0.0 else 1000
    low, high = floor(volume.inner / size * scale) / scale, ceil(volume.outer / size * scale) / scale
    digits = len(str(scale)) - 1
    return f"{low:,.{digits}f} and {high:,.{digits}f} {unit}"


def _unit(value: float, dimension: int) -> tuple[str, float]:
    """The largest unit of which there is at least one."""
    return next((pair for pair in _UNITS[dimension] if value >= pair[1]), _UNITS[dimension][-1])


# For programs.


def account(found: Workspace | SampledWorkspace, slices: Sequence[CrossSection]) -> dict[str, Any]:
    """The whole result but for the cells; mm and degrees, null for what a method does not tell."""
    return {
        "schema": "parakin.workspace/1",
        "machine": found.machine.name,
        "kind": found.region.kind,
        "axes": list(found.axes),
        "unit": found.unit,
        **(_estimated(found) if isinstance(found, SampledWorkspace) else _proved(found)),
        "slices": [
            {
                "axis": section.axis,
                "value": section.value,
                "area": section.area,
                "outlines": [_rounded(outline) for outline in section.outlines],
            }
            for section in slices
        ],
        "parameters": _at_the_rim(found),
    }


def _proved(found: Workspace) -> dict[str, Any]:
    inside, volume = int(found.cells.inside.sum()), found.volume
    return {
        "volume": {"inner": volume.inner, "estimate": volume.estimate, "outer": volume.outer},
        "gap": volume.gap,
        "stopped": found.stopped,
        "empty": found.empty,
        **_shape(found),
        "surface": found.surface,
        "cells": {"inside": inside, "boundary": len(found.cells.low) - inside},
    }


def _estimated(found: SampledWorkspace) -> dict[str, Any]:
    """As of the certified one; ``empty`` is null where nothing was found, for nothing is proved."""
    content: dict[str, Any] = {
        "volume": {"inner": None, "estimate": found.estimate, "outer": None},
        "gap": None,
        "stopped": "step",
        "empty": False if found.estimate > 0.0 else None,
        **(_shape(found) if isinstance(found, GridWorkspace) else {"box": None, "centroid": None, "bounded_by": []}),
        "surface": None,
        "cells": {"inside": int(found.mask.sum()) if isinstance(found, GridWorkspace) else None, "boundary": None},
        "note": note(found),
    }
    if isinstance(found, PolarWorkspace | DriveWorkspace):
        content["curves"] = [
            {"name": group.name, "lines": [_rounded(line) for line in group.lines]}
            for group in curves(found)
            if not group.fine
        ]
    return content


def _shape(found: Workspace | GridWorkspace) -> dict[str, Any]:
    return {
        "box": None if found.box is None else {"low": found.box[0].tolist(), "high": found.box[1].tolist()},
        "centroid": None if found.centroid is None else found.centroid.tolist(),
        "bounded_by": [
            {"limit": bound.limit, "share": bound.fraction, "middle": list(bound.middle)} for bound in found.bounded_by
        ],
    }


def _rounded(points: Array) -> Any:
    return (np.round(points, 2) + 0.0).tolist()


def _at_the_rim(found: Workspace | SampledWorkspace) -> dict[str, Any]:
    """The parameters, angles in degrees."""
    turning = {axis for axis, unit in zip(found.machine.axes, found.machine.axis_units, strict=True) if unit == "rad"}
    parameters = dict(found.parameters)
    parameters["at"] = {axis: degrees(v) if axis in turning else v for axis, v in parameters["at"].items()}
    for swept in ("every", "some"):
        parameters[swept] = {axis: [degrees(end) for end in span] for axis, span in parameters[swept].items()}
    if "turns_step" in parameters:
        parameters["turns_step"] = degrees(parameters["turns_step"])
    return parameters
