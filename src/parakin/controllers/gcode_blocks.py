"""Blocks of G-code from rows of numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array

DIGITS = 6  # behind the point: of mm, of degrees, and of the inverse of minutes
_ROWS = 1 << 14  # formatted at a time


def at_the_rim(values: Array, units: Sequence[str]) -> Array:
    """Rows in mm and degrees, rounded to the digits that are printed."""
    scale = np.where(np.array(units) == "rad", 180.0 / np.pi, 1.0)
    return np.round(values * scale, DIGITS) + 0.0


def blocks(lead: str, letters: Sequence[str], rows: Array, seconds: Array) -> str:
    """Lines ``lead X.. Y.. F..`` of rows (k, letters), F the inverse of the minutes that each takes."""
    number = f"%.{DIGITS}f"
    line = lead + " ".join(f"{letter}{number}" for letter in letters) + f" F{number}\n"
    table = np.column_stack([rows, 60.0 / seconds])
    parts = [table[begin : begin + _ROWS] for begin in range(0, len(table), _ROWS)]
    return "".join(line * len(part) % tuple(part.ravel().tolist()) for part in parts)
