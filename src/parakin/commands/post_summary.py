"""The summary of ``parakin post`` for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..controllers import Target, load_controller
from ..export.number_format import format_duration, format_fixed
from ..units import to_display
from .console import format_table
from .offences import format_offence

if TYPE_CHECKING:
    from ..toolpath.job import Job
    from ..toolpath.placing.placement import Placement
    from ..toolpath.turned_job import TurnedJob
    from .part_job import PreparedPart

_NOTES = 5  # remarks on the file that are printed
_BINDING = 4  # limits that are named of those that bind
_LEAST_FRACTION = 0.005  # what binds for less than this fraction of the time is not named


def summarise_job(prepared: PreparedPart, target: Target | None, written: dict[str, str], missing: list[str]) -> str:
    """Summarise a job; the last lines name the files."""
    from ..export.json.job import encode_joint_ranges
    from ..toolpath.placing.outside import describe_outside
    from ..toolpath.posting.offence_texts import describe_place
    from ..toolpath.posting.setup_texts import describe_setup

    job, placement = prepared.job, prepared.placement
    posted = job.posted
    path = posted.path
    records = len(job.programmed.path)
    count = f"{records:,} record{'s' * (records != 1)}"
    if job.inserted:
        count += f" and {job.inserted:,} inserted"
    lines = [f"{path.source} on {posted.machine.name}: {count}, {_format_verdict(job)}", ""]
    if placement is not None:
        lines += [_format_placement(placement, prepared.turned is not None, job.runs), ""]
    lines += [*describe_setup(posted), ""]
    if prepared.turned is not None:
        lines += [_format_turn(prepared.turned), ""]
    header = ("joint", "from", "to", "", "limits")
    lines += [
        format_table([_format_range(joint) for joint in encode_joint_ranges(posted)], header, " rr"),
        "",
        *_format_times(prepared, target if "program" in written else None),
        "",
    ]
    if job.outside is not None:
        lines.append(f"{path.source}: {describe_outside(job.outside)}")
    else:
        lines += [format_offence(describe_place(posted, offence), offence, "record") for offence in posted.offences]
    lines += [f"{_format_place(path.source, note.line)}: note: {note.text}" for note in path.notes[:_NOTES]]
    if len(path.notes) > _NOTES:
        lines.append(f"{len(path.notes) - _NOTES} more notes in the report")
    lines += missing
    if lines[-1]:
        lines.append("")
    width = max(len(kind) for kind in written) + 2
    return "\n".join([*lines, *(f"{kind:<{width}}{name}" for kind, name in written.items())])


def _format_place(source: str, line: int) -> str:
    return f"{source}:{line}" if line else source


def _format_verdict(job: Job) -> str:
    posted = job.posted
    if posted.first is None:
        return "all within the limits, and between them" + ("" if job.runs else ", but it does not run")
    counts = [(posted.broken_record_count, "off limits"), (posted.broken_motion_count, "off limits on the way there")]
    verdict = " and ".join(f"{count:,} {what}" for count, what in counts if count)
    return f"{verdict}, the first in line {posted.first.line}"


def _format_placement(placement: Placement, is_turned: bool, runs: bool) -> str:
    """Format a placement with its margin, or without where the turn, which has a line of its own, tells another."""
    values = placement.format_values()
    if placement.allowed and not runs:
        return f"no placement was found at which the path runs; best for its records alone is --workpiece {values}"
    if is_turned:
        return f"best placement --workpiece {values}"
    if placement.allowed:
        return f"best placement --workpiece {values}: {placement.margin:.1%} of half a range left to {placement.limit}"
    return (
        f"no placement within these bounds is allowed; the nearest is --workpiece {values}: "
        f"{-placement.margin:.1%} of half a range beyond {placement.limit}"
    )


def _format_turn(turned: TurnedJob) -> str:
    """Format the range of C that was chosen, and what it gained against C as at home."""
    if not turned.is_chosen:
        better = "leaves more margin or takes less time" if turned.home.runs else "keeps the limits"
        return f"turn about the tool: C as at home, for no other was found that {better}"
    low, high = (to_display(end, "rad") for end in (turned.low, turned.high))

    def describe(job: Job, margin: float) -> str:
        left = f"{margin:.1%} of half a range left" if margin >= 0.0 else "off limits"
        return left if job.seconds is None or not job.runs else f"{left} in {format_duration(job.seconds)}"

    chosen, home = describe(turned.job, turned.margin), describe(turned.home, turned.home_margin)
    return f"turn about the tool chosen, C from {low:.1f} to {high:.1f}°: {chosen}; with C as at home: {home}"


def _format_times(prepared: PreparedPart, target: Target | None) -> list[str]:
    """Format the cycle time, and the controller's time if it differs."""
    job, seconds = prepared.job, prepared.controller_seconds
    if job.trajectory is None or job.seconds is None:
        return [f"no cycle time: {job.unplanned}"]
    text = f"cycle time {format_duration(job.seconds)}"
    if job.waits:
        text += f", of which the program waits {job.waits:g} s"
    fractions = job.trajectory.binding_fractions.items()
    bound = [f"{name} {fraction:.0%}" for name, fraction in fractions if fraction >= _LEAST_FRACTION][:_BINDING]
    text += f"; bound by {', '.join(bound)}" if bound else ""
    if target is None or seconds is None:
        return [text]
    title = load_controller(target).title
    return [text, f"about {format_duration(seconds)} under {title}, from the first record on"]


def _format_range(joint: dict[str, Any]) -> tuple[str, ...]:
    def format_number(value: float | None) -> str:
        return "-" if value is None or value != value else format_fixed(value, 3)

    def format_end(value: float) -> str:
        return f"{value:,.3f}".rstrip("0").rstrip(".") if abs(value) < float("inf") else "-"

    limits = f"{format_end(joint['low'])} to {format_end(joint['high'])}"
    return joint["joint"], format_number(joint["min"]), format_number(joint["max"]), joint["unit"], limits
