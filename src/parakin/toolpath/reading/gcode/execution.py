"""Execute the words of a block, in the order of RS274/NGC."""

import math
from typing import Literal

import numpy as np

from ...path import Event
from ..text import INCH, refuse
from . import codes
from .block import NO_PROGRAM, Block, round_whole
from .codes import format_g_code
from .motion import AXES, GcodeMotion

_TIP_NOTE = "tool centre point control (G43.4 or TRAORI): every point is read as the tool's tip, with it and without"
_DELETED_NOTE = "a block that a slash lets the operator leave out: it is read"
_SPACED_NOTE = "blanks within a number: it is read without them, as RS274/NGC has it"
_FEED_NOTE = "F in a block that changes the unit: it is in the unit before, as RS274/NGC has it"


class BlockExecutor:
    """Execute one block at a time. Errors name no file and no line. Lengths in the events' texts are mm."""

    def __init__(self, motion: GcodeMotion):
        self.motion = motion
        self.events: list[Event] = []
        self.units: Literal["mm", "inch"] = "mm"
        self.units_given = False
        self.tool: dict[str, float | str] = {}
        self.finished = False
        self._begun = False  # whether there was a block with words
        self._selected_tool = math.nan
        self._speed = math.nan  # S, rev/min
        self._spindle: int | None = None  # M3, M4 or M5
        self._offset: str | None = None  # the tool length offset in force, where it may be other than zero
        self._system: int | None = None  # the work system, G54 to G59.3
        self._machine_records = 0  # those given in the machine's own coordinates

    def execute(self, block: Block, line: int) -> None:
        """Execute a block; each step takes the words it uses out of the block, and a word that is left is refused."""
        if block.deleted:
            self.motion.notes.add(line, _DELETED_NOTE)
        if block.spaced:
            self.motion.notes.add(line, _SPACED_NOTE)
        for message in block.messages:
            self._add_event(line, "(" + "".join(c if c.isprintable() else "?" for c in message) + ")")
        self._execute_program_number(block, line)
        named = {letter for letter in AXES if letter in block.values}
        moves = self._set_motion_code(block, named)
        self._execute_feed(block, line, moves)
        self._execute_spindle_and_tool(block, line)
        self._execute_once(block, line, moves)
        self._execute_units(block, line)
        self.motion.plane = block.g.get("plane", self.motion.plane)
        self._execute_length_offset(block, line)
        self._execute_work_system(block, line)
        self._execute_path_mode(block, line)
        if "distance" in block.g:
            self.motion.incremental = block.g["distance"] == codes.G91
        if "centre" in block.g:
            self.motion.absolute_centres = block.g["centre"] == codes.G90_1
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
        offsets = block.g.get("length") == codes.G43_1 and bool(named)
        if offsets and code is not None:
            refuse(f"axis words for both G43.1 and {format_g_code(code)}; expected two blocks")
        if code is not None or "cancel" in block.g:
            motion.mode = code
        if named and motion.mode is None and not offsets:
            refuse(f"{min(named)} without a motion code; expected G0, G1, G2 or G3 with it or before it")
        # an arc needs no axis words, for it can end where it starts
        return (bool(named) and not offsets) or code in (codes.G2, codes.G3)

    def _execute_motion(self, block: Block, line: int, named: set[str], moves: bool) -> None:
        """Make the records of G0, G1, G2 and G3; ``named`` are the block's axis letters."""
        motion, values = self.motion, block.values
        machine = block.g.get("once") == codes.G53
        if machine:
            self._check_machine_coordinates(moves)
        if not moves:
            return
        before = motion.records.count
        end = motion.take_end(values, line, machine=machine)
        if motion.mode in (codes.G2, codes.G3):
            motion.add_arc(end, line, values, named)
        else:
            motion.add_line(end, line, values)
        if machine:
            self._machine_records += motion.records.count - before

    def _check_machine_coordinates(self, moves: bool) -> None:
        """Refuse G53 where the block does not settle a point of the workpiece."""
        if not moves or self.motion.mode not in (codes.G0, codes.G1):
            refuse("G53 expected axis words with G0 or G1")
        if self.motion.incremental:
            refuse("G53 in G91; expected G90")
        motion = self.motion
        if motion.workpiece is None:
            refuse(
                "G53: where the work lies in the machine's coordinates this file does not tell; expected a workpiece"
            )
        if not np.array_equal(motion.workpiece[:, :3], np.eye(3)):
            refuse(
                "G53 while the work is turned in the machine's coordinates; expected a workpiece that is only shifted"
            )
        if self._offset is not None:
            refuse(
                f"G53 while a tool length offset ({self._offset}) is in force: "
                "where it leads the tip this file does not tell; expected G49 before"
            )

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
            self.tool.setdefault("number", self._selected_tool)
            self._add_event(line, f"T{self._selected_tool:.0f}")
        if "tool" in m:
            self._add_event(line, "M6")
            selected = self._selected_tool
            if self.tool.get("number", selected) != selected and not math.isnan(selected):
                self.motion.notes.add(line, "another tool: the path's tool is the first one")
        for group in ("spindle", "coolant", "override"):
            if group in m:
                self._add_event(line, f"M{m[group]}")
        self._spindle = m.get("spindle", self._spindle)
        speed = 0.0 if self._spindle == codes.SPINDLE_OFF else self._speed
        self.motion.rpm = math.nan if self._spindle is None else speed

    # modes

    def _execute_once(self, block: Block, line: int, moves: bool) -> None:
        """Note a dwell (G4) or the end of G92 offsets (G92.1, G92.2)."""
        dwells, blends = block.g.get("once") == codes.G4, block.g.get("path") == codes.G64
        if dwells + blends + (moves and self.motion.mode in (codes.G2, codes.G3)) > 1 and "P" in block.values:
            refuse("P in a block with several codes that use it; expected two blocks")
        if dwells:
            seconds = block.values.pop("P", -1.0)
            if seconds < 0.0:
                refuse("G4 expected P, the seconds to wait, of 0 or more")
            self._add_event(line, f"G4 P{seconds:.10g}")
        elif block.g.get("once") in (codes.G92_1, codes.G92_2):
            self._add_event(line, format_g_code(block.g["once"]))

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

    def _execute_length_offset(self, block: Block, line: int) -> None:
        """Note a tool length offset (G43 to G49). It moves nothing here, for the points are the tip's."""
        code, values = block.g.get("length"), block.values
        if code is None:
            return
        name = text = format_g_code(code)
        offset = True
        if code == codes.G49:
            offset = False
        elif code == codes.G43_1:
            if {"A", "B", "C"} & values.keys():
                refuse("A, B or C with G43.1; expected X, Y or Z")
            shifts = {letter: values.pop(letter) * self.motion.scale for letter in "XYZ" if letter in values}
            offset = any(shifts.values())
            text = " ".join([name, *(f"{letter}{value:.10g}" for letter, value in shifts.items())])
        elif "H" in values:
            number = round_whole("H", values.pop("H"))
            offset = number > 0 or (code == codes.G43_2 and self._offset is not None)
            text = f"{name} H{number}"
        if code == codes.G43_4:
            self.motion.notes.add(line, _TIP_NOTE)
        self._offset = name if offset else None
        self._add_event(line, text)

    def _execute_work_system(self, block: Block, line: int) -> None:
        """Accept one work system (G54 to G59.3) for the whole program."""
        code = block.g.get("system")
        if code is None or code == self._system:
            return
        name = format_g_code(code)
        if self._system is not None:
            refuse(
                f"{name} after {format_g_code(self._system)}: the offsets of work systems are not in this file; "
                "expected one system throughout"
            )
        if code != codes.G54 and self.motion.records.count > self._machine_records:
            refuse(f"{name} after motion in another system; expected it before, for its offset is not in this file")
        self._system = code
        self._add_event(line, name)

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
