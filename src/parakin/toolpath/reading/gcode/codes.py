"""The G and M codes that are read, in the modal groups of RS274/NGC, and what is said of those that are not.

G codes are told in tenths, 431 for G43.1, as they have at most one decimal.
"""

from ..cl.tokens import refuse

TIP_CONTROL = 434  # G43.4, or TRAORI as Siemens has it
G_GROUPS: dict[str, tuple[int, ...]] = {
    "motion": (0, 10, 20, 30),
    "cancel": (800,),  # gives way to a motion code in its block, as in the usual first line
    "once": (40, 530, 921, 922),  # non-modal: a dwell, machine coordinates, no G92 offsets (there are none here)
    "plane": (170, 180, 190),
    "distance": (900, 910),
    "centre": (901, 911),
    "feed": (930, 940),
    "units": (200, 210),
    "compensation": (400,),
    "length": (430, 431, 432, TIP_CONTROL, 490),
    "return": (980, 990),
    "system": (540, 550, 560, 570, 580, 590, 591, 592, 593),
    "path": (610, 611, 640),
    "speed": (970,),
}
M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60),
    "tool": (6,),
    "spindle": (3, 4, 5),
    "coolant": (7, 8, 9),
    "override": (48, 49),
}
_G_GROUP = {code: group for group, codes in G_GROUPS.items() for code in codes}
_M_GROUP = {code: group for group, codes in M_GROUPS.items() for code in codes}

_CYCLE = "a canned cycle; write it as plain motion"
_OFFSET = "it sets offsets; expected points in one work system"
_PLACE = "it moves through a place this file does not tell; expected G53 or plain motion"
_RADIUS = "cutter radius compensation; expected a path of the tool's tip"
_G_REFUSED = {
    100: _OFFSET,
    280: _PLACE,
    281: "it keeps a place outside this file",
    300: _PLACE,
    301: "it keeps a place outside this file",
    330: "threading; write it as plain motion",
    331: "rigid tapping; write it as plain motion",
    410: _RADIUS,
    411: _RADIUS,
    420: _RADIUS,
    421: _RADIUS,
    50: "a spline; write it as G1 or arcs",
    51: "a spline; write it as G1 or arcs",
    52: "a spline; write it as G1 or arcs",
    53: "a spline; write it as G1 or arcs",
    520: _OFFSET,
    730: _CYCLE,
    740: _CYCLE,
    760: "a threading cycle; write it as plain motion",
    920: _OFFSET,
    923: _OFFSET,
    950: "a feed per revolution; expected G94 or G93",
    960: "a constant surface speed; expected G97",
} | dict.fromkeys(range(810, 900, 10), _CYCLE)


def g_name(code: int) -> str:
    """``G43.1`` for 431."""
    return f"G{code // 10}" if code % 10 == 0 else f"G{code // 10}.{code % 10}"


def g_group(code: int) -> str:
    """The modal group of a G code in tenths; one that is not read is refused."""
    if code not in _G_GROUP:
        why = "probing; expected a path without it" if 382 <= code <= 385 else _G_REFUSED.get(code)
        refuse(f"{g_name(code)}: {why}" if why else f"{g_name(code)} is not a G code this reader knows")
    return _G_GROUP[code]


def m_group(code: int) -> str:
    """The modal group of an M code; one that is not read is refused."""
    if 100 <= code <= 199:
        refuse(f"M{code}: a user's own code, of an effect this file does not tell")
    if code in (97, 98, 99):
        refuse(f"M{code}: subroutines are not read; expected plain blocks")
    if code not in _M_GROUP:
        known = " ".join(f"M{code}" for code in sorted(_M_GROUP))
        refuse(f"M{code} is not an M code this reader knows; expected one of {known}")
    return _M_GROUP[code]
