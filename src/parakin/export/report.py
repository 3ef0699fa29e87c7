"""The report on a tool path on a machine: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from .curves import joint_curves
from .figures import page, placed
from .pathview import path_figures
from .ranges import Use, edge, shown, used

if TYPE_CHECKING:
    from ..toolpath.program import ToolPath
    from ..toolpath.result import Offence, Posted

_NOTES = 200  # of the reader that are listed
_LONGEST = 240  # characters of a source line that are quoted
_READ = 1 << 16  # bytes of one line that are looked at


def report_html(posted: Posted) -> str:
    """The report as one HTML document: verdict, ranges, path, curves, offences, notes, facts.

    Whatever the length of the path it stays below some 8 MB: what is drawn are the extremes of every stretch.
    """
    path, machine = posted.path, posted.machine
    name = Path(path.source).name or path.source
    title = f"{name} on {machine.spec.title or machine.name}"
    parts = [f"<header><h1>{escape(title)}</h1><p class=sub>{escape(path.source)}</p></header>\n", _verdict(posted)]
    if len(path):
        uses, relative = used(posted)
        parts += [_ranges(posted, uses), _space(posted, relative), _curves(posted, uses)]
    parts += [_offences(posted), _notes(path), _facts(posted)]
    return page(title, "".join(parts))


def _card(heading: str, body: str, sub: str = "") -> str:
    under = f"<p class=sub>{sub}</p>\n" if sub else ""
    return f"<section class=card><h2>{escape(heading)}</h2>\n{under}{body}</section>\n"


def _of(count: int, one: str) -> str:
    return f"{count:,} {one}{'' if count == 1 else 's'}"


def _verdict(posted: Posted) -> str:
    path, first = posted.path, posted.first
    if not len(path):
        text = "<strong>Nothing to run</strong><p>The file has no motion.</p>"
        return f"<section class='card verdict bad'>{text}</section>\n"
    if first is None:
        text = f"All {_of(len(path), 'record')} stay within every limit of {escape(posted.machine.name)}."
        return f"<section class='card verdict'><strong>Runs</strong><p>{text}</p></section>\n"
    place = f"{path.source}:{first.line}: {first.text}"
    counts = (
        f"{posted.off:,} of {_of(len(path), 'record')} off limits ({posted.off / len(path):.2%}); "
        f"{_of(len(posted.offences), 'limit')} broken."
    )
    return (
        "<section class='card verdict bad'><strong>Does not run</strong>"
        f"<p class=first>{escape(place)}</p><p>{counts}</p></section>\n"
    )


# Ranges.


def _ranges(posted: Posted, uses: list[Use]) -> str:
    joints, rest = uses[: len(posted.machine.joints)], uses[len(posted.machine.joints) :]
    body = f"<h3>Joints</h3><div class=two>{''.join(_bar(posted, use) for use in joints)}</div>"
    if rest:
        bars = "".join(_bar(posted, use) for use in rest)
        body += f"<h3>Other limits</h3><div class=two>{bars}</div>"
    key = (
        "<span class=key style='background:#dfe7ee;margin-left:0'></span>allowed"
        "<span class=key style='background:var(--used)'></span>used"
        "<span class=key style='background:var(--bad)'></span>used beyond a limit. At the right the least margin"
        " over the path, and where."
    )
    return _card("Ranges", body, key)


def _bar(posted: Posted, use: Use) -> str:
    """The range used inside the range allowed, in per cent of what both cover."""
    ends = [v for v in (use.low, use.high, use.least, use.most) if isfinite(v)]
    if not isfinite(use.low) and use.unit in ("mm", "rad") and isfinite(use.high) and use.high > 0.0:
        ends.append(0.0)  # an angle of a cone, or a distance: what has no lower bound begins at 0
    start, stop = (min(ends), max(ends)) if ends else (0.0, 1.0)
    width = (stop - start) or 1.0
    start, width = start - 0.02 * width, 1.04 * width

    def stretch(style: str, low: float, high: float) -> str:
        left, right = (100.0 * (min(max(v, start), start + width) - start) / width for v in (low, high))
        return f"<i class={style} style='left:{left:.2f}%;width:{right - left:.2f}%'></i>"

    pieces = [stretch("ok", use.low, use.high)]
    if isfinite(use.least):
        if use.most >= use.low and use.least <= use.high:
            pieces.append(stretch("in", max(use.least, use.low), min(use.most, use.high)))
        if use.least < use.low:
            pieces.append(stretch("out", use.least, min(use.most, use.low)))
        if use.most > use.high:
            pieces.append(stretch("out", max(use.least, use.high), use.most))
    if isfinite(use.margin):
        line = int(posted.path.line[use.record])
        slack = f"{shown(use.margin, use.unit)} left" if use.margin >= 0.0 else f"{shown(-use.margin, use.unit)} beyond"
        slack += f"<br><small>line {line}</small>"
    else:
        slack = "<small>no limit</small>" if isfinite(use.least) else "<small>never reached</small>"
    lost = f"<br><small>{use.lost:,} can’t be told</small>" if use.lost else ""
    name = escape(use.name).replace(".", ".<wbr>").replace("-", "-<wbr>")
    bad = " bad" if use.margin < 0.0 else ""
    span = f"{shown(use.least, use.unit).removesuffix(' mm')} … {shown(use.most, use.unit)}"
    low, high = (edge(v, use.unit) if isfinite(v) else "" for v in (use.low, use.high))
    return (
        f"<div class='bar{bad}'><div><b>{name}</b></div><div><div class=scale>{''.join(pieces)}</div>"
        f"<div class=ends><span>{low}</span><span>used {span}</span><span>{high}</span></div></div>"
        f"<div class=slack>{slack}{lost}</div></div>\n"
    )


# Figures.


def _space(posted: Posted, relative: NDArray[np.float64]) -> str:
    far, near, record = path_figures(posted, relative)
    at = f"line {int(posted.path.line[record])}, record {record:,}"
    if posted.worst is not None and posted.worst.record == record:
        at += ", the worst offence"
    at += "; its shadow is at home"
    if not np.isfinite(posted.joints[record]).all():
        at = "home, for it can take no record"
    left = (
        f"<div>{placed('machine', far, '620px')}<p class=sub>The machine at {at}."
        " The surface is a coarse sample of where the tip can be at the path’s mean orientation.</p></div>"
    )
    right = (
        f"<div>{placed('path', near, '620px')}<p class=sub>The tool tip’s path, coloured by the least margin of"
        " all limits as a share of half the limit’s range: 0 % is a limit. Rapid motions are dashed.</p></div>"
    )
    return _card("Path in the workspace", f"<div class=two>{left}{right}</div>")


def _curves(posted: Posted, uses: list[Use]) -> str:
    figure, height = joint_curves(posted, uses[: len(posted.machine.joints)])
    sub = "Limits are dashed; red lies beyond one. "
    if len(posted.path) > 4000:
        sub += "Of every stretch of records the least and the greatest value is drawn, so no extreme is left out."
    return _card("Joints over the path", placed("curves", figure, f"{height}px"), sub)


# Tables.


def source_lines(path: ToolPath, wanted: Iterable[int]) -> dict[int, str]:
    """The text of some lines of the source file, as far as it is still there; cut where it is long."""
    left, found = set(wanted), {}
    try:
        source = Path(path.source)
        if not left or not source.is_file():
            return {}
        with source.open("rb") as file:
            number, fresh = 1, True
            while left and (piece := file.readline(_READ)):
                if fresh and number in left:
                    text = piece.decode("utf-8", "replace").rstrip("\r\n")
                    found[number] = text[:_LONGEST] + ("…" if len(text) > _LONGEST else "")
                    left.discard(number)
                fresh = piece.endswith(b"\n")
                number += fresh
    except (OSError, ValueError):  # a name that no file can have
        pass
    return found


def _offences(posted: Posted) -> str:
    if posted.first is None:
        return ""
    text = source_lines(posted.path, {o.line for o in (*posted.offences, posted.first)})
    first = f"<tr><th colspan=5>First</th></tr>{_offence(posted.first, text, False)}"
    worst = "".join(_offence(offence, text, True) for offence in posted.offences)
    head = (
        "<tr><th>Line</th><th>What</th><th class=n>Beyond by</th><th class=n>Records</th><th>The line reads</th></tr>"
    )
    rows = f"{head}{first}<tr><th colspan=5>Every broken limit at its worst</th></tr>{worst}"
    return _card("Offences", f"<div class=wide><table>{rows}</table></div>")


def _offence(offence: Offence, text: dict[int, str], count: bool) -> str:
    beyond, reads = shown(offence.excess, offence.unit), escape(text.get(offence.line, ""))
    return (
        f"<tr><td>{offence.line}</td><td>{escape(offence.text)}</td><td class=n>{beyond}</td>"
        f"<td class=n>{f'{offence.count:,}' if count else ''}</td><td><code>{reads}</code></td></tr>\n"
    )


def _notes(path: ToolPath) -> str:
    if not path.notes:
        return ""
    rows = "".join(
        f"<tr><td class=k>{f'line {note.line}' if note.line else 'file'}</td><td>{escape(note.text)}</td></tr>\n"
        for note in path.notes[:_NOTES]
    )
    more = len(path.notes) - _NOTES
    tail = f"<p class=sub>{more:,} more notes are not listed.</p>" if more > 0 else ""
    return _card("Notes of the reader", f"<table>{rows}</table>{tail}")


def _facts(posted: Posted) -> str:
    path, machine = posted.path, posted.machine
    steps = np.linalg.norm(np.diff(path.tip, axis=0), axis=1)
    rapid, feed = path.rapid[1:], path.feed[1:]
    timed = ~rapid & (feed > 0.0)
    unknown = float(steps[~rapid & ~timed].sum())
    minutes = float((steps[timed] / feed[timed]).sum())
    time = _duration(minutes) + " in feed motions, at the programmed feeds"
    if unknown > 0.0:
        time += f"; {shown(unknown, 'mm')} without a feed not counted"
    tool = ", ".join(f"{key.replace('_', ' ')} {value:g}" if isinstance(value, float) else f"{key} {value}"
                     for key, value in path.tool.items())  # fmt: skip
    rows = [
        ("Records", f"{len(path):,}, of them {int(path.rapid.sum()):,} in rapid"),
        ("Path in feed", shown(float(steps[~rapid].sum()), "mm")),
        ("Path in rapid", shown(float(steps[rapid].sum()), "mm")),
        ("Programmed time", time),
        ("Workpiece in the machine", _placement(posted.frame)),
        ("Machine", f"{machine.spec.title} ({machine.name}): axes {' '.join(machine.axes)}"),
        ("Working mode", posted.mode or "the only one"),
        ("File", f"{'Siemens NX' if path.dialect == 'nx' else 'APT'}, in {path.units}"),
        ("Tool", tool or "not named"),
        ("Written by", f"parakin {__version__}"),
    ]
    body = "".join(f"<tr><td class=k>{escape(key)}</td><td>{escape(value)}</td></tr>\n" for key, value in rows)
    return _card("Facts", f"<table>{body}</table>")


def _duration(minutes: float) -> str:
    seconds = round(60.0 * minutes, 1) if minutes < 1.0 else round(60.0 * minutes)
    if seconds < 60:
        return f"{seconds:g} s"
    hours, rest = divmod(int(seconds), 3600)
    return f"{f'{hours:,} h ' if hours else ''}{rest // 60} min {rest % 60} s"


def _placement(frame: NDArray[np.float64]) -> str:
    r, origin = frame[:, :3], frame[:, 3]
    b = np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))
    a, c = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    parts = [f"{letter} {shown(float(v), 'mm')}" for letter, v in zip("XYZ", origin, strict=True)]
    parts += [f"{letter} {shown(float(v), 'rad')}" for letter, v in zip("ABC", (a, b, c), strict=True)]
    return ", ".join(parts)
