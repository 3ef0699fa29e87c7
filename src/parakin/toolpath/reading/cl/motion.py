"""What a CL file has said so far, and the motion that follows from it: points, arcs, drill cycles, feeds, frames."""

import math

import numpy as np

from ...path import Floats
from ..arcs import arc, plane_of, turn_axis
from ..columns import Frame, NoteBook, Placement, Records
from .tokens import AXIS_TOLERANCE, FEED_UNITS, SMALLEST_SQUARE, DrillCycle, refuse

MACHINE = Frame(np.eye(3), np.zeros(3))
Point = tuple[float, float, float]


class Motion:
    """Modal state and the records made from it.

    ``position`` and ``axis`` are the last point and tool axis in the file's own numbers (position None: not known).
    """

    def __init__(self, expected: int, arc_tolerance: float):
        self.records = Records(expected)
        self.notes = NoteBook()
        self.arc_tolerance = arc_tolerance
        self.placement = Placement()
        self.frame: Frame | None = None
        self.first_frame: Frame | None = None
        self.origin_turn: Floats | None = None
        self.first_scale = 1.0
        self.position: Point | None = None
        self.axis: Point = (0.0, 0.0, 1.0)
        self.off_unit = np.zeros(3)  # axes off unit length: how many, first line, worst deviation
        self.rapid = False
        self.rpm = math.nan
        self.feed_value, self.feed_unit = math.nan, "PERMIN"
        self.feed = math.nan
        self.tangent: Point | None = None
        self.circle: tuple[int, list[float]] | None = None
        self.cycle: DrillCycle | None = None
        self.cycle_level: tuple[float, Point] | None = None

    # feeds and speeds

    def feed_of(self, value: float, unit: str) -> float:
        """mm/min; NaN for a feed per revolution while the spindle's speed isn't known."""
        length, per_turn = FEED_UNITS[unit]
        per = value * (self.placement.scale if length is None else length)
        return per * self.rpm if per_turn else per

    def set_feed(self, value: float, unit: str | None) -> None:
        self.feed_value, self.feed_unit = value, unit or self.feed_unit
        self.feed = self.feed_of(self.feed_value, self.feed_unit)

    def set_speed(self, rpm: float) -> None:
        self.rpm = rpm
        self.feed = self.feed_of(self.feed_value, self.feed_unit)

    def check_feed(self, line: int, feed: float, value: float) -> None:
        """Remark a programmed value that makes no feed, at a motion that uses it."""
        if math.isnan(feed) and not math.isnan(value):
            self.notes.add(line, "a feed per revolution while the spindle speed is not known: the feed is left open")

    # frames and units

    def change_placement(
        self,
        line: int,
        *,
        scale: float | None = None,
        origin: Floats | None = None,
        origin_turn: Floats | None = None,
        frame: Frame | None = None,
    ) -> None:
        """Later records are in other units, from another ORIGIN or in another frame; the tool stays where it is."""
        old, known = self.placement, self.position
        self.settle()
        kept = old.origin, self.frame
        if scale is not None and self.records.n:
            # a change of units between records: what was said in the old unit stays where it is
            kept = old.origin * (old.scale / scale), self.frame and self.frame.scaled(old.scale / scale)
        scale = old.scale if scale is None else scale
        self.frame = frame or kept[1]
        if origin is not None:
            self.origin_turn = origin_turn
        turn, shift = self.origin_turn, np.zeros(3)
        if self.records.n:
            now = (self.frame or MACHINE).scaled(scale)
            if self.first_frame is None and self.frame is not None:
                self.first_frame = MACHINE  # points without a frame, then others with one: the former are the machine's
            first = (self.first_frame or MACHINE).scaled(self.first_scale)
            if not now.same(first):
                relative = first.rotation.T @ now.rotation
                shift = first.rotation.T @ (now.origin - first.origin)
                turn = relative if turn is None else relative @ turn
                self.notes.add(line, "another workpiece frame: later points are given in the file's first one")
        self.placement = Placement(scale, kept[0] if origin is None else origin, turn, shift)
        if known is not None:
            here, unused = np.array([known]), np.zeros((1, 3))
            old.apply(here, unused)
            x, y, z = self.placement.undo(here[0]).tolist()
            self.position = (x, y, z)
        if not np.array_equal(np.eye(3) if old.turn is None else old.turn, np.eye(3) if turn is None else turn):
            self.axis = (0.0, 0.0, 1.0)  # the old axis is not in the new directions
        self.set_feed(self.feed_value, None)

    def settle(self) -> None:
        """Bring what was read so far into the first frame, which is the one in force at the first record."""
        if self.records.n and not self.records.placed:
            self.first_frame, self.first_scale = self.frame, self.placement.scale
        self.records.place(self.placement)

    # records

    def direction(self, ijk: list[float], line: int) -> Point:
        """A unit vector; off unit length is remarked, no length refused."""
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

    def add(self, tip: Point, line: int, rapid: bool, feed: float | None = None) -> None:
        """One record at tip with the modal axis, speed and, unless given, feed."""
        r = self.records
        r.reserve(1)
        n = r.n
        r.tip[n], r.axis[n], r.line[n] = tip, self.axis, line
        r.rapid[n], r.feed[n], r.spindle[n] = rapid, self.feed if feed is None else feed, self.rpm
        r.n = n + 1
        self.position = tip

    def move(self, tip: Point, ijk: list[float], line: int) -> None:
        """GOTO and GODLTA: a point, the end of an NX arc, or a hole of the cycle in force."""
        before = self.axis
        if ijk:
            self.axis = self.direction(ijk, line)
        if self.cycle is None or self.cycle.feed is None:
            self.check_feed(line, self.feed, self.feed_value)
        if self.circle is not None:
            at, values = self.circle
            self.circle = None
            # NX states the circle's axis for clockwise motion: left-handed about it
            normal = -np.array(Motion.direction_of(values[3:6]))
            self.sweep(tip, values[:3], values[6], normal, before, at, line, helix=True)
        elif self.cycle is not None:
            self.drill(self.cycle, tip, before, line)
        else:
            self.add(tip, line, self.rapid)
        self.rapid = False
        self.tangent = None

    @staticmethod
    def direction_of(ijk: list[float]) -> Point:
        norm = math.hypot(*ijk)
        if not norm > 1e-6:
            refuse("a direction without length; expected a unit vector")
        return ijk[0] / norm, ijk[1] / norm, ijk[2] / norm

    def tangent_arc(self, centre: list[float], radius: float, end: Point, line: int) -> None:
        """An APT arc, from INDIRV and TLON."""
        if self.cycle is not None or self.circle is not None:
            refuse("an arc within a cycle or another arc; expected GOTO")
        if self.tangent is None or self.position is None:
            refuse("expected INDIRV/i,j,k and a position (FROM or GOTO) before the arc")
        start, middle = np.array(self.position), np.array(centre)
        normal = plane_of(start, np.array(end), middle, np.array(self.tangent))
        self.check_feed(line, self.feed, self.feed_value)
        self.sweep(end, centre, radius, normal, self.axis, line, line, helix=False)
        self.rapid = False
        self.tangent = None

    def sweep(
        self,
        end: Point,
        centre: list[float],
        radius: float,
        normal: Floats,
        before: Point,
        at: int,
        line: int,
        helix: bool,
    ) -> None:
        """Records along an arc to ``end``; the axis turns from ``before`` to the modal one.

        at, line : source lines of the points between and of the end
        """
        if self.position is None:
            refuse("an arc without a position to start from; expected FROM or GOTO before it")
        scale = self.placement.scale
        start, last, middle = (np.array(p) * scale for p in (self.position, end, centre))
        if helix and abs(float((last - start) @ normal)) > 0.01:
            self.notes.add(line, "an arc whose ends differ in height, read as a helix")
        points, fraction = arc(start, last, middle, radius * scale, normal, self.arc_tolerance, helix)
        axes = turn_axis(np.array(before), np.array(self.axis), fraction)
        points /= scale
        points[-1] = end
        r, k = self.records, len(points)
        r.reserve(k)
        rows = slice(r.n, r.n + k)
        r.tip[rows], r.axis[rows], r.line[rows] = points, axes, at
        r.rapid[rows], r.feed[rows], r.spindle[rows] = self.rapid, self.feed, self.rpm
        r.n += k
        r.line[r.n - 1] = line
        self.position = end

    # drill cycles

    def start_cycle(self, cycle: DrillCycle | None) -> None:
        self.cycle, self.cycle_level = cycle, None
        if cycle is not None and cycle.retract is None and self.position is not None:
            height = sum(p * a for p, a in zip(self.position, self.axis, strict=True))
            self.cycle_level = height, self.axis

    def drill(self, cycle: DrillCycle, hole: Point, before: Point, line: int) -> None:
        """One hole: across at height, rapid down to the clearance, feed to depth, rapid out."""
        a = self.axis
        x, y, z = hole

        def above(height: float) -> Point:
            return x + height * a[0], y + height * a[1], z + height * a[2]

        if cycle.retract is not None:
            out = cycle.retract
        elif self.cycle_level is None or max(abs(p - q) for p, q in zip(self.cycle_level[1], a, strict=True)) > 1e-9:
            refuse("RTRCTO,AUTO without a position before the cycle along the same tool axis; expected RTRCTO,distance")
        else:
            out = max(cycle.clear, self.cycle_level[0] - (x * a[0] + y * a[1] + z * a[2]))
        if self.position is not None and before == a:
            px, py, pz = self.position
            height = (px - x) * a[0] + (py - y) * a[1] + (pz - z) * a[2]
            rise = cycle.clear - height
            if rise > 1e-9:
                self.add((px + rise * a[0], py + rise * a[1], pz + rise * a[2]), line, True)
            elif rise < -1e-9:
                self.add(above(height), line, True)
        self.add(above(cycle.clear), line, True)
        feed = self.feed if cycle.feed is None else self.feed_of(*cycle.feed)
        if cycle.feed is not None:
            self.check_feed(line, feed, cycle.feed[0])
        self.add(above(cycle.depth), line, False, feed)
        self.add(above(out), line, True)
        self.notes.add(line, "a drill cycle's hole, written out as motion")


def frame_of(origin: list[float], x: list[float], y: list[float]) -> Frame:
    """A frame from its origin and the directions of X and Y, which must be orthogonal; Z is their cross product."""
    ex, ey = np.array(Motion.direction_of(x)), np.array(Motion.direction_of(y))
    if abs(float(ex @ ey)) > AXIS_TOLERANCE:
        refuse("the X and Y directions of MSYS are not at right angles")
    ez = np.cross(ex, ey)
    ez /= np.linalg.norm(ez)
    return Frame(np.column_stack([ex, np.cross(ez, ex), ez]), np.array(origin))


def matrix_frame(rows: list[list[float]]) -> Frame:
    """A frame from three rows of a 3 by 4 matrix, whose rotation is freed from its rounding."""
    matrix = np.array(rows)
    rotation = matrix[:, :3]
    error = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if not error < AXIS_TOLERANCE or np.linalg.det(rotation) < 0.0:
        refuse("the matrix after $$*CATIA0 is no right-handed rotation; expected unit columns at right angles")
    if error > 1e-12:
        left, _, right = np.linalg.svd(rotation)
        rotation = left @ right
    return Frame(rotation, matrix[:, 3])
