"""The report's tables: offences with their source lines, the reader's notes, facts."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Array
from ...kinematics.rotations import TURNS
from ...toolpath.posting.frames import find_frame_angles
from ...toolpath.posting.setup_texts import describe_tools
from ...toolpath.reading.cl.dialects import TITLES
from ...version import __version__
from ..number_format import format_duration, format_value
from .cards import make_card, make_fact_table

if TYPE_CHECKING:
    from ...toolpath.path import ToolPath
    from ...toolpath.posting.posted import Offence, Posted

_NOTES = 200  # greatest number of the reader's notes that are listed
_LONGEST = 240  # characters of a source line that are quoted
_READ = 1 << 16  # bytes of one line that are read


def read_source_lines(path: ToolPath, wanted: Iterable[int]) -> dict[int, str]:
    """Read some lines of the source file, if it still exists; long lines are cut."""
    left, lines = set(wanted), {}
    try:
        source = Path(path.source)
        if not left or not source.is_file():
            return {}
        with source.open("rb") as file:
            number, fresh = 1, True
            while left and (piece := file.readline(_READ)):
                if fresh and number in left:
                    text = piece.decode("utf-8", "replace").rstrip("\r\n")
                    lines[number] = text[:_LONGEST] + ("…" if len(text) > _LONGEST else "")
                    left.discard(number)
                fresh = piece.endswith(b"\n")
                number += fresh
    except (OSError, ValueError):  # a name that no file can have
        pass
    return lines


def render_offence_card(posted: Posted) -> str:
    if posted.first is None:
        return ""
    text = read_source_lines(posted.path, {o.line for o in (*posted.offences, posted.first)})
    first = f"<tr><th colspan=5>First</th></tr>{_render_offence(posted.first, text, False)}"
    worst = "".join(_render_offence(offence, text, True) for offence in posted.offences)
    head = (
        "<tr><th>Line</th><th>What</th><th class=n>Beyond by</th>"
        f"<th class=n>Records{' and motions' if posted.checked else ''}</th><th>The line reads</th></tr>"
    )
    rows = f"{head}{first}<tr><th colspan=5>Every broken limit at its worst</th></tr>{worst}"
    return make_card("Offences", f"<div class=wide><table>{rows}</table></div>")


def _render_offence(offence: Offence, text: dict[int, str], count: bool) -> str:
    beyond, reads = format_value(offence.excess, offence.unit), escape(text.get(offence.line, ""))
    place = f"{offence.line}<br><small>{describe_share(offence)}</small>" if offence.share < 1.0 else str(offence.line)
    return (
        f"<tr><td>{place}</td><td>{escape(offence.text)}</td><td class=n>{beyond}</td>"
        f"<td class=n>{f'{offence.count:,}' if count else ''}</td><td><code>{reads}</code></td></tr>\n"
    )


def describe_share(offence: Offence) -> str:
    """Describe where between two records an offence is."""
    return f"on the way, {100.0 * offence.share:.0f} %"


def render_note_card(path: ToolPath) -> str:
    if not path.notes:
        return ""
    rows = "".join(
        f"<tr><td class=k>{f'line {note.line}' if note.line else 'file'}</td><td>{escape(note.text)}</td></tr>\n"
        for note in path.notes[:_NOTES]
    )
    more = len(path.notes) - _NOTES
    tail = f"<p class=sub>{more:,} more notes are not listed.</p>" if more > 0 else ""
    return make_card("Notes of the reader", f"<table>{rows}</table>{tail}")


def render_fact_card(posted: Posted) -> str:
    path, machine = posted.path, posted.machine
    steps, rapid = _measure_steps(path), path.rapid[1:]
    seconds, unknown = sum_programmed_time(path)
    time = format_duration(seconds) + " in feed motions, at the programmed feeds"
    if unknown > 0.0:
        time += f"; {format_value(unknown, 'mm')} without a feed not counted"
    tool = ", ".join(f"{key.replace('_', ' ')} {value:g}" if isinstance(value, float) else f"{key} {value}"
                     for key, value in path.tool.items())  # fmt: skip
    rows = [
        ("Records", f"{len(path):,}, of them {int(path.rapid.sum()):,} in rapid"),
        ("Path in feed", format_value(float(steps[~rapid].sum()), "mm")),
        ("Path in rapid", format_value(float(steps[rapid].sum()), "mm")),
        ("Programmed time", time),
        ("Workpiece in the machine", _format_placement(posted.frame)),
        ("Machine", f"{machine.spec.title} ({machine.name}): axes {' '.join(machine.axes)}"),
        ("Working mode", posted.mode or "the only one"),
        ("File", f"{TITLES[path.dialect]}, in {path.units}"),
        ("Tool", tool or "not named"),
        *(("Tool length", text) for text in describe_tools(path)),
        ("Written by", f"parakin {__version__}"),
    ]
    return make_card("Facts", make_fact_table(rows))


def sum_programmed_time(path: ToolPath) -> tuple[float, float]:
    """Sum the time of the feed motions at the programmed feeds, s, and the length of those without a feed, mm."""
    steps, feed = _measure_steps(path), path.feed[1:]
    seconds = np.full(len(steps), np.nan) if path.seconds is None else path.seconds[1:]
    cut = ~path.rapid[1:]
    fed, timed = cut & (feed > 0.0), cut & (seconds >= 0.0)
    unknown = float(steps[cut & ~fed & ~timed].sum())
    return float((steps[fed] / feed[fed]).sum()) * 60.0 + float(seconds[timed & ~fed].sum()), unknown


def _measure_steps(path: ToolPath) -> Array:
    steps: Array = np.linalg.norm(np.diff(path.tip, axis=0), axis=1)
    return steps


def _format_placement(frame: Array) -> str:
    """Format a frame (3, 4) by its origin and its angles, R = Rz(C)·Ry(B)·Rx(A)."""
    words = [f"{letter} {format_value(float(v), 'mm')}" for letter, v in zip("XYZ", frame[:, 3], strict=True)]
    angles = zip(TURNS, find_frame_angles(frame), strict=True)
    words += [f"{letter} {format_value(angle, 'rad')}" for letter, angle in angles]
    return ", ".join(words)
