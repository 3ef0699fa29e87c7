"""What the words of a block do, in the order in which RS274/NGC executes them."""

import math
from typing import Literal

import numpy as np

from ...path import Event
from ..cl.tokens import INCH, refuse
from .codes import TIP_CONTROL, g_name
from .motion import AXES, GcodeMotion
from .words import NO_PROGRAM, Block, whole

_DWELL, _MACHINE, _BLEND = 40, 530, 640
_NO_OFFSETS = (921, 922)
_TIP_NOTE = "tool centre point control (G43.4 or TRAORI): every point is read as the tool's tip, with it and without"
_DELETED_NOTE = "a block that a slash lets the operator leave out: it is read"
_SPACED_NOTE = "blanks within a number: it is read without them, as RS274/NGC has it"
_FEED_NOTE = "F in a block that changes the unit: it is in the unit before, as RS274/NGC has it"


class GcodeState:
    """Acts on one block at a time. Errors carry no place. Lengths in the events' texts are mm."""

    def __init__(self, motion: GcodeMotion):
        self.motion = motion
        self.events: list[Event] = []
        self.units: Literal["mm", "inch"] = "mm"
        self.units_given = False
        self.tool: dict[str, float | str] = {}
        self.finished = False
        self._begun = False  # whether there was a block with words
        self._selected = math.nan
        self._speed = math.nan
        self._spindle: int | None = None
        self._offset: str | None = None  # the tool length offset in force, where it may be other than zero
        self._system: int | None = None
        self._machine_rows = 0  # records given in the machine's own coordinates

    def act(self, block: Block, line: int) -> None:
        """Everything a block asks for; each step takes the words it uses out of the block."""
        if block.deleted:
            self.motion.notes.add(line, _DELETED_NOTE)
        if block.spaced:
            self.motion.notes.add(line, _SPACED_NOTE)
        for message in block.messages:
            self._event(line, "(" + "".join(c if c.isprintable() else "?" for c in message) + ")")
        self._name(block, line)
        named = {letter for letter in AXES if letter in block.values}
        moves = self._moves(block, named)
        self._feed(block, line, moves)
        self._spindle_and_tool(block, line)
        self._once(block, line, moves)
        self._units(block, line)
        self.motion.plane = block.g.get("plane", self.motion.plane)
        self._length(block, line)
        self._work_system(block, line)
        self._path_mode(block, line)
        if "distance" in block.g:
            self.motion.incremental = block.g["distance"] == 910
        if "centre" in block.g:
            self.motion.absolute_centres = block.g["centre"] == 901
        self._move(block, line, named, moves)
        for letter, value in block.values.items():
            refuse(f"{letter}{value:g}: no code of this block uses it")
        if "stop" in block.m:
            self._event(line, f"M{block.m['stop']}")
            self.finished = block.m["stop"] in (2, 30)

    def _event(self, line: int, text: str) -> None:
        self.events.append(Event(self.motion.rows.count, line, " ".join(text.split())))

    def _name(self, block: Block, line: int) -> None:
        if block.program is not None:
            if self._begun or self.motion.rows.count:
                refuse(NO_PROGRAM)
            self._event(line, f"O{block.program}")
        self._begun = self._begun or bool(block.values or block.g or block.m or block.program)

    # motion

    def _moves(self, block: Block, named: set[str]) -> bool:
        """Whether the block moves the tool; sets the motion code in force."""
        motion, code = self.motion, block.g.get("motion")
        offsets = block.g.get("length") == 431 and bool(named)
        if offsets and code is not None:
            refuse(f"axis words for both G43.1 and {g_name(code)}; expected two blocks")
        if code is not None or "cancel" in block.g:
            motion.mode = code
        if named and motion.mode is None and not offsets:
            refuse(f"{min(named)} without a motion code; expected G0, G1, G2 or G3 with it or before it")
        # an arc needs no axis words: it can end where it starts
        return (bool(named) and not offsets) or code in (20, 30)

    def _move(self, block: Block, line: int, named: set[str], moves: bool) -> None:
        motion, values = self.motion, block.values
        machine = block.g.get("once") == _MACHINE
        if machine:
            self._check_machine(moves)
        if not moves:
            return
        before = motion.rows.count
        end = motion.end(values, line, machine)
        if motion.mode in (20, 30):
            motion.arc(end, line, values, named)
        else:
            motion.straight(end, line, values)
        if machine:
            self._machine_rows += motion.rows.count - before

    def _check_machine(self, moves: bool) -> None:
        if not moves or self.motion.mode not in (0, 10):
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

    def _feed(self, block: Block, line: int, moves: bool) -> None:
        motion, values = self.motion, block.values
        if "feed" in block.g:
            motion.inverse_time = block.g["feed"] == 930
            if not motion.inverse_time:
                motion.rate = motion.feed = math.nan  # G94 forgets F even where it is in force, as LinuxCNC has it
        if "F" not in values:
            return
        if values["F"] < 0.0:
            refuse("a feed below zero")
        if not motion.inverse_time:
            unit = block.g.get("units")
            if unit is not None and (unit == 200) != (motion.scale != 1.0):
                motion.notes.add(line, _FEED_NOTE)
            motion.set_feed(values.pop("F"))
        elif not moves or motion.mode == 0:
            del values["F"]
            motion.notes.add(line, "F in G93 in a block without motion at a feed: of no effect")

    def _spindle_and_tool(self, block: Block, line: int) -> None:
        values, codes = block.values, block.m
        if "S" in values:
            self._speed = values.pop("S")
            if self._speed < 0.0:
                refuse("a spindle speed below zero")
            self._event(line, f"S{self._speed:.10g}")
        if "T" in values:
            self._selected = float(whole("T", values.pop("T")))
            self.tool.setdefault("number", self._selected)
            self._event(line, f"T{self._selected:.0f}")
        if "tool" in codes:
            self._event(line, "M6")
            if self.tool.get("number", self._selected) != self._selected and not math.isnan(self._selected):
                self.motion.notes.add(line, "another tool: the path's tool is the first one")
        for group in ("spindle", "coolant", "override"):
            if group in codes:
                self._event(line, f"M{codes[group]}")
        self._spindle = codes.get("spindle", self._spindle)
        self.motion.rpm = math.nan if self._spindle is None else 0.0 if self._spindle == 5 else self._speed

    # modes

    def _once(self, block: Block, line: int, moves: bool) -> None:
        dwells, blends = block.g.get("once") == _DWELL, block.g.get("path") == _BLEND
        if dwells + blends + (moves and self.motion.mode in (20, 30)) > 1 and "P" in block.values:
            refuse("P in a block with several codes that use it; expected two blocks")
        if dwells:
            seconds = block.values.pop("P", -1.0)
            if seconds < 0.0:
                refuse("G4 expected P, the seconds to wait, of 0 or more")
            self._event(line, f"G4 P{seconds:.10g}")
        elif block.g.get("once") in _NO_OFFSETS:
            self._event(line, g_name(block.g["once"]))

    def _units(self, block: Block, line: int) -> None:
        if "units" not in block.g:
            return
        motion, scale = self.motion, INCH if block.g["units"] == 200 else 1.0
        self.units_given = True
        if not motion.rows.count:
            self.units = "mm" if scale == 1.0 else "inch"
        elif scale != motion.scale:
            motion.notes.add(line, "the unit of length changes within the file")
        motion.scale = scale

    def _length(self, block: Block, line: int) -> None:
        """Tool length offsets move nothing here: the points are the tip's."""
        code, values = block.g.get("length"), block.values
        if code is None:
            return
        name = text = g_name(code)
        offset = True
        if code == 490:
            offset = False
        elif code == 431:
            if {"A", "B", "C"} & values.keys():
                refuse("A, B or C with G43.1; expected X, Y or Z")
            shifts = {letter: values.pop(letter) * self.motion.scale for letter in "XYZ" if letter in values}
            offset = any(shifts.values())
            text = " ".join([name, *(f"{letter}{value:.10g}" for letter, value in shifts.items())])
        elif "H" in values:
            number = whole("H", values.pop("H"))
            offset = number > 0 or (code == 432 and self._offset is not None)
            text = f"{name} H{number}"
        if code == TIP_CONTROL:
            self.motion.notes.add(line, _TIP_NOTE)
        self._offset = name if offset else None
        self._event(line, text)

    def _work_system(self, block: Block, line: int) -> None:
        code = block.g.get("system")
        if code is None or code == self._system:
            return
        if self._system is not None:
            refuse(
                f"{g_name(code)} after {g_name(self._system)}: the offsets of work systems are not in this file; "
                "expected one system throughout"
            )
        if code != 540 and self.motion.rows.count > self._machine_rows:
            refuse(
                f"{g_name(code)} after motion in another system; expected it before, for its offset is not in this file"
            )
        self._system = code
        self._event(line, g_name(code))

    def _path_mode(self, block: Block, line: int) -> None:
        code, values = block.g.get("path"), block.values
        if code is None:
            return
        words = [g_name(code)]
        for letter in "PQ" if code == _BLEND else "":
            if letter in values:
                tolerance = values.pop(letter) * self.motion.scale
                if tolerance < 0.0:
                    refuse(f"{letter} below zero with G64; expected a length")
                words.append(f"{letter}{tolerance:.10g}")
        self._event(line, " ".join(words))
