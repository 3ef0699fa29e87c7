"""Calibrations and plans of measurements as objects for JSON, ``parakin.calibration/1`` and ``parakin.plan/1``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...units import name_display_unit, to_display
from .performance import encode_pose

if TYPE_CHECKING:
    from ...calibration.calibration import Calibration
    from ...calibration.identifiability import Combination
    from ...calibration.measurement_plan import MeasurementPlan


def encode_calibration(calibration: Calibration, files: Mapping[str, str]) -> dict[str, Any]:
    """Encode a calibration, and the files that were written by their kinds; mm and degrees."""
    measured = calibration.measured
    return {
        "schema": "parakin.calibration/1",
        "machine": calibration.family.machine.name,
        "measurements": len(measured.joints),
        "measured": [*measured.axes, *(["distance"] if measured.distances is not None else [])],
        "parameters": [
            {
                "name": parameter.name,
                "unit": name_display_unit(parameter.unit),
                "was": to_display(before.value, parameter.unit),
                "value": to_display(parameter.value, parameter.unit),
                "deviation": to_display(parameter.deviation or 0.0, parameter.unit),
            }
            for before, parameter in zip(calibration.family.parameters, calibration.parameters, strict=True)
        ],
        "fixed": list(calibration.fixed),
        "centre": None if calibration.centre is None else calibration.centre.tolist(),
        "frame": None if calibration.frame is None else calibration.frame.tolist(),
        "error": calibration.error,
        "residual": {"fit": calibration.fit, "held_out": calibration.held_out},
        "residuals": calibration.residuals.tolist(),
        "outliers": [row + 1 for row in calibration.outliers],
        "combinations": [_encode_combination(combination) for combination in calibration.combinations],
        "files": dict(files),
    }


def encode_plan(plan: MeasurementPlan, files: Mapping[str, str]) -> dict[str, Any]:
    """Encode a plan of measurements, and the files that were written by their kinds; mm and degrees."""
    machine = plan.machine
    units = zip(machine.joints, machine.joint_units, strict=True)
    joints = [(name, unit, column) for column, (name, unit) in enumerate(units)]
    return {
        "schema": "parakin.plan/1",
        "machine": machine.name,
        "measured": list(plan.axes),
        "error": plan.error,
        "poses": [
            {
                "pose": encode_pose(machine, pose),
                "joints": {name: to_display(float(row[column]), unit) for name, unit, column in joints},
            }
            for pose, row in zip(plan.poses, plan.joints, strict=True)
        ],
        "combinations": [_encode_combination(combination) for combination in plan.combinations],
        "files": dict(files),
    }


def _encode_combination(combination: Combination) -> dict[str, Any]:
    return {"amplification": combination.amplification, "names": list(combination.names)}
