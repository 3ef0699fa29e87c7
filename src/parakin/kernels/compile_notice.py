"""Who is told that Numba begins to compile, without Numba being imported for it."""

from __future__ import annotations

from collections.abc import Callable

_waiting: list[Callable[[], None]] = []


def call_at_first_compilation(tell: Callable[[], None]) -> None:
    """Call a function once, as soon as a kernel is compiled."""
    _waiting.append(tell)


def report_compilation() -> None:
    """Tell those who wait that a kernel is being compiled."""
    while _waiting:
        _waiting.pop()()
