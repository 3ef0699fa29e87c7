"""The report on a tool path on a machine: one HTML file that needs nothing else."""

from __future__ import annotations

from html import escape
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...arguments import check_arguments
from ...errors import NoMethodError, PoseError
from ...toolpath.placing.outside import Outside, describe_outside
from ...toolpath.posting.offence_texts import describe_place
from ...toolpath.posting.range_use import RangeUse, measure_range_use
from ..number_format import format_count, format_duration
from ..page.page import render_path_page
from .cards import make_card
from .figures import embed_figure, render_page
from .force_card import render_force_card
from .joint_curves import build_joint_curves
from .packed_pages import render_page_frame
from .range_bars import render_range_card
from .tables import render_fact_card, render_note_card, render_offence_card
from .timing import format_cycle, render_timing_card

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted
    from ...toolpath.timing import Trajectory
    from ...toolpath.timing.drive_forces import DriveForces

_PAGE_NUMBERS = 120_000  # of the path in the page: some 0.5 MB of text


@check_arguments
def render_report(
    posted: Posted,
    trajectory: Trajectory | None = None,
    unplanned: str = "",
    waits: float = 0.0,
    outside: Outside | None = None,
    forces: DriveForces | None = None,
) -> str:
    """Render the report as one HTML document: verdict, ranges, path, curves, time, offences, notes, facts.

    posted : :attr:`Job.posted`, the path on a machine
    trajectory : :attr:`Job.trajectory`, if there is one
    unplanned : why there is none
    waits : how long the program waits besides it, s
    outside : :attr:`Job.outside`, where the part would have to lie
    forces : of :func:`parakin.compute_drive_forces`, what the trajectory asks of the drives

    Whatever the length of the path the document stays below some 2 MB: of every stretch the extremes are drawn.

    Raises :class:`PoseError` for a negative time.
    """
    if not 0.0 <= waits < inf:
        raise PoseError(f"waits: a time of 0 s or more expected, not {waits:g}")
    path, machine = posted.path, posted.machine
    name = Path(path.source).name or path.source
    title = f"{name} on {machine.spec.title or machine.name}"
    cards = [
        f"<header><h1>{escape(title)}</h1><p class=sub>{escape(path.source)}</p></header>\n",
        _render_verdict(posted, trajectory, _Remarks(unplanned, waits, outside)),
    ]
    if len(path):
        uses, _ = measure_range_use(posted)
        cards += [render_range_card(posted, uses), _render_page_card(posted, trajectory), _render_curves(posted, uses)]
        cards += [] if trajectory is None else [render_timing_card(trajectory)]
        cards += [] if forces is None else [render_force_card(forces)]
    cards += [render_offence_card(posted), render_note_card(path), render_fact_card(posted)]
    return render_page(title, "".join(cards))


class _Remarks(NamedTuple):
    """What the verdict says besides: see :func:`render_report`."""

    unplanned: str
    waits: float
    outside: Outside | None


def _render_verdict(posted: Posted, trajectory: Trajectory | None, remarks: _Remarks) -> str:
    unplanned, waits, outside = remarks
    path, first = posted.path, posted.first
    if not len(path):
        text = "<strong>Nothing to run</strong><p>The file has no motion.</p>"
        return f"<section class='card verdict bad'>{text}</section>\n"
    time = "" if trajectory is None else f"<p>{format_cycle(trajectory)}</p>"
    if waits:
        time += f"<p>Besides, the program waits {format_duration(waits)} by its own words.</p>"
    if unplanned:
        time += f"<p>No cycle time: {escape(unplanned)}</p>"
    if first is None:
        both = " and the motions between them" if posted.checked else ""
        text = (
            f"All {format_count(len(path), 'record')}{both} stay within every limit of {escape(posted.machine.name)}."
        )
        verdict = "Stays within the limits" if unplanned else "Runs"
        body = f"<strong>{verdict}</strong><p>{text}{_note_unchecked(posted)}</p>{time}"
        return f"<section class='card verdict'>{body}</section>\n"
    broken, motions = posted.broken_record_count, posted.broken_motion_count
    counts = f"{broken:,} of {format_count(len(path), 'record')} off limits ({broken / len(path):.2%})"
    if motions:
        breaks = "breaks" if motions == 1 else "break"
        counts += f"; {format_count(motions, 'motion')} {breaks} a limit that the records at both ends keep"
    counts += f"; {format_count(len(posted.offences), 'limit')} broken."
    place = f"{describe_place(posted, first)}: {first.text}" if outside is None else describe_outside(outside)
    return (
        "<section class='card verdict bad'><strong>Does not run</strong>"
        f"<p class=first>{escape(place)}</p>"
        f"<p>{counts}{_note_unchecked(posted)}</p>{time}</section>\n"
    )


def _note_unchecked(posted: Posted) -> str:
    return "" if posted.checked or len(posted.path) < 2 else " The motions between them were not checked."


def _render_page_card(posted: Posted, trajectory: Trajectory | None) -> str:
    try:
        page = render_path_page(posted, trajectory, _PAGE_NUMBERS)
    except NoMethodError as error:
        return make_card("The machine on the path", "", escape(str(error)))
    return make_card(
        "The machine on the path",
        render_page_frame([page], "The machine on the path"),
        "Play it, drag the tool, choose what colours the path; red is off limits.",
    )


def _render_curves(posted: Posted, uses: list[RangeUse]) -> str:
    figure, height = build_joint_curves(posted, uses[: len(posted.machine.joints)])
    sub = "Limits are dashed; red lies beyond one. "
    if len(posted.path) > 4000:
        sub += "Of every stretch of records the least and the greatest value is drawn, so no extreme is left out."
    return make_card("Joints over the path", embed_figure("curves", figure, f"{height}px"), sub)
