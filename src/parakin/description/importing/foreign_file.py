"""Recognise the program that a configuration is for, and read its machine."""

from __future__ import annotations

import re
from pathlib import Path

from ...errors import InputError
from .foreign_machine import ForeignMachine
from .klipper import read_klipper
from .linuxcnc import read_linuxcnc
from .reprapfirmware import read_reprapfirmware

_LARGEST = 1 << 22  # bytes of a configuration


def read_foreign_machine(path: Path, unit: str | None = None) -> ForeignMachine:
    """Read a machine from LinuxCNC's ini or HAL file, Klipper's printer.cfg, or RepRapFirmware's config.g.

    unit : ``mm`` or ``inch`` of LinuxCNC's lengths; by default what the ini file says

    Raises :class:`InputError` with file and line for what can't be imported.
    """
    source = str(path)
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError as error:
        raise InputError(f"can't be read: {error.strerror or error}", source) from error
    if len(content) > _LARGEST or b"\0" in content:
        raise InputError("is no configuration in words", source)
    text = content.decode("utf-8", "replace")
    if path.suffix.lower() in (".ini", ".hal"):
        return read_linuxcnc(path, text, unit)
    if re.search(r"^\s*\[printer\]", text, re.MULTILINE):
        return read_klipper(text, source)
    if re.search(r"^\s*M66[59]\b", text, re.MULTILINE | re.IGNORECASE):
        return read_reprapfirmware(text, source)
    raise InputError("expected LinuxCNC's .ini or .hal, Klipper's printer.cfg, or RepRapFirmware's config.g", source)
