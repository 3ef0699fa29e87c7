"""The tables of G and M codes that are read, by modal group of RS274/NGC, and the reasons for refusing others.

To read a new code, add it to its modal group here and to the method of :class:`.execution.BlockExecutor` that executes
the group; a block has at most one code of a group. The letters of words with a value are :data:`.block.VALUES`.

G codes are numbers in tenths, 431 for G43.1, as they have at most one decimal.
"""

from ..text import refuse

G0, G1, G2, G3 = 0, 10, 20, 30
G4, G53, G92_1, G92_2 = 40, 530, 921, 922
G17, G18, G19 = 170, 180, 190
G20, G21 = 200, 210
G43, G43_1, G43_2, G43_4, G49 = 430, 431, 432, 434, 490
G54 = 540
G61, G61_1, G64 = 610, 611, 640
G90, G91, G90_1, G91_1 = 900, 910, 901, 911
G93, G94 = 930, 940

G_GROUPS: dict[str, tuple[int, ...]] = {
    "motion": (G0, G1, G2, G3),
    "cancel": (800,),  # gives way to a motion code in its block, as in the usual first line
    "once": (G4, G53, G92_1, G92_2),  # non-modal: a dwell, machine coordinates, no G92 offsets (there are none here)
    "plane": (G17, G18, G19),
    "distance": (G90, G91),
    "centre": (G90_1, G91_1),
    "feed": (G93, G94),
    "units": (G20, G21),
    "compensation": (400,),
    "length": (G43, G43_1, G43_2, G43_4, G49),  # G43.4, tool centre point control, is TRAORI in Siemens' words
    "return": (980, 990),
    "system": (G54, 550, 560, 570, 580, 590, 591, 592, 593),
    "path": (G61, G61_1, G64),
    "speed": (970,),
}
M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60),
    "tool": (6,),
    "spindle": (3, 4, 5),
    "coolant": (7, 8, 9),
    "override": (48, 49),
}
END_CODES, SPINDLE_OFF = (2, 30), 5  # M codes
_G_GROUP = {code: group for group, codes in G_GROUPS.items() for code in codes}
_M_GROUP = {code: group for group, codes in M_GROUPS.items() for code in codes}

_CYCLE = "a canned cycle; write it as plain motion"
_OFFSET = "it sets offsets; expected points in one work system"
_UNKNOWN_POINT = "it moves through a place this file does not tell; expected G53 or plain motion"
_KEPT_POINT = "it keeps a place outside this file"
_RADIUS = "cutter radius compensation; expected a path of the tool's tip"
_SPLINE = "a spline; write it as G1 or arcs"
_PROBING = "probing; expected a path without it"
_G_REFUSED = {
    50: _SPLINE,
    51: _SPLINE,
    52: _SPLINE,
    53: _SPLINE,
    100: _OFFSET,
    280: _UNKNOWN_POINT,
    281: _KEPT_POINT,
    300: _UNKNOWN_POINT,
    301: _KEPT_POINT,
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
    520: _OFFSET,
    730: _CYCLE,
    740: _CYCLE,
    760: "a threading cycle; write it as plain motion",
    920: _OFFSET,
    923: _OFFSET,
    950: "a feed per revolution; expected G94 or G93",
    960: "a constant surface speed; expected G97",
} | dict.fromkeys(range(810, 900, 10), _CYCLE)


def format_g_code(code: int) -> str:
    """Write a G code in tenths: ``G43.1`` for 431."""
    return f"G{code // 10}" if code % 10 == 0 else f"G{code // 10}.{code % 10}"


def find_g_group(code: int) -> str:
    """Find the modal group of a G code in tenths; refuse a code that is not read."""
    if code not in _G_GROUP:
        reason = _G_REFUSED.get(code)
        name = format_g_code(code)
        refuse(f"{name}: {reason}" if reason else f"{name} is not a G code this reader knows")
    return _G_GROUP[code]


def find_m_group(code: int) -> str:
    """Find the modal group of an M code; refuse a code that is not read."""
    if 100 <= code <= 199:
        refuse(f"M{code}: a user's own code, of an effect this file does not tell")
    if code in (97, 98, 99):
        refuse(f"M{code}: subroutines are not read; expected plain blocks")
    if code not in _M_GROUP:
        known = " ".join(f"M{code}" for code in sorted(_M_GROUP))
        refuse(f"M{code} is not an M code this reader knows; expected one of {known}")
    return _M_GROUP[code]
