"""List what a tool path says besides motion as commands that every control's dialect can put into its own words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from ..errors import PoseError
from ..toolpath.path import Event, ToolPath, ToolUse
from ..toolpath.posting.tool_lengths import describe_tool
from ..toolpath.timing.stops import find_dwell
from .gcode_text import make_plain

# of G-code, carried over as they are: spindle, coolant, stops, dwells, outputs, inputs, the controller's own codes
_NUMBER = r"[-+\d.eE]+"
_SAME = re.compile(rf"M\d+(?: [PQREL]{_NUMBER})*|S{_NUMBER}|G4 P{_NUMBER}")
# M codes that become comments: of the tool, whose change is a stop for the operator and may bring no length offset, and
# those that save and restore modes which the program sets itself
COMMENTED = frozenset((6, 61, 70, 71, 72, 73))
_END = re.compile(r"M(?:2|30)")  # the program's own end replaces them
_MESSAGE = re.compile(r"\(\s*msg\s*,(.*)\)", re.I | re.S)
_STATEMENT = re.compile(r"([A-Z-]+)\s*(?:/(.*))?", re.S)
_TURN = re.compile(r"^SPINDL\b.*\b(CC?LW)\b")  # which way the spindle turns; a later ON does not repeat it
_INSERTED = re.compile(r"INSERT[\s/,]*[\"']?M(\d{1,9})[\"']?", re.I)  # a word that the file gives the controller itself
_KEPT_BACK = COMMENTED | {2, 30, 98, 99}  # M codes that no INSERT and no AUXFUN may give
_LOADING = re.compile(r"M6$|(?:LOADTL|TOOLNO)\b|LOAD\s*/\s*TOOL\b", re.I)  # statements that change the tool
_COOLANT = {"ON": "M8", "FLOOD": "M8", "MIST": "M7", "OFF": "M9"}
_OWN_CODE = re.compile(r"(?:AUXFUN|INSERT)\b", re.I)  # statements that give an M code of the machine's own
_FIRST_OWN_CODE, _LARGEST_CODE = 100, 199  # of the M codes that RS274/NGC leaves to the machine


class Command(NamedTuple):
    """What a program says besides motion.

    kind : ``code`` is G-code's words for spindle, coolant, stops, outputs; ``own`` an M code whose meaning is the
        machine's own; ``dwell`` a wait; ``message`` is shown to the operator; ``remark`` acts upon nothing
    text : the words, the seconds, or the text as the file has it
    line : of the file, 1-based
    """

    kind: Literal["code", "own", "dwell", "message", "remark"]
    text: str
    line: int


def list_commands(path: ToolPath, places: Sequence[int]) -> dict[int, list[Command]]:
    """List a path's events as commands by place, ``places`` having one for each event.

    Before a tool is changed spindle and coolant are stopped; what the file says after it starts them again.

    Raises :class:`PoseError` with file and line for an event that no controller can be told.
    """
    commands = dict[int, list[Command]]()
    changes = _find_changes(path)
    turns = _list_turns(path)
    for number, (place, event) in enumerate(zip(places, path.events, strict=True)):
        here = commands.setdefault(place, [])
        if number in changes:
            use = changes[number]
            here += [Command("code", "M5", event.line), Command("code", "M9", event.line)]
            here += [] if use is None else [Command("message", _describe_change(use), event.line)]
        here += _translate_event(event, path, turns[number])
        here += [Command("code", "M0", event.line)] if number in changes else []
    return commands


def check_events(path: ToolPath) -> None:
    """Refuse a path with an event that no controller can be told; see :func:`list_commands`."""
    for event, turn in zip(path.events, _list_turns(path), strict=True):
        _find_word(event, path, turn)


def _find_changes(path: ToolPath) -> dict[int, ToolUse | None]:
    """Find the events that change the tool, by their numbers: the statement that loads it, else the first one there.

    A path that does not tell its tools is judged by its statements, and the tools are None.
    """
    changes = dict[int, ToolUse | None]()
    if not any(use.data for use in path.tools):
        between = (number for number, event in enumerate(path.events) if 0 < event.record < len(path))
        return {number: None for number in between if _LOADING.match(path.events[number].text)}
    for use in path.tools:
        if not (use.changed and 0 < use.record < len(path)):
            continue
        there = [number for number, event in enumerate(path.events) if event.record == use.record]
        loading = [number for number in there if path.events[number].line == use.line]
        if there:
            changes[(loading or there)[0]] = use
    return changes


def _describe_change(use: ToolUse) -> str:
    """Describe to the operator which tool comes next."""
    return f"{describe_tool(use)}, length {use.length:.6g} mm"


def _list_turns(path: ToolPath) -> list[str]:
    """List for each event which way the spindle turns from there on, as SPINDL has said last: CLW or CCLW."""
    turn, turns = "CLW", []
    for event in path.events:
        turn = next(iter(_TURN.findall(event.text.upper())), turn)
        turns.append(turn)
    return turns


def _translate_event(event: Event, path: ToolPath, turn: str) -> Iterator[Command]:
    """Yield the commands of an event."""
    message = _MESSAGE.fullmatch(event.text)
    seconds = find_dwell(event)
    if message:
        yield Command("message", message[1], event.line)
    elif _END.fullmatch(event.text):
        return
    elif seconds is not None:
        yield Command("dwell", f"{seconds:.10g}", event.line)
    else:
        word = _find_word(event, path, turn)
        if word is None:
            yield Command("remark", f"line {event.line}: {event.text}", event.line)
        else:
            yield Command("own" if _is_own(event, path) else "code", word, event.line)


def _is_own(event: Event, path: ToolPath) -> bool:
    """Tell whether an event gives an M code whose meaning is the machine's own."""
    if path.dialect == "gcode":
        code = re.fullmatch(r"M(\d+)", event.text)
        return code is not None and int(code[1]) >= _FIRST_OWN_CODE
    return bool(_OWN_CODE.match(event.text))


def _find_word(event: Event, path: ToolPath, turn: str) -> str | None:
    """Find the G-code word that says the same as an event; None where there is none.

    turn : CLW or CCLW, which way the spindle turns from the event on
    """
    if path.dialect == "gcode":
        return _keep_word(event, path)
    statement = _STATEMENT.fullmatch(event.text.upper())
    name, rest = (statement[1], statement[2] or "") if statement else ("", "")
    arguments = [word.strip() for word in rest.split(",")]
    if name == "STOP":
        return "M0"
    if name == "OPSTOP":
        return "M1"
    if name == "COOLNT":
        return _COOLANT["OFF"] if "OFF" in arguments else _COOLANT.get(arguments[0])
    if name == "SPINDL":
        return _format_spindle(arguments, event, path, turn)
    if name == "AUXFUN":
        return _format_auxiliary(arguments, event, path)
    inserted = _INSERTED.fullmatch(event.text)
    if inserted is None or (event.record == len(path) and _END.fullmatch(f"M{int(inserted[1])}")):
        return None
    return _format_auxiliary([inserted[1]], event, path)


def _keep_word(event: Event, path: ToolPath) -> str | None:
    """Keep a G-code word as it is; None where it sets what the program sets itself."""
    if not _SAME.fullmatch(event.text):
        return None
    code = re.match(r"M(\d+)", event.text)
    number = int(code[1]) if code else 0
    if number in COMMENTED:
        return None
    if number > _LARGEST_CODE:
        raise PoseError(f"{path.source}:{event.line}: M{number} can't be passed on; M0 to M{_LARGEST_CODE} expected")
    return event.text


def _format_auxiliary(arguments: list[str], event: Event, path: ToolPath) -> str:
    """Switch what the controller calls by an M code (AUXFUN, INSERT)."""
    number = arguments[0] if len(arguments) == 1 else ""
    if not number.isascii() or not number.isdigit() or int(number) > _LARGEST_CODE or int(number) in _KEPT_BACK:
        raise PoseError(
            f"{path.source}:{event.line}: {make_plain(event.text)[:40]} can't be passed on; "
            f"the number of an M code that moves nothing and changes no tool expected"
        )
    return f"M{int(number)}"


def _format_spindle(arguments: list[str], event: Event, path: ToolPath, turn: str) -> str | None:
    """Switch the spindle off, or on at its speed; None where that is not known."""
    if "OFF" in arguments:
        return "M5"
    speed = float(path.spindle[event.record]) if event.record < len(path) else float("nan")
    if speed == 0.0:
        return "M5"
    if not speed < 1e9:
        return None
    return f"S{speed:.10g} {'M4' if turn == 'CCLW' else 'M3'}"
