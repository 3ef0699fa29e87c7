"""``parakin linuxcnc``: a configuration for the controller LinuxCNC."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .console import announce_compiling, print_json
from .options import Json, Name, Sizes, load_machine


def linuxcnc(
    name: Name,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A LinuxCNC configuration that starts: kinematics in C, ini and HAL files, tool table.

    It runs as a simulation without hardware; its page, NAME.md, says how to install and start it.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    output
        Folder for the files; by default one of the machine's name.
    """
    machine = load_machine(name, sizes)
    announce_compiling()
    from ..controllers.linuxcnc.configuration import make_linuxcnc_configuration
    from ..export.files import write_files

    files = make_linuxcnc_configuration(machine)
    paths = [str(path) for path in write_files(Path(machine.name) if output is None else output, files)]
    if json:
        print_json({"schema": "parakin.linuxcnc/1", "machine": machine.name, "files": paths})
    else:
        print("\n".join(paths))
    return 0
