"""``parakin forces``: what a part asks of the drives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..errors import InputError
from ..export.figure_file import PICTURES
from ..export.number_format import format_fixed, format_use
from .console import ProgressBar, announce_compiling, format_table, print_json, print_remark, print_text
from .force_option import parse_cutting_force
from .options import OFF_LIMITS, Json, Mode, Name, OutputPath, Sizes, load_machine, require_ending
from .part_options import (
    FrameChoice,
    PartOptions,
    Reference,
    Start,
    ToolLengthText,
    ToolTable,
    fit_part,
    parse_tool_length,
    read_part,
)
from .post import ArcTolerance, CornerStyle, WorkpieceText
from .workpiece import parse_workpiece

if TYPE_CHECKING:
    from ..model.elements import BodyBuild
    from ..toolpath.timing.drive_forces import DriveForces


def forces(
    name: Name,
    part: Path,
    /,
    *,
    workpiece: WorkpieceText = None,
    force: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    frame: FrameChoice = "file",
    start: Start = None,
    reference: Reference = None,
    tools: ToolTable = None,
    tool_length: ToolLengthText = None,
    mode: Mode = None,
    arc_tolerance: ArcTolerance = 0.01,
    corners: CornerStyle = "round",
    csv: Path | None = None,
    output: OutputPath = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """The drives' forces, torques and powers along a part, from the masses of all that moves.

    The exit code is 3 if the machine can't run the part, or a drive would have to give more than its file says.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    part
        The CL file, of CATIA (APT) or Siemens NX, or a G-code program.
    force
        A force on the tool's tip wherever it cuts, not in rapid: X=-200N,Z=-1kN. Where the machine's file bounds forces
        or powers, the feed keeps them with it.
    csv
        A table to write: forces and powers of each drive over the time.
    output
        A figure to write, .png, .pdf or .svg: the same as curves.
    """
    machine = load_machine(name, sizes)
    _check_options(output, csv, arc_tolerance)
    acting, placed = (
        parse_cutting_force(machine, force, "--force"),
        None if workpiece is None else parse_workpiece(workpiece),
    )
    length = parse_tool_length(tool_length, tools)
    announce_compiling()
    from ..toolpath.job import prepare
    from ..toolpath.posting.frames import compose_frames
    from ..toolpath.timing.drive_forces import compute_drive_forces

    with ProgressBar() as progress:
        options = PartOptions(frame, start, reference, tools)
        saying = progress.stage("reading", 0.0, 0.1)
        path = read_part(part, options, arc_tolerance, compose_frames(placed, None), saying)
        path = replace(fit_part(machine, path, length, placed), cutting_force=acting)
        saying = progress.stage("checking and timing", 0.1, 0.9)
        job = prepare(machine, path, workpiece=placed, mode=mode, corners=corners, progress=saying)
    if job.trajectory is None or job.posted.first is not None:
        reason = job.unplanned if job.posted.first is None else "off limits"
        print_remark(f"{part}: {reason}; parakin post tells more")
        return OFF_LIMITS
    result = compute_drive_forces(job.trajectory)
    files = _write(result, csv, output)
    if json:
        from ..export.json.drive_forces import encode_drive_forces

        print_json(encode_drive_forces(result, files))
    else:
        print_text("\n".join([_format_forces(result), *(f"{kind}  {path}" for kind, path in files.items())]))
    return OFF_LIMITS if result.overloaded else 0


def _check_options(output: Path | None, csv: Path | None, arc_tolerance: float) -> None:
    require_ending(output, PICTURES)
    require_ending(csv, (".csv",), "--csv")
    if not arc_tolerance > 0.0:
        raise InputError("expected a length above zero, in mm", "--arc-tolerance")


def _write(result: DriveForces, csv: Path | None, output: Path | None) -> dict[str, str]:
    from ..export.files import write_files

    files = {}
    if csv is not None:
        from ..export.tables.drive_forces import format_drive_forces_csv

        write_files(csv.parent, {csv.name: format_drive_forces_csv(result)})
        files["table"] = str(csv)
    if output is not None:
        from ..export.force_curves import render_drive_forces

        write_files(output.parent, {output.name: render_drive_forces(result, output.suffix.lower())})
        files["figure"] = str(output)
    return files


def _format_forces(result: DriveForces) -> str:
    machine, trajectory = result.trajectory.posted.machine, result.trajectory
    rows = []
    for i, drive in enumerate(machine.drives):
        scale, name = (1e-3, "Nm") if drive.unit == "rad" else (1.0, "N")
        peak = format_use(scale * float(result.peaks[i]), scale * drive.force, name)
        rms = format_use(scale * float(result.rms[i]), scale * drive.rated, name)
        power = format_use(float(result.peak_powers[i]), 1e-3 * drive.power, "W")
        rows.append([drive.name, peak, rms, power, result.describe_peak(i)])
    masses = ", ".join(f"{kind} {format_fixed(mass, 1)}" for kind, mass in result.masses.items())
    drawn = [kind for kind in result.masses if not _is_stated(machine.bodies.get(kind))]
    lines = [
        f"{machine.name}: the drives on {trajectory.posted.path.source}, {format_fixed(trajectory.seconds, 2)} s\n",
        format_table(rows, ["", "peak", "rms", "peak power", "peak at"], " rrr "),
        "",
        f"{format_fixed(sum(result.masses.values()), 1)} kg move: {masses}",
    ]
    if drawn:
        lines.append(f"as thick as drawn, for the machine's file does not say: {', '.join(drawn)}")
    rotors = "" if any(drive.inertia for drive in machine.drives) else " and motors' rotors"
    lines.append(f"without friction{rotors}")
    if result.overloaded:
        lines.append(f"more than the drives can: {', '.join(result.overloaded)}")
    return "\n".join(lines)


def _is_stated(build: BodyBuild | None) -> bool:
    return build is not None and (build.mass is not None or build.diameter is not None)
