"""The words of a CL statement: numbers, feeds and speeds, drill cycles, tool data.

Pure functions of the text. What is wrong is raised as an InputError without a place; the reader adds file and line.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NoReturn

from ....errors import InputError

AXIS_TOLERANCE = 1e-3  # beyond this off unit length an axis earns a note
SMALLEST_SQUARE = 1e-12  # no direction is read from an axis whose squared length is below this
LARGEST = 1e9  # no number in a CL file is larger: a thousand kilometres
INCH = 25.4

# name: (length unit in mm or None for the file's own, per revolution)
FEED_UNITS: dict[str, tuple[float | None, bool]] = {
    "MMPM": (1.0, False),
    "IPM": (INCH, False),
    "PERMIN": (None, False),
    "MMPR": (1.0, True),
    "IPR": (INCH, True),
    "PERREV": (None, True),
}
_BLANKS = re.compile(r"(?<![\d.])\s+|\s+(?![\d.])", re.ASCII)
_NUMBER = re.compile(r"([+-]?)\s*(\d+\.?\d*|\.\d+)(?:[EeDd]([+-]?\d+))?", re.ASCII)


def quoted(text: str, most: int = 24) -> str:
    """The text, printable, in one line, and short enough for a message."""
    return ascii(text if len(text) <= most else text[: most - 3] + "...")


def squeezed(text: str) -> str:
    """In capitals and without blanks, but for those between digits: there a comma is missing, and 1 2 is not 12."""
    return _BLANKS.sub("", text).strip().upper()


def refuse(message: str) -> NoReturn:
    raise InputError(message)


def number(token: str) -> float:
    """A decimal number; NaN, infinities, underscores and blanks between digits are none."""
    found = _NUMBER.fullmatch(token.strip())
    if found is None:
        refuse(f"{quoted(token.strip())} is not a number")
    sign, digits, exponent = found.groups()
    # float() rounds correctly, and no digits are too many for it; the exponent's length is bounded to keep it fast
    if exponent is not None and len(exponent) > 6:
        refuse(f"{quoted(token.strip())} is out of range")
    value = float(f"{sign}{digits}e{exponent or 0}")
    if not abs(value) <= LARGEST:
        refuse(f"{quoted(token.strip())} is out of range")
    return value


def is_number(token: str) -> bool:
    return _NUMBER.fullmatch(token.strip()) is not None


def numbers(args: Sequence[str], counts: Iterable[int], form: str) -> list[float]:
    """All arguments as numbers; ``form`` says what was expected, ``counts`` how many are allowed."""
    if len(args) not in counts:
        refuse(f"expected {form}, got {len(args)} value{'' if len(args) == 1 else 's'}")
    try:
        return [number(a) for a in args]
    except InputError as error:
        refuse(f"{error.message}; expected {form}")


def feed(args: Sequence[str]) -> tuple[float, str | None]:
    """Value and unit word of FEDRAT, in either order; None if the unit is left as it was."""
    form = "FEDRAT/value,unit with a unit of " + " ".join(FEED_UNITS)
    units = [a for a in args if a in FEED_UNITS]
    rest = [a for a in args if a not in FEED_UNITS]
    if len(units) > 1:
        refuse(f"more than one unit; expected {form}")
    (value,) = numbers(rest, (1,), form)
    if value < 0:
        refuse(f"a feed below zero; expected {form}")
    return value, units[0] if units else None


def spindle(args: Sequence[str]) -> tuple[float | None, bool, bool]:
    """Value of SPINDL or None, whether it is a surface speed, and whether the spindle is switched off."""
    form = "SPINDL/value,RPM|SFM|SMM,CLW|CCLW in any order, or SPINDL/ON|OFF"
    known = {"RPM", "SFM", "SMM", "CLW", "CCLW", "ON", "OFF"}
    values = [a for a in args if a not in known]
    if len(values) > 1 or not args:
        refuse(f"expected {form}")
    value = number(values[0]) if values and is_number(values[0]) else None
    if values and (value is None or value < 0):
        refuse(f"{quoted(values[0])} is no spindle speed; expected {form}")
    return value, "SFM" in args or "SMM" in args, "OFF" in args


@dataclass(frozen=True)
class DrillCycle:
    """CYCLE/DRILL as NX writes it. Distances along the tool axis from the hole's point, in the file's unit.

    clear : where rapid ends above the hole
    depth : where the feed ends, below it
    retract : where the tool withdraws to, or None for the height it came from (RTRCTO,AUTO)
    feed : value and unit word, or None for the feed in force
    """

    clear: float
    depth: float
    retract: float | None
    feed: tuple[float, str] | None


def drill_cycle(args: Sequence[str]) -> DrillCycle:
    """The cycle, or an InputError where its motion isn't settled by the statement alone."""
    form = "CYCLE/DRILL,RAPTO,r,FEDTO,d[,RTRCTO,r|AUTO][,MMPM|IPM|MMPR|IPR,feed]; write other cycles as plain motion"
    if not args or args[0] != "DRILL":
        refuse(f"a cycle that cannot be turned into motion: {quoted('/'.join(args[:1]))}; expected {form}")
    rest = list(args[1:])
    values: dict[str, float] = {}
    auto = False
    rate: tuple[float, str] | None = None
    while rest:
        word = rest.pop(0)
        if word == "MANUAL" and "RTRCTO" in values:
            continue
        if word == "RTRCTO" and rest and rest[0] == "AUTO":
            rest.pop(0)
            auto = True
            continue
        name = {"CLEAR": "RAPTO"}.get(word, word)
        if name not in ("RAPTO", "FEDTO", "RTRCTO", *FEED_UNITS) or not rest:
            refuse(f"{quoted(word)} in a cycle that cannot be turned into motion; expected {form}")
        (value,) = numbers([rest.pop(0)], (1,), form)
        if name in FEED_UNITS:
            rate = (value, name)
        else:
            values[name] = value
    if "RAPTO" not in values or "FEDTO" not in values:
        refuse(f"a cycle without RAPTO and FEDTO; expected {form}")
    clear, depth = values["RAPTO"], values["FEDTO"]
    retract = None if auto else values.get("RTRCTO", clear)
    if not depth < clear or (retract is not None and retract < clear) or (rate is not None and rate[0] < 0):
        refuse(f"expected FEDTO below RAPTO, RTRCTO not below it and a feed of zero or more in {form}")
    return DrillCycle(clear, depth, retract, rate)


def tool_data(args: Sequence[str], scale: float) -> dict[str, float | str]:
    """TLDATA: words for the kind, then for a mill diameter, lower radius, length, taper and tip; lengths to mm."""
    words = [a for a in args if not is_number(a)]
    form = "TLDATA/MILL,diameter,lower radius,length,taper,tip"
    values = [number(a) for a in args[len(words) :]] if args[: len(words)] == words else refuse(f"expected {form}")
    if not words or not values or (words == ["MILL"] and len(values) < 5):
        refuse(f"expected {form}, got {len(values)} number{'' if len(values) == 1 else 's'}")
    tool: dict[str, float | str] = {"type": ",".join(words), "diameter": values[0] * scale}
    if words == ["MILL"]:
        tool |= {"corner_radius": values[1] * scale, "length": values[2] * scale, "taper": values[3], "tip": values[4]}
    return tool
