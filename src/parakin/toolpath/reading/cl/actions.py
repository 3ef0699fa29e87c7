"""The effect of each CL word on motion, tool and events; the table in :mod:`.words` gives each word its method."""

import math
import re
from typing import Literal

import numpy as np

from ...path import Event
from ..text import is_number, parse_number, refuse
from .arguments import (
    LENGTH_UNITS,
    DrillCycle,
    parse_drill_cycle,
    parse_feed,
    parse_numbers,
    parse_spindle,
    parse_tool_data,
)
from .frames import build_frame, frame_from_matrix, normalize_direction
from .motion import ClMotion, NxCircle

_ARC = re.compile(r"TLON,GOFWD/\(?CIRCLE/([^()/]*?)\)?,ON,(?:\d+,INTOF,)?\(?LINE/([^()/]*)\)?", re.ASCII)
_ARC_FORM = "TLON,GOFWD/(CIRCLE/x,y,z,r),ON,2,INTOF,(LINE/x,y,z,x,y,z)"
_POINT_FORM = "x,y,z or x,y,z,i,j,k"


class ClActions:
    """The state of a CL file and the methods that its words call, each with the arguments and the source line.

    Errors name neither the word nor the line.
    """

    def __init__(self, motion: ClMotion):
        self.motion = motion
        self.events: list[Event] = []
        self.dialect: Literal["apt", "nx"] = "apt"
        self.units: Literal["mm", "inch"] = "mm"
        self.units_given = False
        self.inches_noted = False
        self.tool: dict[str, float | str] = {}
        self.finished = False
        self._last_cycle: DrillCycle | None = None

    def add_event(self, text: str, line: int) -> None:
        """Keep a statement as an event before the next record."""
        self.events.append(Event(self.motion.records.n, line, " ".join(text.split())))

    # motion

    def go_to(self, args: list[str], line: int) -> None:
        """Move to a point, with or without a new tool axis (GOTO)."""
        v = parse_numbers(args, (3, 6), _POINT_FORM)
        self.motion.move_to((v[0], v[1], v[2]), v[3:], line)

    def go_by(self, args: list[str], line: int) -> None:
        """Move by a step from the last point (GODLTA)."""
        v = parse_numbers(args, (3, 6), "dx,dy,dz or dx,dy,dz,i,j,k")
        self._refuse_in_cycle_or_circle()
        if self.motion.position is None:
            refuse("no position to step from; expected FROM or GOTO before it")
        x, y, z = self.motion.position
        self.motion.move_to((x + v[0], y + v[1], z + v[2]), v[3:], line)

    def start_from(self, args: list[str], line: int) -> None:
        """Start at a point (FROM)."""
        v = parse_numbers(args, (3, 6), _POINT_FORM)
        self._refuse_in_cycle_or_circle()
        if v[3:]:
            self.motion.axis = self.motion.normalize_axis(v[3:], line)
        self.motion.add_record((v[0], v[1], v[2]), line, rapid=False)
        self.motion.tangent = None

    def set_rapid(self, args: list[str], line: int) -> None:
        """Make the next motion a rapid one (RAPID)."""
        self.motion.rapid = True

    def set_arc_direction(self, args: list[str], line: int) -> None:
        """Set the direction in which the arc of TLON starts (INDIRV)."""
        i, j, k = parse_numbers(args, (3,), "a direction i,j,k")
        self.motion.tangent = normalize_direction([i, j, k])

    def go_along_arc(self, args: list[str], line: int) -> None:
        """Move along a circle to the end of a line (TLON); the only argument is the whole statement."""
        (statement,) = args
        match = _ARC.fullmatch(statement)
        if match is None:
            refuse(f"an arc that cannot be read; expected {_ARC_FORM}")
        circle = parse_numbers(match[1].split(","), (4,), _ARC_FORM)
        ends = parse_numbers(match[2].split(","), (6,), _ARC_FORM)
        self.motion.add_tangent_arc(circle[:3], circle[3], (ends[3], ends[4], ends[5]), line)

    def start_circle(self, args: list[str], line: int) -> None:
        """Start an arc that the next GOTO ends (CIRCLE of NX)."""
        form = "cx,cy,cz,ax,ay,az,radius,..."
        if "TIMES" in args:
            refuse(f"a helix of several turns (TIMES) cannot be turned into motion; expected {form}")
        v = parse_numbers(args, range(7, 13), form)
        self._refuse_in_cycle_or_circle()
        self.motion.circle = NxCircle(line, v[:3], normalize_direction(v[3:6]), v[6])

    def set_cycle(self, args: list[str], line: int) -> None:
        """Start, repeat or end a drill cycle at the points from here on (CYCLE)."""
        self._refuse_in_circle()
        if args in (["OFF"], ["NOMORE"]):
            self.motion.set_cycle(None)
        elif args == ["ON"]:
            if self._last_cycle is None:
                refuse("CYCLE/ON before any cycle; expected CYCLE/DRILL,... first")
            self.motion.set_cycle(self._last_cycle)
        else:
            self._last_cycle = parse_drill_cycle(args)
            self.motion.set_cycle(self._last_cycle)

    def end_program(self, args: list[str], line: int) -> None:
        """End the program; what follows is not read (FINI)."""
        self._refuse_in_circle()
        self.finished = True

    def _refuse_in_cycle_or_circle(self) -> None:
        if self.motion.cycle is not None or self.motion.circle is not None:
            refuse("only GOTO can follow within a cycle or after CIRCLE")

    def _refuse_in_circle(self) -> None:
        if self.motion.circle is not None:
            refuse(f"expected the GOTO that ends the CIRCLE of line {self.motion.circle.line}")

    # feed, spindle

    def set_feed(self, args: list[str], line: int) -> None:
        """Set the feed from here on (FEDRAT)."""
        value, unit = parse_feed(args)
        self.motion.set_feed(value, unit)
        if unit in ("IPM", "IPR") and not self.units_given and not self.inches_noted:
            self.inches_noted = True
            self.motion.notes.add(line, "feeds in inches in a file without UNITS: its lengths are taken for mm")

    def set_spindle(self, args: list[str], line: int) -> None:
        """Set the spindle's speed from here on (SPINDL)."""
        speed = parse_spindle(args)
        if speed.off:
            self.motion.set_speed(0.0)
        elif speed.surface:
            self.motion.set_speed(math.nan)
            self.motion.notes.add(line, "a surface speed: the spindle's speed is left open")
        elif speed.value is not None:
            self.motion.set_speed(speed.value)

    # units and frames

    def set_units(self, args: list[str], line: int) -> None:
        """Set the unit of lengths from here on (UNITS)."""
        if len(args) != 1 or args[0] not in LENGTH_UNITS:
            refuse("expected UNITS/MM or UNITS/INCHES")
        self._refuse_in_cycle_or_circle()
        scale = LENGTH_UNITS[args[0]]
        if not self.motion.records.n:
            self.units = "mm" if scale == 1.0 else "inch"
        elif scale != self.motion.transform.scale:
            self.motion.notes.add(line, "the unit of length changes within the file")
        self.units_given = True
        self.motion.change_frame(line, scale=scale)

    def set_tool_axis(self, args: list[str], line: int) -> None:
        """Set the tool axis from here on (TLAXIS)."""
        v = parse_numbers(args, (3,), "a tool axis i,j,k")
        self.motion.axis = self.motion.normalize_axis(v, line)

    def set_origin(self, args: list[str], line: int) -> None:
        """Set where the control's zero lies in the part: it is subtracted from the points after it (ORIGIN)."""
        v = parse_numbers(args, (3, 9), "x,y,z or x,y,z and the directions of X and Z")
        self._refuse_in_cycle_or_circle()
        turn = None
        if v[3:]:
            z = np.array(normalize_direction(v[6:9]))
            turn = build_frame(v[:3], v[3:6], np.cross(z, normalize_direction(v[3:6])).tolist()).rotation.T
        if any(v[:3]) or turn is not None:
            self.motion.notes.add(line, "ORIGIN is subtracted from the points after it")
        self.motion.change_frame(line, origin=np.array(v[:3]), origin_turn=turn)

    def set_frame(self, args: list[str], line: int) -> None:
        """Set the workpiece's frame in the machine from here on (MSYS of NX)."""
        v = parse_numbers(args, (9,), "an origin and the directions of X and Y: nine numbers")
        self._refuse_in_cycle_or_circle()
        self.motion.change_frame(line, frame=build_frame(v[:3], v[3:6], v[6:9]))

    def set_frame_matrix(self, rows: list[list[float]], line: int) -> None:
        """Set the workpiece's frame by the three rows after CATIA's $$*CATIA0."""
        self.motion.change_frame(line, frame=frame_from_matrix(rows))

    # tool

    def _set_tool(self, line: int, **data: float | str) -> None:
        if any(self.tool.get(key, value) != value for key, value in data.items()):
            self.motion.notes.add(line, "another tool: the path's tool is the first one")
        for key, value in data.items():
            self.tool.setdefault(key, value)

    def set_tool_data(self, args: list[str], line: int) -> None:
        """Set kind and lengths of the tool (TLDATA of NX)."""
        self._set_tool(line, **parse_tool_data(args, self.motion.transform.scale))

    def set_cutter(self, args: list[str], line: int) -> None:
        """Set lengths of the tool (CUTTER of APT)."""
        v = parse_numbers(args, range(1, 8), "CUTTER/diameter[,corner radius,e,f,a,b,height]")
        scale = self.motion.transform.scale
        data = {"diameter": v[0] * scale}
        if len(v) > 1:
            data["corner_radius"] = v[1] * scale
        if len(v) == 7:
            data["length"] = v[6] * scale
        self._set_tool(line, **data)

    def load_tool(self, args: list[str], line: int) -> None:
        """Set the tool's number or name (LOADTL, TOOLNO, LOAD, SELECT)."""
        args = args[1:] if args[:1] == ["TOOL"] else args
        if args and is_number(args[0]):
            self._set_tool(line, number=parse_number(args[0]))
        elif args and args[0]:
            self._set_tool(line, name=args[0])

    def start_tool_path(self, args: list[str], line: int) -> None:
        """Start a tool path and set its tool's name (TOOL PATH of NX)."""
        self._refuse_in_cycle_or_circle()
        if "TOOL" in args[1:-1]:
            self._set_tool(line, name=args[args.index("TOOL", 1) + 1])
