"""Recognise the program that a configuration is for, and read its machine."""

from __future__ import annotations

import re
from pathlib import Path

from ...errors import InputError
from .configuration_text import read_configuration
from .foreign_machine import ForeignMachine
from .klipper import read_klipper
from .linuxcnc import read_linuxcnc
from .reprapfirmware import read_reprapfirmware


def read_foreign_machine(path: Path, unit: str | None = None) -> ForeignMachine:
    """Read a machine from LinuxCNC's ini or HAL file, Klipper's printer.cfg, or RepRapFirmware's config.g.

    unit : ``mm`` or ``inch`` of LinuxCNC's lengths; by default what the ini file says

    Raises :class:`InputError` with file and line for what can't be imported.
    """
    text = read_configuration(path)
    if path.suffix.lower() in (".ini", ".hal"):
        return read_linuxcnc(path, text, unit)
    if re.search(r"^\s*\[(printer\]|include\s)", text, re.MULTILINE):
        return read_klipper(path, text)
    if path.suffix.lower() == ".g" or re.search(r"^\s*M66[59]\b", text, re.MULTILINE | re.IGNORECASE):
        return read_reprapfirmware(path, text)
    raise InputError("expected LinuxCNC's .ini or .hal, Klipper's printer.cfg, or RepRapFirmware's config.g", str(path))
