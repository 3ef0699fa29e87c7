"""grbl 1.1: three axes, lines of 79 characters, a planner of 15 motions.

From its sources (gnea/grbl): ``protocol.c`` drops blanks and comments and takes ``LINE_BUFFER_SIZE`` - 1 = 79
characters a line; realtime commands (``! ~ ?``) act inside comments, too. ``gcode.c`` knows G53 with G1, wants F in
every block of G93 (error 22), ignores M1, and has no M6 and, as delivered, no M7 (error 20). ``nuts_bolts.c`` reads 8
digits into a float. ``planner.c`` holds ``BLOCK_BUFFER_SIZE`` - 1 = 15 motions, keeps $110 and $120, and passes
junctions by $11.
"""

from __future__ import annotations

from .gcode_text import make_plain
from .joints.dialect import JointDialect, name_codes
from .joints.feeds import Feed, invert_minutes
from .joints.letters import AxisLetters
from .joints.program import describe_joint_control

_REALTIME = str.maketrans("!~?", "...")
_LINE_SECONDS = 0.005  # 56 characters of ten bits at 115,200 baud


def replace_realtime_characters(text: str) -> str:
    """Replace the characters that grbl obeys wherever they stand."""
    return make_plain(text).translate(_REALTIME)


DIALECT = JointDialect(
    title="grbl",
    feed=Feed("F", invert_minutes, 3, 99999.0, "F is the inverse of minutes"),
    modes=("G21G90G17G40G49", "G94"),
    start=("G93",),
    motion="G53G1{axes}{feed}",
    end=("M2",),
    notes=("$110 to $112 and $120 to $122: speeds and accelerations of the joints; $32 is 0",),
    axes=AxisLetters("XYZ", "XYZ"),
    between="",
    longest=79,
    clean=replace_realtime_characters,
    dwell=("G4P{:.10g}",),
    codes=name_codes(0, 3, 4, 5, 8, 9) | {1: ""},
    shortest=_LINE_SECONDS,
    line_seconds=_LINE_SECONDS,
    buffer=15,
)
CONTROLLER = describe_joint_control(DIALECT, ".nc")
