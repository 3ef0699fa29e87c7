"""The records of a G-code program as they are made, and their columns."""

from __future__ import annotations

from array import array

import numpy as np

from ....arrays import Array

# columns of a row: six coordinates (mm, degrees), then
FEED, SECONDS, SPINDLE, RAPID, LINE = range(6, 11)
WIDTH = 11
_CHUNK = 1 << 16  # rows kept as they are made, before they go into columns


class GcodeRecords:
    """Rows of WIDTH numbers; ``fresh`` takes their numbers one after another."""

    def __init__(self) -> None:
        self.fresh = array("d")
        self._columns: list[Array] = []
        self._moved = 0  # rows in columns already

    @property
    def count(self) -> int:
        """The number of all rows."""
        return self._moved + len(self.fresh) // WIDTH

    def add_rows(self, rows: Array) -> None:
        """Add rows (k, WIDTH)."""
        self.fresh.frombytes(np.ascontiguousarray(rows, np.float64).tobytes())

    def compact(self) -> None:
        """Move the fresh rows into columns, once there are many."""
        if len(self.fresh) >= _CHUNK * WIDTH:
            self._move_to_columns()

    def _move_to_columns(self) -> None:
        rows = np.frombuffer(self.fresh).reshape(-1, WIDTH)
        self._columns.append(rows.T.copy())
        self._moved += len(rows)
        del rows
        self.fresh = array("d")

    def take_columns(self) -> Array:
        """Return all rows as columns (WIDTH, n) and release them."""
        self._move_to_columns()
        columns, self._columns = self._columns, []
        return np.concatenate(columns, axis=1)
