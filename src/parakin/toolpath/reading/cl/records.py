"""The records of a CL file as growing columns."""

import numpy as np

from .file_frames import FileTransform

_BLOCK = 65536  # rows transformed at a time, so that turning a long path needs no second copy of it
_FIRST = 1024


class ClRecords:
    """The columns of a tool path, n rows. Rows from ``placed`` on are still in the file's own numbers."""

    def __init__(self, expected: int):
        capacity = max(_FIRST, expected)
        self.n = 0
        self.placed = 0
        self.tip = np.empty((capacity, 3))
        self.axis = np.empty((capacity, 3))
        self.line = np.empty(capacity, np.int64)
        self.rapid = np.empty(capacity, np.bool_)
        self.feed = np.empty(capacity)
        self.spindle = np.empty(capacity)

    def _resize(self, capacity: int) -> None:
        # The allocator resizes in place, without a second copy. No view of a column outlives a call.
        self.tip.resize((capacity, 3), refcheck=False)
        self.axis.resize((capacity, 3), refcheck=False)
        for column in (self.line, self.rapid, self.feed, self.spindle):
            column.resize(capacity, refcheck=False)

    def reserve(self, more: int) -> None:
        """Make room for so many more rows."""
        if self.n + more > len(self.line):
            self._resize(max(self.n + more, len(self.line) * 3 // 2))

    def trim(self) -> None:
        """Give back the room that is not used."""
        self._resize(self.n)

    def place_rows(self, transform: FileTransform) -> None:
        """Bring the rows read since the last call into the first frame, in mm."""
        for a in range(self.placed, self.n, _BLOCK):
            b = min(a + _BLOCK, self.n)
            transform.apply(self.tip[a:b], self.axis[a:b])
        self.placed = self.n
