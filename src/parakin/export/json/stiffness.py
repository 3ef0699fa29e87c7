"""An analysis of stiffness as an object for JSON, ``parakin.stiffness/1``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...performance.jacobians import list_twist_names
from .performance import encode_pose

if TYPE_CHECKING:
    from ...arrays import Array
    from ...stiffness.stiffness import Stiffness

_PERCENTS = (0, 5, 50)


def encode_stiffness(
    stiffness: Stiffness, force: Array | None, files: Mapping[str, str], weight: bool = False
) -> dict[str, Any]:
    """Encode stiffnesses in N/mm, deflections in mm and rad, the compliance at the worst pose in mm, rad, N, Nmm."""
    machine, worst = stiffness.machine, int(stiffness.least.argmin())
    units = np.eye(len(stiffness.translations))
    return {
        "schema": "parakin.stiffness/1",
        "machine": machine.name,
        "poses": len(stiffness.poses),
        "least": _encode_percentiles(stiffness.least),
        "along": {
            axis: _encode_percentiles(stiffness.along(unit))
            for axis, unit in zip(stiffness.translations, units, strict=True)
        },
        "drive_share": float(np.mean(stiffness.drive_share)),
        "worst_pose": encode_pose(machine, stiffness.poses[worst]),
        "twist": list(list_twist_names(machine)),
        "compliance_at_worst_pose": stiffness.compliances[worst].tolist(),
        "deflection": None if force is None else _encode_deflection(stiffness, force),
        "sag": _encode_sag(stiffness) if weight else None,
        "files": dict(files),
    }


def _encode_percentiles(values: Array) -> dict[str, float]:
    return {str(percent): float(np.percentile(values, percent)) for percent in _PERCENTS}


def _encode_deflection(stiffness: Stiffness, force: Array) -> dict[str, Any]:
    names, moved = list_twist_names(stiffness.machine), stiffness.deflect(force)
    sizes = np.linalg.norm(moved[:, : len(stiffness.translations)], axis=1)
    worst = int(sizes.argmax())
    return {
        "force": dict(zip(stiffness.translations, force.tolist(), strict=True)),
        "median": float(np.median(sizes)),
        "worst": float(sizes[worst]),
        "worst_twist": dict(zip(names, moved[worst].tolist(), strict=True)),
        "worst_pose": encode_pose(stiffness.machine, stiffness.poses[worst]),
    }


def _encode_sag(stiffness: Stiffness) -> dict[str, Any]:
    sizes = np.linalg.norm(stiffness.sag()[:, : len(stiffness.translations)], axis=1)
    worst = int(sizes.argmax())
    return {
        "median": float(np.median(sizes)),
        "worst": float(sizes[worst]),
        "worst_pose": encode_pose(stiffness.machine, stiffness.poses[worst]),
    }
