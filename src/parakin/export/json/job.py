"""A job as an object for JSON, ``parakin.post/1``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from ...toolpath.placing.outside import Outside, describe_outside, format_option
from ...units import AXIS_UNITS, name_display_unit, to_display
from .offence import encode_offence

if TYPE_CHECKING:
    from ...arrays import Array
    from ...toolpath.job import Job
    from ...toolpath.linearise.rewinds import Rewind
    from ...toolpath.path import ToolUse
    from ...toolpath.placing.placement import Placement
    from ...toolpath.posting.posted import Posted
    from ...toolpath.turned_job import TurnedJob


def encode_job(
    job: Job,
    placement: Placement | None,
    rewinds: Sequence[Rewind],
    turned: TurnedJob | None,
    controller_seconds: float | None,
    missing: Sequence[str],
    files: Mapping[str, str],
) -> dict[str, Any]:
    """Encode a job, its placement, rewinds and turn that were found, why files are missing, and files by their kinds.

    controller_seconds : what the program's controller takes, s; None without one that says so
    """
    posted, trajectory = job.posted, job.trajectory
    path, first, worst = posted.path, posted.first, posted.worst
    return {
        "schema": "parakin.post/1",
        "part": path.source,
        "machine": posted.machine.name,
        "mode": posted.mode,
        "verdict": "ok" if job.runs else "off limits" if first is not None else "no trajectory",
        "records": len(path),
        "inserted": job.inserted,
        "off_limits": posted.broken_record_count,
        "motions_off_limits": posted.broken_motion_count,
        "frame": posted.frame.tolist(),
        "file_frame": None if job.programmed.path.frame is None else job.programmed.path.frame.tolist(),
        "tool_length": path.fitted_length,
        "tools": [_encode_tool(use) for use in path.tools],
        "placement": None if placement is None else _encode_placement(placement, job.runs),
        "joints": encode_joint_ranges(posted),
        "seconds": job.seconds,
        "controller_seconds": controller_seconds,
        "waits": job.waits,
        "bound_by": {} if trajectory is None else trajectory.binding_fractions,
        "rewinds": [
            {"line": rewind.line, "joint": rewind.joint, "turns": rewind.turns, "retract": rewind.retract}
            for rewind in rewinds
        ],
        "turn": None if turned is None else _encode_turn(turned),
        "offences": [encode_offence(offence) for offence in posted.offences],
        "outside": None if job.outside is None else _encode_outside(job.outside),
        "first": None if first is None else encode_offence(first),
        "worst": None if worst is None else encode_offence(worst),
        "notes": [{"line": note.line, "text": note.text} for note in path.notes],
        "missing": list(missing),
        "files": dict(files),
    }


def _encode_turn(turned: TurnedJob) -> dict[str, Any]:
    """Encode whether the turn about the tool's axis was chosen, C's range, and what it gained against C as at home."""
    home = turned.home
    return {
        "chosen": turned.is_chosen,
        "C": [to_display(end, "rad") for end in (turned.low, turned.high)],
        "margin": _encode_finite(turned.margin),
        "home_margin": _encode_finite(turned.home_margin),
        "home_seconds": home.seconds,
        "home_runs": home.runs,
    }


def _encode_finite(number: float) -> float | None:
    return number if isfinite(number) else None


def _encode_outside(outside: Outside) -> dict[str, Any]:
    """Encode where a path and the workspace are, by axis, and the workpiece that would bring the one into the other."""

    def encode_bounds(bounds: Array) -> dict[str, list[float]]:
        return {letter: ends.tolist() for letter, ends in zip("XYZ", bounds.T, strict=True) if ends[0] == ends[0]}

    values = {axis: to_display(value, AXIS_UNITS[axis]) for axis, value in outside.workpiece.items()}
    return {
        "text": describe_outside(outside),
        "path": encode_bounds(outside.path),
        "workspace": encode_bounds(outside.workspace),
        "workpiece": values,
        "option": format_option(outside),
        "off_limits_there": outside.broken,
    }


def _encode_tool(use: ToolUse) -> dict[str, Any]:
    """Encode a tool with the length that counts; a cutter's length is without its holder. Lengths are mm."""
    data = {key: value for key, value in use.data.items() if key not in ("length", "set_length")}
    cutter = use.data.get("length")
    return {"record": use.record, "line": use.line, "length": use.length, "cutter_length": cutter, **data}


def encode_joint_ranges(posted: Posted) -> list[dict[str, Any]]:
    """Encode what a path uses of each joint's range: its least and greatest value, and the range's ends."""
    rows = []
    for drive, values in zip(posted.machine.drives, posted.joints.T, strict=True):
        ends = (drive.low, drive.high, np.fmin.reduce(values), np.fmax.reduce(values))
        low, high, least, most = (to_display(float(end), drive.unit) for end in ends)
        rows.append(
            {
                "joint": drive.name,
                "unit": name_display_unit(drive.unit),
                "min": least,
                "max": most,
                "low": low,
                "high": high,
            }
        )
    return rows


def _encode_placement(placement: Placement, runs: bool) -> dict[str, Any]:
    """Encode a placement, whether its records keep the limits there, and whether the whole job runs there."""
    return {
        "runs": runs,
        "allowed": placement.allowed,
        "workpiece": {axis: to_display(value, AXIS_UNITS[axis]) for axis, value in placement.values.items()},
        "margin": placement.margin,
        "limit": placement.limit,
        "record": placement.record,
        "tried": placement.tried,
    }
