"""The spindle of a CL file: its speeds, dwells in its turns, and how it turns back out of a tap."""

import math
from collections.abc import Sequence

from ...path import Event
from ..text import refuse
from .motion import ClMotion
from .word_arguments import parse_dwell, parse_spindle


def set_speed(motion: ClMotion, args: Sequence[str], diameter: float | None, line: int) -> None:
    """Set the spindle's speed as SPINDL states it; ON goes on at the last one above zero.

    diameter : of the cutter in use, mm, or None; a surface speed is refused without it
    """
    speed = parse_spindle(args)
    if "CLW" in args or "CCLW" in args:
        motion.clockwise = "CLW" in args
    if speed.off or speed.value == 0.0:
        motion.set_speed(0.0)
    elif speed.surface is not None and speed.value is not None:
        if not diameter:
            refuse("a surface speed while the cutter's diameter is not known; expected RPM, or CUTTER before it")
        motion.set_speed(speed.value * speed.surface / (math.pi * diameter))
        motion.notes.add(line, f"a surface speed: {motion.rpm:.6g} rev/min at the cutter's diameter")
    elif speed.value is not None:
        motion.set_speed(speed.value)
    else:
        motion.set_speed(motion.last_speed)
        if math.isnan(motion.rpm):
            motion.notes.add(line, "the spindle is switched on without a speed: it is left to the operator")


def compute_dwell(motion: ClMotion, value: float, *, in_revolutions: bool) -> float:
    """Compute the seconds of a dwell, which the file may give in the spindle's turns."""
    if value < 0.0:
        refuse("a dwell below zero")
    if not in_revolutions:
        return value
    if not motion.rpm > 0.0:
        refuse("a dwell in revolutions while the spindle speed is not known; expected SPINDL/n,RPM before it")
    return value * 60.0 / motion.rpm


def add_dwell(motion: ClMotion, args: Sequence[str], line: int) -> None:
    """Wait where the tool is (DELAY)."""
    value, in_revolutions = parse_dwell(args)
    seconds = compute_dwell(motion, value, in_revolutions=in_revolutions)
    motion.events.append(Event(motion.records.n, line, f"DELAY/{seconds:.10g}"))


def reverse_spindle(motion: ClMotion, line: int) -> None:
    """Turn the spindle the other way at the end of a tap."""
    if not motion.rpm > 0.0:
        refuse("a tap while the spindle speed is not known; expected SPINDL/n,RPM before it")
    motion.clockwise = not motion.clockwise
    way = "CLW" if motion.clockwise else "CCLW"
    motion.events.append(Event(motion.records.n, line, f"SPINDL/RPM,{motion.rpm:.10g},{way}"))
    motion.notes.add(
        line, "a tap: fed in and out with the spindle reversed, not in step with it; it needs a floating holder"
    )
