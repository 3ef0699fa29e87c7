"""Machines of other programs' configurations: LinuxCNC, Klipper, RepRapFirmware."""

from .foreign_file import read_foreign_machine
from .foreign_machine import ForeignMachine, format_machine_yaml

__all__ = ["ForeignMachine", "format_machine_yaml", "read_foreign_machine"]
