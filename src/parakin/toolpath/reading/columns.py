"""Records as they are read: growing columns, the frame they are in, and notes gathered by kind."""

from dataclasses import dataclass, field

import numpy as np

from ..path import Floats, Note

_BLOCK = 65536  # rows transformed at a time, so that turning a long path needs no second copy of it
_FIRST = 1024


@dataclass(frozen=True)
class Frame:
    """A frame in the machine: rotation (3, 3) and origin (3,) in the file's unit."""

    rotation: Floats
    origin: Floats

    def scaled(self, factor: float) -> "Frame":
        return Frame(self.rotation, self.origin * factor)

    def same(self, other: "Frame") -> bool:
        """Equal but for the last digits of the origin."""
        near = np.abs(self.origin - other.origin) <= 1e-12 * np.maximum(1.0, np.abs(other.origin))
        return np.array_equal(self.rotation, other.rotation) and bool(near.all())


@dataclass
class Placement:
    """From the file's numbers to the first workpiece frame, in mm.

    scale : mm in the file's unit
    turn, shift : (3, 3) or None and (3,) mm: x -> turn (scale (x - origin)) + shift
    origin : (3,) what ORIGIN put to zero, in the file's unit
    """

    scale: float = 1.0
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    turn: Floats | None = None
    shift: Floats = field(default_factory=lambda: np.zeros(3))

    def apply(self, tip: Floats, axis: Floats) -> None:
        """In place, rows of (n, 3)."""
        if self.origin.any():
            tip -= self.origin
        if self.scale != 1.0:
            tip *= self.scale
        if self.turn is not None:
            tip[:] = tip @ self.turn.T
            axis[:] = axis @ self.turn.T
        if self.shift.any():
            tip += self.shift

    def undo(self, tip: Floats) -> Floats:
        """One point (3,) back to the file's numbers."""
        local = tip - self.shift
        if self.turn is not None:
            local = self.turn.T @ local
        return np.asarray(local / self.scale + self.origin)


class Records:
    """The columns of a tool path. Rows from ``placed`` on are still in the file's own numbers."""

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
        # resized in place by the allocator: no second copy. No views of the columns outlive a call.
        self.tip.resize((capacity, 3), refcheck=False)
        self.axis.resize((capacity, 3), refcheck=False)
        for column in (self.line, self.rapid, self.feed, self.spindle):
            column.resize(capacity, refcheck=False)

    def reserve(self, more: int) -> None:
        if self.n + more > len(self.line):
            self._resize(max(self.n + more, len(self.line) * 3 // 2))

    def trim(self) -> None:
        self._resize(self.n)

    def place(self, placement: Placement) -> None:
        """Bring the rows read since the last call into the first frame, in mm."""
        for a in range(self.placed, self.n, _BLOCK):
            b = min(a + _BLOCK, self.n)
            placement.apply(self.tip[a:b], self.axis[a:b])
        self.placed = self.n


class NoteBook:
    """Notes by kind: a million lines of one kind make one note, with its first line and their count."""

    _MOST_KINDS = 200

    def __init__(self) -> None:
        self._kinds: dict[str, list[int]] = {}

    def add(self, line: int, text: str, count: int = 1) -> None:
        known = self._kinds.get(text)
        if known is None:
            if len(self._kinds) >= self._MOST_KINDS:
                text = "further remarks, left out here"
            known = self._kinds.setdefault(text, [line, 0])
        known[1] += count

    def notes(self) -> tuple[Note, ...]:
        made = [Note(line, text if n == 1 else f"{text} ({n} times)") for text, (line, n) in self._kinds.items()]
        return tuple(sorted(made))
