"""``parakin post``: a tool path on a machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from ..controllers import Target, load_controller
from ..errors import InputError, PoseError
from .console import ProgressBar, announce_compiling, print_json, print_text
from .force_option import parse_cutting_force
from .options import OFF_LIMITS, Json, Mode, Sizes, complete_machine, load_machine
from .part_job import JobOptions, check_clearance, check_turn, prepare_part
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
from .workpiece import parse_workpiece

if TYPE_CHECKING:
    from ..arrays import Array, Writer
    from ..export.files import Content
    from ..toolpath.job import Job
    from ..toolpath.timing.drive_forces import DriveForces
    from .part_job import PreparedPart

Part = Annotated[
    Path,
    Parameter(help="The CL file, of CATIA (APT) or Siemens NX, or a G-code program."),
]
MachineOption = Annotated[
    str,
    Parameter(
        name=["--machine", "-m"],
        completer=complete_machine,
        help="A shipped machine's name (see parakin machines) or a YAML file.",
    ),
]
WorkpieceText = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help=(
            "Where the part lies, on top of the file's own frame: x,y,z[,a,b,c] in mm and degrees, or "
            "X=10,Z=-1400,C=30."
        ),
    ),
]
PlaceBounds = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help=(
            "Find where the part lies best instead, within bounds: X=-100:100,Y=-100:100,C=-180:180; or with its "
            "middle within a length of home along X, Y and Z: 200mm."
        ),
    ),
]
TargetName = Annotated[
    Target | None,
    Parameter(
        help=(
            "Write a program too: linuxcnc, which moves the tool straight (PART.linuxcnc.ngc); joints, for controllers "
            "that know no kinematics (PART.joints.ngc), or one of these by its name, in its own words."
        )
    ),
]
Force = Annotated[
    bool,
    Parameter(
        negative=(),
        help="Write the program even if the path is off limits; its header says so.",
    ),
]
TipTolerance = Annotated[
    float,
    Parameter(help="How far the tool's tip may be off the programmed path, in mm."),
]
AxisTolerance = Annotated[
    float,
    Parameter(help="How far the tool's axis may lean off the programmed one, in degrees."),
]
ArcTolerance = Annotated[
    float,
    Parameter(help="How far the lines that replace an arc may lie off it, in mm."),
]
CornerStyle = Annotated[
    Literal["round", "stop"],
    Parameter(help="Round them within the tolerance, or stop at them."),
]
TurnChoice = Annotated[
    Literal["home", "free"],
    Parameter(
        help=(
            "On a machine with six axes, the turn about the tool's axis: C as at home, or free, chosen along the whole "
            "path for the most margin and then the least time."
        )
    ),
]
Retract = Annotated[
    float | None,
    Parameter(
        name="--rewind",
        help=(
            "Where a turning joint comes to the end of its range, retract the tool by so many mm along its axis, turn "
            "the joint back, and return."
        ),
    ),
]
ClearancePlane = Annotated[
    float | None,
    Parameter(
        name="--clearance",
        allow_leading_hyphen=True,
        help="Z of the workpiece, in mm, above which rapid motions are clear: a turning joint may turn back there.",
    ),
]
CuttingForce = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help=(
            "A force on the tool's tip wherever it cuts, X=-200N,Z=-1kN: the feed keeps the drives' forces and powers "
            "with it, where the machine's file bounds them, and the report tells them."
        ),
    ),
]
Rate = Annotated[
    float | None,
    Parameter(help="Write setpoints too, so many a second: PART.setpoints.csv."),
]
Folder = Annotated[
    Path,
    Parameter(
        name=["--output", "-o"],
        help="Folder for the files.",
    ),
]
Parquet = Annotated[
    bool,
    Parameter(help="Write the tables as .parquet too."),
]
PlayedPage = Annotated[
    bool,
    Parameter(help="Write PART.page.html too, on which the machine moves along the path."),
]
Animation = Annotated[
    bool,
    Parameter(help="Write PART.glb too, the machine's bodies in motion, for Blender and other programs."),
]


def post(
    part: Part,
    /,
    *,
    machine: MachineOption,
    workpiece: WorkpieceText = None,
    place: PlaceBounds = None,
    frame: FrameChoice = "file",
    start: Start = None,
    reference: Reference = None,
    tools: ToolTable = None,
    tool_length: ToolLengthText = None,
    mode: Mode = None,
    target: TargetName = None,
    force: Force = False,
    tolerance: TipTolerance = 0.01,
    angle_tolerance: AxisTolerance = 0.05,
    arc_tolerance: ArcTolerance = 0.01,
    corners: CornerStyle = "round",
    turn: TurnChoice = "home",
    rewind: Retract = None,
    clearance: ClearancePlane = None,
    cutting_force: CuttingForce = None,
    rate: Rate = None,
    output: Folder = Path(),
    parquet: Parquet = False,
    page: PlayedPage = False,
    animation: Animation = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A tool path checked everywhere and timed; joints, a report, and programs for the controller.

    Writes PART.joints.csv and PART.report.html. The exit code is 0 if the machine can run the path, 3 if it can't
    (table and report are written all the same, a program only with --force), 2 for input that can't be read.
    """
    chosen = load_machine(machine, sizes)
    placed = _parse_workpiece_unless_found(workpiece, place)
    _check_tolerances(tolerance, angle_tolerance, arc_tolerance)
    length = parse_tool_length(tool_length, tools)
    check_clearance(rewind, clearance)
    acting = parse_cutting_force(chosen, cutting_force, "--cutting-force")
    announce_compiling()
    from ..export.files import write_files
    from ..toolpath.job import Tolerances
    from ..toolpath.posting.frames import compose_frames
    from .post_summary import summarise_job

    with ProgressBar() as progress:
        path = read_part(
            part, PartOptions(frame, start, reference, tools), arc_tolerance,
            None if place else compose_frames(placed, None), progress.stage("reading", 0.0, 0.1),
        )  # fmt: skip
        check_turn(chosen, path, turn)
        path = replace(fit_part(chosen, path, length, placed), cutting_force=acting)
        tolerances = Tolerances(tolerance, radians(angle_tolerance))
        options = JobOptions(mode, tolerances, target, corners, rewind, clearance, turn)
        prepared = prepare_part(chosen, path, placed, place, options, progress)
        job = prepared.job
        files, missing = _make_files(
            part.stem, prepared, _Wanted(target, force, rate, parquet, page, animation, output), progress
        )
        paths = write_files(output, dict(files.values()))
    written = {kind: str(name) for kind, name in zip(files, paths, strict=True)}
    if json:
        print_json(_encode(prepared, missing, written))
    else:
        print_text(summarise_job(prepared, target, written, missing))
    return 0 if job.runs and not missing else OFF_LIMITS


def _encode(prepared: PreparedPart, missing: list[str], written: dict[str, str]) -> dict[str, Any]:
    from ..export.json.job import encode_job

    return encode_job(
        prepared.job,
        prepared.placement,
        prepared.rewinds,
        prepared.turned,
        prepared.controller_seconds,
        missing,
        written,
    )


def _parse_workpiece_unless_found(workpiece: str | None, place: str | None) -> Array | None:
    if place is not None and workpiece is not None:
        raise InputError("--place finds the workpiece's pose; expected it or --workpiece", "--place")
    return None if workpiece is None else parse_workpiece(workpiece)


def _check_tolerances(tolerance: float, angle_tolerance: float, arc_tolerance: float) -> None:
    lengths = {"--tolerance": tolerance, "--angle-tolerance": angle_tolerance, "--arc-tolerance": arc_tolerance}
    for option, value in lengths.items():
        if not (value > 0.0 and isfinite(value)):
            unit = "an angle above zero, in degrees" if "angle" in option else "a length above zero, in mm"
            raise InputError(f"expected {unit}", option)


@dataclass(frozen=True)
class _Wanted:
    """The options that say which files to write besides the joint table and the report."""

    target: Target | None
    force: bool
    rate: float | None
    parquet: bool
    page: bool
    animation: bool
    folder: Path

    def explain_missing(self, kind: str, reason: str, name: str) -> str:
        """Say why a file can't be made, and that one of an earlier run stays in its place."""
        older = f"; {name} in the folder is of an earlier run" if (self.folder / name).exists() else ""
        return f"no {kind}: {reason}{older}"


def _make_files(
    stem: str, prepared: PreparedPart, wanted: _Wanted, progress: ProgressBar
) -> tuple[dict[str, tuple[str, Content]], list[str]]:
    """Make the requested files, named by kind, and give the reasons for those that can't be made."""
    from ..export.report.report import render_report
    from ..export.tables import joints as joint_table
    from ..export.tables import setpoints as setpoint_table

    job, missing = prepared.job, list[str]()
    posted, trajectory = job.posted, job.trajectory
    saying = progress.stage("writing the tables", 0.7, 0.9)
    files: dict[str, tuple[str, Content]] = {
        "table": (f"{stem}.joints.csv", joint_table.make_joint_csv(posted, saying))
    }
    if wanted.parquet:
        files["parquet"] = (f"{stem}.joints.parquet", joint_table.make_joint_parquet(posted, saying))
    if wanted.rate is not None:
        if trajectory is None:
            missing.append(wanted.explain_missing("setpoints", job.unplanned, f"{stem}.setpoints.csv"))
        else:
            saying = progress.stage("writing the setpoints", 0.9, 1.0)
            content = setpoint_table.make_setpoint_csv(trajectory, wanted.rate, saying)
            files["setpoints"] = (f"{stem}.setpoints.csv", content)
            if wanted.parquet:
                content = setpoint_table.make_setpoint_parquet(trajectory, wanted.rate, saying)
                files["setpoints-parquet"] = (f"{stem}.setpoints.parquet", content)
    if wanted.target is not None:
        name = f"{stem}.{wanted.target}{load_controller(wanted.target).suffix}"
        try:
            files["program"] = (name, _make_program(prepared, wanted.force))
        except PoseError as error:
            missing.append(wanted.explain_missing("program", str(error), name))
    if wanted.page:
        from ..export.page.page import render_path_page

        if len(posted.path):
            files["page"] = (f"{stem}.page.html", render_path_page(posted, trajectory))
        else:
            missing.append(wanted.explain_missing("page", "the file has no motion", f"{stem}.page.html"))
    if wanted.animation:
        name = f"{stem}.glb"
        if trajectory is None:
            missing.append(wanted.explain_missing("animation", job.unplanned, name))
        else:
            from ..export.machine.animated_glb import render_path_glb

            files["animation"] = (name, render_path_glb(trajectory, progress.stage("drawing the motion", 0.9, 1.0)))
    report = render_report(posted, trajectory, job.unplanned, job.waits, job.outside, _measure_forces(job))
    files["report"] = (f"{stem}.report.html", report)
    return files, missing


def _measure_forces(job: Job) -> DriveForces | None:
    """Measure the drives' forces where the tool's is stated, or the machine's file says what its drives can give."""
    drives = job.posted.machine.drives
    said = any(isfinite(value) for drive in drives for value in (drive.force, drive.rated, drive.power))
    if job.trajectory is None or not (said or any(job.posted.path.cutting_force)):
        return None
    from ..toolpath.timing.drive_forces import compute_drive_forces

    return compute_drive_forces(job.trajectory)


def _make_program(prepared: PreparedPart, force: bool) -> Writer:
    from ..toolpath.posting.offence_texts import describe_place

    job, run = prepared.job, prepared.run
    posted = job.posted
    if posted.first is not None and not force:
        raise PoseError("the path is off limits; --force writes it all the same")
    if run is None:
        raise PoseError(job.unplanned)
    broken = "\n".join(f"{describe_place(posted, offence)}: {offence.text}" for offence in posted.offences)
    return run.make_program(broken or None, job.corner_tolerance)
