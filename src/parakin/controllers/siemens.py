"""Sinumerik 840D: transformations off, every block in the machine's coordinates.

From its manuals: ``SUPA`` suppresses in its block all frames, the handwheel's and external offsets (Programming
Manual Fundamentals, 6FC5398-1BP10-2BA0, 3.6); ``D0`` takes the tool's offset away, which SUPA may leave in force.
``TRAFOOF`` switches every transformation off (Job Planning, 6FC5398-2BP10-1BA0, 7.8). ``G93`` is the inverse of a
block's minutes (NC Programming, 6FC5398-2EP40-0BA0, 2.7). ``G64`` goes on between blocks, ``G9`` with ``G601`` stops
within the fine window (the same, 2.11). ``G4 F`` is a dwell in seconds, ``MSG`` shows a text.
"""

from __future__ import annotations

from .gcode_text import make_plain
from .joints.dialect import JointDialect
from .joints.feeds import Feed, invert_minutes
from .joints.program import describe_joint_control


def replace_quotes(text: str) -> str:
    """Replace quotation marks, which end a message."""
    return make_plain(text).replace('"', "'")


DIALECT = JointDialect(
    title="Sinumerik 840D",
    feed=Feed("F", invert_minutes, 3, 999999.0, "F is the inverse of minutes"),
    begin=("%_N_{name}_MPF", ";$PATH=/_N_MPF_DIR"),
    modes=("TRAFOOF", "G17 G40 G71 G90 G500 D0"),
    start=("G64 G601 G93",),
    motion="SUPA G1 {axes} {feed}",
    exact="G9 ",
    end=("G94", "M30"),
    notes=("turning axes are no modulo axes",),
    longest=120,
    clean=replace_quotes,
    comment="; {}",
    message='MSG("{}")',
    dwell=("G4 F{:.10g}",),
    digits={"mm": 5, "rad": 5},
    own_codes=frozenset(range(200)) - {2, 6, 17, 30, 70},
)
CONTROLLER = describe_joint_control(DIALECT, ".mpf")
