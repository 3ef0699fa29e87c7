"""RS274/NGC, as LinuxCNC speaks it with one joint an axis."""

from __future__ import annotations

from ..gcode_text import DIGITS, LONGEST_COMMENT
from .dialect import JointDialect, name_codes
from .feeds import Feed, invert_minutes

GCODE = JointDialect(
    title="G-code",
    feed=Feed("F", invert_minutes, 6, 1e9, "F is the inverse of minutes"),
    modes=("G21 G90 G17 G40 G49",),
    start=("G93",),
    motion="G1 {axes} {feed}",
    end=("M2",),
    notes=("work and tool offsets have to be zero",),
    digits=DIGITS,
    longest=LONGEST_COMMENT + 4,
    message="(MSG,{})",
    codes=name_codes(*range(200)),
    own_codes=range(200),
    parameter_codes=range(200),
)
