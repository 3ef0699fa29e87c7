"""An analysis of accuracy as an object for JSON, ``parakin.accuracy/1``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...units import name_display_unit, to_display
from .performance import encode_pose

if TYPE_CHECKING:
    from ...accuracy.accuracy import Accuracy
    from ...accuracy.tolerances import Tolerance
    from ...accuracy.worst_case import WorstCase


def encode_accuracy(
    accuracy: Accuracy,
    worst_case: WorstCase | None,
    allowed: Sequence[Tolerance] | None,
    files: Mapping[str, str],
) -> dict[str, Any]:
    """Encode the tool's error over the workspace, its proved bound and the allowed tolerances; mm and degrees."""
    machine = accuracy.machine
    return {
        "schema": "parakin.accuracy/1",
        "machine": machine.name,
        "poses": len(accuracy.poses),
        "deviation": {str(percent): accuracy.percentile(percent) for percent in (50, 95, 100)},
        "turn": to_display(float(accuracy.turns.max()), "rad"),
        "first_order_bound": float(accuracy.greatest.max()),
        "worst_pose": encode_pose(machine, accuracy.poses[accuracy.worst]),
        "budget": [
            {**_encode_tolerance(tolerance), "share": mean, "share_at_worst_pose": worst}
            for tolerance, mean, worst in accuracy.budget
        ],
        "worst_case": None
        if worst_case is None
        else {
            "bound": worst_case.bound,
            "attained": worst_case.attained,
            "pose": encode_pose(machine, worst_case.pose),
            "boxes": worst_case.boxes,
            "unproved": None if worst_case.unproved is None else encode_pose(machine, worst_case.unproved),
        },
        "allowed": None if allowed is None else [_encode_tolerance(tolerance) for tolerance in allowed],
        "files": dict(files),
    }


def _encode_tolerance(tolerance: Tolerance) -> dict[str, Any]:
    return {
        "name": tolerance.name,
        "tolerance": to_display(tolerance.value, tolerance.unit),
        "unit": name_display_unit(tolerance.unit),
    }
