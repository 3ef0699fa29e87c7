"""Searched designs as an object for JSON, ``parakin.designs/1``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...synthesis.designs import Designs


def encode_designs(designs: Designs, files: Sequence[str]) -> dict[str, Any]:
    """Encode designs, mm and rad, and the files that were written."""
    return {
        "schema": "parakin.designs/1",
        "machine": designs.problem.machine.name,
        "minimise": list(designs.problem.minimise),
        "maximise": list(designs.problem.maximise),
        "bounds": dict(designs.problem.bounds),
        "within": dict(designs.problem.within or {}),
        "designs": [
            {
                "sizes": dict(design.sizes),
                "values": dict(design.values),
                "proved": dict(design.proved),
                "box": {axis: list(ends) for axis, ends in design.box.items()},
                "ranges": {name: list(ends) for name, ends in design.ranges.items()},
                "verdict": "proved",
                "boxes": design.boxes,
            }
            for design in designs.front
        ],
        "unproved": [{"sizes": dict(failed.sizes), "reason": failed.reason} for failed in designs.unproved],
        "shortfall": designs.shortfall,
        "files": list(files),
    }
