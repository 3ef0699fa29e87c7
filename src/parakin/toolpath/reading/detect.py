"""Any file of a tool path: which reader it is for."""

import os
import re
from pathlib import PurePath
from typing import Literal

from ...errors import InputError
from ..path import Floats, ToolPath
from .cl.reader import Progress, opened, read_cl
from .gcode.reader import read_gcode

_GCODE_SUFFIXES = frozenset((".ngc", ".nc", ".gcode", ".tap", ".cnc"))
_LOOKED_AT = 1 << 16  # bytes
_JOINTS = b"joints, made by parakin )"  # of the head of such a program
# how lines begin that only one of the two can have
_CL = re.compile(
    rb"\s*(?:\$\$|(?:PARTNO|PPRINT|GOTO|GODLTA|FROM|UNITS|TOOL\s+PATH|TLDATA|MSYS|CUTTER|LOADTL|LOAD|SELECT|FEDRAT|SPINDL|"
    rb"RAPID|MULTAX|PAINT|MACHIN|TLAXIS|ORIGIN|INTOL|OUTTOL|CIRCLE|INDIRV|CYCLE|COOLNT)\s*(?:[/,\s]|$))",
    re.IGNORECASE,
)
_GCODE = re.compile(rb"\s*(?:[%(;]|/?\s*[A-Z]\s*[-+]?\s*\.?\d)", re.IGNORECASE)


def read_path(
    path: str | os.PathLike[str],
    *,
    arc_tolerance: float = 0.01,
    workpiece: Floats | None = None,
    progress: Progress | None = None,
) -> ToolPath:
    """Read a CL file or a G-code program, whichever it is; see :func:`read_cl` and :func:`read_gcode`.

    ``workpiece`` is for G53 in G-code; it does not place the path.
    """
    if sniff(path) == "gcode":
        source = os.fsdecode(path)
        with opened(path, source) as file:
            if _JOINTS in (file.read(_LOOKED_AT) or b""):
                raise InputError("a program of joint positions; expected the tool path that it was made from", source)
        return read_gcode(path, arc_tolerance=arc_tolerance, workpiece=workpiece, progress=progress)
    return read_cl(path, arc_tolerance=arc_tolerance, progress=progress)


def sniff(path: str | os.PathLike[str]) -> Literal["cl", "gcode"]:
    """What a file is: by its suffix (.ngc .nc .gcode .tap .cnc), else by the first line that only one of them can have.

    Raises :class:`InputError` if the file cannot be opened.
    """
    if PurePath(os.fsdecode(path)).suffix.lower() in _GCODE_SUFFIXES:
        return "gcode"
    source = os.fsdecode(path)
    with opened(path, source) as file:
        try:
            start = file.read(_LOOKED_AT) or b""
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", source) from error
    for line in start.removeprefix(b"\xef\xbb\xbf").splitlines():
        if _CL.match(line):
            return "cl"
        if _GCODE.match(line):
            return "gcode"
    return "cl"
