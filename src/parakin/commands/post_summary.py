"""The account of ``parakin post``, for people and for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .console import fixed, rim, rim_unit, table
from .offences import offence_json, offence_line

if TYPE_CHECKING:
    from ..toolpath.job import Job
    from ..toolpath.placing.placement import Placement
    from ..toolpath.posting.posted import Posted

_NOTES = 5  # remarks on the file that are printed
_BINDING = 4  # limits that are named of those that bind
_SHARE = 0.005  # of the time: what binds for less is not named


def summary(
    job: Job, target: str | None, written: dict[str, str], placement: Placement | None, missing: list[str]
) -> str:
    """The account for people; its last lines name the files."""
    from ..toolpath.posting.offences import describe_place

    posted = job.posted
    path = posted.path
    count = f"{len(job.programmed.path):,} records"
    if job.inserted:
        count += f" and {job.inserted:,} inserted"
    lines = [f"{path.source} on {posted.machine.name}: {count}, {_verdict(posted)}", ""]
    if placement is not None:
        lines += [_placed(placement), ""]
    header = ("joint", "from", "to", "", "limits")
    lines += [
        table([_range_row(joint) for joint in _ranges(posted)], header, " rr"),
        "",
        *_timed(job, target if "program" in written else None),
        "",
    ]
    lines += [offence_line(describe_place(posted, offence), offence, "record") for offence in posted.offences]
    if posted.rewinds:
        places = ", ".join(str(int(path.line[record])) for record in posted.rewinds[:_NOTES])
        more = " ..." if len(posted.rewinds) > _NOTES else ""
        lines.append(f"{path.source}: note: a turning joint is turned back in rapid to line {places}{more}")
    lines += [f"{_at(path.source, note.line)}: note: {note.text}" for note in path.notes[:_NOTES]]
    if len(path.notes) > _NOTES:
        lines.append(f"{len(path.notes) - _NOTES} more notes in the report")
    lines += missing
    if lines[-1]:
        lines.append("")
    width = max(len(kind) for kind in written) + 2
    return "\n".join([*lines, *(f"{kind:<{width}}{name}" for kind, name in written.items())])


def _at(source: str, line: int) -> str:
    return f"{source}:{line}" if line else source


def _verdict(posted: Posted) -> str:
    if posted.first is None:
        return "all within the limits, and between them"
    counts = [(posted.broken_record_count, "off limits"), (posted.broken_motion_count, "off limits on the way there")]
    said = " and ".join(f"{count:,} {what}" for count, what in counts if count)
    return f"{said}, the first in line {posted.first.line}"


def _placed(placement: Placement) -> str:
    values = ",".join(f"{axis}={rim(value, _unit(axis)):.6g}" for axis, value in placement.values.items())
    if placement.allowed:
        return f"best placement --workpiece {values}: {placement.margin:.1%} of half a range left to {placement.limit}"
    return (
        f"no placement within these bounds is allowed; the nearest is --workpiece {values}: "
        f"{-placement.margin:.1%} of half a range beyond {placement.limit}"
    )


def _unit(axis: str) -> str:
    return "mm" if axis in "XYZ" else "rad"


def _timed(job: Job, target: str | None) -> list[str]:
    from ..export.report.cards import duration

    if job.trajectory is None or job.seconds is None:
        return [f"no cycle time: {job.unplanned}"]
    text = f"cycle time {duration(job.seconds)}"
    if job.waits:
        text += f", of which the program waits {job.waits:g} s"
    bound = [f"{name} {share:.0%}" for name, share in job.trajectory.shares.items() if share >= _SHARE][:_BINDING]
    text += f"; bound by {', '.join(bound)}" if bound else ""
    if target != "linuxcnc":
        return [text]
    from ..controllers import program_seconds

    return [
        text,
        f"about {duration(program_seconds(job.trajectory) + job.waits)} under LinuxCNC, from the first record on",
    ]


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


def as_json(job: Job, written: dict[str, str], placement: Placement | None, missing: list[str]) -> dict[str, Any]:
    """The account for programs: mm, degrees and s, null where a value does not exist or there is no bound."""
    posted, trajectory = job.posted, job.trajectory
    path = posted.path
    return {
        "schema": "parakin.post/1",
        "part": path.source,
        "machine": posted.machine.name,
        "mode": posted.mode,
        "verdict": "ok" if job.runs else "off limits" if posted.first is not None else "no law",
        "records": len(path),
        "inserted": job.inserted,
        "off_limits": posted.broken_record_count,
        "motions_off_limits": posted.broken_motion_count,
        "frame": posted.frame.tolist(),
        "placement": None if placement is None else _placement_json(placement),
        "joints": _ranges(posted),
        "seconds": job.seconds,
        "waits": job.waits,
        "bound_by": {} if trajectory is None else trajectory.shares,
        "rewinds": list(posted.rewinds),
        "offences": [offence_json(offence) for offence in posted.offences],
        "first": offence_json(posted.first),
        "worst": offence_json(posted.worst),
        "notes": [{"line": note.line, "text": note.text} for note in path.notes],
        "missing": missing,
        "files": written,
    }


def _placement_json(placement: Placement) -> dict[str, Any]:
    return {
        "workpiece": {axis: rim(value, _unit(axis)) for axis, value in placement.values.items()},
        "margin": placement.margin,
        "limit": placement.limit,
        "record": placement.record,
        "tried": placement.tried,
    }
