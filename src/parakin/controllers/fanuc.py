"""Fanuc 16i to 31i: G93 in work coordinates that have to be the machine's.

G93 is told 0.001 to 9999.999 in every block (16/18-C Operator's Manual, B-62764EN, 5 Feed functions), so that no
block is shorter than 6 ms. G53 always moves in rapid, so the blocks are of G54, whose offsets have to be zero, the
external ones and those of tools too. G9 stops exactly at a block's end. Numbers have three digits after
their points, as increment system IS-B reads them; comments are upper case. G4 X is a dwell in seconds.
"""

from __future__ import annotations

import re

from .gcode_text import make_plain
from .joints.dialect import JointDialect
from .joints.feeds import Feed, invert_minutes
from .joints.program import describe_joint_control


def restrict_characters(text: str) -> str:
    """Keep capitals, digits and what else all of these controls have on their screens."""
    return re.sub(r"[^A-Z0-9 +\-.,/*=\[\]:]", " ", make_plain(text).upper())


DIALECT = JointDialect(
    title="Fanuc",
    feed=Feed("F", invert_minutes, 3, 9999.999, "F is the inverse of minutes"),
    begin=("%", "O0001 ({name})"),
    modes=("G21 G90 G17 G40 G49 G80 G54",),
    start=("G64 G93",),
    motion="G1 {axes} {feed}",
    exact="G9 ",
    end=("G94", "M30", "%"),
    shortest=0.006,
    notes=(
        "G54, external and tool offsets have to be zero",
        "turning axes count on beyond 360 deg",
    ),
    digits={"mm": 3, "rad": 3},
    longest=72,
    clean=restrict_characters,
    comment="({})",
    dwell=("G4 X{:.3f}",),
    spindle="S{:.0f}",
    own_codes=frozenset(range(198)) - {2, 6, 30, 96, 97, 98, 99},
)
CONTROLLER = describe_joint_control(DIALECT, ".nc")
