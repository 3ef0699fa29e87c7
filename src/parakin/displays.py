"""How objects show themselves in notebooks: by functions that stand above them and are registered here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .errors import ParakinError

_renderers: dict[str, Callable[[Any], str | None]] = {}


def register_display(class_name: str, render: Callable[[Any], str | None]) -> None:
    """Register what renders objects of a class as HTML; None for one that its repr shows well enough."""
    _renderers[class_name] = render


class Displayed:
    """An object that notebooks show as HTML."""

    def _repr_html_(self) -> str | None:
        try:
            return _renderers[type(self).__name__](self)
        except ParakinError:  # nothing to draw: the repr will do
            return None
