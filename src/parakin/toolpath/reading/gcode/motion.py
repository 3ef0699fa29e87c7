"""The modal state of a G-code program's motion and the records that follow from it: lines, arcs, feeds."""

import math
from collections.abc import Iterator

import numpy as np

from ....arrays import Array
from ..notes import NoteBook
from ..text import refuse
from .arc_motion import PLANES, ArcMotion, Flat, find_arc_centre, interpolate_g_arc
from .block import POLAR, round_whole
from .codes import G0, G2, G17, format_g_code
from .records import FEED, LINE, RAPID, SECONDS, SPINDLE, WIDTH, GcodeRecords
from .work_systems import WorkSystems

AXES = "XYZABC"
STILL = 1e-7  # mm: where X, Y and Z move less, RS274/NGC as LinuxCNC has it takes F for degrees per minute
CENTRES = "IJK"
_MOST_CYCLE_POINTS = 1_000_000
_MOST_POINTS = 20_000_000  # greatest number of points of all arcs: a few GB of memory


class GcodeMotion:
    """Modal state of the motion. Lengths are mm, turns degrees as programmed.

    here : X, Y, Z, A, B, C; X, Y, Z are NaN until they are given, A, B, C 0
    turned : whether A, B, C were given
    plain_turns : whether the fast reader may read A, B, C
    tip_control : whether G43.4 is in force
    untipped_line : the first line with A, B or C without it, 0 if there is none
    mode : the motion code in force in tenths, None if there is none
    plane : the code of the arcs' plane in tenths
    scale : mm in the programmed unit
    incremental, absolute_centres, inverse_time : G91, G90.1, G93
    rate, feed : F as written, and in mm/min; NaN until given
    rpm : spindle speed in rev/min, NaN if not known
    workpiece : (3, 4) rotation and origin (mm) of the work in the machine's coordinates; None if not known
    systems : the coordinate systems; ``here`` and the records are in the program's coordinates
    frames : how the records lead to W: the first record of each frame, and the frame
    """

    def __init__(self, arc_tolerance: float, workpiece: Array | None):
        self.records = GcodeRecords()
        self.notes = NoteBook()
        self.arc_tolerance = arc_tolerance
        self.workpiece = workpiece
        self.systems = WorkSystems(workpiece)
        self.frames = [(0, self.systems.frame())]
        self._arc_points = 0
        self._cycle_points = 0
        self.here = [math.nan, math.nan, math.nan, 0.0, 0.0, 0.0]
        self.turned = [False, False, False]
        self.plain_turns = [False, False, False]
        self.tip_control = False
        self.untipped_line = 0
        self.has_jumped = False  # whether a tool length offset has moved the tip since the last motion of a cycle
        self.was_shifted = False  # whether the program's coordinates have ever moved
        self.mode: int | None = None
        self.plane = G17
        self.scale = 1.0
        self.incremental = False
        self.absolute_centres = False
        self.inverse_time = False
        self.rate = self.feed = math.nan
        self.rpm = math.nan

    def set_feed(self, rate: float) -> None:
        """Set the feed in the programmed unit per minute."""
        self.rate, self.feed = rate, rate * self.scale

    def take_end(self, values: dict[str, float], line: int, *, machine: bool) -> list[float]:
        """Take a block's axis words out of its values and return where they lead, six coordinates.

        machine : G53, the words are in the machine's own coordinates, where the workpiece's origin shifts the work
        """
        if machine:
            return self._take_machine_end(values, line)
        end = list(self.here)
        for k, value in self._take_words(values, line):
            if self.incremental:
                if end[k] != end[k]:
                    refuse(
                        f"G91 while {AXES[k]} is not known; expected {AXES[k]} once in G90 before, or a stated start"
                    )
                value += end[k]
            end[k] = value
        if any(letter in values for letter in POLAR):
            self._turn_polar(end, values)
        return end

    def _turn_polar(self, end: list[float], values: dict[str, float]) -> None:
        """Set X and Y of an end by polar words, a distance from the zero in force and an angle; G91: steps of them."""
        radius, angle = values.pop("@", None), values.pop("^", None)
        if end[:2] != self.here[:2]:
            refuse("X or Y beside polar words (@, ^); expected one of both")
        out, turn = math.hypot(*end[:2]), math.degrees(math.atan2(end[1], end[0]))
        if (radius is None and out != out) or ((angle is None or self.incremental) and not out > 0.0):
            refuse("a polar word from the zero of X and Y, or from an unknown place; expected both @ and ^ in G90")
        step_out, step_turn = (out, turn) if self.incremental else (0.0, 0.0)
        out = out if radius is None else step_out + radius * self.scale
        turn = math.radians(turn if angle is None else step_turn + angle)
        end[0], end[1] = out * math.cos(turn), out * math.sin(turn)

    def _take_machine_end(self, values: dict[str, float], line: int) -> list[float]:
        point = self.systems.to_work(self.here)
        for k, value in self._take_words(values, line):
            point[k] = value - self.systems.offset_in_machine(k)
        return self.systems.from_work(point)

    def _take_words(self, values: dict[str, float], line: int) -> Iterator[tuple[int, float]]:
        """Take axis words out of a block's values one by one: their columns, and the values in mm and degrees."""
        for k, letter in enumerate(AXES):
            value = values.pop(letter, None)
            if value is None:
                continue
            if k < 3:
                value *= self.scale
            else:
                self._give_turn(k - 3, value, line)
            yield k, value

    def _give_turn(self, k: int, value: float, line: int) -> None:
        """Note that A, B or C (``k``) is given."""
        if not self.turned[k]:
            self.turned[k] = True
            if self.records.count and value != 0.0:
                self.notes.add(line, f"{AXES[k + 3]} is first given here: it is 0 before")
        self.plain_turns[k] = True
        if not self.tip_control:
            self.untipped_line = self.untipped_line or line

    def set_tip_control(self, on: bool) -> None:
        """Switch tool centre point control (G43.4) on or off."""
        if on and not all(value == value for value in self.here[:3]):
            self.untipped_line = 0  # the turns before are no records
        if self.tip_control and not on and not self.untipped_line:
            self.plain_turns = [False] * 3
        self.tip_control = on

    # coordinate systems

    def find_holder(self) -> list[float]:
        """Return where the tool's holder is, in W turned by nothing: the tip and the tool length offset in force."""
        tip = self.systems.to_work(self.here)
        return [*(p + q for p, q in zip(tip[:3], self.systems.tool.tolist(), strict=True)), *tip[3:]]

    def keep_holder(self, holder: list[float]) -> None:
        """Let the holder be where it was, in the coordinates now in force."""
        tip = [*(p - q for p, q in zip(holder[:3], self.systems.tool.tolist(), strict=True)), *holder[3:]]
        frame = self.systems.frame()
        if frame == self.frames[-1][1] and not self.systems.tool.any() and not self.was_shifted:
            return
        self.was_shifted = True
        self.here = self.systems.from_work(tip)
        if frame != self.frames[-1][1]:
            if self.frames[-1][0] == self.records.count:
                self.frames.pop()
            self.frames.append((self.records.count, frame))

    # lines

    def add_line(self, end: list[float], line: int, values: dict[str, float]) -> None:
        """Add the record of a straight motion (G0 and G1)."""
        rapid = self.mode == G0
        seconds = math.nan
        if not rapid:
            self.check_feed("G1", values)
            seconds = self._take_seconds(values)
            degrees = math.dist(self.here[3:], end[3:])
            if not self.inverse_time and degrees > 0.0 and self._tip_stays(end):
                seconds = 60.0 * degrees / self.rate
        feed = math.nan if self.inverse_time else self.feed
        self.records.fresh.extend((*end, feed, seconds, self.rpm, rapid, line))
        self.here, self.has_jumped = end, False

    def add_cycle_point(self, end: list[float], line: int, *, rapid: bool) -> None:
        """Add the record of a motion within a cycle, unless it leads nowhere."""
        if end == self.here and not self.has_jumped:
            return
        self.has_jumped = False
        self._cycle_points += 1
        if self._cycle_points > _MOST_CYCLE_POINTS:
            refuse(f"cycles of more than {_MOST_CYCLE_POINTS} motions in all; expected larger steps or fewer repeats")
        self.records.fresh.extend((*end, self.feed, math.nan, self.rpm, rapid, line))
        self.here = end

    def add_rapid(self, end: list[float], line: int) -> None:
        """Add the record of a rapid motion, whatever motion code is in force."""
        feed = math.nan if self.inverse_time else self.feed
        self.records.fresh.extend((*end, feed, math.nan, self.rpm, True, line))
        self.here, self.has_jumped = end, False

    def _tip_stays(self, end: list[float]) -> bool:
        """Tell whether a motion leaves X, Y and Z as they are; unknown coordinates count as unchanged."""
        return not any(abs(p - q) > STILL for p, q in zip(self.here[:3], end[:3], strict=True))

    # arcs

    def add_arc(self, end: list[float], line: int, values: dict[str, float], named: set[str]) -> None:
        """Add the records of an arc (G2 and G3); ``named`` are the axis words of the block."""
        name, clockwise = format_g_code(self.mode or 0), self.mode == G2
        plane = PLANES[self.plane]
        self.check_feed(name, values)
        seconds = self._take_seconds(values)
        self._check_known(name, plane, named)
        turns = round_whole("P", values.pop("P", 1.0))
        if turns < 1:
            refuse(f"{name} P0; expected P of 1 or more turns")
        arc = ArcMotion(self._take_centre(end, name, values, named), plane, clockwise, turns)
        points, fraction = interpolate_g_arc(
            self.here[:3], end[:3], arc, inches=self.scale != 1.0, tolerance=self.arc_tolerance
        )
        self._arc_points += len(points)
        if self._arc_points > _MOST_POINTS:
            refuse(
                f"arcs of more than {_MOST_POINTS} points in all at a tolerance of {self.arc_tolerance:g} mm; "
                "expected a coarser one"
            )
        rows = np.empty((len(points), WIDTH))
        rows[:, :3] = points
        first, last = np.array(self.here[3:]), np.array(end[3:])
        rows[:, 3:6] = first + (last - first) * fraction[:, None]
        rows[-1, 3:6] = last
        rows[:, FEED] = math.nan if self.inverse_time else self.feed
        rows[:, SECONDS] = seconds / len(points)
        rows[:, SPINDLE], rows[:, RAPID], rows[:, LINE] = self.rpm, 0.0, line
        self.records.add_rows(rows)
        self.here = end

    def _check_known(self, name: str, plane: tuple[int, int, int], named: set[str]) -> None:
        """Refuse an arc that starts at unknown coordinates: the plane's two, and the third where the block names it."""
        for k in plane[:2] if AXES[plane[2]] not in named else plane:
            if self.here[k] != self.here[k]:
                refuse(f"{name} while {AXES[k]} is not known; expected {AXES[k]} before it, or a stated start")

    def _take_centre(self, end: list[float], name: str, values: dict[str, float], named: set[str]) -> Flat:
        """Take R, or I, J and K, out of a block's values and return the arc's centre in its plane, mm."""
        first, second, along = PLANES[self.plane]
        letters = CENTRES[first], CENTRES[second]
        if values.get(CENTRES[along]) == 0.0:
            del values[CENTRES[along]]
        if CENTRES[along] in values:
            plane = format_g_code(self.plane)
            refuse(f"{CENTRES[along]} for an arc in {plane}; expected {letters[0]} and {letters[1]}, or R")
        given = [letter for letter in letters if letter in values]
        radius = values.pop("R", None)
        if (radius is None) != bool(given):
            refuse(f"{name} expected either R or {letters[0]} and {letters[1]}")
        start, last = (self.here[first], self.here[second]), (end[first], end[second])
        if radius is not None:
            if not named & {AXES[first], AXES[second]}:
                refuse(f"a full circle by R has no definite centre; expected {letters[0]} or {letters[1]}")
            return find_arc_centre(start, last, radius * self.scale, self.mode == G2)
        if self.absolute_centres and len(given) != 2:
            refuse(f"{name} in G90.1; expected both {letters[0]} and {letters[1]}")
        out = [values.pop(letter, 0.0) * self.scale for letter in letters]
        if self.absolute_centres:
            return out[0], out[1]
        return start[0] + out[0], start[1] + out[1]

    # feeds

    def check_feed(self, name: str, values: dict[str, float]) -> None:
        """Refuse a motion in feed without a feed in force."""
        if self.inverse_time:
            if "F" not in values:
                refuse(f"{name} in G93 without F; expected F, the inverse of its minutes, in every such block")
        elif not self.rate > 0.0:
            refuse(f"{name} without a feed; expected F above zero with it or before it, behind any G94")

    def _take_seconds(self, values: dict[str, float]) -> float:
        """Take F out of the values in G93 and return the time it gives the block, s; NaN in G94."""
        if not self.inverse_time:
            return math.nan
        rate = values.pop("F")
        if not rate > 0.0:
            refuse(f"F{rate:g} in G93; expected the inverse of a time in minutes, above zero")
        return 60.0 / rate
