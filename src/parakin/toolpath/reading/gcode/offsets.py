"""Execute the codes that set and use offsets: G10, G28, G30, G43 to G49, G52, G54 to G59.3, G92."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from ..text import refuse
from . import codes
from .block import Block, round_whole
from .codes import format_g_code
from .motion import AXES, GcodeMotion
from .parameters import Parameters
from .work_systems import COUNT, WorkSystems

FIRST_HOME, SECOND_HOME = 5161, 5181  # parameters of the reference points of G28 and G30: X, and five more behind it
_TIP_NOTE = "tool centre point control (G43.4 or TRAORI): every point is read as the tool's tip, with it and without"
_LENGTH_NOTE = "a tool length offset whose length this file does not tell: it moves nothing"
_BASE_NOTE = "G10 puts the first work system elsewhere in the machine than the workpiece says: the path moves with it"
_LOCAL_NOTE = "G92 before the position is known: the path's zero is where G92 puts it"


class LengthOffset(NamedTuple):
    """A tool length offset from a record on.

    length : mm along Z, NaN if not known
    keeps_tip : whether it is of tool centre point control, where every point is the tool's tip
    from_table : whether the length is a tool table's
    """

    record: int
    line: int
    length: float
    keeps_tip: bool
    from_table: bool


class OffsetExecutor:
    """Carry out the codes that move the coordinates.

    add_event : takes a line and the text of an event
    tools : the lengths of tools by number, mm; None if there is no table
    machine_records : how many records are given in the machine's own coordinates
    lengths : the tool length offsets in the order of their lines
    """

    def __init__(
        self,
        motion: GcodeMotion,
        parameters: Parameters,
        add_event: Callable[[int, str], None],
        tools: Mapping[int, float] | None,
    ):
        self.motion = motion
        self.systems = motion.systems
        self.parameters = parameters
        self.machine_records = 0
        self.lengths: list[LengthOffset] = []
        self._from_file: set[int] = set()  # the tools whose lengths G10 L1 gives
        self._add_event = add_event
        self._tools: dict[int, float] | None = None if tools is None else {int(n): float(v) for n, v in tools.items()}
        self._unknown_length: str | None = None  # the code in force whose length is not known
        self._length_scale = 1.0  # mm in the unit that the offset in force was set in
        self._unknown_local = [False] * 6  # whether G92 was given while the position was not known

    def execute_once(self, block: Block, line: int) -> None:
        """Execute G10, G28, G30, G52 and G92."""
        code = block.g.get("once")
        if code == codes.G10:
            self._set_offsets(block.values, line)
        elif code in (codes.G28, codes.G30):
            self._return_home(code, block.values, line)
        elif code in (codes.G28_1, codes.G30_1):
            self._keep_home(code, line)
        elif code in (codes.G52, codes.G92):
            self._set_local(code, block.values, line)
        elif code in (codes.G92_1, codes.G92_2, codes.G92_3):
            self._switch_local(code, line)

    def check_machine_coordinates(self, name: str, axes: list[int]) -> None:
        """Refuse a code that needs the machine's coordinates along axes where they are not known."""
        workpiece = self.motion.workpiece
        if workpiece is not None and not np.array_equal(workpiece[:, :3], np.eye(3)):
            refuse(
                f"{name} while the work is turned in the machine's coordinates; "
                "expected a workpiece that is only shifted"
            )
        for k in axes:
            if math.isnan(self.systems.base[k]):
                refuse(
                    f"{name}: where the work lies in the machine's coordinates this file does not tell; "
                    "expected a workpiece"
                )
            if self._unknown_local[k]:
                refuse(
                    f"{name} after G92 while {AXES[k]} was not known; expected motion to a known {AXES[k]} before G92"
                )
        self._check_length_unit(name)
        if self._unknown_length is not None:
            refuse(
                f"{name} while a tool length offset ({self._unknown_length}) is in force: "
                "where it leads the tip this file does not tell; expected G49 before, or a table of tools"
            )

    def _check_length_unit(self, name: str) -> None:
        """Refuse a code that needs the tool length offset in force where the unit has changed since."""
        if self.systems.tool.any() and self.motion.scale != self._length_scale:
            refuse(
                f"{name} while the unit has changed under a tool length offset, which LinuxCNC then takes in the wrong "
                "unit; expected G49 before G20 or G21"
            )

    # tool lengths

    def execute_length_offset(self, block: Block, line: int, loaded: float | None) -> None:
        """Execute a tool length offset (G43 to G49): the holder stays, so that the tip's coordinates change.

        loaded : the number of the tool in the spindle, NaN if not known, None while this block changes it
        """
        code, values = block.g.get("length"), block.values
        if code is None:
            return
        name = text = format_g_code(code)
        number: float | None = None
        offset: list[float] | None = self.systems.tool.tolist()
        if code == codes.G49:
            offset = [0.0] * 3
        elif code == codes.G43_1:
            if {"A", "B", "C"} & values.keys():
                refuse("A, B or C with G43.1; expected X, Y or Z")
            shifts = {letter: values.pop(letter) * self.motion.scale for letter in "XYZ" if letter in values}
            offset = [shifts.get(letter, old) for letter, old in zip("XYZ", offset or [0.0] * 3, strict=True)]
            text = " ".join([name, *(f"{letter}{value:.10g}" for letter, value in shifts.items())])
            if self._unknown_length is not None and len(shifts) < len("XYZ") and "Z" not in shifts:
                offset = None
        else:
            given = float(round_whole("H", values.pop("H"))) if "H" in values else None
            text = name if given is None else f"{name} H{given:.0f}"
            number = given or loaded  # H0 is the tool in the spindle, as LinuxCNC has it
            if number is None and self._tools is not None:
                refuse(
                    f"{name} without the tool's number as H in the block of its change, which may still be for the "
                    "tool before; expected H, or a block of its own"
                )
            if number is None or math.isnan(number):
                number = math.nan if given is None else 0.0
            length = self._find_length(name, number)
            offset = None if length is None else [0.0, 0.0, length]
            if code == codes.G43_2 and offset is not None:
                offset = [p + q for p, q in zip(self.systems.tool.tolist(), offset, strict=True)]
                if self._unknown_length is not None:
                    offset = None
        self.motion.set_tip_control(code == codes.G43_4)
        if code == codes.G43_4:
            self.motion.notes.add(line, _TIP_NOTE)
        from_table = code in (codes.G43, codes.G43_2, codes.G43_4) and number not in self._from_file
        length = math.nan if offset is None else float(offset[2])
        keeps_tip = code == codes.G43_4
        self.lengths.append(LengthOffset(self.motion.records.count, line, length, keeps_tip, from_table))
        self._set_length_offset(name, offset, line, keeps_tip=keeps_tip)
        self._add_event(line, text)

    def _find_length(self, name: str, number: float) -> float | None:
        """Find a tool's length, None if it is not known."""
        if number == 0.0:
            return 0.0
        if self._tools is None or math.isnan(number):
            return None
        if number not in self._tools:
            refuse(f"{name} for tool {number:.0f}, which is not in the table of tools; expected its length there")
        return self._tools[int(number)]

    def read_tool_offset(self, number: float) -> tuple[float, float, float]:
        """Return X, Y and Z of a tool in the table, whether they are in force or not; NaN where they are not known."""
        known = self._tools is not None and number in self._tools
        return (0.0, 0.0, self._tools[int(number)]) if known and self._tools else (math.nan,) * 3

    def _set_length_offset(self, name: str, offset: list[float] | None, line: int, *, keeps_tip: bool) -> None:
        self._check_length_unit(name)
        was_known = self._unknown_length is None
        self._length_scale = self.motion.scale
        self._unknown_length = name if offset is None else None
        if offset is None:
            if not keeps_tip:
                self.motion.notes.add(line, _LENGTH_NOTE)
            return
        holder = self.motion.find_holder()
        if was_known and not keeps_tip:
            if offset != self.systems.tool.tolist():
                self.systems.tool = np.array(offset)
                self.motion.was_shifted = self.motion.has_jumped = True
                self.motion.keep_holder(holder)
        else:
            self.systems.tool = np.array(offset)

    # work systems

    def execute_work_system(self, block: Block, line: int) -> None:
        """Select a work system (G54 to G59.3)."""
        code = block.g.get("system")
        if code is None:
            return
        name, systems = format_g_code(code), self.systems
        number = WorkSystems.number(code)
        first = not self._selected
        if number == systems.current and not first:
            return
        self._selected = True
        if number != systems.current:
            moved = self.motion.records.count > self.machine_records
            if not systems.has_shift(number):
                if moved or not first or systems.stated:
                    self._refuse_system(name, moved and first)
                systems.make_first(number)
            else:
                self._check_rotation(name, float(systems.rotation[number]))
                holder = self.motion.find_holder()
                systems.current = number
                self.motion.keep_holder(holder)
        self._add_event(line, name)

    _selected = False  # whether a work system was selected

    def _refuse_system(self, name: str, moved: bool) -> None:
        if moved:
            refuse(f"{name} after motion in another system; expected it before, for its offset is not in this file")
        current = self.systems.current
        other = codes.G_GROUPS["system"][current - 1]
        refuse(
            f"{name} after {format_g_code(other)}: the offset between the two is not in this file; "
            "expected G10 L2 for both, or one system throughout"
        )

    def _check_rotation(self, name: str, rotation: float) -> None:
        """Refuse to turn the coordinates under offsets in X or Y, where LinuxCNC loses the position."""
        systems = self.systems
        if rotation != systems.rotation[systems.current] and (systems.local[:2].any() or systems.tool[:2].any()):
            refuse(
                f"{name} turns the coordinates under an offset (G92, G52 or G43.1) in X or Y, "
                "where LinuxCNC loses the position; expected the offset off before"
            )

    def _set_offsets(self, values: dict[str, float], line: int) -> None:
        """Execute G10: L2 and L20 set a work system's origin, L1 a tool's length."""
        kind = round_whole("L", values.pop("L", 0.0))
        number = round_whole("P", values.pop("P", -1.0)) if "P" in values else -1
        if kind == 1:
            self._set_tool_length(number, values, line)
            return
        if kind not in (2, 20):
            refuse(f"G10 L{kind}; expected L1, L2 or L20")
        if not 0 <= number <= COUNT:
            refuse(f"G10 L{kind} expected P, the number of a work system, 0 to {COUNT}")
        systems = self.systems
        number = number or systems.current
        words = {letter: values.pop(letter) for letter in AXES if letter in values}
        text = " ".join([f"G10 L{kind} P{number}", *(f"{k}{v * self._scale(k):.10g}" for k, v in words.items())])
        holder = self.motion.find_holder()
        if "R" in values:
            if kind != 2:
                refuse("G10 L20 with R; expected L2")
            if number == systems.current:
                self._check_rotation("G10 L2", values["R"])
            systems.rotation[number] = values.pop("R")
        systems.stated.add(number)
        for letter, value in words.items():
            k = AXES.index(letter)
            if kind == 2:
                self._place_system(number, k, value * self._scale(letter), line)
            else:
                self._place_here(number, k, value * self._scale(letter))
        if number == systems.current:
            self.motion.keep_holder(holder)
        self._add_event(line, text)

    def _place_system(self, number: int, k: int, value: float, line: int) -> None:
        moved = self.motion.records.count > self.machine_records
        shifted = self.systems.shift[number, k]
        known = self.systems.place(number, k, value, moved=moved)
        if number == self.systems.current:
            if not known:
                refuse(
                    f"G10 L2 P{number} after motion: where the work lay before this file does not tell; "
                    "expected a workpiece"
                )
            if self.motion.workpiece is not None and self.systems.shift[number, k] != shifted:
                self.motion.notes.add(line, _BASE_NOTE)

    def _place_here(self, number: int, k: int, value: float) -> None:
        """Let a system's coordinate be ``value`` where the tool is."""
        systems = self.systems
        if any(p != p for p in self.motion.here[: max(k + 1, 2) if systems.rotation[number] else k + 1][k:]):
            refuse(f"G10 L20 while {AXES[k]} is not known; expected {AXES[k]} before it")
        if systems.rotation[number] != 0.0 and k < 2:
            refuse("G10 L20 for a work system that is turned; expected one without R")
        here = systems.to_work(self.motion.here)[k]
        systems.set_shift(number, k, here - value - float(systems.local[k]))

    def _scale(self, letter: str) -> float:
        return self.motion.scale if letter in "XYZ" else 1.0

    def _set_tool_length(self, number: int, values: dict[str, float], line: int) -> None:
        if number < 1 or values.keys() - {"Z"} or "Z" not in values:
            refuse("G10 L1 expected P, the number of a tool, and Z, its length")
        length = values.pop("Z") * self.motion.scale
        self._tools = {**(self._tools or {}), number: length}
        self._from_file.add(number)
        self._add_event(line, f"G10 L1 P{number} Z{length:.10g}")

    # G92 and G52

    def _set_local(self, code: int, values: dict[str, float], line: int) -> None:
        name, systems, motion = format_g_code(code), self.systems, self.motion
        words = {letter: values.pop(letter) * self._scale(letter) for letter in AXES if letter in values}
        if not words:
            refuse(f"{name} without axis words; expected X, Y, Z, A, B or C")
        holder, here = motion.find_holder(), list(motion.here)
        for letter, value in words.items():
            k = AXES.index(letter)
            if code == codes.G52:
                systems.local[k] = value
            elif here[k] == here[k]:
                systems.local[k] += here[k] - value
            elif motion.records.count or systems.rotation[systems.current]:
                refuse(f"G92 while {letter} is not known; expected {letter} before it")
            else:
                self._unknown_local[k] = True
                motion.here[k] = value
                holder[k] = motion.find_holder()[k]
                motion.notes.add(line, _LOCAL_NOTE)
        systems.kept = systems.local.copy()
        motion.keep_holder(holder)
        if code == codes.G92:
            for letter, value in words.items():
                motion.here[AXES.index(letter)] = value
        self._add_event(line, " ".join([name, *(f"{letter}{value:.10g}" for letter, value in words.items())]))

    def _switch_local(self, code: int, line: int) -> None:
        """Cancel the offsets of G92 (G92.1, G92.2) or restore them (G92.3)."""
        if any(self._unknown_local):
            k = self._unknown_local.index(True)
            refuse(f"{format_g_code(code)} after G92 while {AXES[k]} was not known; expected {AXES[k]} before G92")
        holder = self.motion.find_holder()
        self.systems.local = self.systems.kept.copy() if code == codes.G92_3 else np.zeros(6)
        if code == codes.G92_1:
            self.systems.kept = np.zeros(6)
        self.motion.keep_holder(holder)
        self._add_event(line, format_g_code(code))

    # reference points

    def _return_home(self, code: int, values: dict[str, float], line: int) -> None:
        """Move through the block's point to the reference point, in rapid, along the axes named or along all."""
        name, motion = format_g_code(code), self.motion
        named = [k for k, letter in enumerate(AXES) if letter in values]
        first = FIRST_HOME if code == codes.G28 else SECOND_HOME
        axes = named or [0, 1, 2, *(k for k in (3, 4, 5) if motion.turned[k - 3] or self._is_set(first + k))]
        for k in axes:
            if not self._is_set(first + k):
                refuse(
                    f"{name}: the reference point's {AXES[k]} in the machine, #{first + k}, is not set in this file; "
                    "expected it set before, a stated reference, or G53"
                )
        self.check_machine_coordinates(name, [k for k in axes if k < len("XYZ")])
        if self.systems.rotation[self.systems.current] and (0 in axes) != (1 in axes):
            refuse(f"{name} along X or Y alone in a work system that is turned; expected both")
        if named:
            unknown = motion.incremental and any(motion.here[k] != motion.here[k] for k in named)
            if unknown and all(values[AXES[k]] == 0.0 for k in named):
                for k in named:
                    del values[AXES[k]]
            else:
                motion.add_rapid(motion.take_end(values, line, machine=False), line)
        elif motion.has_jumped:
            motion.add_rapid(list(motion.here), line)
        targets = {AXES[k]: self.parameters.find(first + k) / (motion.scale if k < len("XYZ") else 1.0) for k in axes}
        motion.add_rapid(motion.take_end(targets, line, machine=True), line)

    def _is_set(self, number: int) -> bool:
        return not math.isnan(self.parameters.find(number))

    def _keep_home(self, code: int, line: int) -> None:
        """Keep the present position in the machine as a reference point; a coordinate that is not known is none."""
        name = format_g_code(code)
        self.check_machine_coordinates(name, [0, 1, 2])
        first = FIRST_HOME if code == codes.G28_1 else SECOND_HOME
        place = self.systems.to_work(self.motion.here)
        for k, value in enumerate(place):
            if value != value:
                refuse(f"{name} while {AXES[k]} is not known; expected {AXES[k]} before it")
            self.parameters.assign(first + k, value + self.systems.offset_in_machine(k))
        self._add_event(line, name)
