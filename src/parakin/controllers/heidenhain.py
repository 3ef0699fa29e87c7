"""Heidenhain TNC in Klartext: straight lines in the machine's coordinates, a feed a block.

M91 refers a block to the machine datum, for that block only; the tool's length is not compensated in it (TNC 426B,
280 472, 7.3 *Miscellaneous functions for coordinate data*). F is mm/min, of turning axes degrees a minute (TNC 407,
M116: *standard behavior*). How it counts where both move, the manuals at hand don't say: such machines get FT, the
time of a block in seconds, which the iTNC 530 has; other controls refuse the word. M functions stand in blocks of
their own, a speed is told by TOOL CALL, and cycle 9 is a dwell.
"""

from __future__ import annotations

from .joints.dialect import JointDialect
from .joints.feeds import Feed, keep_seconds, measure_speed
from .joints.program import describe_joint_control
from .siemens import replace_quotes

DIALECT = JointDialect(
    title="Heidenhain TNC",
    feed=Feed("F", measure_speed, 3, 99999.0, "F is mm or degrees a minute"),
    mixed_feed=Feed("FT", keep_seconds, 3, 999.999, "FT is seconds, a word of the iTNC 530", grows=True),
    begin=("BEGIN PGM {name} MM",),
    motion="L {axes} R0 {feed} M91",
    end=("M30", "END PGM {name} MM"),
    notes=(
        "no tilted working plane, no M128, no TCPM",
        "turning axes count on beyond 360 deg, by M127",
    ),
    sign="+",
    longest=100,
    clean=lambda text: replace_quotes(text).replace("~", "-"),
    comment="; {}",
    dwell=("CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL {:.10g}"),
    spindle="TOOL CALL Z S{:.0f}",
    spindle_apart=True,
    own_codes=frozenset(range(89)) - {2, 6, 30},
    numbered=True,
)
CONTROLLER = describe_joint_control(DIALECT, ".h")
