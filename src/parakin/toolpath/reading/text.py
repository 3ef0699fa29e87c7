"""Read what tool path files are made of: lines, numbers, and the limits that the CL and G-code readers share.

Errors name no file and no line; the reader that calls adds both.
"""

import io
import math
import os
import re
import stat
from collections.abc import Container, Mapping
from numbers import Real
from pathlib import Path
from typing import Any, NoReturn

from ...errors import InputError

LARGEST = 1e9  # the largest number in a file: a thousand kilometres in mm
READ_SIZE = 1 << 20  # bytes read from a file at a time
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_NUMBER = re.compile(r"([+-]?)\s*(\d+(?:\.\d*)?|\.\d+)(?:[EeDd]([+-]?\d+))?", re.ASCII)
_LONGEST_EXPONENT = 6  # characters; keeps float() fast on hostile input


def open_file(path: str | os.PathLike[str], source: str) -> io.FileIO:
    """Open a file for reading without a buffer; ``source`` is its name in the InputError if that fails.

    A pipe is refused: its format is looked for before it is read, and what is read of it once is gone.
    """
    if not source:
        raise InputError("an empty name; expected a file's", "path")
    try:
        mode = Path(path).stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise InputError("cannot be read: a pipe or a device; expected a plain file", source)
        return Path(path).open("rb", buffering=0)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source) from error
    except ValueError as error:
        raise InputError("cannot be read: a null character in the name", quote_short(source)) from error


def check_arc_tolerance(tolerance: float) -> None:
    """Refuse a chord tolerance (mm) that is not above zero and finite."""
    if not 0.0 < tolerance < float("inf"):
        raise InputError("expected a length above zero, in mm", "arc_tolerance")


def check_numbers(values: Mapping[Any, Any] | None, names: Container[Any] | None, name: str, form: str) -> None:
    """Refuse an argument of numbers by names unless all are finite, and the names are allowed; None allows any."""
    for key, value in (values or {}).items():
        is_number = isinstance(value, Real) and math.isfinite(value)
        if not is_number or (names is not None and key not in names):
            raise InputError(f"expected {form}", name)


def check_tool_lengths(tools: Mapping[int, float] | None) -> None:
    """Refuse lengths of tools that are not finite, or not by whole numbers."""
    check_numbers(tools, None, "tools", "lengths in mm by the numbers of tools")
    check_numbers({key: key for key in tools or ()}, None, "tools", "lengths in mm by the numbers of tools")


def describe_control(character: str) -> str:
    """Describe a control character, which no line of text may hold."""
    described = {
        "\0": "a NUL byte: a binary or UTF-16 file; expected plain text",
        "\r": "a carriage return within a line; expected lines that end in LF or CR LF",
    }
    return described.get(character, f"a control character ({ord(character)}); expected plain text")


def decode_line(raw: bytes | bytearray) -> str:
    """Decode a line as UTF-8, or as Windows-1252 where it is not UTF-8."""
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def quote_short(text: str, longest: int = 24) -> str:
    """Quote a text for a message: printable ASCII, in one line, cut to ``longest`` characters."""
    return ascii(text if len(text) <= longest else text[: longest - 3] + "...")


def refuse(message: str, line: int | None = None) -> NoReturn:
    """Raise an InputError without file, and without a line unless it is another one than the reader's own."""
    raise InputError(message, None, line)


def parse_number(token: str) -> float:
    """Parse a decimal number, refusing NaN, infinities, underscores and blanks between digits."""
    match = _NUMBER.fullmatch(token.strip())
    if match is None:
        refuse(f"{quote_short(token.strip())} is not a number")
    sign, digits, exponent = match.groups()
    if exponent is not None and len(exponent) > _LONGEST_EXPONENT:
        refuse(f"{quote_short(token.strip())} is out of range")
    value = float(f"{sign}{digits}e{exponent or 0}")  # rounds correctly, whatever the number of digits
    if not abs(value) <= LARGEST:
        refuse(f"{quote_short(token.strip())} is out of range")
    return value


def is_number(token: str) -> bool:
    """Tell whether :func:`parse_number` can read a token, whatever its size."""
    return _NUMBER.fullmatch(token.strip()) is not None
