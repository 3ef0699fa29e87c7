"""Where a program stops the tool between motions, and for how long."""

from __future__ import annotations

import re
from math import inf

from ..path import Event, ToolPath

# What a controller carries out between motions: spindle, coolant, tool, stops. Modes and messages stop nothing.
_WORDS = "STOP|OPSTOP|DELAY|DWELL|SPINDL|COOLNT|LOADTL|LOAD/TOOL|TOOLNO|AUXFUN"
_STOPPING = re.compile(rf"(?:M\d|G4\b|(?:{_WORDS})\b|INSERT[\s/,]*[\"']?M\d)", re.I)
_DWELL = re.compile(r"(?:G4 P|(?:DELAY|DWELL)\s*/\s*)([-+\d.eE]+)\s*(?:,\s*(REV|SEC)\s*)?", re.I)  # s, or turns


def find_stops(path: ToolPath) -> tuple[int, ...]:
    """Find the records at which an event stops the tool, ascending."""
    last = len(path) - 1
    records = {min(event.record, last + 1) - 1 for event in path.events if _STOPPING.match(event.text)}
    records |= {use.record - 1 for use in path.tools if use.changed}
    return tuple(sorted(record for record in records if 0 <= record < last))


def sum_dwells(path: ToolPath) -> float:
    """Sum the dwells that the program states, s; tool changes and stops for the operator take a time of their own."""
    return sum(find_dwell(event, path) or 0.0 for event in path.events)


def find_dwell(event: Event, path: ToolPath) -> float | None:
    """Find the seconds that an event waits; None if it does not, or for turns of a spindle whose speed is not known."""
    match = _DWELL.fullmatch(event.text)
    if match is None:
        return None
    try:
        value = float(match[1])
    except ValueError:
        return None
    if (match[2] or "").upper() == "REV":
        speed = float(path.spindle[max(0, min(event.record, len(path)) - 1)]) if len(path) else 0.0
        value = 60.0 * value / speed if speed > 0.0 else inf
    return value if 0.0 <= value < inf else None
