"""Controllers, a file or a folder each: the programs that they run.

Each describes its controller by ``CONTROLLER``, a :class:`~.controller.Controller`. The name of the file or folder
stands in :data:`Target` below, where ``parakin post --target NAME`` finds it. ``gcode_text.py`` and
``event_lines.py`` write what all G-code has in common; ``joints/`` is what controls without kinematics have in
common.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from .controller import Controller

Target: TypeAlias = Literal["linuxcnc", "joints", "grbl", "fluidnc", "siemens", "heidenhain", "fanuc", "beckhoff"]

# Cards that a LinuxCNC configuration may be for, the names of `linuxcnc/hardware/cards.py`.
Hardware: TypeAlias = Literal["mesa-7i96s", "mesa-7i76e", "parport", "ethercat"]

# Screens that a LinuxCNC configuration may start, the names of `linuxcnc/config.py`.
Screen: TypeAlias = Literal["axis", "gmoccapy"]


def load_controller(target: Target) -> Controller:
    """Import a controller's file or folder and return its description."""
    controller: Controller = import_module(f".{target}", __name__).CONTROLLER
    return controller
