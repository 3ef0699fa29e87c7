"""``parakin linuxcnc``: a configuration for the controller LinuxCNC."""

from __future__ import annotations

from pathlib import Path

from ..controllers import Hardware, Screen
from ..errors import InputError
from .console import announce_compiling, print_json, print_text
from .options import Json, Name, OutputPath, Sizes, load_machine


def linuxcnc(
    name: Name,
    /,
    *,
    output: OutputPath = None,
    hardware: Hardware | None = None,
    screen: Screen = "axis",
    force: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A LinuxCNC configuration that starts: kinematics in C, ini and HAL files, tool table.

    It runs as a simulation without hardware, or is a template for a card; its page, NAME.md, says how to install and
    start it, and what is left to the hand.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    output
        Folder for the files; by default one of the machine's name.
    hardware
        The card that drives the machine; by default none, a simulation.
    screen
        LinuxCNC's screen, beside the window that shows the machine.
    force
        Overwrite files that were edited since parakin wrote them.
    """
    machine = load_machine(name, sizes)
    announce_compiling()
    from ..controllers.linuxcnc.configuration import make_linuxcnc_configuration
    from ..controllers.linuxcnc.stamp import find_edited_files
    from ..export.files import write_files

    folder = Path(machine.name) if output is None else output
    files = make_linuxcnc_configuration(machine, hardware, screen)
    edited = [] if force else find_edited_files(folder, files)
    if edited:
        more = f" (and {', '.join(path.name for path in edited[1:])})" if edited[1:] else ""
        raise InputError(f"not as parakin wrote it{more}; nothing is written, --force overwrites it", str(edited[0]))
    paths = [str(path) for path in write_files(folder, files)]
    if json:
        print_json({"schema": "parakin.linuxcnc/1", "machine": machine.name, "files": paths})
    else:
        print_text("\n".join(paths))
    return 0
