"""``parakin post``: a tool path on a machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError
from .console import Progress, announce_compiling, fixed, print_json, rim, rim_unit, table
from .options import OFF_LIMITS, Json, Mode, Sizes, machine_names, machine_of

if TYPE_CHECKING:
    from ..export.files import Content
    from ..toolpath.result import Offence, Posted

_NOTES = 5  # remarks on the file that are printed


def post(
    part: Path,
    /,
    *,
    machine: Annotated[str, Parameter(name=["--machine", "-m"], completer=machine_names)],
    workpiece: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    mode: Mode = None,
    arc_tolerance: float = 0.01,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path(),
    parquet: bool = False,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """Joints, limits and a report for a tool path.

    Writes PART.joints.csv and PART.report.html. The exit code is 0 if every record is within the machine's limits,
    3 if one is not (the files are written all the same), 2 for input that can't be read.

    Parameters
    ----------
    part
        The CL file, of CATIA (APT) or Siemens NX.
    machine
        A shipped machine's name (see parakin machines) or a YAML file.
    workpiece
        Where the part lies, on top of the file's own frame: x,y,z[,a,b,c] in mm and degrees, or X=10,Z=-1400,C=30.
    arc_tolerance
        How far the lines that replace an arc may lie off it, in mm.
    output
        Folder for the files.
    parquet
        Write PART.joints.parquet too.
    """
    from ..toolpath.frames import parse_workpiece

    chosen = machine_of(machine, sizes)
    frame = None if workpiece is None else parse_workpiece(workpiece)
    if not 0.0 < arc_tolerance < float("inf"):
        raise InputError("expected a length above zero, in mm", "--arc-tolerance")
    announce_compiling()
    from ..export.files import write_all
    from ..export.report import report_html
    from ..toolpath import table as joint_table
    from ..toolpath.cl import read_cl
    from ..toolpath.post import post as post_path

    with Progress() as progress:
        path = read_cl(part, arc_tolerance=arc_tolerance, progress=progress.part("reading", 0.0, 0.2))
        posted = post_path(
            chosen, path, workpiece=frame, mode=mode, progress=progress.part("computing the joints", 0.2, 0.6)
        )
        saying = progress.part("writing the table", 0.7, 0.9 if parquet else 1.0)
        files: dict[str, tuple[str, Content]] = {
            "table": (f"{part.stem}.joints.csv", joint_table.csv_writer(posted, saying))
        }
        if parquet:
            saying = progress.part("writing the table", 0.9, 1.0)
            files["parquet"] = (f"{part.stem}.joints.parquet", joint_table.parquet_writer(posted, saying))
        files["report"] = (f"{part.stem}.report.html", report_html(posted))
        paths = write_all(output, dict(files.values()))
    written = {kind: str(path) for kind, path in zip(files, paths, strict=True)}
    if json:
        print_json(as_json(posted, written))
    else:
        print(summary(posted, written))
    return OFF_LIMITS if posted.off else 0


def summary(posted: Posted, written: dict[str, str]) -> str:
    """The account for people; its last line names the report."""
    path, machine = posted.path, posted.machine
    verdict = "all within the limits"
    if posted.first is not None:
        verdict = f"{posted.off:,} off limits, the first in line {posted.first.line}"
    lines = [f"{path.source} on {machine.name}: {len(path):,} records, {verdict}", ""]
    header = ("joint", "from", "to", "", "limits")
    lines.append(table([_range_row(joint) for joint in _ranges(posted)], header, " rr"))
    lines += ["", *(offence_line(path.source, offence, "record") for offence in posted.offences)]
    lines += [f"{path.source}:{note.line}: note: {note.text}" for note in path.notes[:_NOTES]]
    if len(path.notes) > _NOTES:
        lines.append(f"{len(path.notes) - _NOTES} more notes in the report")
    if lines[-1]:
        lines.append("")
    return "\n".join([*lines, *(f"{kind:<8}{name}" for kind, name in written.items())])


def _range_row(joint: dict[str, Any]) -> tuple[str, ...]:
    def number(value: float | None) -> str:
        return "-" if value is None or value != value else fixed(value, 3)

    def end(value: float) -> str:
        return f"{value:,.3f}".rstrip("0").rstrip(".") if abs(value) < float("inf") else "-"

    limits = f"{end(joint['low'])} to {end(joint['high'])}"
    return joint["joint"], number(joint["min"]), number(joint["max"]), joint["unit"], limits


def _ranges(posted: Posted) -> list[dict[str, Any]]:
    import numpy as np

    rows = []
    for drive, values in zip(posted.machine.model.drives, posted.joints.T, strict=True):
        low, high, least, most = (
            rim(float(v), drive.unit) for v in (drive.low, drive.high, np.fmin.reduce(values), np.fmax.reduce(values))
        )
        rows.append(
            {"joint": drive.name, "unit": rim_unit(drive.unit), "min": least, "max": most, "low": low, "high": high}
        )
    return rows


def offence_line(source: str, offence: Offence, what: str) -> str:
    """``part.cls:214: leg d2 would be 1,533.2 mm, limit 1,520 (12 records)``."""
    several = f" (the worst of {offence.count:,} {what}s)" if offence.count > 1 else ""
    return f"{source}:{offence.line}: {offence.text}{several}"


def offence_json(offence: Offence | None) -> dict[str, Any] | None:
    if offence is None:
        return None
    return {
        "limit": offence.limit,
        "text": offence.text,
        "record": offence.record,
        "line": offence.line,
        "value": rim(offence.value, offence.unit),
        "bound": rim(offence.bound, offence.unit),
        "excess": rim(offence.excess, offence.unit),
        "unit": rim_unit(offence.unit),
        "count": offence.count,
    }


def as_json(posted: Posted, written: dict[str, str]) -> dict[str, Any]:
    """The account for programs: mm and degrees, null where a value does not exist or there is no bound."""
    path = posted.path
    return {
        "schema": "parakin.post/1",
        "part": path.source,
        "machine": posted.machine.name,
        "mode": posted.mode,
        "verdict": "off limits" if posted.off else "ok",
        "records": len(path),
        "off_limits": posted.off,
        "frame": posted.frame.tolist(),
        "joints": _ranges(posted),
        "offences": [offence_json(offence) for offence in posted.offences],
        "first": offence_json(posted.first),
        "worst": offence_json(posted.worst),
        "notes": [{"line": note.line, "text": note.text} for note in path.notes],
        "files": written,
    }
