"""The table of CL dialects: how a file tells its dialect, and what the words mean that differ between them.

Sources: PTC, CL data file formats (CIRCLE, CYCLE, CSYS); Siemens, CLSF manual (CIRCLE is left-handed, checked against
tangents of real files); Autodesk, ISO 4343 APT post processors (MOVARC is right-handed; that for CAMplete gives CIRCLE
the other axis), their LOADTL (pocket, body length, offset) and cycles (in that for CAMplete CLEAR is the height of the
clearance plane, RAPTO and RTRCTO are distances above the hole's point); ISO 4343:2000.
"""

import re
from typing import Literal, NamedTuple

DialectName = Literal["apt", "catia", "nx", "creo", "solidworks", "autodesk", "camplete", "mastercam", "gcode"]

RIGHT, LEFT, UNKNOWN = 1, -1, 0  # hands: how a motion turns about the axis that its statement gives
SIGNED, BELOW = "signed", "below"  # FEDTO: along the tool axis, or a distance below the hole's point
# RAPTO beside CLEAR: the same distance, one down from CLEAR, or the distance where CLEAR is a height in the part
SAME, DOWN, HEIGHT = "same", "down", "height"
_OTHER_VALUES = "they mean other things in each post processor"
_AUTODESK_VALUES = (
    "Autodesk's posts mean a height or a distance by the clearance, and the hole's bottom or its top by the point"
)


class Dialect(NamedTuple):
    """What a dialect is told by and what its words mean.

    title : the name for people
    circle : the hand of CIRCLE; UNKNOWN: its neighbours have to prove it
    fedto : the sense of FEDTO in a cycle; None: a negative one is below the point, a positive one is refused
    header : a comment ($$, PPRINT, REMARK) before the first motion that tells the dialect
    words : words that only this dialect has
    clear : what CLEAR of a cycle is where RAPTO stands beside it
    cycle_values : why the values of a cycle by position tell nothing
    tool_values : what the values behind the number of LOADTL are, by position: ``set_length`` from the spindle's nose
        to the tip, ``body_length`` below the holder, or something that is no length; None: not known
    upright : whether points after MULTAX/OFF have the tool along Z
    """

    title: str
    circle: int = UNKNOWN
    fedto: str | None = None
    header: str | None = None
    words: tuple[str, ...] = ()
    tool_values: tuple[str, ...] | None = None
    clear: str = SAME
    cycle_values: str = _OTHER_VALUES
    upright: bool = False


DIALECTS: dict[DialectName, Dialect] = {
    "apt": Dialect("APT"),
    "creo": Dialect(
        "PTC Creo", RIGHT, BELOW, r"\$\$\*\s*PRO/CLFILE|\$\$->|\bPRO/NC\b", clear=DOWN, upright=True,
        cycle_values="Creo's option cycle_format is fixed, which leaves open from where they count; set it to couplet",
    ),
    "catia": Dialect(
        "CATIA V5", UNKNOWN, None, r"\$\$\*\s*CATIA|\bCATIA APT\b", (), ("offset", "offset"),
        cycle_values="CATIA's PP word table, which is not in the file, says which is which",
    ),
    "solidworks": Dialect(
        "SolidWorks CAM", RIGHT, BELOW, r"\bSOLID ?WORKS\b|\bCAMWORKS\b", ("UNIT",), ("set_length",)
    ),
    "autodesk": Dialect(
        "Autodesk APT", RIGHT, None, r"\bAUTODESK\b|\bHSMWORKS\b|\bFUSION ?360\b|\bINVENTOR CAM\b", ("MOVARC",),
        ("pocket", "body_length", "offset", "offset"), cycle_values=_AUTODESK_VALUES, upright=True,
    ),
    "camplete": Dialect(
        "Autodesk's post for CAMplete", LEFT, BELOW, r"\bCAMPLETE\b|\bMANUSNC\b", ("MCS", "CSI_TOOL_PATH"),
        ("pocket", "body_length", "offset", "offset"), HEIGHT, _AUTODESK_VALUES,
    ),
    "mastercam": Dialect("Mastercam", UNKNOWN, None, r"\bMASTERCAM\b"),
    "nx": Dialect(
        "Siemens NX", LEFT, SIGNED, r"\bSIEMENS NX\b|\bUNIGRAPHICS\b",
        ("TOOLPATH", "TLDATA", "MSYS", "PAINT", "END-OF-PATH"),
    ),
}  # fmt: skip
TITLES: dict[str, str] = {"gcode": "G-code", **{name: dialect.title for name, dialect in DIALECTS.items()}}

_HEADERS: list[tuple[DialectName, re.Pattern[str]]] = [
    (name, re.compile(dialect.header, re.IGNORECASE)) for name, dialect in DIALECTS.items() if dialect.header
]
_BY_WORD: dict[str, DialectName] = {word: name for name, dialect in DIALECTS.items() for word in dialect.words}
_CREO_MACHINE = re.compile(r"UNC[XL]\d\d", re.IGNORECASE)  # Creo's names of machines without one of their own


def find_by_comment(text: str) -> DialectName | None:
    """Find the dialect whose header a comment is."""
    return next((name for name, header in _HEADERS if header.search(text)), None)


def find_by_word(word: str, args: list[str]) -> DialectName | None:
    """Find the dialect that alone has a word, or its default machine (MACHIN/UNCX01 of Creo)."""
    if word == "MACHIN" and args and _CREO_MACHINE.fullmatch(args[0]):
        return "creo"
    return _BY_WORD.get(word)
