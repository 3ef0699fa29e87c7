"""The remarks that a reader gathers for the user."""

from ..path import Note


class NoteBook:
    """Notes by kind: equal texts make one note, with the first line and their count."""

    _MOST_KINDS = 200

    def __init__(self) -> None:
        self._kinds: dict[str, list[int]] = {}  # text: first line, count

    def add(self, line: int, text: str, count: int = 1) -> None:
        """Add a remark on a line (0: the whole file) that was met ``count`` times."""
        kind = self._kinds.get(text)
        if kind is None:
            if len(self._kinds) >= self._MOST_KINDS:
                text = "further remarks, left out here"
            kind = self._kinds.setdefault(text, [line, 0])
        kind[1] += count

    def list_notes(self) -> tuple[Note, ...]:
        """List all notes in the order of their lines."""
        notes = [Note(line, text if n == 1 else f"{text} ({n} times)") for text, (line, n) in self._kinds.items()]
        return tuple(sorted(notes))
