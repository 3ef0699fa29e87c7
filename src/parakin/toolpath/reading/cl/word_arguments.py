"""The arguments of CL words: numbers, feeds and speeds, tool data; drill cycles are in :mod:`.cycles`.

Pure functions of the text. Errors name no file and no line; the reader adds both.
"""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ....errors import InputError
from ....units import INCH
from ..text import is_number, parse_number, quote_short, refuse

# name: (length unit in mm or None for the file's own, per revolution)
FEED_UNITS: dict[str, tuple[float | None, bool]] = {
    "MMPM": (1.0, False),
    "IPM": (INCH, False),
    "PERMIN": (None, False),
    "MMPR": (1.0, True),
    "IPR": (INCH, True),
    "PERREV": (None, True),
}
SURFACE_SPEEDS = {"SFM": 12.0 * INCH, "SMM": 1000.0}  # mm/min
LENGTH_UNITS = {"MM": 1.0, "INCHES": INCH, "INCH": INCH, "IN": INCH}  # mm
_GEARS = ("RANGE", "MAXRPM")  # of SPINDL: the gear and the most revolutions, each with its value
_BLANKS = re.compile(r"(?<![\d.\s])\s+|(?<!\s)\s++(?![\d.])", re.ASCII)


def remove_blanks(text: str) -> str:
    """Convert to capitals and remove blanks, except between digits: a comma is missing there, and 1 2 is not 12."""
    return _BLANKS.sub("", text).strip().upper()


def parse_numbers(args: Sequence[str], counts: Iterable[int], form: str) -> list[float]:
    """Parse all arguments as numbers; ``counts`` says how many are allowed, ``form`` what the error expects."""
    if len(args) not in counts:
        refuse(f"expected {form}, got {len(args)} value{'' if len(args) == 1 else 's'}")
    try:
        return [parse_number(a) for a in args]
    except InputError as error:
        refuse(f"{error.message}; expected {form}")


def parse_feed(args: Sequence[str]) -> tuple[float, str | None]:
    """Parse FEDRAT: value and unit word, in either order; None where the unit stays as it was."""
    form = "FEDRAT/value,unit with a unit of " + " ".join(FEED_UNITS)
    units = [a for a in args if a in FEED_UNITS]
    rest = [a for a in args if a not in FEED_UNITS]
    if len(units) > 1:
        refuse(f"more than one unit; expected {form}")
    (value,) = parse_numbers(rest, (1,), form)
    if value < 0:
        refuse(f"a feed below zero; expected {form}")
    return value, units[0] if units else None


class SpindleSpeed(NamedTuple):
    """The arguments of SPINDL: the value or None, mm/min in a unit of a surface speed or None, whether it is off."""

    value: float | None
    surface: float | None
    off: bool


def parse_spindle(args: Sequence[str]) -> SpindleSpeed:
    """Parse SPINDL: value and words in any order."""
    form = "SPINDL/value,RPM|SFM|SMM,CLW|CCLW in any order, or SPINDL/ON|OFF"
    words = {"RPM", "CLW", "CCLW", "ON", "OFF", *SURFACE_SPEEDS}
    args = [a for k, a in enumerate(args) if a not in _GEARS and (k == 0 or args[k - 1] not in _GEARS)]
    values = [a for a in args if a not in words]
    if len(values) > 1 or not args:
        refuse(f"expected {form}")
    value = parse_number(values[0]) if values and is_number(values[0]) else None
    if values and (value is None or value < 0):
        refuse(f"{quote_short(values[0])} is no spindle speed; expected {form}")
    surface = next((SURFACE_SPEEDS[a] for a in args if a in SURFACE_SPEEDS), None)
    return SpindleSpeed(value, surface, "OFF" in args)


def parse_dwell(args: Sequence[str]) -> tuple[float, bool]:
    """Parse DELAY: the value, and whether it is in revolutions of the spindle, not seconds."""
    (value,) = parse_numbers([a for a in args if a not in ("REV", "SEC")], (1,), "DELAY/seconds or DELAY/turns,REV")
    return value, "REV" in args


def parse_tool_number(text: str) -> float:
    """Parse a tool's number, refusing one that is not whole or below zero."""
    number = parse_number(text)
    if number < 0.0 or number != int(number):
        refuse(f"{quote_short(text)} is no tool's number; expected a whole one, not below zero")
    return number


def parse_tool_data(args: Sequence[str], scale: float) -> dict[str, float | str]:
    """Parse TLDATA: words for the kind, then for a mill diameter, lower radius, length, taper and tip; lengths to mm.

    scale : mm in the file's unit
    """
    words = [a for a in args if not is_number(a)]
    form = "TLDATA/MILL,diameter,lower radius,length,taper,tip"
    values = (
        [parse_number(a) for a in args[len(words) :]] if args[: len(words)] == words else refuse(f"expected {form}")
    )
    if not words or not values or (words == ["MILL"] and len(values) < 5):
        refuse(f"expected {form}, got {len(values)} number{'' if len(values) == 1 else 's'}")
    tool: dict[str, float | str] = {"type": ",".join(words), "diameter": values[0] * scale}
    if words[-1] == "MILL" and words[0] in ("MILL", "DRILL") and len(values) > 2:
        tool |= {"corner_radius": values[1] * scale, "length": values[2] * scale}
    if words == ["MILL"]:
        tool |= {"taper": values[3], "tip": values[4]}
    return tool


def parse_tool_values(names: Sequence[str], values: Sequence[str], scale: float) -> dict[str, float]:
    """Parse the lengths among the values behind a tool's number, in mm; ``names`` are the dialect's, in order."""
    pairs = zip(names, values, strict=False)
    return {name: parse_number(value) * scale for name, value in pairs if name.endswith("length")}
