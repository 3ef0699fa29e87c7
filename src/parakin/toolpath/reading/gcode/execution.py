"""Execute the words of a block, in the order of RS274/NGC."""

import math
from collections.abc import Callable, Mapping
from typing import Literal

from ....units import INCH
from ...path import Event
from ..text import refuse
from ..tools import ToolLog
from . import codes
from .block import NO_PROGRAM, POLAR, Block, round_whole
from .codes import find_m_group, format_g_code
from .cycles import CannedCycles
from .expressions import Key
from .machine_parameters import add_machine_parameters
from .motion import AXES, GcodeMotion
from .offsets import FIRST_HOME, OffsetExecutor
from .parameters import Parameters

_SET_TOOL = 61  # M61
_DELETED_NOTE = "a block that a slash lets the operator leave out: it is read"
_SPACED_NOTE = "blanks within a number: it is read without them, as RS274/NGC has it"
_FEED_NOTE = "F in a block that changes the unit: it is in the unit before, as RS274/NGC has it"


class BlockExecutor:
    """Execute one block at a time. Errors name no file and no line. Lengths in the events' texts are mm.

    tools : the lengths of tools by number, mm; None if there is no table
    reference : X to C of the machine's reference point (G28), mm and degrees
    """

    def __init__(
        self,
        motion: GcodeMotion,
        tools: Mapping[int, float] | None = None,
        reference: Mapping[str, float] | None = None,
    ):
        self.motion = motion
        self.parameters = Parameters(motion.notes)
        self.events: list[Event] = []
        self.units: Literal["mm", "inch"] = "mm"
        self.units_given = False
        self.tools = ToolLog()
        self.finished = False
        self._begun = False  # whether there was a block with words
        self._selected_tool = math.nan
        self._loaded_tool = math.nan
        self._speed = math.nan  # S, rev/min
        self._cycles = CannedCycles(motion, self._add_event, self._turn_spindle)
        self.offsets = OffsetExecutor(motion, self.parameters, self._add_event, tools)
        add_machine_parameters(self.parameters, motion, self._read_modes())
        for k, letter in enumerate(AXES):
            if reference and letter in reference:
                self.parameters.assign(FIRST_HOME + k, float(reference[letter]))

    def _read_modes(self) -> dict[Key, Callable[[], float]]:
        """Name the parameters that this executor knows."""
        return {
            5400: lambda: self._loaded_tool,
            **{5401 + k: lambda k=k: self.offsets.read_tool_offset(self._loaded_tool)[k] for k in range(3)},  # type: ignore[misc]
            "_current_tool": lambda: self._loaded_tool,
            "_selected_tool": lambda: self._selected_tool,
            "_rpm": lambda: self._speed,
            "_spindle_on": lambda: float(self._cycles.spindle in (3, 4)),
            "_spindle_cw": lambda: float(self._cycles.spindle == 3),
        }

    def execute(self, block: Block, line: int) -> None:
        """Execute a block; each step takes the words it uses out of the block, and a word that is left is refused."""
        if block.deleted:
            self.motion.notes.add(line, _DELETED_NOTE)
        if block.spaced:
            self.motion.notes.add(line, _SPACED_NOTE)
        for key, value in block.assignments:
            self.parameters.assign(key, value)
        for message in block.messages:
            self._add_event(line, "(" + "".join(c if c.isprintable() else "?" for c in message) + ")")
        self._execute_program_number(block, line)
        named = {letter for letter in AXES if letter in block.values}
        named |= {"X", "Y"} if any(letter in block.values for letter in POLAR) else set()
        previous = self.motion.mode
        moves = self._set_motion_code(block, named)
        self._execute_feed(block, line, moves)
        self._execute_spindle_and_tool(block, line)
        self._execute_dwell(block, line, moves)
        self._execute_units(block, line)
        self.motion.plane = block.g.get("plane", self.motion.plane)
        if block.values.pop("D", None) is not None:
            self.motion.notes.add(line, "D, a tool's number for radius compensation, which is off: of no effect")
        self.offsets.execute_length_offset(block, line, None if "tool" in block.m else self._loaded_tool)
        self.offsets.execute_work_system(block, line)
        self._execute_path_mode(block, line)
        if "distance" in block.g:
            self.motion.incremental = block.g["distance"] == codes.G91
        if "centre" in block.g:
            self.motion.absolute_centres = block.g["centre"] == codes.G90_1
        if "return" in block.g:
            self._cycles.retract_to_r = block.g["return"] == codes.G99
        self.offsets.execute_once(block, line)
        if moves and self.motion.mode in codes.CYCLES:
            if block.g.get("once") == codes.G53:
                refuse("G53 expected axis words with G0 or G1")
            self._cycles.execute(block.values, line, previous)
        else:
            self._execute_motion(block, line, named, moves)
        for letter, value in block.values.items():
            refuse(f"{letter}{value:g}: no code of this block uses it")
        if "stop" in block.m:
            self._add_event(line, f"M{block.m['stop']}")
            self.finished = block.m["stop"] in codes.END_CODES

    def _add_event(self, line: int, text: str) -> None:
        self.events.append(Event(self.motion.records.count, line, " ".join(text.split())))

    def _execute_program_number(self, block: Block, line: int) -> None:
        """Accept O and a number in the first block."""
        if block.program is not None:
            if self._begun or self.motion.records.count:
                refuse(NO_PROGRAM)
            self._add_event(line, f"O{block.program}")
        self._begun = self._begun or bool(block.values or block.g or block.m or block.program)

    # motion

    def _set_motion_code(self, block: Block, named: set[str]) -> bool:
        """Set the motion code in force; return whether the block moves the tool."""
        motion, code = self.motion, block.g.get("motion")
        once = block.g.get("once")
        other = once if once in codes.TAKES_AXES else None
        if block.g.get("length") == codes.G43_1 and named:
            other = codes.G43_1
        if other is not None and code is not None:
            refuse(f"axis words for both {format_g_code(other)} and {format_g_code(code)}; expected two blocks")
        if code is not None or "cancel" in block.g:
            motion.mode = code
        if other is not None:
            return False
        if named and motion.mode is None:
            refuse(f"{min(named)} without a motion code; expected G0, G1, G2 or G3 with it or before it")
        if code in codes.CYCLES and not named:
            refuse(f"{format_g_code(code or 0)} without axis words; expected the place of a hole")
        # an arc needs no axis words, for it can end where it starts; its centre alone goes on with one
        goes_on = motion.mode in (codes.G2, codes.G3) and not block.values.keys().isdisjoint("IJK")
        return bool(named) or code in (codes.G2, codes.G3) or goes_on

    def _execute_motion(self, block: Block, line: int, named: set[str], moves: bool) -> None:
        """Make the records of G0, G1, G2 and G3; ``named`` are the block's axis letters."""
        motion, values = self.motion, block.values
        machine = block.g.get("once") == codes.G53
        if machine:
            self._check_machine_coordinates(moves, named)
        if not moves:
            return
        end = motion.take_end(values, line, machine=machine)
        if motion.mode in (codes.G2, codes.G3):
            motion.add_arc(end, line, values, named)
        else:
            motion.add_line(end, line, values)
        if machine:
            self.offsets.machine_records += 1

    def _check_machine_coordinates(self, moves: bool, named: set[str]) -> None:
        """Refuse G53 where the block does not settle a point of the workpiece."""
        if not moves or self.motion.mode not in (codes.G0, codes.G1):
            refuse("G53 expected axis words with G0 or G1")
        if self.motion.incremental:
            refuse("G53 in G91; expected G90")
        self.offsets.check_machine_coordinates("G53", [AXES.index(letter) for letter in named])

    # feeds, spindle, tool

    def _execute_feed(self, block: Block, line: int, moves: bool) -> None:
        """Set the feed by G93, G94 and F; F in G93 is left to the motion."""
        motion, values = self.motion, block.values
        if "feed" in block.g:
            motion.inverse_time = block.g["feed"] == codes.G93
            if not motion.inverse_time:
                motion.rate = motion.feed = math.nan  # G94 forgets F even where it is in force, as LinuxCNC has it
        if "F" not in values:
            return
        if values["F"] < 0.0:
            refuse("a feed below zero")
        if not motion.inverse_time:
            unit = block.g.get("units")
            if unit is not None and (unit == codes.G20) != (motion.scale != 1.0):
                motion.notes.add(line, _FEED_NOTE)
            motion.set_feed(values.pop("F"))
        elif not moves or motion.mode == codes.G0:
            del values["F"]
            motion.notes.add(line, "F in G93 in a block without motion at a feed: of no effect")

    def _execute_spindle_and_tool(self, block: Block, line: int) -> None:
        """Execute S, T and the M codes of tool, spindle, coolant and override."""
        values, m = block.values, block.m
        if "S" in values:
            self._speed = values.pop("S")
            if self._speed < 0.0:
                refuse("a spindle speed below zero")
            self._add_event(line, f"S{self._speed:.10g}")
        if "T" in values:
            self._selected_tool = float(round_whole("T", values.pop("T")))
            self._tell_tool(self._selected_tool, line, loads=False)
            self._add_event(line, f"T{self._selected_tool:.0f}")
        for group in ("output", "tool", "spindle", "coolant", "override", "other"):
            code = m.get(group)
            if code is None:
                continue
            if group == "tool":
                self._change_tool(line)
            elif group == "spindle":
                self._cycles.spindle = code
                self._add_event(line, f"M{code}")
            else:
                self._pass_through(code, values, line)
        self._set_speed()

    def _set_speed(self) -> None:
        spindle = self._cycles.spindle
        speed = 0.0 if spindle == codes.SPINDLE_OFF else self._speed
        self.motion.rpm = math.nan if spindle is None else speed

    def _turn_spindle(self, line: int, code: int) -> None:
        """Switch the spindle within a cycle."""
        self._cycles.spindle = code
        self._add_event(line, f"M{code}")
        self._set_speed()

    def _change_tool(self, line: int) -> None:
        self._add_event(line, "M6")
        self._loaded_tool = self._selected_tool
        self._tell_tool(self._loaded_tool, line, loads=True)
        if self._cycles.spindle is not None:
            self._cycles.spindle = codes.SPINDLE_OFF  # LinuxCNC stops it for the change

    def _tell_tool(self, number: float, line: int, *, loads: bool) -> None:
        """Keep the number of the tool that is loaded, or of the first one that is selected."""
        if (loads and self.tools.uses) or (not self.tools.uses and not math.isnan(number)):
            data: dict[str, float | str] = {"name": "not told"} if math.isnan(number) else {"number": number}
            if self.tools.tell(self.motion.records.count, line, data, loads=loads):
                self.motion.notes.add(line, "another tool from here on")

    def _pass_through(self, code: int, values: dict[str, float], line: int) -> None:
        """Keep an M code that moves nothing as an event, with its words."""
        words = codes.M_WORDS.get(code)
        if words is None and find_m_group(code) == "other":
            words = codes.UNKNOWN_M_WORDS
            whose = "a user's own code" if code >= 100 else "a code that LinuxCNC does not know"
            self.motion.notes.add(line, f"M{code}: {whose}; it is passed through")
        text = [f"M{code}", *(f"{letter}{values.pop(letter):.10g}" for letter in words or "" if letter in values)]
        if code in (62, 63, 64, 65, 66) and len(text) == 1:
            refuse(f"M{code} without P; expected the number of an output or input")
        if code == _SET_TOOL:
            if len(text) == 1:
                refuse(f"M{code} without Q; expected the number of the tool")
            self._loaded_tool = self._selected_tool = float(text[1][1:])
            self._tell_tool(self._loaded_tool, line, loads=True)
        self._add_event(line, " ".join(text))

    # modes

    def _execute_dwell(self, block: Block, line: int, moves: bool) -> None:
        """Note a dwell (G4)."""
        dwells, blends = block.g.get("once") == codes.G4, block.g.get("path") == codes.G64
        if dwells + blends + (moves and self.motion.mode in (codes.G2, codes.G3)) > 1 and "P" in block.values:
            refuse("P in a block with several codes that use it; expected two blocks")
        if dwells:
            seconds = block.values.pop("P", -1.0)
            if seconds < 0.0:
                refuse("G4 expected P, the seconds to wait, of 0 or more")
            self._add_event(line, f"G4 P{seconds:.10g}")

    def _execute_units(self, block: Block, line: int) -> None:
        """Set the unit of lengths (G20, G21)."""
        if "units" not in block.g:
            return
        motion, scale = self.motion, INCH if block.g["units"] == codes.G20 else 1.0
        self.units_given = True
        if not motion.records.count:
            self.units = "mm" if scale == 1.0 else "inch"
        elif scale != motion.scale:
            motion.notes.add(line, "the unit of length changes within the file")
        motion.scale = scale

    def _execute_path_mode(self, block: Block, line: int) -> None:
        """Note the path mode (G61, G61.1, G64 with its tolerances in mm)."""
        code, values = block.g.get("path"), block.values
        if code is None:
            return
        words = [format_g_code(code)]
        for letter in "PQ" if code == codes.G64 else "":
            if letter in values:
                tolerance = values.pop(letter) * self.motion.scale
                if tolerance < 0.0:
                    refuse(f"{letter} below zero with G64; expected a length")
                words.append(f"{letter}{tolerance:.10g}")
        self._add_event(line, " ".join(words))
