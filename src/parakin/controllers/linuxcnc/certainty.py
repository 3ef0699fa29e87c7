"""Tell whether the forward's common point of spheres needs no check that the legs close there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...algebra import Trace
from ...machine import Machine
from .rounding import bound_rounding
from .tape_to_c import format_c

CLEAR = 0.1  # of a leg: a common point so high over the spheres' centres is told without a check


def write_certainty(machine: Machine) -> Iterator[str]:
    """Write whether rounding can't leave a common point's closures open, with joints in their ranges.

    An exact point is on the spheres, so that its own error bounds what it leaves open.
    """
    certain, height = False, CLEAR * min(machine.leg_sizes)
    if machine.has_closed_forward:
        trace = Trace()
        point, square = machine.trace_common_point(trace.inputs(len(machine.joints)))
        box = [(drive.low, drive.high) for drive in machine.drives]
        errors = bound_rounding(trace, point, box, {square: height**2})
        certain = 2.0 * float(np.hypot.reduce(errors)) <= machine.closure_tolerance
    yield f"#define CERTAIN {int(certain)} /* with joints in their ranges the forward closes by its form */"
    yield f"#define CERTAIN_HEIGHT {format_c(height**2)} /* where it is higher over the spheres' centres, mm² */"
