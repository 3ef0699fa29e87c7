"""Poses with their joints as an object for JSON, ``parakin.inverse/1`` and ``parakin.forward/1``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ...units import to_display
from .offence import encode_offence

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Offence
    from ..tables.poses import ColumnGroup, PoseTable


def encode_poses(
    problem: Literal["inverse", "forward"], table: PoseTable, offences: Sequence[Offence], files: Mapping[str, str]
) -> dict[str, Any]:
    """Encode the answer to a problem, with its offences and the files that were written by their kinds."""
    return {
        "schema": f"parakin.{problem}/1",
        "machine": table.machine.name,
        "verdict": "off limits" if any(table.broken) else "ok",
        "rows": _encode_rows(table),
        "offences": [encode_offence(offence) for offence in offences],
        "files": dict(files),
    }


def _encode_rows(table: PoseTable) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = [
        {"pose": pose, "joints": joints, "broken": broken or None}
        for pose, joints, broken in zip(
            _encode_values(table, "pose"), _encode_values(table, "joints"), table.broken, strict=True
        )
    ]
    if table.solution is not None:
        solution = table.solution
        columns = {name: getattr(solution, name).tolist() for name in ("residual", "converged", "in_other_mode")}
        columns["reason"] = [reason or None for reason in solution.reasons.tolist()]
        for row, *verdicts in zip(rows, *columns.values(), strict=True):
            row |= dict(zip(columns, verdicts, strict=True))
    return rows


def _encode_values(table: PoseTable, side: ColumnGroup) -> list[dict[str, float]]:
    names, units, values = table.columns(side)
    factors = [to_display(1.0, unit) for unit in units]
    return [
        {name: value * factor for name, value, factor in zip(names, line, factors, strict=True)}
        for line in values.tolist()
    ]
