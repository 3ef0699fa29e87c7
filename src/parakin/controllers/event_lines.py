"""Write what a tool path says besides motion in RS274/NGC; what has no word there becomes a comment."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ..toolpath.path import Event, ToolPath
from .gcode_text import LONGEST_COMMENT, format_comments, make_plain

_SAME = re.compile(r"M(?:0|1|3|4|5|7|8|9|60)|S[\d.]+|G4 P[\d.eE+-]+")  # G-code that is carried over as it is
_END = re.compile(r"M(?:2|30)")  # the program's own end replaces them
_MESSAGE = re.compile(r"\(\s*msg\s*,(.*)\)", re.I | re.S)
_STATEMENT = re.compile(r"([A-Z-]+)\s*(?:/(.*))?", re.S)
_TURN = re.compile(r"^SPINDL\b.*\b(CC?LW)\b")  # which way the spindle turns; a later ON does not repeat it
_DWELL = re.compile(r"\d*\.?\d+")
_TOOLS = {"LOADTL", "TOOLNO"}
_COOLANT = {"ON": "M8", "FLOOD": "M8", "MIST": "M7", "OFF": "M9"}


def format_events(path: ToolPath, places: Sequence[int]) -> dict[int, list[str]]:
    """Format a path's events; return the lines by place, ``places`` having one for each event."""
    lines = dict[int, list[str]]()
    for place, event in zip(places, path.events, strict=True):
        lines.setdefault(place, []).extend(_format_event(event, path))
    return lines


def _format_event(event: Event, path: ToolPath) -> Iterator[str]:
    """Yield the lines of an event, without their ends."""
    message = _MESSAGE.fullmatch(event.text)
    if message:
        yield f"(MSG,{make_plain(message[1])[:LONGEST_COMMENT]})"
        return
    if _END.fullmatch(event.text):
        return
    word = _find_word(event, path)
    if word:
        yield word
    else:
        yield from format_comments(f"line {event.line}: {event.text}")
        if _changes_tool(event, path):
            yield "M0"


def _find_word(event: Event, path: ToolPath) -> str | None:
    """Find the G-code word that says the same as an event; None where there is none."""
    if path.dialect == "gcode":
        return event.text if _SAME.fullmatch(event.text) else None
    statement = _STATEMENT.fullmatch(event.text.upper())
    name, rest = (statement[1], statement[2] or "") if statement else ("", "")
    arguments = [part.strip() for part in rest.split(",")]
    if name == "STOP":
        return "M0"
    if name == "OPSTOP":
        return "M1"
    if name == "COOLNT":
        return _COOLANT.get(arguments[0])
    if name in ("DELAY", "DWELL") and len(arguments) == 1 and _DWELL.fullmatch(arguments[0]):
        return f"G4 P{arguments[0]}"
    if name == "SPINDL":
        return _format_spindle(arguments, event, path)
    return None


def _format_spindle(arguments: list[str], event: Event, path: ToolPath) -> str | None:
    """Switch the spindle off, or on at its speed; None for a surface speed."""
    if "OFF" in arguments:
        return "M5"
    speed = float(path.spindle[event.record]) if event.record < len(path) else float("nan")
    if not 0.0 < speed < 1e9:
        return None
    turns = _TURN.findall(event.text.upper())  # a tap's hole has several events in one line
    turns = turns or [turn for e in path.events if e.line <= event.line for turn in _TURN.findall(e.text.upper())]
    return f"S{speed:.10g} {'M4' if turns[-1:] == ['CCLW'] else 'M3'}"


def _changes_tool(event: Event, path: ToolPath) -> bool:
    """Tell whether an event is a tool change between motions that the operator has to make."""
    name = event.text.upper()
    tool = name == "M6" or name.startswith("LOAD/TOOL") or name.split("/")[0].strip() in _TOOLS
    return tool and 0 < event.record < len(path)
