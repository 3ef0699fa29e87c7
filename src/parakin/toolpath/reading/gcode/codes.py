"""The tables of G and M codes that are read, by modal group of RS274/NGC, and the reasons for refusing others.

To read a new code, add it to its modal group here and to the method that executes the group: of
:class:`.execution.BlockExecutor`, of :class:`.offsets.OffsetExecutor` for what moves coordinates, of
:class:`.cycles.CannedCycles` for cycles. A block has at most one code of a group. The letters of words with a value are
:data:`.block.VALUES`.

G codes are numbers in tenths, 431 for G43.1, as they have at most one decimal.
"""

from ..text import refuse

G0, G1, G2, G3 = 0, 10, 20, 30
G4, G10, G28, G28_1, G30, G30_1 = 40, 100, 280, 281, 300, 301
G52, G53, G92, G92_1, G92_2, G92_3 = 520, 530, 920, 921, 922, 923
G17, G18, G19 = 170, 180, 190
G20, G21 = 200, 210
G43, G43_1, G43_2, G43_4, G49 = 430, 431, 432, 434, 490
G54 = 540
G61, G61_1, G64 = 610, 611, 640
G90, G91, G90_1, G91_1 = 900, 910, 901, 911
G93, G94 = 930, 940
G98, G99 = 980, 990
CYCLES = (730, 740, 810, 820, 830, 840, 850, 860, 870, 890)
TAKES_AXES = frozenset(
    (G10, G28, G30, G52, G92)
)  # codes of the group "once" whose axis words move nothing by themselves

G_GROUPS: dict[str, tuple[int, ...]] = {
    "motion": (G0, G1, G2, G3, *CYCLES),
    "cancel": (800,),  # gives way to a motion code in its block, as in the usual first line
    "once": (G4, G10, G28, G28_1, G30, G30_1, G52, G53, G92, G92_1, G92_2, G92_3),  # non-modal
    "plane": (G17, G18, G19),
    "distance": (G90, G91),
    "centre": (G90_1, G91_1),
    "radius": (80,),
    "feed": (G93, G94),
    "units": (G20, G21),
    "compensation": (400,),
    "length": (G43, G43_1, G43_2, G43_4, G49),  # G43.4, tool centre point control, is TRAORI in Siemens' words
    "return": (G98, G99),
    "system": (G54, 550, 560, 570, 580, 590, 591, 592, 593),
    "path": (G61, G61_1, G64),
    "speed": (970,),
}
GROUP_TITLES = {  # what a modal group of G or M codes does, for people
    "motion": "rapid, lines, arcs, and drilling cycles, which are written out as motion",
    "cancel": "cancels a motion code",
    "once": "dwell, offsets, reference points, machine coordinates: for one block",
    "plane": "plane of arcs and cycles",
    "distance": "absolute, incremental",
    "centre": "arc centres absolute, incremental",
    "radius": "X as a radius, which it is anyway",
    "feed": "feed as inverse time, per minute",
    "units": "inches, mm",
    "compensation": "cutter radius compensation off",
    "length": "tool length offsets; G43.4 is tool centre point control",
    "return": "way out of a cycle",
    "system": "work systems",
    "path": "path modes; they pass through as comments",
    "speed": "spindle speed in revolutions",
    "stop": "stops and ends",
    "tool": "tool change: spindle and coolant off, a stop for the operator",
    "spindle": "spindle",
    "coolant": "coolant",
    "override": "overrides",
    "output": "outputs and inputs; they pass through",
}
M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60),
    "tool": (6,),
    "spindle": (3, 4, 5),
    "coolant": (7, 8, 9),
    "override": (48, 49),
    "output": (62, 63, 64, 65, 66, 67, 68),
}
M_WORDS = {  # the words of codes that LinuxCNC reads and that move nothing; they pass through
    19: "RQP", 50: "P", 51: "P", 52: "P", 53: "P", 61: "Q", 62: "P", 63: "P", 64: "P", 65: "P",
    66: "PELQ", 67: "EQ", 68: "EQ", 70: "", 71: "",
}  # fmt: skip
UNKNOWN_M_WORDS = "PQREL"  # words of a user's own M codes and of those that LinuxCNC does not know
END_CODES, SPINDLE_OFF = (2, 30), 5  # M codes
_G_GROUP = {code: group for group, codes in G_GROUPS.items() for code in codes}
_M_GROUP = {code: group for group, codes in M_GROUPS.items() for code in codes}

_RADIUS = "cutter radius compensation; expected a path of the tool's tip"
_SPLINE = "a spline; write it as G1 or arcs"
_PROBING = "probing; expected a path without it"
G_REFUSED = {
    70: "X as a diameter, for lathes; expected G8",
    50: _SPLINE,
    51: _SPLINE,
    52: _SPLINE,
    53: _SPLINE,
    330: "threading; write it as plain motion",
    331: "rigid tapping; write it as plain motion",
    382: _PROBING,
    383: _PROBING,
    384: _PROBING,
    385: _PROBING,
    410: _RADIUS,
    411: _RADIUS,
    420: _RADIUS,
    421: _RADIUS,
    760: "a threading cycle; write it as plain motion",
    880: "a cycle from which the operator retracts by hand; write it as plain motion",
    950: "a feed per revolution; expected G94 or G93",
    960: "a constant surface speed; expected G97",
}
M_REFUSED = {
    72: "it restores modes kept before; expected each mode stated",
    73: "it restores modes kept before; expected each mode stated",
    97: "a subroutine of Haas; expected O words such as sub and call",
    98: "subroutines of Fanuc; expected O words such as sub and call",
    99: "subroutines of Fanuc; expected O words such as sub and call",
}


def format_g_code(code: int) -> str:
    """Write a G code in tenths: ``G43.1`` for 431."""
    return f"G{code // 10}" if code % 10 == 0 else f"G{code // 10}.{code % 10}"


def find_g_group(code: int) -> str:
    """Find the modal group of a G code in tenths; refuse a code that is not read."""
    if code not in _G_GROUP:
        reason = G_REFUSED.get(code)
        name = format_g_code(code)
        refuse(f"{name}: {reason}" if reason else f"{name} is not a G code this reader knows")
    return _G_GROUP[code]


def find_m_group(code: int) -> str:
    """Find the modal group of an M code; "other" for one that passes through. Refuse one that changes the motion."""
    if code in M_REFUSED:
        refuse(f"M{code}: {M_REFUSED[code]}")
    return _M_GROUP.get(code, "other")
