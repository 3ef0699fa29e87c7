"""Where a program stops the tool between motions, and for how long."""

from __future__ import annotations

import re
from math import inf

from ..path import Event, ToolPath

# What a controller carries out between motions: spindle, coolant, tool, stops. Modes and messages stop nothing.
_STOPPING = re.compile(r"(?:M\d|G4\b|(?:STOP|OPSTOP|DELAY|DWELL|SPINDL|COOLNT|LOADTL|LOAD/TOOL|TOOLNO|AUXFUN)\b)", re.I)
_DWELL = re.compile(r"(?:G4 P|(?:DELAY|DWELL)\s*/\s*)([-+\d.eE]+)\s*$", re.I)  # s; DELAY/2,REV waits for turns


def find_stops(path: ToolPath) -> tuple[int, ...]:
    """Find the records at which an event stops the tool, ascending."""
    last = len(path) - 1
    records = {min(event.record, last + 1) - 1 for event in path.events if _STOPPING.match(event.text)}
    records |= {use.record - 1 for use in path.tools if use.changed}
    return tuple(sorted(record for record in records if 0 <= record < last))


def sum_dwells(path: ToolPath) -> float:
    """Sum the dwells that the program states, s; tool changes and stops for the operator take a time of their own."""
    return sum(_parse_dwell(event) for event in path.events)


def _parse_dwell(event: Event) -> float:
    """Parse the seconds that an event waits; 0 if it does not, or waits for something else."""
    match = _DWELL.match(event.text)
    try:
        seconds = float(match[1]) if match else 0.0
    except ValueError:
        return 0.0
    return seconds if 0.0 <= seconds < inf else 0.0
