"""Where a G-code program has led the tool, how fast, and the records made from it."""

import math

import numpy as np

from ...path import Floats
from ..cl.tokens import refuse
from ..columns import NoteBook
from .arcs import PLANES, arc_points, centre_from_radius
from .codes import g_name
from .records import FEED, LINE, RAPID, SECONDS, SPINDLE, WIDTH, Rows
from .words import whole

AXES = "XYZABC"
STILL = 1e-7  # mm: where X, Y and Z move less, RS274/NGC as LinuxCNC has it takes F for degrees per minute
CENTRES = "IJK"
_MOST_POINTS = 20_000_000  # of all arcs: some GB of memory


class GcodeMotion:
    """Modal state of the motion. Lengths are mm, turns degrees as programmed.

    here : X, Y, Z, A, B, C; X, Y, Z are NaN until they are given, A, B, C 0
    mode : the motion code in force in tenths, None if there is none
    rate, feed : F as written, and in mm/min; NaN until given
    workpiece : (3, 4) rotation and origin (mm) of the work in the machine's coordinates; None if not known
    """

    def __init__(self, arc_tolerance: float, workpiece: Floats | None):
        self.rows = Rows()
        self.notes = NoteBook()
        self.arc_tolerance = arc_tolerance
        self.workpiece = workpiece
        self._points = 0  # of arcs
        self.here = [math.nan, math.nan, math.nan, 0.0, 0.0, 0.0]
        self.turned = [False, False, False]  # whether A, B, C were given
        self.mode: int | None = None
        self.plane = 170
        self.scale = 1.0
        self.incremental = False
        self.absolute_centres = False
        self.inverse_time = False
        self.rate = self.feed = math.nan
        self.rpm = math.nan

    def set_feed(self, rate: float) -> None:
        self.rate, self.feed = rate, rate * self.scale

    def end(self, values: dict[str, float], line: int, machine: bool) -> list[float]:
        """Where a block's axis words lead, taken out of it; ``machine`` where G53 tells them in the machine's own
        coordinates, in which the work is shifted by the workpiece's origin.
        """
        end = list(self.here)
        for k, letter in enumerate(AXES):
            value = values.pop(letter, None)
            if value is None:
                continue
            if k < 3:
                value *= self.scale
                if machine and self.workpiece is not None:
                    value -= float(self.workpiece[k, 3])
            elif not self.turned[k - 3]:
                self.turned[k - 3] = True
                if self.rows.count and value != 0.0:
                    self.notes.add(line, f"{letter} is first given here: it is 0 before")
            if self.incremental and not machine:
                if end[k] != end[k]:
                    refuse(f"G91 while {letter} is not known; expected {letter} once in G90 before")
                value += end[k]
            end[k] = value
        return end

    def straight(self, end: list[float], line: int, values: dict[str, float]) -> None:
        """G0 and G1."""
        rapid = self.mode == 0
        seconds = math.nan
        if not rapid:
            self._need_feed("G1", values)
            seconds = self._seconds(values)
            degrees = math.dist(self.here[3:], end[3:])
            if not self.inverse_time and degrees > 0.0 and self.still(end):
                seconds = 60.0 * degrees / self.rate
        feed = math.nan if self.inverse_time else self.feed
        self.rows.fresh.extend((*end, feed, seconds, self.rpm, rapid, line))
        self.here = end

    def still(self, end: list[float]) -> bool:
        """Whether X, Y and Z stay; one that isn't known does."""
        return not any(abs(p - q) > STILL for p, q in zip(self.here[:3], end[:3], strict=True))

    def arc(self, end: list[float], line: int, values: dict[str, float], named: set[str]) -> None:
        """G2 and G3; ``named`` are the axis words of the block."""
        name, clockwise = g_name(self.mode or 0), self.mode == 20
        plane = PLANES[self.plane]
        self._need_feed(name, values)
        seconds = self._seconds(values)
        for k in plane[:2]:
            if self.here[k] != self.here[k]:
                refuse(f"{name} while {AXES[k]} is not known; expected {AXES[k]} before it")
        if AXES[plane[2]] in named and math.isnan(self.here[plane[2]]):
            refuse(f"{name} while {AXES[plane[2]]} is not known; expected {AXES[plane[2]]} before it")
        turns = whole("P", values.pop("P", 1.0))
        if turns < 1:
            refuse(f"{name} P0; expected P of 1 or more turns")
        centre = self._centre(end, name, clockwise, plane, values, named)
        points, fraction = arc_points(
            self.here[:3], end[:3], centre, plane, clockwise, turns, self.scale != 1.0, self.arc_tolerance
        )
        self._points += len(points)
        if self._points > _MOST_POINTS:
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
        self.rows.add(rows)
        self.here = end

    def _centre(
        self,
        end: list[float],
        name: str,
        clockwise: bool,
        plane: tuple[int, int, int],
        values: dict[str, float],
        named: set[str],
    ) -> tuple[float, float]:
        first, second, along = plane
        letters = CENTRES[first], CENTRES[second]
        if CENTRES[along] in values:
            refuse(f"{CENTRES[along]} for an arc in {g_name(self.plane)}; expected {letters[0]} and {letters[1]}, or R")
        given = [letter for letter in letters if letter in values]
        radius = values.pop("R", None)
        if (radius is None) != bool(given):
            refuse(f"{name} expected either R or {letters[0]} and {letters[1]}")
        start, last = (self.here[first], self.here[second]), (end[first], end[second])
        if radius is not None:
            if not named & {AXES[first], AXES[second]}:
                refuse(f"a full circle by R has no definite centre; expected {letters[0]} or {letters[1]}")
            return centre_from_radius(start, last, radius * self.scale, clockwise)
        if self.absolute_centres and len(given) != 2:
            refuse(f"{name} in G90.1; expected both {letters[0]} and {letters[1]}")
        out = [values.pop(letter, 0.0) * self.scale for letter in letters]
        if self.absolute_centres:
            return out[0], out[1]
        return start[0] + out[0], start[1] + out[1]

    def _need_feed(self, name: str, values: dict[str, float]) -> None:
        if self.inverse_time:
            if "F" not in values:
                refuse(f"{name} in G93 without F; expected F, the inverse of its minutes, in every such block")
        elif not self.rate > 0.0:
            refuse(f"{name} without a feed; expected F above zero with it or before it, behind any G94")

    def _seconds(self, values: dict[str, float]) -> float:
        """The time that G93 gives a block, NaN in G94."""
        if not self.inverse_time:
            return math.nan
        rate = values.pop("F")
        if not rate > 0.0:
            refuse(f"F{rate:g} in G93; expected the inverse of a time in minutes, above zero")
        return 60.0 / rate
