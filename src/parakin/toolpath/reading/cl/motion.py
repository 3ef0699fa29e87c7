"""The modal state of a CL file and the records that follow from it: points, arcs, drill cycles, feeds, frames."""

import math
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ..arcs import find_arc_normal, interpolate_arc, interpolate_axis
from ..notes import NoteBook
from ..text import refuse
from .arguments import FEED_UNITS, DrillCycle
from .frames import AXIS_TOLERANCE, MACHINE, SMALLEST_SQUARE, FileTransform, Frame, Triple
from .records import ClRecords

_HELIX = 0.01  # mm along a circle's axis between an arc's ends; above this the arc is a helix
_SAME_AXIS = 1e-9  # components of two tool axes that are equal
_SAME_HEIGHT = 1e-9  # in the file's unit: two heights above a hole that are equal


class NxCircle(NamedTuple):
    """A CIRCLE of NX that waits for its GOTO: source line, centre, unit axis and radius in the file's unit."""

    line: int
    centre: list[float]
    axis: Triple
    radius: float


class Arc(NamedTuple):
    """An arc without its ends, in the file's unit; the motion is right-handed about the unit normal (3,).

    line : source line of the points between the ends
    helix : whether the ends may differ in height along the normal
    """

    line: int
    centre: list[float]
    normal: Array
    radius: float
    helix: bool


class CycleStart(NamedTuple):
    """Where a drill cycle began: height along the tool axis in the file's unit, and that axis."""

    height: float
    axis: Triple


class ClMotion:
    """Modal state and the records made from it.

    position, axis : the last point and tool axis in the file's own numbers (position None: not known)
    transform : from the file's numbers to the first frame, in mm
    frame, first_frame : the workpiece's frame in the machine in force, and at the first record; None: not given
    off_unit : axes off unit length: how many, first line, worst deviation
    rapid : whether the next motion is rapid
    rpm, feed : spindle speed and feed in mm/min, NaN if not known; feed_value and feed_unit as programmed
    tangent, circle, cycle : the direction of INDIRV, the CIRCLE that waits for its GOTO, the drill cycle in force
    """

    def __init__(self, expected: int, arc_tolerance: float):
        self.records = ClRecords(expected)
        self.notes = NoteBook()
        self.arc_tolerance = arc_tolerance
        self.transform = FileTransform()
        self.frame: Frame | None = None
        self.first_frame: Frame | None = None
        self.first_scale = 1.0
        self.origin_turn: Array | None = None
        self.position: Triple | None = None
        self.axis: Triple = (0.0, 0.0, 1.0)
        self.off_unit = np.zeros(3)
        self.rapid = False
        self.rpm = math.nan
        self.feed_value, self.feed_unit = math.nan, "PERMIN"
        self.feed = math.nan
        self.tangent: Triple | None = None
        self.circle: NxCircle | None = None
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

    def set_speed(self, rpm: float) -> None:
        """Set the spindle's speed in rev/min, and with it a feed per revolution."""
        self.rpm = rpm
        self.feed = self.convert_feed(self.feed_value, self.feed_unit)

    def check_feed(self, line: int, feed: float, value: float) -> None:
        """Note a programmed value that makes no feed, at a motion that uses it."""
        if math.isnan(feed) and not math.isnan(value):
            self.notes.add(line, "a feed per revolution while the spindle speed is not known: the feed is left open")

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
        old, old_turn, position = self.transform, self.transform.turn, self.position
        self.place_records()
        old_origin, old_frame = old.origin, self.frame
        if scale is not None and self.records.n:
            # a change of units between records: what was given in the old unit stays where it is
            old_origin = old.origin * (old.scale / scale)
            old_frame = self.frame and self.frame.scale_origin(old.scale / scale)
        scale = old.scale if scale is None else scale
        self.frame = frame or old_frame
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
            self.axis = (0.0, 0.0, 1.0)  # the old axis is not in the new directions
        self.set_feed(self.feed_value, None)

    def _relate_to_first_frame(self, scale: float, line: int) -> tuple[Array | None, Array]:
        """The turn (3, 3) or None and the shift (3,) in mm from the frame in force to that of the first record."""
        turn, shift = self.origin_turn, np.zeros(3)
        if not self.records.n:
            return turn, shift
        now = (self.frame or MACHINE).scale_origin(scale)
        if self.first_frame is None and self.frame is not None:
            self.first_frame = MACHINE  # points without a frame, then others with one: the former are the machine's
        first = (self.first_frame or MACHINE).scale_origin(self.first_scale)
        if now.equals(first):
            return turn, shift
        relative = first.rotation.T @ now.rotation
        shift = first.rotation.T @ (now.origin - first.origin)
        self.notes.add(line, "another workpiece frame: later points are given in the file's first one")
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

    def move_to(self, tip: Triple, ijk: list[float], line: int) -> None:
        """Move to a point, along an NX circle to its end, or into a hole of the cycle in force (GOTO and GODLTA).

        ijk : the new tool axis, empty if it stays
        """
        before = self.axis
        if ijk:
            self.axis = self.normalize_axis(ijk, line)
        if self.cycle is None or self.cycle.feed is None:
            self.check_feed(line, self.feed, self.feed_value)
        if self.circle is not None:
            circle, self.circle = self.circle, None
            # NX states the circle's axis for clockwise motion: left-handed about it
            arc = Arc(circle.line, circle.centre, -np.array(circle.axis), circle.radius, helix=True)
            self._add_arc(arc, tip, before, line)
        elif self.cycle is not None:
            self._drill_hole(self.cycle, tip, before, line)
        else:
            self.add_record(tip, line, rapid=self.rapid)
        self.rapid = False
        self.tangent = None

    def add_tangent_arc(self, centre: list[float], radius: float, end: Triple, line: int) -> None:
        """Add the records of an APT arc (TLON), which starts along the direction of INDIRV."""
        if self.cycle is not None or self.circle is not None:
            refuse("an arc within a cycle or another arc; expected GOTO")
        if self.tangent is None or self.position is None:
            refuse("expected INDIRV/i,j,k and a position (FROM or GOTO) before the arc")
        start, middle = np.array(self.position), np.array(centre)
        normal = find_arc_normal(start, np.array(end), middle, np.array(self.tangent))
        self.check_feed(line, self.feed, self.feed_value)
        self._add_arc(Arc(line, centre, normal, radius, helix=False), end, self.axis, line)
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
            start, last, centre, arc.radius * scale, arc.normal, self.arc_tolerance, helix=arc.helix
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

    def set_cycle(self, cycle: DrillCycle | None) -> None:
        """Drill at the points from here on, or with None no longer."""
        self.cycle, self.cycle_start = cycle, None
        if cycle is not None and cycle.retract is None and self.position is not None:
            height = sum(p * a for p, a in zip(self.position, self.axis, strict=True))
            self.cycle_start = CycleStart(height, self.axis)

    def _drill_hole(self, cycle: DrillCycle, hole: Triple, axis_before: Triple, line: int) -> None:
        """Drill one hole: across at height, rapid down to the clearance, feed to depth, rapid out."""
        a = self.axis
        x, y, z = hole

        def point_above(height: float) -> Triple:
            return x + height * a[0], y + height * a[1], z + height * a[2]

        if cycle.retract is not None:
            out = cycle.retract
        elif self.cycle_start is None or not _is_same_axis(self.cycle_start.axis, a):
            refuse("RTRCTO,AUTO without a position before the cycle along the same tool axis; expected RTRCTO,distance")
        else:
            out = max(cycle.clear, self.cycle_start.height - (x * a[0] + y * a[1] + z * a[2]))
        if self.position is not None and axis_before == a:
            px, py, pz = self.position
            height = (px - x) * a[0] + (py - y) * a[1] + (pz - z) * a[2]
            rise = cycle.clear - height
            if rise > _SAME_HEIGHT:
                self.add_record((px + rise * a[0], py + rise * a[1], pz + rise * a[2]), line, rapid=True)
            elif rise < -_SAME_HEIGHT:
                self.add_record(point_above(height), line, rapid=True)
        self.add_record(point_above(cycle.clear), line, rapid=True)
        feed = self.feed if cycle.feed is None else self.convert_feed(*cycle.feed)
        if cycle.feed is not None:
            self.check_feed(line, feed, cycle.feed[0])
        self.add_record(point_above(cycle.depth), line, rapid=False, feed=feed)
        self.add_record(point_above(out), line, rapid=True)
        self.notes.add(line, "a drill cycle's hole, written out as motion")


def _is_same_axis(one: Triple, other: Triple) -> bool:
    return not max(abs(p - q) for p, q in zip(one, other, strict=True)) > _SAME_AXIS
