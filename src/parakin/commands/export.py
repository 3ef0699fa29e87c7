"""``parakin export``: a machine as a file for another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError
from .console import print_json, print_remark, print_text
from .options import OFF_LIMITS, Json, Name, OutputPath, Sizes, load_machine, require_ending
from .values import parse_row

if TYPE_CHECKING:
    from ..arrays import Array
    from ..controllers.move_check.move_check import Firmware
    from ..export.files import Content
    from ..machine import Machine

ExportFormat = Literal[
    "mjcf",
    "urdf",
    "glb",
    "stl",
    "klipper",
    "reprapfirmware",
    "check-move",
    "check-move-klipper",
    "check-move-grblhal",
    "check-move-fluidnc",
    "check-move-reprapfirmware",
]

_ENDINGS: dict[ExportFormat, str] = {
    "mjcf": ".xml",
    "urdf": ".urdf",
    "glb": ".glb",
    "stl": ".stl",
    "klipper": ".cfg",
    "reprapfirmware": ".g",
    "check-move": ".h",
    "check-move-klipper": ".py",
    "check-move-grblhal": ".c",
    "check-move-fluidnc": ".h",
    "check-move-reprapfirmware": ".h",
}
_POSED = ("glb", "stl")
_FIRMWARES: dict[ExportFormat, Firmware] = {
    "check-move-klipper": "Klipper",
    "check-move-grblhal": "grblHAL",
    "check-move-fluidnc": "FluidNC",
    "check-move-reprapfirmware": "RepRapFirmware",
}


def export(
    name: Name,
    /,
    *,
    to: Annotated[ExportFormat, Parameter(name="--to")],
    at: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    output: OutputPath = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A machine as a file for another program.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    to
        What to write: mjcf, a MuJoCo model with closed loops, limits, masses and a servo for each drive; urdf, its
        tree, and its loops in a JSON file beside it; glb and stl, a mesh of its parts at a pose; klipper and
        reprapfirmware, a delta's sizes in that firmware's words; check-move, a small C function for firmware that
        proves a straight move inside the machine's limits, and check-move-klipper, -grblhal, -fluidnc and
        -reprapfirmware, what makes that firmware refuse a move that it does not prove.
    at
        The pose of a mesh: X=10,Z=-1400 or all values in order, mm and degrees; the rest is home's. By default home.
        The exit code is 3, and nothing is written, where it is out of reach.
    output
        The file; by default the machine's name in this folder.
    """
    machine = load_machine(name, sizes)
    ending = _ENDINGS[to]
    output = Path(f"{machine.name}{ending}") if output is None else output
    require_ending(output, (ending,))
    if at is not None and to not in _POSED:
        raise InputError(f"{to} has no pose, only {' and '.join(_POSED)} have one", "--at")
    pose = None if at is None else parse_row(at.split(","), machine.axes, machine.axis_units, machine.home, "--at")
    import numpy as np

    from ..export.files import write_files

    if pose is not None and not np.isfinite(machine.inverse(pose)).all():
        print_remark(f"--at: out of reach: {machine.limits[int(machine.check(pose)) - 1]}")
        return OFF_LIMITS
    files = _render(machine, to, output, pose)
    write_files(output.parent, files)
    written = {"loops" if name != output.name else to: str(output.parent / name) for name in files}
    if json:
        print_json({"schema": "parakin.export/1", "machine": machine.name, "to": to, "files": written})
    else:
        print_text("\n".join(f"{kind}  {name}" for kind, name in written.items()))
    return 0


def _render(machine: Machine, to: ExportFormat, output: Path, pose: Array | None) -> dict[str, Content]:
    """Render the files by their names; the output's own comes first."""
    from ..controllers.move_check import move_check
    from ..export.machine import firmware, mjcf, posed_mesh, urdf

    if to == "urdf":
        tree, loops = urdf.render_urdf(machine)
        return {output.name: tree, f"{output.stem}_loops.json": loops}
    if to == "glb":
        return {output.name: posed_mesh.render_glb(machine, pose)}
    if to == "stl":
        return {output.name: posed_mesh.render_stl(machine, pose)}
    render = {
        "mjcf": mjcf.render_mjcf,
        "klipper": firmware.render_klipper,
        "reprapfirmware": firmware.render_reprapfirmware,
        "check-move": move_check.render_move_check,
    }
    if to in _FIRMWARES:
        return {output.name: move_check.render_firmware_check(machine, _FIRMWARES[to])}
    return {output.name: render[to](machine)}
