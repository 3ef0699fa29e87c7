"""The records of a G-code program as they are made, and their columns."""

from __future__ import annotations

from array import array

import numpy as np

from ...path import Floats

# columns of a row: six coordinates (mm, degrees), then
FEED, SECONDS, SPINDLE, RAPID, LINE = range(6, 11)
WIDTH = 11
_CHUNK = 1 << 16  # rows kept as they are made, before they go into columns


class Rows:
    """Rows of numbers. ``fresh`` takes them one after another; ``count`` of them are in columns already."""

    def __init__(self) -> None:
        self.fresh = array("d")
        self._kept: list[Floats] = []
        self._settled = 0

    @property
    def count(self) -> int:
        return self._settled + len(self.fresh) // WIDTH

    def add(self, rows: Floats) -> None:
        """Rows (k, WIDTH)."""
        self.fresh.frombytes(np.ascontiguousarray(rows, np.float64).tobytes())

    def settle(self) -> None:
        """Give the rows made so far their final place, once there are many."""
        if len(self.fresh) >= _CHUNK * WIDTH:
            self._settle()

    def _settle(self) -> None:
        rows = np.frombuffer(self.fresh).reshape(-1, WIDTH)
        self._kept.append(rows.T.copy())
        self._settled += len(rows)
        del rows
        self.fresh = array("d")

    def columns(self) -> Floats:
        """All rows, (WIDTH, n); they are no longer kept here."""
        self._settle()
        kept, self._kept = self._kept, []
        return np.concatenate(kept, axis=1)
