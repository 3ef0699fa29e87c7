"""All assemblies of a joint vector as an object for JSON, ``parakin.assemblies/1``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...units import to_display

if TYPE_CHECKING:
    from ...arrays import Array
    from ...kinematics.assemblies import Assemblies
    from ...machine import Machine


def encode_assemblies(machine: Machine, joints: Array, assemblies: Assemblies) -> dict[str, Any]:
    """Encode the assemblies of one joint vector (joints,); bounds that are not proved are None."""
    return {
        "schema": "parakin.assemblies/1",
        "machine": machine.name,
        "joints": _encode_row(joints, machine.joints, machine.joint_units),
        "complete": assemblies.complete,
        "complex": assemblies.complex_count,
        "at_infinity": assemblies.infinite_count,
        "lost": assemblies.lost_count,
        "untold": assemblies.untold_count,
        "assemblies": [
            {
                "pose": _encode_row(pose, machine.axes, machine.axis_units),
                "side": int(side),
                "within_limits": bool(within),
                "residual": float(residual),
                "proved_within_mm": _encode_bound(radii[0]),
                "proved_within_deg": _encode_bound(np.degrees(radii[1])),
            }
            for pose, side, within, residual, radii in zip(
                assemblies.poses,
                assemblies.sides,
                assemblies.within_limits,
                assemblies.residuals,
                assemblies.radii,
                strict=True,
            )
        ],
    }


def _encode_row(row: Array, names: tuple[str, ...], units: tuple[str, ...]) -> dict[str, float]:
    return {name: float(to_display(value, unit)) for name, value, unit in zip(names, row.tolist(), units, strict=True)}


def _encode_bound(bound: float) -> float | None:
    return float(bound) if np.isfinite(bound) else None
