"""Expand the canned cycles G73, G74 and G81 to G89 into their motions, as LinuxCNC does."""

import math
from collections.abc import Callable

from ....units import INCH
from ..text import refuse
from .arc_motion import PLANES
from .block import round_whole
from .codes import CYCLES, G17, format_g_code
from .motion import AXES, CENTRES, GcodeMotion

PECKING, PECK_SHORT, TAP_LEFT, DRILL, DRILL_DWELL, TAP, BORE, BORE_STOP, BACK_BORE, BORE_DWELL = (
    830, 730, 740, 810, 820, 840, 850, 860, 870, 890,
)  # fmt: skip
_BACK = 0.01 * INCH  # mm above the depth reached that a peck begins
_DWELLS = (DRILL_DWELL, BORE_STOP, BORE_DWELL)  # P is expected
_MOST_REPEATS = 1_000_000
_SPINDLE = {TAP: (3,), TAP_LEFT: (4,), BORE_STOP: (3, 4), BACK_BORE: (3, 4)}  # how the spindle must turn


class CannedCycles:
    """The sticky values of cycles and the motions that follow from them. Lengths are mm.

    add_event : takes a line and the text of an event
    turn_spindle : takes a line and M3, M4 or M5
    spindle : M3, M4 or M5, None if not known
    retract_to_r : whether G99, else G98 is in force; None before either, when LinuxCNC takes G99
    """

    def __init__(
        self, motion: GcodeMotion, add_event: Callable[[int, str], None], turn_spindle: Callable[[int, int], None]
    ):
        self.motion = motion
        self.add_event = add_event
        self.turn_spindle = turn_spindle
        self.spindle: int | None = None
        self.retract_to_r: bool | None = None
        self._bottom = self._r = self._step = math.nan
        self._dwell = 0.0  # LinuxCNC keeps it from cycle to cycle
        self._centre = [0.0, 0.0, 0.0]
        self._initial = math.nan  # the level along the drilling axis before the first of a series of cycles

    def execute(self, values: dict[str, float], line: int, previous: int | None) -> None:
        """Take a cycle's words out of a block's values and make its motions.

        previous : the motion code in force before the block
        """
        motion = self.motion
        code = motion.mode or 0
        name = format_g_code(code)
        again = previous == code
        if motion.inverse_time:
            refuse(f"{name} in G93; expected G94")
        if code in (TAP, TAP_LEFT) and motion.plane != G17:
            refuse(f"{name} outside of G17, where LinuxCNC moves other axes; expected G17")
        motion.check_feed(name, values)
        for letter in "ABC":
            if letter in values:
                refuse(f"{letter} in a block with {name}; expected a motion to it before")
        first, second, along = PLANES[motion.plane]
        self._take_words(code, values, AXES[along], again=again)
        here = motion.here
        if previous not in CYCLES:
            self._initial = here[along]
        if self.retract_to_r is None:
            self.retract_to_r = True
            motion.notes.add(line, "a cycle before any G98 or G99: it retracts to R, as in LinuxCNC")
        level = here[along] if self.retract_to_r else self._initial
        start = [here[first], here[second]]
        given = [values.pop(AXES[k], None) for k in (first, second)]
        steps = [0.0, 0.0]
        for k, value in enumerate(given):
            if motion.incremental:
                steps[k] = 0.0 if value is None else value * motion.scale
            elif value is not None:
                start[k] = value * motion.scale
        for k, value in zip((first, second, along), (*start, level + self._initial), strict=True):
            if value != value:
                refuse(f"{name} while {AXES[k]} is not known; expected {AXES[k]} before it, or a stated start")
        repeats = round_whole("L", values.pop("L", 1.0))
        if not 1 <= repeats <= _MOST_REPEATS:
            refuse(f"{name} L{repeats}; expected 1 to {_MOST_REPEATS} repeats")
        self._repeat(code, line, (start, steps, level), repeats)

    def _take_words(self, code: int, values: dict[str, float], axis: str, *, again: bool) -> None:
        """Take the words that stay in force within a series of the same cycle."""
        name, scale = format_g_code(code), self.motion.scale
        for letter, kept in (("R", "_r"), (axis, "_bottom")):
            if letter in values:
                setattr(self, kept, values.pop(letter) * scale)
            elif not again:
                refuse(f"{name} without {letter}; expected {letter} in the first block of a cycle")
        if code in (PECKING, PECK_SHORT):
            if "Q" in values:
                self._step = values.pop("Q") * scale
                if not self._step > 0.0:
                    refuse(f"{name} expected Q, the depth of a step, above zero")
            elif not again:
                refuse(f"{name} without Q; expected the depth of a step")
        if code in (*_DWELLS, TAP, TAP_LEFT):
            if "P" in values:
                self._dwell = values.pop("P")
                if self._dwell < 0.0:
                    refuse(f"{name} with P below zero; expected the seconds to wait")
            elif not again and code in _DWELLS:
                refuse(f"{name} without P; expected the seconds to wait")
        if code == BACK_BORE:
            for k, letter in enumerate(CENTRES):
                if letter in values:
                    self._centre[k] = values.pop(letter) * scale
                elif not again:
                    refuse(f"{name} without {letter}; expected I, J and K")
        allowed = _SPINDLE.get(code)
        if allowed is not None and self.spindle not in allowed:
            refuse(
                f"{name} while the spindle does not turn; expected {' or '.join(f'M{m}' for m in allowed)} before it"
            )

    def _repeat(self, code: int, line: int, place: tuple[list[float], list[float], float], repeats: int) -> None:
        """Make the motions of all repeats; ``place`` holds the start in the plane, the steps and the level."""
        motion = self.motion
        (x, y), (step_x, step_y), level = place
        r, bottom = self._r, self._bottom
        if motion.incremental:
            r += self._initial
            bottom += r
        if r < bottom:
            refuse(f"{format_g_code(code)} whose R lies below its depth; expected it above")
        along = PLANES[motion.plane][2]
        if level < r:
            end = list(motion.here)
            end[along] = r
            motion.add_cycle_point(end, line, rapid=True)
            level = r
        clear = r if self.retract_to_r else level
        for _ in range(repeats):
            x, y = x + step_x, y + step_y
            self._move(line, (x, y, level), rapid=True)
            self._move(line, (x, y, r), rapid=True)
            self._make_hole(code, line, (x, y), (r, clear, bottom))
            level = clear

    def _move(self, line: int, place: tuple[float, float, float], *, rapid: bool) -> None:
        end = list(self.motion.here)
        for k, value in zip(PLANES[self.motion.plane], place, strict=True):
            end[k] = value
        self.motion.add_cycle_point(end, line, rapid=rapid)

    def _make_hole(self, code: int, line: int, at: tuple[float, float], levels: tuple[float, float, float]) -> None:
        """Make the motions from R on: one hole."""
        r, clear, bottom = levels
        if code == BACK_BORE:
            self._bore_back(line, at, clear, bottom)
            return
        if code in (PECKING, PECK_SHORT):
            depth = r - self._step
            while depth > bottom:
                self._move(line, (*at, depth), rapid=False)
                if code == PECKING:
                    self._move(line, (*at, r), rapid=True)
                self._move(line, (*at, depth + _BACK), rapid=True)
                if depth - self._step == depth:
                    refuse(f"{format_g_code(code)} whose Q is too small")
                depth -= self._step
        spindle = self.spindle or 0
        self._move(line, (*at, bottom), rapid=False)
        if code in (TAP, TAP_LEFT):
            self.turn_spindle(line, 5)
            self.turn_spindle(line, 7 - spindle)  # M3 and M4 change places
        if code in _DWELLS or (code in (TAP, TAP_LEFT) and self._dwell > 0.0):
            self.add_event(line, f"G4 P{self._dwell:.10g}")
        if code == BORE_STOP:
            self.turn_spindle(line, 5)
        if code == BORE:
            self._move(line, (*at, r), rapid=False)
        self._move(line, (*at, clear), rapid=code not in (TAP, TAP_LEFT, BORE_DWELL))
        if code in (TAP, TAP_LEFT):
            self.turn_spindle(line, 5)
        if code in (TAP, TAP_LEFT, BORE_STOP):
            self.turn_spindle(line, spindle)

    def _bore_back(self, line: int, at: tuple[float, float], clear: float, bottom: float) -> None:
        """Bore from below (G87): pass through the hole beside its axis, feed up and down again, and pass back."""
        first, second, along = PLANES[self.motion.plane]
        top = self._centre[along] + (bottom if self.motion.incremental else 0.0)
        aside = at[0] + self._centre[first], at[1] + self._centre[second]
        spindle = self.spindle or 0
        self._move(line, (*aside, self.motion.here[along]), rapid=True)
        self._orient(line)
        self._move(line, (*aside, bottom), rapid=True)
        self._move(line, (*at, bottom), rapid=True)
        self.turn_spindle(line, spindle)
        self._move(line, (*at, top), rapid=False)
        self._move(line, (*at, bottom), rapid=False)
        self._orient(line)
        self._move(line, (*aside, bottom), rapid=True)
        self._move(line, (*aside, clear), rapid=True)
        self._move(line, (*at, clear), rapid=True)
        self.turn_spindle(line, spindle)

    def _orient(self, line: int) -> None:
        self.turn_spindle(line, 5)
        self.add_event(line, "M19 R0")
