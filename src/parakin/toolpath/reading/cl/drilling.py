"""Write the motion of drill cycles as records: approach, pecks, dwell and the way out of each hole."""

import math

from ...path import Event
from ..text import refuse
from .cycles import DrillCycle
from .file_frames import Triple
from .motion import ClMotion
from .spindle import compute_dwell, reverse_spindle

_SAME_AXIS = 1e-9  # components of two tool axes that are equal
_SAME_HEIGHT = 1e-9  # greatest difference of two heights above a hole that count as equal, in the file's unit
_PECK_GAP = 0.254  # mm, up after a peck of BRKCHP and above the last depth in DEEP, as LinuxCNC's G73 and G83 have it


def drill_hole(motion: ClMotion, cycle: DrillCycle, hole: Triple, axis_before: Triple, line: int) -> None:
    """Drill one hole: across at height, rapid down to the clearance, feed to depth, out."""
    a = motion.axis
    x, y, z = hole

    def point_above(height: float) -> Triple:
        return x + height * a[0], y + height * a[1], z + height * a[2]

    begin = motion.records.n
    out = _find_way_out(motion, cycle, hole)
    feed = motion.feed if cycle.feed is None else motion.convert_feed(*cycle.feed)
    if motion.position is not None and axis_before == a:
        px, py, pz = motion.position
        height = (px - x) * a[0] + (py - y) * a[1] + (pz - z) * a[2]
        rise = cycle.clear - height
        if rise > _SAME_HEIGHT:
            motion.add_record((px + rise * a[0], py + rise * a[1], pz + rise * a[2]), line, rapid=True)
        elif rise < -_SAME_HEIGHT:
            motion.add_record(point_above(height), line, rapid=True)
    motion.add_record(point_above(cycle.clear), line, rapid=True)
    motion.require_feed(line, feed, math.nan if cycle.feed is None else cycle.feed[0])
    for height, rapid in _list_strokes(cycle, _PECK_GAP / motion.transform.scale):
        motion.add_record(point_above(height), line, rapid=rapid, feed=feed)
    _add_dwell(motion, cycle, line)
    if cycle.kind == "tap":
        reverse_spindle(motion, line)
        motion.add_record(point_above(cycle.clear), line, rapid=False, feed=feed)
        reverse_spindle(motion, line)
    elif cycle.kind == "bore":
        motion.add_record(point_above(cycle.clear), line, rapid=False, feed=feed)
    if cycle.kind not in ("tap", "bore") or abs(out - cycle.clear) > _SAME_HEIGHT:
        motion.add_record(point_above(out), line, rapid=True)
    motion.count_cycle_points(motion.records.n - begin)
    motion.notes.add(line, "a drill cycle's hole, written out as motion")


def _find_way_out(motion: ClMotion, cycle: DrillCycle, hole: Triple) -> float:
    """Find the height above the hole that the tool withdraws to."""
    if cycle.retract is not None:
        return cycle.retract
    start, axis = motion.cycle_start, motion.axis
    if start is None or max(abs(p - q) for p, q in zip(start.axis, axis, strict=True)) > _SAME_AXIS:
        refuse("RTRCTO,AUTO without a position before the cycle along the same tool axis; expected RTRCTO,distance")
    return max(cycle.clear, start.height - sum(p * q for p, q in zip(hole, axis, strict=True)))


def _list_strokes(cycle: DrillCycle, gap: float) -> list[tuple[float, bool]]:
    """List the heights from the clearance to the depth, each with whether it is reached in rapid."""
    strokes: list[tuple[float, bool]] = []
    if cycle.kind in ("deep", "break"):
        # pecks count from the hole's point; the first one goes through the air above it too
        reached = min(0.0, cycle.clear) - (cycle.first_step or cycle.step)
        while reached > cycle.depth + _SAME_HEIGHT:
            strokes.append((reached, False))
            if cycle.kind == "break":
                strokes.append((min(reached + gap, cycle.clear), True))
            else:
                strokes += [(cycle.clear, True), (min(reached + gap, cycle.clear), True)]
            reached -= cycle.step
    return [*strokes, (cycle.depth, False)]


def _add_dwell(motion: ClMotion, cycle: DrillCycle, line: int) -> None:
    """Wait at depth."""
    if cycle.dwell is None:
        return
    value, in_revolutions = cycle.dwell
    seconds = compute_dwell(motion, value, in_revolutions=in_revolutions)
    if seconds > 0.0:
        motion.events.append(Event(motion.records.n, line, f"DELAY/{seconds:.6f}"))
