"""Read any tool path file: detect its format and call the reader for it."""

import os
import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import Literal

from ...arguments import check_arguments
from ...arrays import Array, Progress
from ...errors import InputError
from ..path import ToolPath
from .cl.reader import read_cl
from .gcode.reader import read_gcode
from .text import BYTE_ORDER_MARK, open_file

_GCODE_SUFFIXES = frozenset((".ngc", ".nc", ".gcode", ".tap", ".cnc"))
_CL_SUFFIXES = frozenset((".apt", ".aptsource", ".cl", ".cls", ".ncl"))
PART_SUFFIXES = _GCODE_SUFFIXES | _CL_SUFFIXES
_LOOKED_AT = 1 << 16  # bytes
_JOINTS = b"joints, made by parakin"  # stands in the head of a program of joint positions
# beginnings of lines that only one of the two formats can have
_CL = re.compile(
    rb"\s*(?:\$\$|(?:PARTNO|PPRINT|GOTO|GODLTA|FROM|UNITS|UNIT|TOOL\s+PATH|TLDATA|MSYS|CUTTER|LOADTL|LOAD|SELECT|FEDRAT|SPINDL|"
    rb"RAPID|MULTAX|PAINT|MACHIN|TLAXIS|ORIGIN|INTOL|OUTTOL|CIRCLE|INDIRV|CYCLE|COOLNT|MODE|MOVARC|CSYS|CUTCOM|GOHOME)\s*(?:[/,\s]|$))",
    re.IGNORECASE,
)
_GCODE = re.compile(rb"\s*(?:[%(;]|/?\s*[A-Z]\s*[-+]?\s*\.?\d)", re.IGNORECASE)


@check_arguments
def read_path(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    workpiece: Array | None = None,
    frame: Literal["file", "ignore"] = "file",
    start: Mapping[str, float] | None = None,
    tools: Mapping[int, float] | None = None,
    reference: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> ToolPath:
    """Read a CL file or a G-code program, whichever it is, as a tool path in mm.

    It is in the workpiece frame of a CL file's first record, or the first work system of a program.

    path : of the file; its suffix tells what it is, else the first line that decides
    arc_tolerance : mm, the largest distance of the straight lines that replace an arc from it
    workpiece : (3, 4), where the part will lie, for G53 in G-code; it does not place the path
    frame : of CL files: take the file's own frame (MSYS, CSYS, CATIA's matrix) as the part's place, or ignore it
    start : of G-code: where the tool is when it starts, in the work system: X to C, mm and degrees
    tools : the tools' lengths by number, mm, as from :func:`parakin.read_tool_table`; they go before those of the file
    reference : of G-code: the machine's reference point (G28, G30): X to C, mm and degrees
    progress : called now and then with the fraction done, 0 to 1

    Raises :class:`InputError` with file and line for what cannot be read or understood.
    """
    source = os.fsdecode(path)
    with open_file(path, source) as file:
        if _JOINTS in (file.read(_LOOKED_AT) or b"").lower():
            raise InputError("a program of joint positions; expected the tool path that it was made from", source)
    if detect_format(path) == "gcode":
        return read_gcode(
            path, arc_tolerance=arc_tolerance, workpiece=workpiece, start=start, tools=tools, reference=reference,
            progress=progress,
        )  # fmt: skip
    for name, given in (("start", start), ("reference", reference)):
        if given is not None:
            raise InputError("only a G-code program takes it for granted; this is a CL file", name)
    return read_cl(path, arc_tolerance=arc_tolerance, frame=frame, tools=tools, progress=progress)


def detect_format(path: str | os.PathLike[str]) -> Literal["cl", "gcode"]:
    """Tell the format of a file by its suffix, else by the first line that decides.

    G-code: .ngc .nc .gcode .tap .cnc; CL: .apt .aptsource .cl .cls .ncl.

    Raises :class:`InputError` if the file cannot be opened.
    """
    suffix = PurePath(os.fsdecode(path)).suffix.lower()
    if suffix in _GCODE_SUFFIXES:
        return "gcode"
    source = os.fsdecode(path)
    with open_file(path, source) as file:
        if suffix in _CL_SUFFIXES:
            return "cl"
        try:
            start = file.read(_LOOKED_AT) or b""
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", source) from error
    for line in start.removeprefix(BYTE_ORDER_MARK).splitlines():
        if _CL.match(line):
            return "cl"
        if _GCODE.match(line):
            return "gcode"
    return "cl"
