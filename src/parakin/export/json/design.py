"""A design as an object for JSON, ``parakin.design/1``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...performance.design import Design


def encode_design(design: Design, files: Mapping[str, str]) -> dict[str, Any]:
    """Encode a design, and the files that were written by their kinds."""
    low, high = design.cube
    least, greatest = design.proof.brackets
    return {
        "schema": "parakin.design/1",
        "family": design.family,
        "edge": design.edge,
        "amplification": design.amplification,
        "rod": design.rod,
        "stroke": list(design.stroke),
        "cube": [[low] * 3, [high] * 3],
        "verdict": design.proof.verdict,
        "tolerance": design.proof.tolerance,
        "psi": {"least": [least.low, least.high], "greatest": [greatest.low, greatest.high]},
        "files": dict(files),
    }
