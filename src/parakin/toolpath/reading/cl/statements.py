"""What each word of the APT/CATIA and Siemens NX dialects does."""

import math
import re
from collections.abc import Callable
from typing import Literal

import numpy as np

from ....errors import InputError
from ...path import Event
from .motion import Motion, Point, frame_of, matrix_frame
from .tokens import (
    INCH,
    DrillCycle,
    drill_cycle,
    feed,
    is_number,
    number,
    numbers,
    quoted,
    refuse,
    spindle,
    squeezed,
    tool_data,
)

UNITS = {"MM": 1.0, "INCHES": INCH, "INCH": INCH, "IN": INCH}
_TEXT_WORD = re.compile(r"\s*(PPRINT|PARTNO|REMARK|TPRINT|INSERT|LETTER|DISPLY)(?![A-Z0-9])", re.IGNORECASE | re.ASCII)
_ARC = re.compile(r"TLON,GOFWD/\(?CIRCLE/([^()/]*?)\)?,ON,(?:\d+,INTOF,)?\(?LINE/([^()/]*)\)?", re.ASCII)
_ARC_FORM = "TLON,GOFWD/(CIRCLE/x,y,z,r),ON,2,INTOF,(LINE/x,y,z,x,y,z)"
_POINT_FORM = "x,y,z or x,y,z,i,j,k"
# words of no effect on the motion, and words that are there for the display or the original processor only
_EVENTS = frozenset(("STOP", "OPSTOP", "COOLNT", "MULTAX", "END", "MACHIN", "AUXFUN", "DELAY", "DWELL", "END-OF-PATH"))
_LOGGED = _EVENTS | {"SPINDL", "LOADTL", "TOOLNO", "LOAD", "SELECT", "TOOLPATH", "CUTTER", "FINI"}
_SILENT = frozenset(("PAINT", "AUTOPS", "INTOL", "OUTTOL", "TOLER", "CLPRNT", "NOPOST"))
_NX_WORDS = frozenset(("TOOLPATH", "TLDATA", "MSYS", "PAINT", "CIRCLE", "END-OF-PATH", "SELECT", "LOAD"))


_MOTION = re.compile(r"\s*(GOTO|GODLTA|FROM|RAPID|FEDRAT|CIRCLE|CYCLE|INDIRV|TLON|FINI)\s*(?:[/,]|$)", re.IGNORECASE)


def ends_text(held: str, text: str) -> bool:
    """Whether a message's trailing $ can't have meant to continue it, since the line after it is motion."""
    return _TEXT_WORD.match(held) is not None and _MOTION.match(text) is not None


class Statements:
    """Takes one whole statement at a time and tells the motion. Errors carry no place."""

    def __init__(self, motion: Motion):
        self.motion = motion
        self.events: list[Event] = []
        self.dialect: Literal["apt", "nx"] = "apt"
        self.units: Literal["mm", "inch"] = "mm"
        self.units_given = False
        self.inches_noted = False
        self.tool: dict[str, float | str] = {}
        self.finished = False
        self._last_cycle: DrillCycle | None = None

    def take(self, text: str, line: int) -> str:
        """Act on a statement that begins at a line; returns its word."""
        said = _TEXT_WORD.match(text)
        if said is not None:
            self._event(text, line)
            return said[1].upper()
        head, _, tail = text.partition("/")
        name, comma, minor = squeezed(head).partition(",")
        if name == "TLON":
            self._tlon(squeezed(text), line)
            return name
        args = [squeezed(a) for a in tail.split(",")] if tail.strip() else []
        if comma:
            args = minor.split(",") + args
        if name in _NX_WORDS:
            self.dialect = "nx"
        act = _ACTS.get(name)
        if act is not None:
            try:
                act(self, args, line)
            except InputError as error:
                refuse(f"{name}: {error.message}")
        elif name not in _EVENTS and name not in _SILENT:
            self._unknown(name, line)
        if name in _LOGGED:
            self._event(text, line)
        return name

    def matrix(self, rows: list[list[float]], line: int) -> None:
        """The three rows after $$*CATIA0."""
        self.motion.change_placement(line, frame=matrix_frame(rows))

    def _event(self, text: str, line: int) -> None:
        self.events.append(Event(self.motion.records.n, line, " ".join(text.split())))

    def _unknown(self, name: str, line: int) -> None:
        letters = re.match(r"[A-Z]*", name)
        word = letters[0] if letters else ""
        if word != name and word in ("GOTO", "GODLTA", "FROM", "FEDRAT", "CIRCLE", "MSYS", "TLAXIS", "INDIRV", "UNITS"):
            refuse(f"{quoted(name)}; expected a slash after {word}")
        self.motion.notes.add(line, f"unknown word {quoted(name)}, not acted on")

    # motion

    def _goto(self, args: list[str], line: int) -> None:
        v = numbers(args, (3, 6), _POINT_FORM)
        self.motion.move((v[0], v[1], v[2]), v[3:], line)

    def _alone(self) -> None:
        if self.motion.cycle is not None or self.motion.circle is not None:
            refuse("only GOTO can follow within a cycle or after CIRCLE")

    def _godlta(self, args: list[str], line: int) -> None:
        v = numbers(args, (3, 6), "dx,dy,dz or dx,dy,dz,i,j,k")
        self._alone()
        if self.motion.position is None:
            refuse("no position to step from; expected FROM or GOTO before it")
        x, y, z = self.motion.position
        self.motion.move((x + v[0], y + v[1], z + v[2]), v[3:], line)

    def _from(self, args: list[str], line: int) -> None:
        v = numbers(args, (3, 6), _POINT_FORM)
        self._alone()
        if v[3:]:
            self.motion.axis = self.motion.direction(v[3:], line)
        self.motion.add((v[0], v[1], v[2]), line, False)
        self.motion.tangent = None

    def _rapid(self, args: list[str], line: int) -> None:
        self.motion.rapid = True

    def _indirv(self, args: list[str], line: int) -> None:
        i, j, k = numbers(args, (3,), "a direction i,j,k")
        self.motion.tangent = Motion.direction_of([i, j, k])

    def _tlon(self, compact: str, line: int) -> None:
        found = _ARC.fullmatch(compact)
        if found is None:
            refuse(f"TLON: an arc that cannot be read; expected {_ARC_FORM}")
        try:
            circle = numbers(found[1].split(","), (4,), _ARC_FORM)
            ends = numbers(found[2].split(","), (6,), _ARC_FORM)
            end: Point = (ends[3], ends[4], ends[5])
            self.motion.tangent_arc(circle[:3], circle[3], end, line)
        except InputError as error:
            refuse(f"TLON: {error.message}")

    def _circle(self, args: list[str], line: int) -> None:
        form = "cx,cy,cz,ax,ay,az,radius,..."
        if "TIMES" in args:
            refuse(f"a helix of several turns (TIMES) cannot be turned into motion; expected {form}")
        v = numbers(args, range(7, 13), form)
        self._alone()
        Motion.direction_of(v[3:6])
        self.motion.circle = line, v

    def _cycle(self, args: list[str], line: int) -> None:
        self._alone_circle()
        if args in (["OFF"], ["NOMORE"]):
            self.motion.start_cycle(None)
        elif args == ["ON"]:
            if self._last_cycle is None:
                refuse("CYCLE/ON before any cycle; expected CYCLE/DRILL,... first")
            self.motion.start_cycle(self._last_cycle)
        else:
            self._last_cycle = drill_cycle(args)
            self.motion.start_cycle(self._last_cycle)

    def _alone_circle(self) -> None:
        if self.motion.circle is not None:
            refuse(f"expected the GOTO that ends the CIRCLE of line {self.motion.circle[0]}")

    # state

    def _fedrat(self, args: list[str], line: int) -> None:
        value, unit = feed(args)
        self.motion.set_feed(value, unit)
        if unit in ("IPM", "IPR") and not self.units_given and not self.inches_noted:
            self.inches_noted = True
            self.motion.notes.add(line, "feeds in inches in a file without UNITS: its lengths are taken for mm")

    def _spindl(self, args: list[str], line: int) -> None:
        value, surface, off = spindle(args)
        if off:
            self.motion.set_speed(0.0)
        elif surface:
            self.motion.set_speed(math.nan)
            self.motion.notes.add(line, "a surface speed: the spindle's speed is left open")
        elif value is not None:
            self.motion.set_speed(value)

    def _units(self, args: list[str], line: int) -> None:
        if len(args) != 1 or args[0] not in UNITS:
            refuse("expected UNITS/MM or UNITS/INCHES")
        self._alone()
        scale = UNITS[args[0]]
        if not self.motion.records.n:
            self.units = "mm" if scale == 1.0 else "inch"
        elif scale != self.motion.placement.scale:
            self.motion.notes.add(line, "the unit of length changes within the file")
        self.units_given = True
        self.motion.change_placement(line, scale=scale)

    def _tlaxis(self, args: list[str], line: int) -> None:
        v = numbers(args, (3,), "a tool axis i,j,k")
        self.motion.axis = self.motion.direction(v, line)

    def _origin(self, args: list[str], line: int) -> None:
        """ORIGIN says where the control's zero lies in the part: it is subtracted from the points after it."""
        v = numbers(args, (3, 9), "x,y,z or x,y,z and the directions of X and Z")
        self._alone()
        turn = None
        if v[3:]:
            z = np.array(Motion.direction_of(v[6:9]))
            turn = frame_of(v[:3], v[3:6], np.cross(z, Motion.direction_of(v[3:6])).tolist()).rotation.T
        if any(v[:3]) or turn is not None:
            self.motion.notes.add(line, "ORIGIN is subtracted from the points after it")
        self.motion.change_placement(line, origin=np.array(v[:3]), origin_turn=turn)

    def _msys(self, args: list[str], line: int) -> None:
        v = numbers(args, (9,), "an origin and the directions of X and Y: nine numbers")
        self._alone()
        self.motion.change_placement(line, frame=frame_of(v[:3], v[3:6], v[6:9]))

    def _fini(self, args: list[str], line: int) -> None:
        self._alone_circle()
        self.finished = True

    # tools

    def _set_tool(self, line: int, **known: float | str) -> None:
        if any(self.tool.get(key, value) != value for key, value in known.items()):
            self.motion.notes.add(line, "another tool: the path's tool is the first one")
        for key, value in known.items():
            self.tool.setdefault(key, value)

    def _tldata(self, args: list[str], line: int) -> None:
        self._set_tool(line, **tool_data(args, self.motion.placement.scale))

    def _cutter(self, args: list[str], line: int) -> None:
        v = numbers(args, range(1, 8), "CUTTER/diameter[,corner radius,e,f,a,b,height]")
        scale = self.motion.placement.scale
        known = {"diameter": v[0] * scale}
        if len(v) > 1:
            known["corner_radius"] = v[1] * scale
        if len(v) == 7:
            known["length"] = v[6] * scale
        self._set_tool(line, **known)

    def _load(self, args: list[str], line: int) -> None:
        args = args[1:] if args[:1] == ["TOOL"] else args
        if args and is_number(args[0]):
            self._set_tool(line, number=number(args[0]))
        elif args and args[0]:
            self._set_tool(line, name=args[0])

    def _toolpath(self, args: list[str], line: int) -> None:
        self._alone()
        if "TOOL" in args[1:-1]:
            self._set_tool(line, name=args[args.index("TOOL", 1) + 1])


# unbound, so that a reader is freed, with its columns, as soon as it is let go
_ACTS: dict[str, Callable[[Statements, list[str], int], None]] = {
    "GOTO": Statements._goto,
    "GODLTA": Statements._godlta,
    "FROM": Statements._from,
    "RAPID": Statements._rapid,
    "FEDRAT": Statements._fedrat,
    "SPINDL": Statements._spindl,
    "UNITS": Statements._units,
    "TLAXIS": Statements._tlaxis,
    "ORIGIN": Statements._origin,
    "INDIRV": Statements._indirv,
    "CIRCLE": Statements._circle,
    "CYCLE": Statements._cycle,
    "MSYS": Statements._msys,
    "TLDATA": Statements._tldata,
    "CUTTER": Statements._cutter,
    "LOADTL": Statements._load,
    "TOOLNO": Statements._load,
    "LOAD": Statements._load,
    "SELECT": Statements._load,
    "TOOLPATH": Statements._toolpath,
    "FINI": Statements._fini,
}
