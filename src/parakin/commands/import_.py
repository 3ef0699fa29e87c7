"""``parakin import``: a machine file from another program's configuration."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Literal

from ..errors import InputError
from .console import print_json, print_text
from .options import YAML_ENDINGS, Json, OutputPath, require_ending


def import_machine(
    file: Path,
    /,
    *,
    output: OutputPath = None,
    units: Literal["mm", "inch"] | None = None,
    json: Json = False,
) -> int:
    """Import a machine from the configuration of LinuxCNC, Klipper or RepRapFirmware.

    Parameters
    ----------
    file
        LinuxCNC's .ini or .hal (genhexkins, pentakins, tripodkins, lineardeltakins, rotarydeltakins), Klipper's
        printer.cfg (delta, rotary_delta), or RepRapFirmware's config.g (linear delta).
    output
        The machine file, .yaml; by default the configuration's name in this folder.
    units
        Of LinuxCNC's lengths, where no ini file says it.
    """
    from ..description.importing import format_machine_yaml, read_foreign_machine

    machine = read_foreign_machine(file, units)
    output = Path(f"{file.stem}.yaml") if output is None else output
    require_ending(output, YAML_ENDINGS)
    text = format_machine_yaml(machine, _make_word(output.stem))
    with tempfile.TemporaryDirectory() as folder:  # what is written is a machine
        trial = Path(folder) / output.name
        trial.write_text(text, encoding="utf-8")
        try:
            from .. import load

            load(trial)
        except InputError as error:
            raise InputError(f"makes no machine that works: {error.message}", str(file)) from None
    from ..export.files import write_files

    write_files(output.parent, {output.name: text})
    if json:
        print_json(
            {
                "schema": "parakin.import/1",
                "program": machine.program,
                "kinematics": machine.kinematics,
                "files": {"machine": str(output)},
                "missing": list(machine.missing),
            }
        )
    else:
        print_text(f"{machine.kinematics} of {machine.program}  {output}")
        if machine.missing:
            print_text(f"not there, so not read: {', '.join(machine.missing)}")
    return 0


def _make_word(text: str) -> str:
    """Make a plain word of a file's name."""
    word = "".join(letter if letter.isascii() and (letter.isalnum() or letter == "_") else "_" for letter in text)
    return word if word[:1].isalpha() else f"machine_{word}"
