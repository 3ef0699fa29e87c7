"""Where a program stops the tool between motions, and for how long."""

from __future__ import annotations

import re
from math import inf

from ..path import Event, ToolPath

# What a controller carries out between motions: spindle, coolant, tool, stops. Modes and messages stop nothing.
_HALTS = re.compile(r"(?:M\d|G4\b|(?:STOP|OPSTOP|DELAY|DWELL|SPINDL|COOLNT|LOADTL|LOAD/TOOL|TOOLNO|AUXFUN)\b)", re.I)
_WAIT = re.compile(r"(?:G4 P|(?:DELAY|DWELL)\s*/\s*)([-+\d.eE]+)\s*$", re.I)  # seconds; DELAY/2,REV waits for turns


def stops(path: ToolPath) -> tuple[int, ...]:
    """The records at which an event stops the tool, ascending."""
    last = len(path) - 1
    records = {min(event.record, last + 1) - 1 for event in path.events if _HALTS.match(event.text)}
    return tuple(sorted(record for record in records if 0 <= record < last))


def waiting(path: ToolPath) -> float:
    """How long the program waits by its own words, s; tool changes and stops for the operator take their own time."""
    return sum(_seconds(event) for event in path.events)


def _seconds(event: Event) -> float:
    found = _WAIT.match(event.text)
    try:
        seconds = float(found[1]) if found else 0.0
    except ValueError:
        return 0.0
    return seconds if 0.0 <= seconds < inf else 0.0
