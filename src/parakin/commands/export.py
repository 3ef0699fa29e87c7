"""``parakin export``: a machine as a file for another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError
from .console import print_json, print_text
from .options import Json, Name, Sizes, load_machine

if TYPE_CHECKING:
    from ..export.files import Content
    from ..machine import Machine

ENDINGS = {"mjcf": ".xml", "check-move": ".h"}  # of the files, by what can be written

To = Annotated[Literal["mjcf", "check-move"], Parameter(name="--to")]


def export(
    name: Name,
    /,
    *,
    to: To,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine as a file for another program.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    to
        What to write: mjcf, a MuJoCo model with closed loops, limits, masses and a servo for each drive; check-move, a
        small C function for firmware that proves a straight move inside the machine's limits.
    output
        The file; by default the machine's name in this folder.
    """
    machine = load_machine(name, sizes)
    ending = ENDINGS[to]
    output = Path(f"{machine.name}{ending}") if output is None else output
    if output.suffix.lower() != ending:
        raise InputError(f'"{output}": expected a file name that ends in {ending}', "--output")
    from ..export.files import write_files

    write_files(output.parent, {output.name: _render(machine, to)})
    if json:
        print_json({"schema": "parakin.export/1", "machine": machine.name, "to": to, "files": {to: str(output)}})
    else:
        print_text(f"{to}  {output}")
    return 0


def _render(machine: Machine, to: str) -> Content:
    if to == "check-move":
        from ..controllers.move_check.move_check import render_move_check

        return render_move_check(machine)
    from ..export.machine.mjcf import render_mjcf

    return render_mjcf(machine)
