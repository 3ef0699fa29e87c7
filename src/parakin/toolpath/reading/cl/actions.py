"""The effect of each CL word on motion, tool and events; the table in :mod:`.words` gives each word its method."""

import math
import re
from collections.abc import Mapping
from itertools import takewhile

import numpy as np

from ...path import Event
from ..text import is_number, quote_short, refuse
from ..tools import ToolLog
from .circles import Circle, measure_radius
from .cycles import DrillCycle, parse_cycle
from .dialects import DIALECTS, RIGHT, UNKNOWN, DialectName, find_by_comment, find_by_word
from .drilling import drill_hole
from .file_frames import AXIS_TOLERANCE, UPRIGHT, WorkZeros, build_frame, build_frame_from_matrix, normalise_direction
from .length_units import StatedUnits
from .motion import ClMotion
from .spindle import add_dwell, set_speed
from .word_arguments import (
    LENGTH_UNITS,
    parse_feed,
    parse_numbers,
    parse_tool_data,
    parse_tool_number,
    parse_tool_values,
)

_ARC = re.compile(r"TLON,GOFWD/\(?CIRCLE/([^()/]*?)\)?,ON,(?:\d+,INTOF,)?\(?LINE/([^()/]*)\)?", re.ASCII)
_ARC_FORM = "TLON,GOFWD/(CIRCLE/x,y,z,r),ON,2,INTOF,(LINE/x,y,z,x,y,z)"
_POINT_FORM = "x,y,z or x,y,z,i,j,k"
_MOVARC_FORM = "MOVARC/cx,cy,cz,ax,ay,az,radius[,ANGLE,degrees]"
_NX_CIRCLE = 8  # values of a CIRCLE that only Siemens NX writes: tolerances follow the radius
_MOST_TURNS = 1e6  # greatest number of turns of an arc


class ClActions:
    """The state of a CL file and the methods that its words call, each with the arguments and the source line.

    Errors name neither the word nor the line.
    """

    def __init__(self, motion: ClMotion):
        self.motion = motion
        self.dialect: DialectName = "apt"
        self.told_by_word = False
        self.told_by_header = False
        self.told_line = 0
        self.compensated = False
        self.informing: dict[str, int] = {}
        self.units = StatedUnits()
        self.tools = ToolLog()
        self.finished = False
        self._last_cycle: DrillCycle | None = None
        self._initial = False  # CYCLE/INIT
        self._work_systems = WorkZeros()

    # dialects

    def tell_dialect(self, name: DialectName | None, line: int, *, by_word: bool) -> None:
        """Take a sign of the file's dialect: the first one, but a word tells more than a comment before all motion."""
        outranks = by_word and not self.told_by_word and not self.motion.records.n
        if name is not None and (self.dialect == "apt" or outranks):
            self.told_line = line if name != self.dialect else self.told_line
            self.dialect, self.told_by_word = name, by_word

    def read_comment(self, text: str, line: int) -> None:
        """Take the dialect that a comment tells before the first motion."""
        if not self.motion.records.n:
            name = find_by_comment(text)
            self.told_by_header = self.told_by_header or name is not None
            self.tell_dialect(name, line, by_word=False)

    def read_word(self, word: str, args: list[str], line: int) -> None:
        """Take the dialect that a word tells."""
        self.tell_dialect(find_by_word(word, args), line, by_word=True)

    def add_event(self, text: str, line: int) -> None:
        """Keep a statement as an event before the next record."""
        self.motion.events.append(Event(self.motion.records.n, line, " ".join(text.split())))

    # motion

    def go_to(self, args: list[str], line: int) -> None:
        """Move to a point, with or without a new tool axis (GOTO)."""
        v = parse_numbers(args, (3, 6), _POINT_FORM)
        cycle, tip = self.motion.cycle, (v[0], v[1], v[2])
        if cycle is None:
            self.motion.move_to(tip, v[3:], line)
            return
        before = self.motion.take_axis(v[3:], line)
        drill_hole(self.motion, cycle, tip, before, line)
        self.motion.rapid, self.motion.tangent = False, None

    def go_home(self, args: list[str], line: int) -> None:
        """Move to a stated point in rapid (GOHOME)."""
        if not args or args == [""]:
            refuse("the machine's own home, which the file does not state; expected GOHOME/x,y,z or a GOTO")
        v = parse_numbers(args, (3, 6), f"GOHOME/{_POINT_FORM}")
        self._refuse_in_cycle_or_circle()
        self.motion.rapid = True
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
        """Start at a point; one that is not the file's first is reached in rapid (FROM)."""
        v = parse_numbers(args, (3, 6), _POINT_FORM)
        self._refuse_in_cycle_or_circle()
        self.motion.take_axis(v[3:], line)
        self.motion.close_arc(None)
        self.motion.add_record((v[0], v[1], v[2]), line, rapid=self.motion.records.n > 0)
        self.motion.tangent = None

    def set_rapid(self, args: list[str], line: int) -> None:
        """Make the next motion a rapid one (RAPID)."""
        if any(args):
            refuse(f"{quote_short(','.join(args))} behind RAPID, which is for the next motion; expected RAPID alone")
        self.motion.rapid = True

    def set_arc_direction(self, args: list[str], line: int) -> None:
        """Set the direction in which the arc of TLON starts (INDIRV)."""
        i, j, k = parse_numbers(args, (3,), "a direction i,j,k")
        self.motion.tangent = normalise_direction([i, j, k])

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
        """Start an arc that the next GOTO ends (CIRCLE)."""
        form = "cx,cy,cz,ax,ay,az[,radius,...]"
        revolutions = None
        if "TIMES" in args:
            k = args.index("TIMES")
            (revolutions,) = parse_numbers(args[k + 1 :], (1,), f"{form},TIMES,turns")
            if not 0.0 < revolutions <= _MOST_TURNS:
                refuse(f"{revolutions:g} turns; expected more than zero and at most {_MOST_TURNS:g}")
            args = args[:k]
        v = parse_numbers(args, range(6, 13), form)
        if len(v) >= _NX_CIRCLE:
            self.tell_dialect("nx", line, by_word=False)
        hand = DIALECTS[self.dialect].circle
        if revolutions is not None and hand == UNKNOWN:
            refuse("TIMES in a file whose CAM system no header tells; expected the header of the one that wrote it")
        self._take_circle(v, line, hand, revolutions=revolutions)

    def start_arc(self, args: list[str], line: int) -> None:
        """Start an arc of a stated angle that the next GOTO ends (MOVARC of Autodesk)."""
        args = [a for a in args if a not in ("CENTER", "AXIS", "RADIUS")]
        sweep = None
        if "ANGLE" in args:
            k = args.index("ANGLE")
            (degrees,) = parse_numbers(args[k + 1 :], (1,), _MOVARC_FORM)
            if not 0.0 < abs(degrees) <= 360.0 * _MOST_TURNS:
                refuse(f"an angle of {degrees:g} degrees; expected {_MOVARC_FORM}")
            sweep, args = math.radians(degrees), args[:k]
        self._take_circle(parse_numbers(args, (7,), _MOVARC_FORM), line, RIGHT, sweep=sweep)

    def _take_circle(
        self, v: list[float], line: int, hand: int, *, sweep: float | None = None, revolutions: float | None = None
    ) -> None:
        self._refuse_in_cycle_or_circle()
        centre, axis = np.array(v[:3]), np.array(normalise_direction(v[3:6]))
        points = self.dialect == "creo"
        firm = self.told_by_header or sweep is not None or revolutions is not None
        radius = v[6] if v[6:] else measure_radius(centre, axis, self.motion.position)
        self.motion.circle = Circle(line, centre, axis, radius, hand, sweep, revolutions, points, firm)

    def set_cycle(self, args: list[str], line: int) -> None:
        """Start, repeat or end a drill cycle at the points from here on (CYCLE)."""
        self._refuse_in_circle()
        if args in (["OFF"], ["NOMORE"]):
            self.motion.set_cycle(None)
        elif args == ["ON"]:
            if self._last_cycle is None:
                refuse("CYCLE/ON before any cycle; expected CYCLE/DRILL,... first")
            self.motion.set_cycle(self._last_cycle)
        elif args == ["INIT"]:
            self._initial = True
        else:
            self._last_cycle = parse_cycle(args, DIALECTS[self.dialect], initial=self._initial)
            self.units.note_speed(args, line)
            self.motion.set_cycle(self._last_cycle)

    def end_program(self, args: list[str], line: int) -> None:
        """End the program; what follows is not read (FINI)."""
        self._refuse_in_circle()
        self.motion.close_arc(None)
        self.finished = True

    def _refuse_in_cycle_or_circle(self) -> None:
        if self.motion.cycle is not None or self.motion.circle is not None:
            refuse("only GOTO can follow in a cycle or after CIRCLE; expected CYCLE/OFF before it, or the arc's end")

    def _refuse_in_circle(self) -> None:
        if self.motion.circle is not None:
            refuse(f"expected the GOTO that ends the CIRCLE of line {self.motion.circle.line}")

    # feed, spindle

    def set_feed(self, args: list[str], line: int) -> None:
        """Set the feed from here on (FEDRAT)."""
        value, unit = parse_feed(args)
        self.motion.take_feed(value, unit, line)
        self.units.note_speed(args, line)

    def set_spindle(self, args: list[str], line: int) -> None:
        """Set the spindle's speed from here on (SPINDL)."""
        set_speed(self.motion, args, self.tools.diameter, line)
        self.units.note_speed(args, line)

    def wait(self, args: list[str], line: int) -> None:
        """Wait for seconds, or for turns of the spindle (DELAY)."""
        add_dwell(self.motion, args, line)

    def check_coolant(self, args: list[str], line: int) -> None:
        """Switch coolant on (ON, FLOOD, MIST) or off; note one that programs have no code for (COOLNT)."""
        if not {"ON", "OFF", "FLOOD", "MIST"} & set(args[:1]):
            self.motion.notes.add(line, f"coolant {quote_short(','.join(args))}: no code of programs, only a comment")

    # units and frames

    def set_units(self, args: list[str], line: int) -> None:
        """Set the unit of lengths from here on (UNITS, and UNIT of SolidWorks)."""
        if len(args) != 1 or args[0] not in LENGTH_UNITS:
            refuse("expected UNITS/MM or UNITS/INCHES, UNIT/MM or UNIT/INCH")
        self._refuse_in_cycle_or_circle()
        scale = LENGTH_UNITS[args[0]]
        if not self.motion.records.n:
            self.tools.scale_lengths(scale / self.motion.transform.scale)
        elif scale != self.motion.transform.scale:
            self.motion.notes.add(line, "the unit of length changes within the file")
        self.units.state(scale, in_motion=self.motion.records.n > 0)
        self.motion.change_frame(line, scale=scale)

    def set_tool_axis(self, args: list[str], line: int) -> None:
        """Set the tool axis from here on (TLAXIS)."""
        v = parse_numbers(args, (3,), "a tool axis i,j,k")
        self.motion.set_axis(self.motion.normalize_axis(v, line))

    def set_axis_output(self, args: list[str], line: int) -> None:
        """Set whether points have tool axes (MULTAX); where OFF takes a tilted one away, refuse a point without one."""
        off = args[:1] == ["OFF"]
        if off and DIALECTS[self.dialect].upright:
            self.motion.set_axis(UPRIGHT)
        self.motion.axis_is_open = off and self.motion.axis != UPRIGHT

    def set_origin(self, args: list[str], line: int) -> None:
        """Set where the control's zero lies in the part: it is subtracted from the points after it (ORIGIN)."""
        v = parse_numbers(args, (3, 9), "x,y,z or x,y,z and the directions of X and Z")
        self._refuse_in_cycle_or_circle()
        turn = None
        if v[3:]:
            z = np.array(normalise_direction(v[6:9]))
            turn = build_frame(v[:3], v[3:6], np.cross(z, normalise_direction(v[3:6])).tolist()).rotation.T
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
        self.motion.change_frame(line, frame=build_frame_from_matrix(rows))

    def set_csys(self, args: list[str], line: int) -> None:
        """Set the workpiece's frame by a matrix of three rows and four columns (CSYS of Creo)."""
        v = parse_numbers(args, (12,), "a matrix of three rows and four columns: twelve numbers")
        self._refuse_in_cycle_or_circle()
        self.motion.change_frame(line, frame=build_frame_from_matrix([v[0:4], v[4:8], v[8:12]], "CSYS"))

    def set_work_plane(self, args: list[str], line: int) -> None:
        """Set the workpiece's frame by the directions of X, Y and Z and the origin (MCS)."""
        v = parse_numbers(args, (12,), "the directions of X, Y and Z and an origin: twelve numbers")
        self._refuse_in_cycle_or_circle()
        self.motion.change_frame(line, frame=build_frame_from_matrix(np.array(v).reshape(4, 3).T.tolist(), "MCS"))

    def check_work_plane(self, args: list[str], line: int) -> None:
        """Refuse other directions of X, Y and Z than those of MCS (MCS2)."""
        v = parse_numbers(args, (9,), "the directions of X, Y and Z: nine numbers")
        rotation = np.eye(3) if self.motion.frame is None else self.motion.frame.rotation
        if np.abs(np.array(v).reshape(3, 3).T - rotation).max() > AXIS_TOLERANCE:
            refuse("a frame without its origin; expected MCS with the same directions before it")

    def check_work_system(self, args: list[str], line: int) -> None:
        """Refuse a change of the control's work system, whose offset the file does not tell (ZERO)."""
        self._work_systems.keep("ZERO", args, in_motion=self.motion.records.n > 0)

    def check_fixture(self, args: list[str], line: int) -> None:
        """Refuse a change of the control's fixture offset, which the file does not tell (FIXTUR)."""
        self._work_systems.keep("FIXTUR", args, in_motion=self.motion.records.n > 0)

    # modes that are honoured where they change nothing

    def check_compensation(self, args: list[str], line: int) -> None:
        """Take cutter compensation off; on, only where the file's path is the tool's centre already (CUTCOM)."""
        if args == ["OFF"] or args[:2] == ["OFF", "LENGTH"] or args[:2] == ["ON", "LENGTH"]:
            return
        if not self.compensated:
            refuse("cutter compensation left to the controller; expected a path of the tool's centre, and CUTCOM/OFF")
        self.motion.notes.add(line, "cutter compensation, already in the path: the file says OUTPUT_ON_CENTER")

    def set_compensation_type(self, args: list[str], line: int) -> None:
        """Take what a path of CUTCOM is: the tool's centre or the part's contour (CUTCOM_GEOMETRY_TYPE of Creo)."""
        self.compensated = args == ["OUTPUT_ON_CENTER"]

    def check_mode(self, args: list[str], line: int) -> None:
        """Refuse modes other than milling in absolute coordinates (MODE)."""
        if args not in (["MILL"], ["ABSOL"]):
            refuse(f"{quote_short(','.join(args))}; expected MILL or ABSOL")

    def check_setting(self, args: list[str], line: int) -> None:
        """Refuse a setting of modes other than milling in absolute coordinates (SET/MODE of NX)."""
        if args[:1] == ["MODE"]:
            self.check_mode(args[1:], line)
        else:
            self.informing.setdefault("SET", line)

    def check_off(self, args: list[str], line: int) -> None:
        """Refuse a transformation that is not taken off (TRACUT/NOMORE)."""
        if args not in (["OFF"], ["NOMORE"]):
            refuse("a transformation of the points after it; expected a file with plain points")

    # tool

    def _set_tool(self, line: int, data: Mapping[str, float | str], *, loads: bool = False) -> None:
        if self.tools.tell(self.motion.records.n, line, data, loads=loads):
            self.motion.notes.add(line, "another tool from here on")

    def set_tool_data(self, args: list[str], line: int) -> None:
        """Set kind and lengths of the tool (TLDATA of NX)."""
        self._set_tool(line, parse_tool_data(args, self.motion.transform.scale))

    def set_cutter(self, args: list[str], line: int) -> None:
        """Set lengths of the tool (CUTTER of APT)."""
        v = parse_numbers(args, range(1, 8), "CUTTER/diameter[,corner radius,e,f,a,b,height]")
        scale = self.motion.transform.scale
        data: dict[str, float | str] = {"diameter": v[0] * scale}
        if len(v) > 1:
            data["corner_radius"] = v[1] * scale
        if len(v) == 7:
            data["length"] = v[6] * scale
        self._set_tool(line, data)

    def load_tool(self, args: list[str], line: int) -> None:
        """Put a tool of a number or name into the spindle, with its length where it is given (LOADTL, TOOLNO, LOAD)."""
        args = args[1:] if args[:1] == ["TOOL"] else args
        data: dict[str, float | str] = {}
        if args and is_number(args[0]):
            data["number"] = parse_tool_number(args[0])
        elif args and args[0]:
            data["name"] = args[0]
        data |= self._read_tool_values(list(takewhile(is_number, args[1:])) if data else [], line)
        if "LENGTH" in args:
            k = args.index("LENGTH")
            (length,) = parse_numbers(args[k + 1 : k + 2], (1,), "LENGTH,length")
            of_body = "body_length" in (DIALECTS[self.dialect].tool_values or ())  # by its name as by its position
            data["body_length" if of_body else "set_length"] = length * self.motion.transform.scale
        if data:
            self._refuse_in_cycle_or_circle()
            self._set_tool(line, data, loads=True)

    def _read_tool_values(self, values: list[str], line: int) -> dict[str, float | str]:
        names = DIALECTS[self.dialect].tool_values
        if names is None and values:
            text = "values behind the tool's number, whose meaning no header tells: not taken for a length"
            self.motion.notes.add(line, text)
        return dict(parse_tool_values(names or (), values, self.motion.transform.scale))

    def select_tool(self, args: list[str], line: int) -> None:
        """Keep the number of the tool that is made ready (SELECT), where none is known yet."""
        args = args[1:] if args[:1] == ["TOOL"] else args
        if args and is_number(args[0]) and not self.motion.records.n and "number" not in self.tools.data:
            self._set_tool(line, {"number": parse_tool_number(args[0])})

    def start_tool_path(self, args: list[str], line: int) -> None:
        """Start a tool path and set its tool's name (TOOL PATH of NX)."""
        self._refuse_in_cycle_or_circle()
        self.motion.set_axis(UPRIGHT)
        if "TOOL" in args[1:-1]:
            self._set_tool(line, {"name": args[args.index("TOOL", 1) + 1]})
