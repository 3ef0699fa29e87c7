"""A workspace as an object for JSON, ``parakin.workspace/1``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from ...units import to_display
from ...workspaces.sampled.drive_sweep import DriveWorkspace
from ...workspaces.sampled.grid import GridWorkspace
from ...workspaces.sampled.polar_sweep import PolarWorkspace
from ...workspaces.sampled.sampling import SampledWorkspace
from ..workspace.describe import AnyWorkspace, find_note
from ..workspace.sweep_curves import build_sweep_curves

if TYPE_CHECKING:
    from ...arrays import Array
    from ...workspaces.certified.workspace import Volume, Workspace
    from ...workspaces.sampled.cross_sections import CrossSection


def encode_workspace(
    workspace: AnyWorkspace, cross_sections: Sequence[CrossSection], elsewhere: Volume | None = None
) -> dict[str, Any]:
    """Encode a workspace and its cross-sections, but not its cells; null for what a method does not find.

    ``elsewhere`` is what the machine reaches besides home's part.
    """
    return {
        "schema": "parakin.workspace/1",
        "machine": workspace.machine.name,
        "kind": workspace.region.kind,
        "axes": list(workspace.axes),
        "unit": workspace.unit,
        **(_encode_sampled(workspace) if isinstance(workspace, SampledWorkspace) else _encode_certified(workspace)),
        "slices": [
            {
                "axis": cut.axis,
                "value": cut.value,
                "area": cut.area,
                "outlines": [_round_points(outline) for outline in cut.outlines],
            }
            for cut in cross_sections
        ],
        "elsewhere": None if elsewhere is None else asdict(elsewhere),
        "parameters": _encode_parameters(workspace),
    }


def _encode_certified(workspace: Workspace) -> dict[str, Any]:
    inside, volume = int(workspace.cells.inside.sum()), workspace.volume
    return {
        "volume": {"inner": volume.inner, "estimate": volume.estimate, "outer": volume.outer},
        "gap": volume.gap,
        "stopped": workspace.stopped,
        "empty": workspace.empty,
        **_encode_extent(workspace),
        "surface": workspace.surface,
        "cells": {"inside": inside, "boundary": len(workspace.cells.low) - inside},
    }


def _encode_sampled(workspace: SampledWorkspace) -> dict[str, Any]:
    """Encode with the keys of a certified workspace; ``empty`` is null if no sample is allowed: nothing is proved."""
    extent: dict[str, Any] = {"box": None, "centroid": None, "bounded_by": []}
    content: dict[str, Any] = {
        "volume": {"inner": None, "estimate": workspace.estimate, "outer": None},
        "gap": None,
        "stopped": "step",
        "empty": False if workspace.estimate > 0.0 else None,
        **(_encode_extent(workspace) if isinstance(workspace, GridWorkspace) else extent),
        "surface": None,
        "cells": {
            "inside": int(workspace.mask.sum()) if isinstance(workspace, GridWorkspace) else None,
            "boundary": None,
        },
        "note": find_note(workspace),
    }
    if isinstance(workspace, PolarWorkspace | DriveWorkspace):
        content["curves"] = [
            {"name": group.name, "lines": [_round_points(line) for line in group.lines]}
            for group in build_sweep_curves(workspace)
            if not group.fine
        ]
    return content


def _encode_extent(workspace: Workspace | GridWorkspace) -> dict[str, Any]:
    box, centroid = workspace.box, workspace.centroid
    return {
        "box": None if box is None else {"low": box[0].tolist(), "high": box[1].tolist()},
        "centroid": None if centroid is None else centroid.tolist(),
        "bounded_by": [
            {"limit": limit.limit, "share": limit.fraction, "middle": list(limit.middle)}
            for limit in workspace.bounded_by
        ],
    }


def _round_points(points: Array) -> Any:
    return (np.round(points, 2) + 0.0).tolist()


def _encode_parameters(workspace: AnyWorkspace) -> dict[str, Any]:
    """Encode the parameters, angles in degrees."""
    machine = workspace.machine
    units = dict(zip(machine.axes, machine.axis_units, strict=True))
    parameters = dict(workspace.parameters)
    parameters["at"] = {axis: to_display(value, units[axis]) for axis, value in parameters["at"].items()}
    for swept in ("every", "some"):
        spans = parameters[swept].items()
        parameters[swept] = {axis: [to_display(end, "rad") for end in span] for axis, span in spans}
    if "turns_step" in parameters:
        parameters["turns_step"] = to_display(parameters["turns_step"], "rad")
    return parameters
