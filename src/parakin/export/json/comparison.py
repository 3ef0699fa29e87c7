"""A comparison of machines as an object for JSON, ``parakin.comparison/1``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ...arrays import Array
    from ...comparison.comparison import Comparison, MachineFigures

_PERCENTS = (5, 50, 95)


def encode_comparison(comparison: Comparison, files: dict[str, str]) -> dict[str, Any]:
    """Encode each machine's figures, mm, N/mm and s; null for what was not answers for, or that it can't do."""
    return {
        "schema": "parakin.comparison/1",
        "machines": [_encode_column(column) for column in comparison.columns],
        "files": files,
    }


def _encode_column(column: MachineFigures) -> dict[str, Any]:
    indices, accuracy, stiffness, job = column.performance, column.accuracy, column.stiffness, column.job
    volume = column.workspace.volume
    return {
        "name": column.machine.name,
        "workspace": {
            "inner": volume.inner,
            "outer": volume.outer,
            "dimensions": len(column.workspace.region.free_axes),
            "box": None if column.workspace.box is None else [corner.tolist() for corner in column.workspace.box],
        },
        "amplification": None if isinstance(indices, str) else _encode_percentiles(indices.greatest),
        "condition": None if isinstance(indices, str) else _encode_percentiles(indices.condition),
        "tip_error": None
        if accuracy is None or isinstance(accuracy, str)
        else _encode_percentiles(accuracy.deviations),
        "least_stiffness": None
        if stiffness is None or isinstance(stiffness, str)
        else _encode_percentiles(stiffness.least),
        "cycle_time": None if job is None or isinstance(job, str) else job.seconds,
        "reasons": column.reasons,
    }


def _encode_percentiles(values: Array) -> dict[str, float]:
    return {str(percent): float(np.percentile(values, percent)) for percent in _PERCENTS}
