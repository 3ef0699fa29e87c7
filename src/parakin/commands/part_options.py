"""The options of ``parakin post`` that say how the part's file is read, and the reading of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from ..errors import InputError, PoseError
from ..units import AXIS_UNITS
from .values import parse_value, split_assignments

if TYPE_CHECKING:
    from ..arrays import Array, Progress
    from ..machine import Machine
    from ..toolpath.path import ToolPath
    from ..toolpath.posting.tool_lengths import ToolLength

_EXAMPLE = "X=0,Y=0,Z=50"
_ARGUMENTS = {"frame", "start", "reference", "tools", "arc_tolerance"}  # of read_path; options have their names


def complete_tool_length(context: Any) -> list[str]:
    """List the words that ``--tool-length`` takes in place of mm, for the shell's completion."""
    return [word for word in ("file", "machine") if word.startswith(context.incomplete)]


FrameChoice = Annotated[
    Literal["file", "ignore"],
    Parameter(
        help="Take a CL file's own frame (MSYS, CSYS, CATIA's matrix) as the part's place in the machine, or ignore it."
    ),
]
Start = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help="Where a G-code program takes the tool to be when it starts, in its work system: X=0,Y=0,Z=50.",
    ),
]
Reference = Annotated[
    str | None,
    Parameter(
        allow_leading_hyphen=True,
        help="The machine's reference point (G28, G30) in the machine's coordinates: X=0,Y=0,Z=-1500.",
    ),
]
ToolTable = Annotated[
    Path | None,
    Parameter(help="A tool table of LinuxCNC with the tools' lengths; it goes before the lengths in the file."),
]
ToolLengthText = Annotated[
    str | None,
    Parameter(
        completer=complete_tool_length,
        help=(
            "How long the longest tool is from the spindle's nose to its tip, in mm; file: all tools as the file says, "
            "machine: all as the machine's own. Without it a file that contradicts the machine's own is refused."
        ),
    ),
]


@dataclass(frozen=True)
class PartOptions:
    """How a part's file is read, as written on the command line."""

    frame: Literal["file", "ignore"] = "file"
    start: str | None = None
    reference: str | None = None
    tools: Path | None = None


def read_part(
    part: Path, options: PartOptions, arc_tolerance: float, workpiece: Array | None, progress: Progress
) -> ToolPath:
    """Read a part's file; errors about arguments name the option.

    arc_tolerance, workpiece : as for :func:`parakin.read_path`
    """
    from ..toolpath.reading.detect import read_path
    from ..toolpath.reading.tool_table import read_tool_table

    arguments: dict[str, Any] = {"frame": options.frame}
    for name in ("start", "reference"):
        text = getattr(options, name)
        if text is not None:
            arguments[name] = parse_point(text, f"--{name}")
    if options.tools is not None:
        arguments["tools"] = read_tool_table(options.tools)
    try:
        return read_path(part, arc_tolerance=arc_tolerance, workpiece=workpiece, progress=progress, **arguments)
    except InputError as error:
        if error.source in _ARGUMENTS:
            raise InputError(error.message, f"--{error.source.replace('_', '-')}") from None
        message = error.message.replace("a stated reference", "--reference").replace("a table of tools", "--tools")
        message = message.replace("a stated start", "--start")
        raise InputError(message, error.source, error.line) from None


def parse_tool_length(text: str | None, tools: Path | None) -> ToolLength:
    """Parse the option ``--tool-length``: mm, with or without a unit, ``file`` or ``machine``."""
    if text is None:
        return None
    if tools is not None:
        raise InputError("--tools tells the lengths; expected it or --tool-length", "--tool-length")
    if text == "file":
        return "file"
    if text == "machine":
        return "machine"
    return parse_value("length", text, "--tool-length", "mm")


def fit_part(machine: Machine, path: ToolPath, length: ToolLength, workpiece: Array | None) -> ToolPath:
    """Fit a path to its tools' lengths; errors name the option."""
    from ..toolpath.posting.tool_lengths import fit_tool_lengths

    try:
        return fit_tool_lengths(machine, path, length, workpiece=workpiece)
    except PoseError as error:
        raise InputError(str(error).removeprefix("length: "), "--tool-length") from None
    except InputError as error:
        raise InputError(
            error.message.replace("expected ", "expected --tool-length ", 1), error.source, error.line
        ) from None


def parse_point(text: str, option: str) -> dict[str, float]:
    """Parse coordinates ``X=0,Y=0,Z=50,C=90`` or ``x,y,z[,a,b,c]``; return them by axis, mm and degrees.

    Plain numbers are mm and degrees; a unit may follow.

    Raises :class:`InputError`.
    """
    words = [word.strip() for word in text.split(",")]
    if not any("=" in word for word in words) and len(words) in (3, 6):
        words = [f"{axis}={word}" for axis, word in zip(AXIS_UNITS, words, strict=False)]
    values: dict[str, float] = {}
    form = f"AXIS=VALUE for each axis, such as {_EXAMPLE}"
    for axis, value in split_assignments(",".join(words), AXIS_UNITS, option, form):
        number = parse_value(axis, value, option)
        values[axis] = round(math.degrees(number), 12) if AXIS_UNITS[axis] == "rad" else number
    return values
