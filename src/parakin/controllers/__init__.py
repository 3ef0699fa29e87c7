"""Controllers, a folder each: the programs that they run.

A folder describes its controller by ``CONTROLLER``, a :class:`~.controller.Controller`, in its ``__init__.py``. The
folder's name stands in :data:`Target` below, where ``parakin post --target NAME`` finds it. ``gcode_text.py`` and
``event_lines.py`` write what all G-code has in common.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from .controller import Controller

Target: TypeAlias = Literal["linuxcnc", "joints"]  # the folders


def load_controller(target: Target) -> Controller:
    """Import a controller's folder and return its description."""
    controller: Controller = import_module(f".{target}", __name__).CONTROLLER
    return controller
