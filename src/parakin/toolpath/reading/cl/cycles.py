"""Drill cycles of CL files: the arguments of CYCLE in each dialect.

Pure functions of the text. Errors name no file and no line; the reader adds both.
"""

from collections.abc import Sequence
from typing import NamedTuple

from ..text import is_number, parse_number, quote_short, refuse
from .dialects import BELOW, DOWN, HEIGHT, Dialect
from .file_frames import Triple
from .word_arguments import FEED_UNITS, parse_numbers

# name of a cycle: how its motion goes
CYCLES = {
    "DRILL": "drill",
    "FACE": "drill",
    "CSINK": "drill",
    "CBORE": "drill",
    "SPOT": "drill",
    "DEEP": "deep",
    "DEEP2": "deep",
    "BRKCHP": "break",
    "TAP": "tap",
    "BORE": "bore",
    "REAM": "bore",
}
_FORM = (
    "CYCLE/DRILL|DEEP|BRKCHP|TAP|BORE|REAM with DEPTH,d,CLEAR,c[,RETURN,r] or FEDTO,d,RAPTO,c[,RTRCTO,r|AUTO], "
    "STEP,s, DWELL,t and a feed; write other cycles as plain motion"
)
_VALUES = {
    "DEPTH": "DEPTH",
    "FEDTO": "FEDTO",
    "CLEAR": "CLEAR",
    "RAPTO": "RAPTO",
    "RETURN": "RETURN",
    "RTRCTO": "RETURN",
    "STEP": "STEP",
    "INCR": "STEP",
    "1STPECK": "FIRST",
    "SUBPECK": "STEP",
    "DWELL": "DWELL",
}
_INITIAL = ("AUTO", "INIT")  # the height at which the cycle was called
_MOST_PECKS = 1000


class DrillCycle(NamedTuple):
    """A drill cycle. Distances along the tool axis from the hole's point, in the file's unit.

    kind : drill, deep (out of the hole after each peck), break (a little up), tap or bore (out at the feed)
    clear : where rapid ends above the hole
    depth : where the feed ends, below it
    retract : where the tool withdraws to, or None for the height it came from
    feed : value and unit word, or None for the feed in force
    step : the depth of a peck, 0 without pecks
    first_step : the depth of the first peck, 0 for that of the others
    dwell : time at depth and whether it is in revolutions, not seconds; None for no dwell
    """

    clear: float
    depth: float
    retract: float | None
    feed: tuple[float, str] | None
    kind: str = "drill"
    step: float = 0.0
    dwell: tuple[float, bool] | None = None
    first_step: float = 0.0


class CycleStart(NamedTuple):
    """Where a drill cycle began: height along the tool axis in the file's unit, and that axis."""

    height: float
    axis: Triple


class _Options(NamedTuple):
    """The options of a cycle as written: distances by name, the feed, whether to return to the initial height."""

    values: dict[str, float]
    feed: tuple[float, str] | None
    initial: bool
    revolutions: bool


def parse_cycle(args: Sequence[str], dialect: Dialect, *, initial: bool = False) -> DrillCycle:
    """Parse CYCLE, refusing a cycle whose motion the statement alone does not settle.

    initial : whether the tool goes back to the height it came from where the statement says nothing else
    """
    if not args or args[0] not in CYCLES:
        refuse(f"a cycle that cannot be turned into motion: {quote_short('/'.join(args[:1]))}; expected {_FORM}")
    kind, rest = CYCLES[args[0]], list(args[1:])
    while rest and (rest[0] in ("DEEP", "BRKCHP") or (kind == "bore" and rest[0] == "DRAG")):
        kind = CYCLES.get(rest.pop(0), kind)
    if rest and is_number(rest[0]):
        refuse(f"a cycle with values by position: {dialect.cycle_values}; expected {_FORM}")
    options = _parse_options(rest)
    values = options.values
    if not {"CLEAR", "RAPTO"} & values.keys() or ("DEPTH" in values) == ("FEDTO" in values):
        refuse(f"a cycle without a clearance (CLEAR, RAPTO) and one depth (DEPTH, FEDTO); expected {_FORM}")
    clear, out = _find_clearance(values, dialect)
    depth = -_parse_depth(values, dialect)
    retract = None if options.initial or (initial and "RETURN" not in values) else out
    step, first_step = values.get("STEP", 0.0), values.get("FIRST", 0.0)
    if not depth < clear or (retract is not None and retract < clear) or clear < 0.0:
        refuse(f"expected a depth below the clearance and a return not below it in {_FORM}")
    if min(step, first_step) < 0.0 or (kind in ("deep", "break") and step == 0.0):
        refuse(f"pecks without a step above zero (STEP, INCR); expected {_FORM}")
    if kind in ("deep", "break") and (clear - depth) / step > _MOST_PECKS:
        refuse(f"more than {_MOST_PECKS} pecks in a hole")
    if kind == "drill" and (step > 0.0 or first_step > 0.0):
        refuse(f"STEP in a cycle without pecks; expected {_FORM}")
    dwell = None
    if "DWELL" in values:
        dwell = values["DWELL"], options.revolutions
        if dwell[0] < 0.0:
            refuse("a dwell below zero")
    return DrillCycle(clear, depth, retract, options.feed, kind, step, dwell, first_step)


def _find_clearance(values: dict[str, float], dialect: Dialect) -> tuple[float, float | None]:
    """Find where above the hole rapid ends, and where the tool withdraws to, by the dialect's sense of CLEAR.

    None stands for the height it came from; Creo writes RETURN,0 for its retract plane.
    """
    clear, rapid = values.get("CLEAR"), values.get("RAPTO")
    if dialect.clear == HEIGHT and clear is not None:
        if "RETURN" not in values:
            refuse(f"CLEAR, a height in the part in a file of {dialect.title}, without RTRCTO; expected {_FORM}")
        return values["RETURN"] if rapid is None else rapid, values["RETURN"]
    start = out = rapid if clear is None else clear
    assert start is not None
    if clear is not None and rapid is not None and dialect.clear == DOWN:
        start = clear - rapid
    elif clear is not None and rapid not in (None, clear):
        refuse(f"RAPTO beside another CLEAR, whose sense no header tells; expected one of both in {_FORM}")
    out = values.get("RETURN", out)
    return start, None if dialect.clear == DOWN and values.get("RETURN") == 0.0 else out


def _parse_depth(values: dict[str, float], dialect: Dialect) -> float:
    """Compute the depth below the hole's point, by the dialect's sense of FEDTO."""
    if "DEPTH" in values:
        if values["DEPTH"] < 0.0:
            refuse(f"a DEPTH below zero; it is a distance below the point in {_FORM}")
        return values["DEPTH"]
    fedto = values["FEDTO"]
    if dialect.fedto == BELOW:
        if fedto < 0.0:
            refuse(f"FEDTO below zero in a file of {dialect.title}, where it is a distance below the point")
        return fedto
    if fedto > 0.0:
        refuse(f"FEDTO above zero in a file of {dialect.title}: above the point, or the depth below it in another "
               "dialect; expected a negative one, or DEPTH")  # fmt: skip
    return -fedto


def _parse_options(words: list[str]) -> _Options:
    """Parse the words after the cycle's name."""
    rest = list(words)
    values: dict[str, float] = {}
    feed: tuple[float, str] | None = None
    initial = revolutions = False
    while rest:
        word = rest.pop(0)
        if (word == "MANUAL" and "RETURN" in values) or (word == "ON" and "DWELL" in words):
            continue
        if word in _INITIAL or (word in ("RTRCTO", "RETURN") and rest and rest[0] in _INITIAL):
            rest = rest if word in _INITIAL else rest[1:]
            initial = True
            continue
        if word in ("ORIENT", "ORIANT") and rest and is_number(rest[0]) and parse_number(rest[0]) == 0.0:
            rest.pop(0)
            continue
        if word == "DWELL" and rest and rest[0] in ("REV", "SEC", "ON"):
            revolutions = rest[0] == "REV"
            if rest.pop(0) == "ON":
                continue
        name = _VALUES.get(word)
        if (name is None and word not in FEED_UNITS) or not rest:
            refuse(f"{quote_short(word)} in a cycle that cannot be turned into motion; expected {_FORM}")
        (value,) = parse_numbers([rest.pop(0)], (1,), _FORM)
        if name is not None and values.get(name, value) != value:
            refuse(f"{word} beside another word of its meaning; expected {_FORM}")
        if name is not None:
            values[name] = value
        elif feed is not None:
            refuse(f"two feeds; expected {_FORM}")
        elif value < 0.0:
            refuse(f"a feed below zero; expected {_FORM}")
        else:
            feed = value, word
        if name == "DWELL" and rest and rest[0] in ("REV", "SEC"):
            revolutions = rest.pop(0) == "REV"
    if initial and "RETURN" in values:
        refuse(f"a return to a distance and to the initial height; expected {_FORM}")
    return _Options(values, feed, initial, revolutions)
