"""The parameters of a G-code program: numbered and named, local to a subroutine or global, and those of the control."""

import math
from collections.abc import Callable

from ..notes import NoteBook
from ..text import refuse
from .expressions import Key

LAST = 5601  # the highest number of a parameter
ARGUMENTS = 30  # parameters 1 to 30 are a subroutine's own
DEEPEST_CALLS = 10  # deepest calls, as LinuxCNC has it
_KEPT_FROM = 5061  # from here on, numbers that are not set are not zero, but what the control keeps
_SETTABLE = {*range(5161, 5170), *range(5181, 5190), 5599}  # of those: the reference points of G28 and G30, a switch
_MOST = 20_000  # named parameters kept


class Parameters:
    """Values by number and name.

    readers : what the control knows, by number or name: a function that returns the value, NaN if it is not known
    """

    def __init__(self, notes: NoteBook):
        self.readers: dict[Key, Callable[[], float]] = {}
        self.line = 0  # the line being read, for the notes
        self.changes = 0  # how often a parameter was set, or one read that changes by itself
        self._notes = notes
        self._numbered: dict[int, float] = {}
        self._global: dict[str, float] = {}
        self._local: list[dict[str, float]] = [{}]
        self._saved: list[list[float | None]] = []

    def read(self, key: Key) -> float:
        """Return a parameter's value; a number never set is zero, a name never set is refused."""
        reader = self.readers.get(key)
        if reader is not None:
            self.changes += 1
            value = reader()
            if math.isnan(value):
                refuse(f"{_write_key(key)} is read, but its value is not known from this file")
            return value
        if isinstance(key, int):
            self._check_number(key)
            if key not in self._numbered:
                if key >= _KEPT_FROM:
                    refuse(f"#{key} is read, but its value is not known from this file")
                self._notes.add(self.line, "a parameter is read that this file has not set: it is 0")
            return self._numbered.get(key, 0.0)
        names = self._find_names(key)
        if key not in names:
            refuse(f"{_write_key(key)} is not set in this file")
        return names[key]

    def exists(self, key: Key) -> bool:
        """Tell whether a named parameter has been set, or is the control's own."""
        return key in self.readers or (isinstance(key, str) and key in self._find_names(key))

    def assign(self, key: Key, value: float) -> None:
        """Set a parameter; refuse those that the control alone sets."""
        self.changes += 1
        if isinstance(key, int):
            self._check_number(key)
            if key in self.readers or (key >= _KEPT_FROM and key not in _SETTABLE):
                refuse(f"#{key}: a parameter of the control's own; expected G10, G92 or another code that sets it")
            self._numbered[key] = value
            return
        if key in self.readers:
            refuse(f"{_write_key(key)}: a parameter of the control's own, which can't be set")
        names = self._find_names(key)
        if key not in names and len(self._global) + sum(map(len, self._local)) >= _MOST:
            refuse(f"more than {_MOST} named parameters")
        names[key] = value

    def find(self, number: int) -> float:
        """Return a numbered parameter, NaN if it is not set."""
        return self._numbered.get(number, math.nan)

    def enter(self, arguments: list[float]) -> None:
        """Begin a subroutine: parameters 1 to 30 are its arguments, and its names are its own."""
        self.changes += 1
        if len(self._saved) >= DEEPEST_CALLS - 1:
            refuse(f"subroutines that call one another more than {DEEPEST_CALLS - 1} deep")
        self._saved.append([self._numbered.get(k) for k in range(1, ARGUMENTS + 1)])
        self._local.append({})
        for k in range(ARGUMENTS):
            self._numbered[k + 1] = arguments[k] if k < len(arguments) else 0.0

    def leave(self) -> None:
        """End a subroutine: restore the caller's parameters 1 to 30."""
        self._local.pop()
        for k, value in enumerate(self._saved.pop(), 1):
            if value is None:
                self._numbered.pop(k, None)
            else:
                self._numbered[k] = value

    @property
    def depth(self) -> int:
        """How many subroutines are being executed, one within another."""
        return len(self._saved)

    def _find_names(self, key: str) -> dict[str, float]:
        return self._global if key.startswith("_") else self._local[-1]

    @staticmethod
    def _check_number(number: int) -> None:
        if not 1 <= number <= LAST:
            refuse(f"#{number}: expected a parameter's number from 1 to {LAST}")


def _write_key(key: Key) -> str:
    return f"#{key}" if isinstance(key, int) else f"#<{key}>"
