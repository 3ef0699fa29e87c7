"""The modal state of a CL file and the records that follow from it: points, arcs, drill cycles, feeds, frames."""

import math

import numpy as np

from ....arrays import Array
from ....errors import InputError
from ...path import Event
from ..arcs import find_arc_normal, interpolate_arc, interpolate_axis
from ..notes import NoteBook
from ..text import refuse
from .circles import (
    Arc,
    Circle,
    OpenArc,
    decide_hand,
    find_tangent,
    follow_circle,
    measure_sweep,
    prove_hand,
    settle_sweep,
)
from .cycles import CycleStart, DrillCycle
from .dialects import RIGHT, UNKNOWN
from .file_frames import AXIS_TOLERANCE, MACHINE, SMALLEST_SQUARE, UPRIGHT, FileTransform, Frame, Triple
from .records import ClRecords
from .word_arguments import FEED_UNITS

_HELIX = 0.01  # mm along a circle's axis between an arc's ends; above this the arc is a helix
_MOST_ARC_POINTS = 5_000_000  # greatest number of points of all arcs of a file: some hundred MB of memory
_MOST_CYCLE_POINTS = 1_000_000  # greatest number of motions of all cycles of a file
_PROVED_NOTE = "an arc that goes the other way round than this dialect has it, as the straight cut into it proves"
_TURNED_NOTE = "an arc that turns back on the motion that joins it, for other arcs prove which way its dialect goes"
_FAR = 1e3  # the length of a direction that stands for a motion


class ClMotion:
    """Modal state and the records made from it.

    position, axis : the last point and tool axis in the file's own numbers (position None: not known)
    axis_is_open : whether the next point has to say its tool axis
    transform : from the file's numbers to the first frame, in mm
    frame, first_frame : the workpiece's frame in the machine in force, and at the first record; None: not given
    off_unit : axes off unit length: how many, first line, worst deviation
    rapid : whether the next motion is rapid
    rpm, clockwise : spindle speed, NaN if not known, and which way it turns
    last_speed : the last spindle speed above zero, NaN if there was none
    feed : mm/min, NaN if not known; feed_value and feed_unit as programmed
    tangent, circle, cycle : the direction of INDIRV, the circle that waits for its GOTO, the drill cycle in force
    open_arc : the last arc, until the motion after it confirms which way round it goes
    arc_step : the circle of the last arc with its hand and step, while the next GOTO may go on along it
    arc_end : the number of records after the last arc and the direction (3,) of its end
    """

    def __init__(self, expected: int, arc_tolerance: float):
        self.records = ClRecords(expected)
        self.notes = NoteBook()
        self.events: list[Event] = []
        self.arc_tolerance = arc_tolerance
        self.transform = FileTransform()
        self.frame: Frame | None = None
        self.first_frame: Frame | None = None
        self.first_scale = 1.0
        self.frame_line = 0
        self.origin_turn: Array | None = None
        self.position: Triple | None = None
        self.axis = UPRIGHT
        self.axis_is_open = False
        self.off_unit = np.zeros(3)
        self.rapid = False
        self.rpm = self.last_speed = math.nan
        self.clockwise = True
        self.feed_value, self.feed_unit = math.nan, "PERMIN"
        self.feed = math.nan
        self.tangent: Triple | None = None
        self.circle: Circle | None = None
        self.open_arc: OpenArc | None = None
        self.hand_is_proved = False  # by an arc whose neighbours go round as its dialect's CIRCLE does
        self.arc_step: tuple[Circle, int, float] | None = None
        self.arc_end: tuple[int, Array] = 0, np.zeros(3)
        self.arc_points = self.cycle_points = 0
        self.cycle: DrillCycle | None = None
        self.cycle_start: CycleStart | None = None

    # feeds and speeds

    def convert_feed(self, value: float, unit: str) -> float:
        """Convert a feed to mm/min; NaN for a feed per revolution while the spindle's speed is not known."""
        length, per_turn = FEED_UNITS[unit]
        feed = value * (self.transform.scale if length is None else length)
        return feed * self.rpm if per_turn else feed

    def set_feed(self, value: float, unit: str | None) -> None:
        """Set the feed in force; without a unit in the unit in force."""
        self.feed_value, self.feed_unit = value, unit or self.feed_unit
        self.feed = self.convert_feed(self.feed_value, self.feed_unit)

    def take_feed(self, value: float, unit: str | None, line: int) -> None:
        """Set the feed that a line states; the motion that RAPID announced before it stays a rapid one."""
        if self.rapid:
            self.notes.add(line, "a feed between RAPID and its motion, which is rapid all the same")
        self.set_feed(value, unit)

    def set_speed(self, rpm: float) -> None:
        """Set the spindle's speed in rev/min, and with it a feed per revolution."""
        self.rpm = rpm
        self.last_speed = rpm if rpm > 0.0 else self.last_speed
        self.feed = self.convert_feed(self.feed_value, self.feed_unit)

    def require_feed(self, line: int, feed: float, value: float) -> None:
        """Refuse a cut without a feed or at a feed of zero; a file's first point is where it starts, not a cut.

        value : of the cycle's own feed as programmed, NaN if it has none
        """
        if feed > 0.0 or not self.records.n:
            return
        if feed == 0.0:
            refuse("a cut at a feed of zero; expected a feed or a running spindle before it", line)
        if math.isnan(value) and math.isnan(self.feed_value):
            refuse("a cut without a feed; expected FEDRAT before it", line)
        refuse("a feed per revolution while the spindle speed is not known; expected SPINDL/n,RPM before it", line)

    # frames and units

    def change_frame(
        self,
        line: int,
        *,
        scale: float | None = None,
        origin: Array | None = None,
        origin_turn: Array | None = None,
        frame: Frame | None = None,
    ) -> None:
        """Read later records in other units, from another ORIGIN or in another frame; the tool stays where it is."""
        self.close_arc(None)
        self.arc_step, self.arc_end = None, (-1, np.zeros(3))
        old, old_turn, position = self.transform, self.transform.turn, self.position
        self.place_records()
        old_origin, old_frame = old.origin, self.frame
        if scale is not None and self.records.n:
            # a change of units between records: what was given in the old unit stays where it is
            old_origin = old.origin * (old.scale / scale)
            old_frame = self.frame and self.frame.scale_origin(old.scale / scale)
        scale = old.scale if scale is None else scale
        self.frame = frame or old_frame
        if frame is not None and not self.frame_line:
            self.frame_line = line
        if origin is not None:
            self.origin_turn = origin_turn
        turn, shift = self._relate_to_first_frame(scale, line)
        self.transform = FileTransform(scale, old_origin if origin is None else origin, turn, shift)
        if position is not None:
            here, unused = np.array([position]), np.zeros((1, 3))
            old.apply(here, unused)
            x, y, z = self.transform.invert(here[0]).tolist()
            self.position = (x, y, z)
        if not np.array_equal(np.eye(3) if old_turn is None else old_turn, np.eye(3) if turn is None else turn):
            self.set_axis(UPRIGHT)  # the old axis is not in the new directions
        self.set_feed(self.feed_value, None)

    def _relate_to_first_frame(self, scale: float, line: int) -> tuple[Array | None, Array]:
        """Compute the change from the frame in force to the first record's: turn (3, 3) or None, shift (3,) in mm."""
        turn, shift = self.origin_turn, np.zeros(3)
        if not self.records.n:
            return turn, shift
        now = (self.frame or MACHINE).scale_origin(scale)
        if self.first_frame is None and self.frame is not None:
            self.first_frame = MACHINE  # points without a frame, then others with one: the former are the machine's
        first = (self.first_frame or MACHINE).scale_origin(self.first_scale)
        if now.equals(first):
            return turn, shift
        shift = first.rotation.T @ (now.origin - first.origin)
        origin = ", ".join(f"{value:.6g}" for value in now.origin + 0.0)
        self.notes.add(
            line,
            f"another workpiece frame, origin {origin} mm: its points are given in the file's first one",
        )
        if np.array_equal(first.rotation, now.rotation):  # their product is the identity but for rounding
            return turn, shift
        relative = first.rotation.T @ now.rotation
        return relative if turn is None else relative @ turn, shift

    def place_records(self) -> None:
        """Bring the records read so far into the first frame, which is the one in force at the first record."""
        if self.records.n and not self.records.placed:
            self.first_frame, self.first_scale = self.frame, self.transform.scale
        self.records.place_rows(self.transform)

    # records

    def normalize_axis(self, ijk: list[float], line: int) -> Triple:
        """Scale a tool axis to unit length; note one off unit length, refuse one without length."""
        i, j, k = ijk
        square = i * i + j * j + k * k
        norm = math.sqrt(square)
        if not square > SMALLEST_SQUARE:
            refuse(f"a tool axis of length {norm:g}; expected a unit vector from the tip into the holder")
        deviation = abs(norm - 1.0)
        if deviation > AXIS_TOLERANCE:
            if not self.off_unit[0]:
                self.off_unit[1] = line
            self.off_unit[0] += 1
            self.off_unit[2] = max(self.off_unit[2], deviation)
        return i / norm, j / norm, k / norm

    def add_record(self, tip: Triple, line: int, *, rapid: bool, feed: float | None = None) -> None:
        """Add one record at a tip with the modal axis, speed and, unless given, feed."""
        r = self.records
        r.reserve(1)
        n = r.n
        r.tip[n], r.axis[n], r.line[n] = tip, self.axis, line
        r.rapid[n], r.feed[n], r.spindle[n] = rapid, self.feed if feed is None else feed, self.rpm
        r.n = n + 1
        self.position = tip

    def set_axis(self, axis: Triple) -> None:
        """Set the tool axis of the points from here on."""
        self.axis, self.axis_is_open = axis, False

    def take_axis(self, ijk: list[float], line: int) -> Triple:
        """Set the tool axis, if one is given; return the one before. Refuse a point that leaves it open."""
        before = self.axis
        if ijk:
            self.set_axis(self.normalize_axis(ijk, line))
        elif self.axis_is_open:
            refuse("a point without a tool axis after MULTAX/OFF took a tilted one away; expected TLAXIS/i,j,k, "
                   "or a point with its axis")  # fmt: skip
        return before

    def move_to(self, tip: Triple, ijk: list[float], line: int) -> None:
        """Move to a point, or along a circle to its end (GOTO and GODLTA).

        ijk : the new tool axis, empty if it stays
        """
        before = self.take_axis(ijk, line)
        if not self.rapid:
            self.require_feed(line, self.feed, math.nan)
        circle, self.circle = self.circle, None
        if circle is not None:
            self._move_along_circle(circle, tip, before, line)
        elif self._follows_arc(tip):
            self._continue_arc(tip, before, line)
        else:
            self.close_arc(None if self.rapid or self.position is None else np.subtract(tip, self.position))
            self.arc_step = None
            self.add_record(tip, line, rapid=self.rapid)
        self.rapid = False
        self.tangent = None

    # circles

    def _follows_arc(self, tip: Triple) -> bool:
        """Tell whether a point goes on along the last arc."""
        if self.arc_step is None or self.rapid or self.position is None:
            return False
        circle, hand, step = self.arc_step
        return follow_circle(circle, self.position, tip, (hand, step), self.transform.scale)

    def _find_heading(self) -> Array | None:
        """Find the motion (3,) that the last cut ended with; None if there is none in the frame in force."""
        records, n = self.records, self.records.n
        if self.arc_end[0] == n and n:
            return self.arc_end[1]
        if n - records.placed < 2 or records.rapid[n - 1]:
            return None
        return np.asarray(records.tip[n - 1] - records.tip[n - 2])

    def _move_along_circle(self, circle: Circle, tip: Triple, before: Triple, line: int) -> None:
        """Add the records of an arc to a point, and keep it open for the motion after it."""
        if self.position is None:
            refuse("an arc without a position to start from; expected FROM or GOTO before it")
        start = self.position
        known, turns = settle_sweep(circle, start, tip)
        if self._is_proved_otherwise(circle, known, start, tip):
            known = UNKNOWN
            self.notes.add(circle.line, _PROVED_NOTE)
        self.close_arc(find_tangent(circle, start, known) * _FAR if known != UNKNOWN else None)
        entry = prove_hand(circle, start, self._find_heading(), self.transform.scale)
        hand, circle = known or entry or RIGHT, circle._replace(hand=known)
        self.open_arc = OpenArc(circle, hand, entry, self.records.n, start, tip, (before, self.axis), self.rapid, line)
        self._add_circle(self.open_arc, hand, turns)

    def _is_proved_otherwise(self, circle: Circle, known: int, start: Triple, tip: Triple) -> bool:
        """Tell whether a straight cut into an arc proves the other way round, the short one, and no header says more.

        Else the tool would turn back on the spot, and go the long way.
        """
        if circle.firm or known == UNKNOWN or self.arc_end[0] == self.records.n:
            return False
        entry = prove_hand(circle, start, self._find_heading(), self.transform.scale)
        return entry == -known and measure_sweep(circle, start, tip, entry) < math.pi

    def _continue_arc(self, tip: Triple, before: Triple, line: int) -> None:
        """Add the records of the last arc from a point on it to the next one."""
        assert self.arc_step is not None and self.position is not None
        circle, hand, _ = self.arc_step
        entry = self.open_arc.entry if self.open_arc else UNKNOWN
        self.open_arc = OpenArc(
            circle, hand, entry, self.records.n, self.position, tip, (before, self.axis), self.rapid, line
        )
        self._add_circle(self.open_arc, hand, 0)

    def _add_circle(self, arc: OpenArc, hand: int, turns: int) -> None:
        """Add the records of an arc, going round by a hand."""
        circle = arc.circle
        form = Arc(circle.line, circle.centre.tolist(), hand * circle.axis, circle.radius, helix=True, turns=turns)
        self._add_arc(form, arc.end, arc.axes[0], arc.end_line)
        self.arc_end = self.records.n, find_tangent(circle, arc.end, hand) * _FAR
        self.arc_step = (circle, hand, measure_sweep(circle, arc.start, arc.end, hand)) if circle.points else None

    def close_arc(self, leaving: Array | None) -> None:
        """Confirm the way round of the last arc by the motion (3,) that leaves it; turn it where only that proves it.

        leaving : None if no cut leaves it
        """
        arc, self.open_arc = self.open_arc, None
        if arc is None:
            return
        left = prove_hand(arc.circle, arc.end, leaving, self.transform.scale)
        try:
            hand = decide_hand(arc, left, proved=self.hand_is_proved)
        except InputError as error:
            refuse(error.message, arc.circle.line)
        known = arc.circle.hand != UNKNOWN
        if known and hand not in (arc.entry, left) and -hand in (arc.entry, left):
            self.notes.add(arc.circle.line, _TURNED_NOTE)
        self.hand_is_proved |= known and hand in (arc.entry, left) and -hand not in (arc.entry, left)
        if hand != arc.hand:
            records, begin = self.records, arc.begin
            feed, rpm, axis, rapid = records.feed[begin], records.spindle[begin], self.axis, self.rapid
            records.n, self.position, self.axis, self.rapid = begin, arc.start, arc.axes[1], arc.rapid
            self._add_circle(arc, hand, 0)
            records.feed[begin : records.n], records.spindle[begin : records.n] = feed, rpm
            self.axis, self.rapid = axis, rapid

    def add_tangent_arc(self, centre: list[float], radius: float, end: Triple, line: int) -> None:
        """Add the records of an APT arc (TLON), which starts along the direction of INDIRV."""
        if self.cycle is not None or self.circle is not None:
            refuse("an arc within a cycle or another arc; expected GOTO")
        if self.tangent is None or self.position is None:
            refuse("expected INDIRV/i,j,k and a position (FROM or GOTO) before the arc")
        start, middle = np.array(self.position), np.array(centre)
        normal = find_arc_normal(start, np.array(end), middle, np.array(self.tangent))
        if not self.rapid:
            self.require_feed(line, self.feed, math.nan)
        self.close_arc(np.array(self.tangent))
        self._add_arc(Arc(line, centre, normal, radius, helix=False), end, self.take_axis([], line), line)
        self.rapid = False
        self.tangent = None

    def _add_arc(self, arc: Arc, end: Triple, axis_before: Triple, line: int) -> None:
        """Add records along an arc to its end at a source line; the tool axis turns to the modal one."""
        if self.position is None:
            refuse("an arc without a position to start from; expected FROM or GOTO before it")
        scale = self.transform.scale
        start, last, centre = (np.array(p) * scale for p in (self.position, end, arc.centre))
        if arc.helix and abs(float((last - start) @ arc.normal)) > _HELIX:
            self.notes.add(line, "an arc whose ends differ in height, read as a helix")
        points, fraction = interpolate_arc(
            start, last, centre, arc.radius * scale, arc.normal, self.arc_tolerance, helix=arc.helix, turns=arc.turns
        )
        self.arc_points += len(points)
        if self.arc_points > _MOST_ARC_POINTS:
            refuse(
                f"arcs of more than {_MOST_ARC_POINTS} points in all at a tolerance of {self.arc_tolerance:g} mm; "
                "expected a coarser one"
            )
        axes = interpolate_axis(np.array(axis_before), np.array(self.axis), fraction)
        points /= scale
        points[-1] = end
        r, k = self.records, len(points)
        r.reserve(k)
        rows = slice(r.n, r.n + k)
        r.tip[rows], r.axis[rows], r.line[rows] = points, axes, arc.line
        r.rapid[rows], r.feed[rows], r.spindle[rows] = self.rapid, self.feed, self.rpm
        r.n += k
        r.line[r.n - 1] = line
        self.position = end

    # drill cycles

    def count_cycle_points(self, count: int) -> None:
        """Count the records of a hole; refuse a file whose cycles have too many in all."""
        self.cycle_points += count
        if self.cycle_points > _MOST_CYCLE_POINTS:
            refuse(f"cycles of more than {_MOST_CYCLE_POINTS} motions in all; expected larger steps or fewer holes")

    def set_cycle(self, cycle: DrillCycle | None) -> None:
        """Drill at the points from here on, or with None no longer."""
        self.close_arc(None)
        self.cycle, self.cycle_start = cycle, None
        if cycle is not None and cycle.retract is None and self.position is not None:
            height = sum(p * a for p, a in zip(self.position, self.axis, strict=True))
            self.cycle_start = CycleStart(height, self.axis)
