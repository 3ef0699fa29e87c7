"""Where a program stops the tool between motions, and for how long."""

from __future__ import annotations

import re
from math import inf

from ..path import Event, ToolPath

# What a controller carries out between motions: spindle, coolant, tool, stops. Modes and messages stop nothing.
_WORDS = "STOP|OPSTOP|DELAY|DWELL|SPINDL|COOLNT|LOADTL|LOAD/TOOL|TOOLNO|AUXFUN"
_STOPPING = re.compile(rf"(?:M\d|G4\b|(?:{_WORDS})\b|INSERT[\s/,]*[\"']?M\d)", re.I)
_DWELL = re.compile(r"(?:G4 P|DELAY/)([-+\d.eE]+)")  # s


def find_stops(path: ToolPath) -> tuple[int, ...]:
    """Find the records at which an event stops the tool, ascending."""
    last = len(path) - 1
    records = {min(event.record, last + 1) - 1 for event in path.events if _STOPPING.match(event.text)}
    records |= {use.record - 1 for use in path.tools if use.changed}
    return tuple(sorted(record for record in records if 0 <= record < last))


def sum_dwells(path: ToolPath) -> float:
    """Sum the dwells that the program states, s; tool changes and stops for the operator take a time of their own."""
    return sum(find_dwell(event) or 0.0 for event in path.events)


def find_dwell(event: Event) -> float | None:
    """Find the seconds that an event waits; None if it does not."""
    match = _DWELL.fullmatch(event.text)
    if match is None:
        return None
    try:
        value = float(match[1])
    except ValueError:
        return None
    return value if 0.0 <= value < inf else None
