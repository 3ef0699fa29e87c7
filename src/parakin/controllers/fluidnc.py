"""FluidNC: grbl on an ESP32, with six axes and lines of 254 characters.

From its sources (bdring/FluidNC): ``Channel.h`` has lines of ``maxLine`` = 255 bytes with their end; ``GCode.cpp``
takes A, B and C where they are configured and converts no unit of theirs in G21, shows ``(MSG,...)``, takes M62 to
M68 with their parameters, ignores M1, takes M4 only from a spindle that can be reversed, and passes over M7 and M8
where no coolant is configured. ``planner_blocks`` of its configuration is 16 as delivered, of which it uses 15.
"""

from __future__ import annotations

from dataclasses import replace

from . import grbl
from .joints.dialect import name_codes
from .joints.letters import AxisLetters
from .joints.program import describe_joint_control

_LINE_SECONDS = 0.008  # 92 characters of ten bits at 115,200 baud

DIALECT = replace(
    grbl.DIALECT,
    title="FluidNC",
    notes=(
        "max_rate_mm_per_min and acceleration_mm_per_sec2: speeds and accelerations of the joints, mm or degrees",
        "M7 and M8 act only where coolant is configured, M4 only where the spindle can be reversed",
    ),
    axes=AxisLetters("XYZABC", "XYZABC"),
    longest=254,
    message="(MSG,{})",
    codes=name_codes(0, 3, 4, 5, 7, 8, 9) | {1: ""},
    parameter_codes=range(62, 69),
    shortest=_LINE_SECONDS,
    line_seconds=_LINE_SECONDS,
)
CONTROLLER = describe_joint_control(DIALECT, ".nc")
