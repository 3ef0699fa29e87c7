"""Fit a tool path to the lengths of its tools: where the tip of the machine's own tool has to be, and tool changes.

A machine's kinematics knows one tool, whose length ends its head. A tool that is longer by some extension has its tip
that much farther down the tool's axis. So the path of the machine's own tip is the programmed path, moved up the axis
by the extension; a controller with that kinematics runs it as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Literal, NoReturn, TypeAlias

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Flags, Indices
from ...errors import InputError, PoseError
from ...machine import Machine
from ..path import Note, ToolPath, ToolUse, insert_records
from .frames import compose_frames, compute_poses

ToolLength: TypeAlias = float | Literal["file", "machine"] | None
_SAME = 1e-3  # mm: lengths that are the same, with the decimals of a file
_CLEARANCES = (20.0, 10.0, 5.0, 2.0)  # mm to withdraw from a cut before a change: the first that the machine allows
_LONGEST = 1e4  # mm
_UPRIGHT = 1e-4  # rad: 0.1 um at a tip that is 1 m off
_STOPS = re.compile(r"M0?[59]$|(SPINDL|COOLNT)\s*/\s*OFF", re.I)  # events that stop spindle or coolant
_STARTS = re.compile(r"M0?[34]\b|SPINDL\b(?!\s*/\s*OFF)", re.I)  # events that start the spindle


@check_arguments
def fit_tool_lengths(
    machine: Machine, path: ToolPath, length: ToolLength = None, *, workpiece: Array | None = None
) -> ToolPath:
    """Move a path to where the tip of the machine's own tool has to be, and take the tool out where it is changed.

    Parameters
    ----------
    machine : its :attr:`Machine.tool_length` is what its kinematics has
    path : as read; one that is fitted already is returned as it is
    length : mm of the longest tool, in place of the machine's own length; ``file``: all are as long as the file says;
        ``machine``: all are as long as the machine's own; None: see below
    workpiece : as the path will be posted with; it tells how far the machine can withdraw the tool

    A tool table's length, and one that the file sets (LOADTL with LENGTH, G10 L1, G43.1), is from the spindle's nose to
    the tip. The file's may not differ from the machine's unless ``length`` says what counts, and neither may TLDATA's
    length of a tool that the file loads by its number and tilts. Else the length of a cutter (TLDATA, CUTTER) is
    without its holder: the tool with the longest cutter is as long as the machine's own, which may not be shorter than
    the cutter, and others by what their cutters are shorter. A tool of which nothing is known is as long as the
    machine's own.

    Before a change the tool is withdrawn along its axis, from a cut by 20 mm, or less where the machine can't, and by
    what the next tool is longer, so that no tool is put in deeper than the one before; from a rapid position the next
    one goes on from the same point. What the file says before the change happens before that, but spindle and coolant
    that it stops right before the change run on until the tool is out.

    Raises :class:`InputError` with file and line for a length that contradicts the machine's, and :class:`PoseError`
    for an invalid length or a path fitted to another machine.
    """
    own = machine.tool_length
    if path.fitted_length is not None:
        if path.fitted_length != own:
            raise PoseError(f"path: fitted to a tool of {path.fitted_length:g} mm, {machine.name} has one of {own:g}")
        return path
    if isinstance(length, str) and length not in ("file", "machine"):
        raise PoseError(f"length: mm, 'file' or 'machine' expected, not {length!r}")
    if not isinstance(length, str) and length is not None and not 0.0 <= length <= _LONGEST:
        raise PoseError(f"length: 0 to {_LONGEST:g} mm expected, not {length:g}")
    lengths = _choose_lengths(machine, path, length)
    uses = tuple(use._replace(length=value) for use, value in zip(path.tools, lengths, strict=True))
    if not uses:
        uses = (ToolUse(0, 0, {}, length=own if length is None or isinstance(length, str) else float(length)),)
    extension = np.zeros(len(path))
    for use in uses:
        extension[use.record :] = use.length - own
    notes = (*path.notes, *_note_lengths(path, uses, own))
    path = _insert_changes(machine, replace(path, tools=uses, fitted_length=own, notes=notes), extension, workpiece)
    path = replace(path, notes=(*path.notes, *_note_standing_spindle(path)))
    if path.extension is None or not path.extension.any():
        return replace(path, extension=None)
    return replace(path, tip=path.tip + path.extension[:, None] * path.axis)


def _choose_lengths(machine: Machine, path: ToolPath, length: ToolLength) -> list[float]:
    """Choose the lengths of a path's tools, mm."""
    own = machine.tool_length
    if length == "machine":
        return [own] * len(path.tools)
    longest_tool = own if length is None or isinstance(length, str) else float(length)
    longest = max((cutter for cutter in map(find_cutter_length, path.tools) if cutter == cutter), default=math.nan)
    lengths = []
    for k, use in enumerate(path.tools if length is None and own > 0.0 else ()):
        cutter, stated = find_cutter_length(use), _find_length(use, "set_length")
        if stated == stated or cutter != cutter:
            continue
        if cutter > own + _SAME:
            _refuse_length(machine, path, use, f"has a cutter of {cutter:g} mm")
        if abs(cutter - own) > _SAME and "type" in use.data and "number" in use.data and _is_tilted(path, k):
            _refuse_length(machine, path, use, f"is {cutter:g} mm long by TLDATA and tilts")
    for use in path.tools:
        cutter, stated = find_cutter_length(use), _find_length(use, "set_length")
        if stated == stated:
            if length is None and not use.from_table and abs(stated - own) > _SAME:
                _refuse_length(machine, path, use, f"is {stated:g} mm long")
            lengths.append(stated if length is None or length == "file" or use.from_table else longest_tool)
        elif cutter != cutter:
            lengths.append(longest_tool)
        elif length == "file":
            lengths.append(cutter)
        else:
            lengths.append(longest_tool + cutter - longest)
            if lengths[-1] <= 0.0:
                shorter = longest - cutter
                what = f"{shorter:g} mm shorter than the longest tool" if shorter > _SAME else f"{cutter:g} mm long"
                _refuse_length(machine, path, use, f"is {what}")
    return lengths


def _is_tilted(path: ToolPath, number: int) -> bool:
    """Tell whether a tool ever leaves the part's Z, where a wrong length is more than a shift of the zero."""
    begin, *rest = [use.record for use in path.tools[number:]]
    axes = path.axis[begin : rest[0] if rest else None]
    return bool((axes[:, 2] < math.cos(_UPRIGHT)).any())


def _refuse_length(machine: Machine, path: ToolPath, use: ToolUse, what: str) -> NoReturn:
    raise InputError(
        f"{describe_tool(use)} {what}, the tool of {machine.name} is {machine.tool_length:g} mm long; "
        "expected MM, file or machine to say which counts, or a tool table",
        path.source, use.length_line or use.line or None,
    )  # fmt: skip


def _find_length(use: ToolUse, key: str) -> float:
    value = use.data.get(key, math.nan)
    return float(value) if not isinstance(value, str) else math.nan


def find_cutter_length(use: ToolUse) -> float:
    """Find how much of a tool its file tells below the holder, mm: the longer of cutter and body; NaN if nothing."""
    return float(np.fmax(_find_length(use, "length"), _find_length(use, "body_length")))


def describe_tool(use: ToolUse) -> str:
    """Describe a tool by its number and name: ``tool 2 BALL6``."""
    number, name = use.data.get("number"), use.data.get("name")
    words = [f"{number:g}" if isinstance(number, float) else "", str(name or "")]
    return " ".join(["tool", *(word for word in words if word)]) if any(words) else "the tool"


def _note_lengths(path: ToolPath, uses: Sequence[ToolUse], own: float) -> list[Note]:
    """Note the lengths that count where the file's cutters, or tools of unknown length, leave them to the machine's."""
    notes = []
    for use in uses:
        cutter, stated = find_cutter_length(use), _find_length(use, "set_length")
        line = use.length_line or use.line
        if stated != stated and cutter == cutter and abs(cutter - use.length) > _SAME:
            holder = " with its holder" if use.length > cutter else ""
            text = f"{describe_tool(use)}: a cutter of {cutter:g} mm, taken to be {use.length:g} mm long{holder}"
            notes.append(Note(line, text))
        elif stated != stated and cutter != cutter and len(uses) > 1:
            notes.append(Note(line, f"{describe_tool(use)}: no length told, taken to be {use.length:g} mm long"))
    return notes


def _note_standing_spindle(path: ToolPath) -> list[Note]:
    """Note cuts before the file starts the spindle again, which stops for a change of the tool."""
    started = [(event.record, event.line) for event in path.events if _STARTS.match(event.text)]
    notes = []
    for use in path.tools if started else ():
        cuts = np.flatnonzero(~path.rapid[use.record :]) + use.record
        if not use.changed or not len(cuts) or any(use.line < line and record <= cuts[0] for record, line in started):
            continue
        text = f"a cut while the spindle stands since the change of tool in line {use.line}"
        notes.append(Note(int(path.line[cuts[0]]), text))
    return notes


def _insert_changes(machine: Machine, path: ToolPath, extension: Array, workpiece: Array | None) -> ToolPath:
    """Insert the motions at tool changes: out along the axis with the old tool, and to where the next one goes on.

    extension : (n,) of the tools, mm; the path that is returned has them, its tips are not moved by them
    """
    source, lift, events_at = list[int](), list[float](), dict[int, int]()
    added = 0
    begins = {use.record: use for use in path.tools if use.changed and 0 < use.record < len(path)}
    for record in sorted(begins):
        last, longer = record - 1, float(extension[record] - extension[record - 1])
        from_cut = not path.rapid[last]
        out = max(0.0, longer)
        if from_cut:
            out += _choose_clearance(machine, path, last, out + float(extension[last]), workpiece)
        lifts = [(0.0, out), (1.0, out - longer)]  # old tool, new tool: the holder stands still between both
        if not from_cut:
            lifts.append((1.0, 0.0))
        if out == 0.0 and longer == 0.0:
            lifts = []
        source += [record] * len(lifts)
        lift += [value for pair in lifts for value in pair]
        events_at[record] = added + (1 if lifts else 0)
        added += len(lifts)
    path = replace(path, extension=extension)
    if not source:
        return path
    at = np.array(source, np.int64)
    new, height = np.array(lift).reshape(-1, 2).T
    return _insert_lifts(path, at, new > 0.0, height, events_at)


def _choose_clearance(machine: Machine, path: ToolPath, record: int, height: float, workpiece: Array | None) -> float:
    """Choose how far to withdraw from a record, mm, beyond a height that is needed in any case."""
    clearances = np.array(_CLEARANCES)
    tips = path.tip[record] + (height + clearances)[:, None] * path.axis[record]
    axes = np.repeat(path.axis[record][None], len(tips), axis=0)
    turns = None if path.turns is None else np.repeat(path.turns[record][None], len(tips), axis=0)
    poses = compute_poses(machine, tips, axes, compose_frames(workpiece, path.frame), turns)[0]
    allowed = np.any([machine.check(poses, mode=mode) == 0 for mode in machine.head_modes(machine.mode)], axis=0)
    return float(clearances[allowed.argmax()])


def _insert_lifts(path: ToolPath, at: Indices, new: Flags, height: Array, events_at: dict[int, int]) -> ToolPath:
    """Insert rapid records before records ``at``: above the record before, by ``height`` along its axis.

    new : whether with the next tool
    events_at : by record, how many of all inserted records come before its events
    """
    last = at - 1
    own = np.where(new, at, last)  # the record that has the tool
    line = np.array([next(use.line for use in path.tools if use.record == r) for r in at.tolist()], np.int64)
    values = {
        "tip": path.tip[last] + height[:, None] * path.axis[last],
        "axis": path.axis[last],
        "line": np.where(line > 0, line, path.line[at]),
        "rapid": np.ones(len(at), np.bool_),
        "spindle": path.spindle[own],
        "turns": None if path.turns is None else path.turns[last],
        "extension": None if path.extension is None else path.extension[own],
    }
    ahead = np.searchsorted(at, np.arange(len(path) + 1), side="right")
    ahead[list(events_at)] = list(events_at.values())
    inserted = insert_records(path, at, values, ahead)
    begins = np.searchsorted(at, np.arange(len(path) + 1)).tolist()  # how many are inserted before a record's first one
    events = list(inserted.events)
    for k in _find_events_before_changes(path, events_at):
        record = path.events[k].record
        events[k] = events[k]._replace(record=record + begins[record])
    return replace(inserted, events=tuple(events))


def _find_events_before_changes(path: ToolPath, records: Collection[int]) -> Iterator[int]:
    """Find the events between the last motion before a change of tool and the change; yield their indices."""
    lines = {use.record: use.line for use in path.tools if use.record in records}
    for record, line in lines.items():
        here = [k for k, event in enumerate(path.events) if event.record == record]
        at_change = [i for i, k in enumerate(here) if path.events[k].line == line]
        behind = [i for i, k in enumerate(here) if path.events[k].line > line]
        end = min(at_change or behind or [0])
        while end and _STOPS.match(path.events[here[end - 1]].text):
            end -= 1
        yield from here[:end]
