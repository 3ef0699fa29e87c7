"""The rows of a comparison of machines, for people."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .number_format import format_duration, format_fixed

if TYPE_CHECKING:
    from ..comparison.comparison import Comparison, MachineFigures

_Cell = str | None


def list_rows(comparison: Comparison) -> list[list[str]]:
    """List a row for each figure: its name, then each machine's; a dash for what a machine can't do."""
    rows = []
    for name, tell in _ROWS.items():
        cells = [tell(column) for column in comparison.columns]
        if any(cell is not None for cell in cells):
            rows.append([name, *("-" if cell is None else cell for cell in cells)])
    return rows


def _tell_volume(column: MachineFigures) -> _Cell:
    volume, dimensions = column.workspace.volume, len(column.workspace.region.free_axes)
    low, high = (value * 1e-3**dimensions for value in (volume.inner, volume.outer))
    return f"{low:.3g} to {high:.3g} m{dimensions if dimensions > 1 else ''}"


def _tell_extent(column: MachineFigures) -> _Cell:
    box = column.workspace.box
    return None if box is None else " x ".join(format_fixed(side, 0) for side in (box[1] - box[0]).tolist()) + " mm"


def _tell_amplification(percent: float) -> Callable[[MachineFigures], _Cell]:
    def tell(column: MachineFigures) -> _Cell:
        indices = column.performance
        return None if isinstance(indices, str) else format_fixed(float(np.percentile(indices.greatest, percent)), 2)

    return tell


def _tell_condition(column: MachineFigures) -> _Cell:
    indices = column.performance
    return None if isinstance(indices, str) else format_fixed(float(np.median(indices.condition)), 2)


def _tell_error(percent: float) -> Callable[[MachineFigures], _Cell]:
    def tell(column: MachineFigures) -> _Cell:
        accuracy = column.accuracy
        return None if accuracy is None or isinstance(accuracy, str) else _format_um(accuracy.percentile(percent))

    return tell


def _format_um(value: float) -> str:
    return f"{format_fixed(1e3 * value, 1)} um"


def _tell_stiffness(percent: float) -> Callable[[MachineFigures], _Cell]:
    def tell(column: MachineFigures) -> _Cell:
        stiffness = column.stiffness
        if stiffness is None or isinstance(stiffness, str):
            return None
        return f"{format_fixed(1e-3 * float(np.percentile(stiffness.least, percent)), 1)} N/um"

    return tell


def _tell_time(column: MachineFigures) -> _Cell:
    job = column.job
    seconds = None if job is None or isinstance(job, str) else job.seconds
    return None if seconds is None else format_duration(seconds)


_ROWS: dict[str, Callable[[MachineFigures], _Cell]] = {
    "workspace, home's orientation": _tell_volume,
    "its box": _tell_extent,
    "amplification, half are below": _tell_amplification(50),
    "amplification, 95 % are below": _tell_amplification(95),
    "condition number, half are below": _tell_condition,
    "tip's error, half are below": _tell_error(50),
    "tip's error, 95 % are below": _tell_error(95),
    "least stiffness, half are below": _tell_stiffness(50),
    "least stiffness, 5 % are below": _tell_stiffness(5),
    "the part's cycle time": _tell_time,
}
