"""The report on a tool path on a machine: one HTML file that needs nothing else."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...toolpath.posting.offences import describe_place
from ...toolpath.posting.range_use import RangeUse, measure_range_use
from ..machine.figures import page, placed
from ..number_format import format_count, format_duration
from .cards import make_card
from .curves import joint_curves
from .path_view import PathView, path_view
from .ranges import range_card
from .tables import fact_card, note_card, offence_card
from .timing import cycle_text, timing_card

if TYPE_CHECKING:
    from ...toolpath.posting.posted import Posted
    from ...toolpath.timing import Trajectory


def render_report(posted: Posted, trajectory: Trajectory | None = None, unplanned: str = "", waits: float = 0.0) -> str:
    """The report as one HTML document: verdict, ranges, path, curves, time by a ``trajectory``, offences, notes, facts.

    ``unplanned`` tells why there is no trajectory, ``waits`` how long (s) the program waits besides it.
    Whatever the length of the path it stays below some 8 MB: what is drawn are the extremes of every stretch.
    """
    path, machine = posted.path, posted.machine
    name = Path(path.source).name or path.source
    title = f"{name} on {machine.spec.title or machine.name}"
    parts = [
        f"<header><h1>{escape(title)}</h1><p class=sub>{escape(path.source)}</p></header>\n",
        _verdict(posted, trajectory, unplanned, waits),
    ]
    if len(path):
        uses, relative = measure_range_use(posted)
        view = path_view(posted, relative)
        parts += [range_card(posted, uses), _space(posted, view), _curves(posted, uses)]
        parts += [] if trajectory is None else [timing_card(trajectory, view)]
    parts += [offence_card(posted), note_card(path), fact_card(posted)]
    return page(title, "".join(parts))


def _verdict(posted: Posted, trajectory: Trajectory | None, unplanned: str, waits: float) -> str:
    path, first = posted.path, posted.first
    if not len(path):
        text = "<strong>Nothing to run</strong><p>The file has no motion.</p>"
        return f"<section class='card verdict bad'>{text}</section>\n"
    time = "" if trajectory is None else f"<p>{cycle_text(trajectory)}</p>"
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
        said = f"<strong>{verdict}</strong><p>{text}{_unchecked(posted)}</p>{time}"
        return f"<section class='card verdict'>{said}</section>\n"
    broken, motions = posted.broken_record_count, posted.broken_motion_count
    counts = f"{broken:,} of {format_count(len(path), 'record')} off limits ({broken / len(path):.2%})"
    if motions:
        breaks = "breaks" if motions == 1 else "break"
        counts += f"; {format_count(motions, 'motion')} {breaks} a limit that the records at both ends keep"
    counts += f"; {format_count(len(posted.offences), 'limit')} broken."
    return (
        "<section class='card verdict bad'><strong>Does not run</strong>"
        f"<p class=first>{escape(describe_place(posted, first))}: {escape(first.text)}</p>"
        f"<p>{counts}{_unchecked(posted)}</p>{time}</section>\n"
    )


def _unchecked(posted: Posted) -> str:
    return "" if posted.checked or len(posted.path) < 2 else " The motions between them were not checked."


def _space(posted: Posted, view: PathView) -> str:
    record = view.record
    at = f"line {int(posted.path.line[record])}, record {record:,}"
    if posted.worst is not None and posted.worst.record == record:
        at += (
            ", the worst offence" if posted.worst.share >= 1.0 else ", to which the motion with the worst offence leads"
        )
    at += "; its shadow is at home"
    if not np.isfinite(posted.joints[record]).all():
        at = "home, for it can take no record"
    left = (
        f"<div>{placed('machine', view.machine, '620px')}<p class=sub>The machine at {at}."
        " The surface is a coarse sample of where the tip can be at the path’s mean orientation.</p></div>"
    )
    right = (
        f"<div>{placed('path', view.path, '620px')}<p class=sub>The tool tip’s path, coloured by the least margin of"
        " all limits as a share of half the limit’s range: 0 % is a limit. Rapid motions are dashed.</p></div>"
    )
    return make_card("Path in the workspace", f"<div class=two>{left}{right}</div>")


def _curves(posted: Posted, uses: list[RangeUse]) -> str:
    figure, height = joint_curves(posted, uses[: len(posted.machine.joints)])
    sub = "Limits are dashed; red lies beyond one. "
    if len(posted.path) > 4000:
        sub += "Of every stretch of records the least and the greatest value is drawn, so no extreme is left out."
    return make_card("Joints over the path", placed("curves", figure, f"{height}px"), sub)
