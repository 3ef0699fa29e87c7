"""``parakin page``: a machine as one HTML file on which it moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import InputError
from .console import print_json, print_text
from .options import Json, Name, Sizes, load_machine


def page(
    name: Name,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    force: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine as one HTML file on which it moves, to open from a disk without a network.

    Drag the tool, a strut or a slider: limits colour the struts and are named where they stop it; working and assembly
    modes can be switched; near a singularity the free motion is drawn.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    output
        The file, an .html; by default the machine's name in this folder.
    force
        Overwrite a file that parakin did not write.
    """
    machine = load_machine(name, sizes)
    output = Path(f"{machine.name}.html") if output is None else output
    if output.suffix.lower() != ".html":
        raise InputError(f'"{output}": expected a file name that ends in .html', "--output")
    from ..export.files import write_files
    from ..export.page.page import is_page, render_machine_page

    if not force and output.exists() and not is_page(output):
        raise InputError("no page that parakin wrote; nothing is written, --force overwrites it", str(output))
    write_files(output.parent, {output.name: render_machine_page(machine)})
    if json:
        print_json({"schema": "parakin.page/1", "machine": machine.name, "files": {"page": str(output)}})
    else:
        print_text(f"page  {output}")
    return 0
