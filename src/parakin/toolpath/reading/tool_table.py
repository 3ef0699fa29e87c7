"""Read a tool table as LinuxCNC keeps it: a line a tool, ``T1 P1 Z+75 D10 ;ball mill``."""

import os
import re

from ...arguments import check_arguments
from ...errors import InputError
from .text import BYTE_ORDER_MARK, decode_line, open_file, parse_number, quote_short

_WORD = re.compile(r"([A-Za-z])\s*([-+]?[\d.]+)\s*")
_LETTERS = "TPXYZABCUVWDIJQ"
_LARGEST_FILE = 4_000_000  # bytes
_FORM = "expected T, the tool's number, P, its pocket, and Z, its length in mm, such as T1 P1 Z+75 D10"


@check_arguments
def read_tool_table(path: str | os.PathLike[str]) -> dict[int, float]:
    """Read the lengths of tools by number, mm: from the spindle's nose to the tip, the table's Z.

    path : of the file, a line a tool as LinuxCNC keeps it: ``T1 P1 Z+75 D10 ;ball mill``

    A tool without Z has length 0, as LinuxCNC has it.

    Raises :class:`InputError` with file and line for what is no tool table, and for a length below zero.
    """
    source = os.fsdecode(path)
    try:
        with open_file(path, source) as file:
            data = file.read(_LARGEST_FILE + 1) or b""
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source) from error
    if len(data) > _LARGEST_FILE:
        raise InputError(f"more than {_LARGEST_FILE} bytes; expected a tool table", source)
    lengths: dict[int, float] = {}
    for number, line in enumerate(data.removeprefix(BYTE_ORDER_MARK).split(b"\n"), 1):
        text = decode_line(line).partition(";")[0].strip()
        if text:
            try:
                tool, length = _parse_tool(text)
            except InputError as error:
                raise InputError(error.message, source, number) from None
            if tool in lengths:
                raise InputError(f"tool {tool} is given twice", source, number)
            lengths[tool] = length
    if not lengths:
        raise InputError(f"no tools; {_FORM}", source)
    return lengths


def _parse_tool(text: str) -> tuple[int, float]:
    """Parse a line without its comment; return the tool's number and its length."""
    words, at = dict[str, float](), 0
    while at < len(text):
        word = _WORD.match(text, at)
        letter = word[1].upper() if word else ""
        if word is None or letter not in tuple(_LETTERS) or letter in words:
            raise InputError(f"{quote_short(text[at:])}; {_FORM}")
        words[letter], at = parse_number(word[2]), word.end()
    tool = words.get("T", -1.0)
    if not (tool >= 0.0 and tool == int(tool)):
        raise InputError(f"no tool's number; {_FORM}")
    offset = next((letter for letter in "XYABCUVW" if words.get(letter)), None)
    if offset is not None:
        raise InputError(f"an offset of the tool in {offset}; expected a tool in the spindle's axis, told by its Z")
    length = words.get("Z", 0.0)
    if length < 0.0:
        raise InputError(f"Z{length:g}: a length below zero; expected the distance from the spindle's nose to the tip")
    return int(tool), length
