"""``parakin post``: a tool path on a machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError, PoseError
from .console import Progress, announce_compiling, print_json
from .options import OFF_LIMITS, Json, Mode, Sizes, machine_names, machine_of
from .workpiece import parse_bounds, parse_workpiece

if TYPE_CHECKING:
    from ..export.files import Content
    from ..machine import Machine
    from ..toolpath.job import Job
    from ..toolpath.path import ToolPath
    from ..toolpath.placing.placement import Placement


def post(
    part: Path,
    /,
    *,
    machine: Annotated[str, Parameter(name=["--machine", "-m"], completer=machine_names)],
    workpiece: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    place: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    mode: Mode = None,
    target: Literal["linuxcnc", "joints"] | None = None,
    force: Annotated[bool, Parameter(negative=())] = False,
    tolerance: float = 0.01,
    angle_tolerance: float = 0.05,
    arc_tolerance: float = 0.01,
    corners: Literal["round", "stop"] = "round",
    rate: float | None = None,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path(),
    parquet: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """A tool path checked everywhere and timed; joints, a report, and programs for the controller.

    Writes PART.joints.csv and PART.report.html. The exit code is 0 if the machine can run the path, 3 if it can't
    (table and report are written all the same, a program only with --force), 2 for input that can't be read.

    Parameters
    ----------
    part
        The CL file, of CATIA (APT) or Siemens NX, or a G-code program.
    machine
        A shipped machine's name (see parakin machines) or a YAML file.
    workpiece
        Where the part lies, on top of the file's own frame: x,y,z[,a,b,c] in mm and degrees, or X=10,Z=-1400,C=30.
    place
        Find where the part lies best instead, within bounds: X=-100:100,Y=-100:100,C=-180:180.
    target
        Write a program too: linuxcnc, which moves the tool straight (PART.linuxcnc.ngc), or joints, for controllers
        that know no kinematics (PART.joints.ngc).
    force
        Write the program even if the path is off limits; its header says so.
    tolerance
        How far the tool's tip may be off the programmed path, in mm.
    angle_tolerance
        How far the tool's axis may lean off the programmed one, in degrees.
    arc_tolerance
        How far the lines that replace an arc may lie off it, in mm.
    corners
        Round them within the tolerance, or stop at them.
    rate
        Write setpoints too, so many a second: PART.setpoints.csv.
    output
        Folder for the files.
    parquet
        Write the tables as .parquet too.
    """
    from math import isfinite, radians

    from ..toolpath.posting.frames import compose_frames

    chosen = machine_of(machine, sizes)
    if place is not None and workpiece is not None:
        raise InputError("--place finds the workpiece's pose; expected it or --workpiece", "--place")
    frame = None if workpiece is None else parse_workpiece(workpiece)
    lengths = {"--tolerance": tolerance, "--angle-tolerance": angle_tolerance, "--arc-tolerance": arc_tolerance}
    for option, value in lengths.items():
        if not (value > 0.0 and isfinite(value)):
            unit = "an angle above zero, in degrees" if "angle" in option else "a length above zero, in mm"
            raise InputError(f"expected {unit}", option)
    announce_compiling()
    from ..export.files import write_all
    from ..toolpath.job import Tolerances, prepare
    from ..toolpath.reading.detect import read_path
    from .post_summary import as_json, summary

    with Progress() as progress:
        path = read_path(
            part, arc_tolerance=arc_tolerance, workpiece=None if place else compose_frames(frame, None),
            progress=progress.part("reading", 0.0, 0.1),
        )  # fmt: skip
        placement = None
        if place is not None:
            placement = _placement(chosen, path, place, mode, progress)
            frame, mode = placement.workpiece, placement.mode
        job = prepare(
            chosen, path, workpiece=frame, mode=mode, target=target or "linuxcnc",
            tolerances=Tolerances(tolerance, radians(angle_tolerance)), corners=corners,
            progress=progress.part("checking and timing", 0.3, 0.7),
        )  # fmt: skip
        files, missing = _contents(part.stem, job, target, force, rate, parquet, progress)
        paths = write_all(output, dict(files.values()))
    written = {kind: str(name) for kind, name in zip(files, paths, strict=True)}
    if json:
        print_json(as_json(job, written, placement, missing))
    else:
        print(summary(job, target, written, placement, missing))
    return 0 if job.runs and not missing else OFF_LIMITS


def _placement(machine: Machine, path: ToolPath, place: str, mode: str | None, progress: Progress) -> Placement:
    from ..toolpath.placing.placement import find_placement

    return find_placement(
        machine, path, parse_bounds(place), mode=mode, progress=progress.part("placing the part", 0.1, 0.3)
    )


def _contents(
    stem: str,
    job: Job,
    target: str | None,
    force: bool,
    rate: float | None,
    parquet: bool,
    progress: Progress,
) -> tuple[dict[str, tuple[str, Content]], list[str]]:
    """The files by their kinds, with their names; and why some that were asked for are not among them."""
    from ..export.report.report import report_html
    from ..export.tables import joints as joint_table
    from ..export.tables import setpoints as setpoint_table

    posted, trajectory, missing = job.posted, job.trajectory, list[str]()
    saying = progress.part("writing the tables", 0.7, 0.9)
    files: dict[str, tuple[str, Content]] = {"table": (f"{stem}.joints.csv", joint_table.csv_writer(posted, saying))}
    if parquet:
        files["parquet"] = (f"{stem}.joints.parquet", joint_table.parquet_writer(posted, saying))
    if rate is not None:
        if trajectory is None:
            missing.append(f"no setpoints: {job.unplanned}")
        else:
            saying = progress.part("writing the setpoints", 0.9, 1.0)
            files["setpoints"] = (f"{stem}.setpoints.csv", setpoint_table.setpoints_csv(trajectory, rate, saying))
            if parquet:
                writer = setpoint_table.setpoints_parquet(trajectory, rate, saying)
                files["setpoints-parquet"] = (f"{stem}.setpoints.parquet", writer)
    if target is not None:
        try:
            files["program"] = (f"{stem}.{target}.ngc", _program(job, target, force))
        except PoseError as error:
            missing.append(f"no program: {error}")
    files["report"] = (f"{stem}.report.html", report_html(posted, trajectory, job.unplanned, job.waits))
    return files, missing


def _program(job: Job, target: str, force: bool) -> Content:
    from ..controllers import joint_program, linuxcnc_program
    from ..toolpath.posting.offences import describe_place

    posted = job.posted
    if posted.first is not None and not force:
        raise PoseError("the path is off limits; --force writes it all the same")
    if job.trajectory is None:
        raise PoseError(job.unplanned)
    broken = "\n".join(f"{describe_place(posted, offence)}: {offence.text}" for offence in posted.offences)
    if target == "joints":
        return joint_program(job.trajectory, forced=broken or None)
    return linuxcnc_program(job.trajectory, forced=broken or None, tolerance=job.corner_tolerance)
