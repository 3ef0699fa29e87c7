"""Write what a tool path says besides motion in RS274/NGC; what has no word there becomes a comment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..toolpath.path import ToolPath
from .event_commands import Command, list_commands
from .gcode_text import LONGEST_COMMENT, format_comments, make_plain


def format_events(path: ToolPath, places: Sequence[int]) -> dict[int, list[str]]:
    """Format a path's events; return the lines by place, ``places`` having one for each event.

    Raises :class:`PoseError` with file and line for an event that no controller can be told.
    """
    return {
        place: [line for command in commands for line in format_command(command)]
        for place, commands in list_commands(path, places).items()
    }


def format_command(command: Command) -> Iterator[str]:
    """Format the lines of a command, without their ends."""
    if command.kind == "remark":
        yield from format_comments(command.text)
    elif command.kind == "message":
        yield f"(MSG,{make_plain(command.text)[:LONGEST_COMMENT]})"
    elif command.kind == "dwell":
        yield f"G4 P{command.text}"
    else:
        yield command.text
