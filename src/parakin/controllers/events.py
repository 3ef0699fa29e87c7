"""What a tool path says besides motion, as words of RS274/NGC; what has none there becomes a comment."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ..toolpath.path import Event, ToolPath

_LONGEST = 200  # characters of a comment; LinuxCNC takes 255 in a line
_SAME = re.compile(r"M(?:0|1|3|4|5|7|8|9|60)|S[\d.]+|G4 P[\d.eE+-]+")  # of G-code, carried over as they are
_OVER = re.compile(r"M(?:2|30)")  # the program's own end stands for them
_MESSAGE = re.compile(r"\(\s*msg\s*,(.*)\)", re.I | re.S)
_STATEMENT = re.compile(r"([A-Z-]+)\s*(?:/(.*))?", re.S)
_TURN = re.compile(r"^SPINDL\b.*\b(CC?LW)\b")  # which way the spindle turns; ON says it no more
_WAIT = re.compile(r"\d*\.?\d+")
_TOOLS = {"LOADTL", "TOOLNO"}
_COOLANT = {"ON": "M8", "FLOOD": "M8", "MIST": "M7", "OFF": "M9"}


def spoken(path: ToolPath, places: Sequence[int]) -> dict[int, list[str]]:
    """The lines of a path's events by their places, one for each."""
    found = dict[int, list[str]]()
    for place, event in zip(places, path.events, strict=True):
        found.setdefault(place, []).extend(_lines_of(event, path))
    return found


def _lines_of(event: Event, path: ToolPath) -> Iterator[str]:
    """The lines of an event, without their ends."""
    said = _MESSAGE.fullmatch(event.text)
    if said:
        yield f"(MSG,{_safe(said[1])[:_LONGEST]})"
        return
    if _OVER.fullmatch(event.text):
        return
    word = _word(event, path)
    if word:
        yield word
    else:
        yield from comments(f"line {event.line}: {event.text}")
        if _changes_tool(event, path):
            yield "M0"


def comments(text: str) -> Iterator[str]:
    """A remark as comments, none of them too long, and none that a controller acts upon."""
    plain = _safe(text)
    for begin in range(0, max(len(plain), 1), _LONGEST):
        yield f"( {plain[begin : begin + _LONGEST]} )"


def _safe(text: str) -> str:
    words = " ".join(text.replace("°", " deg").split())
    plain = "".join(c if " " <= c <= "~" else "?" for c in words)
    return plain.translate(str.maketrans("();%", "[],?")).strip()


def _word(event: Event, path: ToolPath) -> str | None:
    if path.dialect == "gcode":
        return event.text if _SAME.fullmatch(event.text) else None
    found = _STATEMENT.fullmatch(event.text.upper())
    name, rest = (found[1], found[2] or "") if found else ("", "")
    given = [part.strip() for part in rest.split(",")]
    if name == "STOP":
        return "M0"
    if name == "OPSTOP":
        return "M1"
    if name == "COOLNT":
        return _COOLANT.get(given[0])
    if name in ("DELAY", "DWELL") and len(given) == 1 and _WAIT.fullmatch(given[0]):
        return f"G4 P{given[0]}"
    if name == "SPINDL":
        return _spindle(given, event, path)
    return None


def _spindle(given: list[str], event: Event, path: ToolPath) -> str | None:
    """On, off, or at a speed; a surface speed is none."""
    if "OFF" in given:
        return "M5"
    speed = float(path.spindle[event.record]) if event.record < len(path) else float("nan")
    if not 0.0 < speed < 1e9:
        return None
    said = [word for e in path.events if e.line <= event.line for word in _TURN.findall(e.text.upper())]
    return f"S{speed:.10g} {'M4' if said[-1:] == ['CCLW'] else 'M3'}"


def _changes_tool(event: Event, path: ToolPath) -> bool:
    """Another tool between motions: the operator has to see to it."""
    name = event.text.upper()
    tool = name == "M6" or name.startswith("LOAD/TOOL") or name.split("/")[0].strip() in _TOOLS
    return tool and 0 < event.record < len(path)
