"""Recognise programs of other controls by what only they write."""

import re
from typing import NamedTuple

_LOOKED_AT = 400  # characters of a line
_CUT = "\0"  # stands where a line was cut, so that no pattern takes that for its end


class OtherControl(NamedTuple):
    """A control, and what its programs alone hold: in a comment or header, and in a block."""

    name: str
    header: re.Pattern[str]
    block: re.Pattern[str]


def _compile_pattern(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE | re.ASCII)


CONTROLS = (
    OtherControl(
        "Heidenhain",
        _compile_pattern(r"\s*(?:\d+\s+)?(?:BEGIN|END)\s+PGM\b|\s*%\s*\w+\s+G7[01]\b"),
        _compile_pattern(
            r"\s*(?:\d+\s+)?(?:BLK\s+FORM|TOOL\s+(?:CALL|DEF)|CYCL\s+(?:DEF|CALL)|L(?:N|BL)?\s+[A-Z]|CC?\s+X|M128\b"
            r"|FN\s*\d|PLANE\s|CALL\s+(?:LBL|PGM)|STOP\b|FUNCTION\s)|.*\b(?:FMAX|R0\s+F\d)|[^(;]*\*\s*$"
        ),
    ),
    OtherControl(
        "Siemens (Sinumerik)",
        _compile_pattern(r"[\s;]*(?:%_N_\w+|\$PATH=|%MPF)"),
        _compile_pattern(
            r"\s*(?:N\d+\s*)?\$[A-Z]{1,3}_|(?!\s*[A-Z]{3,}_)[^(;#$]*(?:\b[A-Z]{1,8}\d*\s*=|\bCYCLE\d+\s*\(|\bTRA(?:ORI|FOOF)\b|\bA?(?:TRANS|ROT|MIRROR|SCALE)\b|\bCIP\b|\bGOTO[FB]\b|\bSUPA\b|\bG500\b|\bMSG\s*\(|\bDEF\s+(?:REAL|INT)\b"
            r"|\bMCALL\b|\bSOFT\b|\bFFWON\b|\bCOMPCAD\b|\bORI(?:WKS|MKS|AXES|VECT)\b|\bCUT3D\w+\b|\bWORKPIECE\s*\()"
        ),
    ),
    OtherControl(
        "Haas",
        _compile_pattern(r"\s*(?:O\d+\s*)?\(.*\bHaas\b"),
        _compile_pattern(r"[^(;]*\b(?:(?:G103|G187|G234|G254|G47|G150)(?!\d)|G15[34]\s*P|M97\s*P|G1[23]\s*[IQD])"),
    ),
    OtherControl(
        "Marlin, Klipper or another 3D printer's control",
        _compile_pattern(
            r"\s*;\s*(?:FLAVOR:|LAYER:|TYPE:|Generated\s+(?:by|with)\s+(?:Cura|PrusaSlicer|Slic3r|OrcaSlicer|BambuStudio)"
            r"|Sliced\s+by)|.*\bSET_VELOCITY_LIMIT\b"
        ),
        _compile_pattern(
            r"(?![^(;]*\bM6[678](?!\d))[^(;]*(?:(?<![A-Z0-9.])E[-+]?[\d.]|\bM(?:8[23]|10[4679]|109|140|190|20[1-5]|221|420)(?!\d))|\s*[A-Z]{3,}_[A-Z_]+"
        ),
    ),
    OtherControl(
        "grbl", _compile_pattern(r"\s*[(;]\s*grbl\b"), _compile_pattern(r"\s*\$(?:J=|N?\d|[$#GINCHX]\s*$|RST=|SLP)")
    ),
    OtherControl(
        "Fanuc",
        _compile_pattern(r"\s*(?:O\d+\s*)?\(.*\bFanuc\b"),
        _compile_pattern(
            r"[^(;]*(?:\bG0?5(?:\.1\s*Q|\s*P)|\bG54\.1\s*P|\bG6(?:5|6|8(?:\.[23])?|9)(?!\d)|\bM0?9[89](?!\d)|\bG10\.6|\bG0?8\s*P"
            r"|\bG43\.5|\bG53\.1|\bG15(?!\d|\s*H)|\bG16(?!\d)|\bG5[01](?:\.1)?(?!\d))"
            r"|\s*(?:N\d+\s*)?(?:IF\s*\[|WHILE\s*\[|GOTO\s*\d|END\s*\d|POPEN|DPRNT|SETVN)"
        ),
    ),
)


def recognise_block(text: str) -> str | None:
    """Return the name of the control that alone writes such a line, None if it is none of those known."""
    if len(text) > _LOOKED_AT:
        text = text[:_LOOKED_AT] + _CUT
    headers = (control.name for control in CONTROLS if control.header.match(text))
    blocks = (control.name for control in CONTROLS if control.block.match(text))
    return next(headers, None) or next(blocks, None)


def name_control(message: str, name: str | None, text: str) -> str:
    """Add a control's name to the message of an error in line ``text``."""
    control = recognise_block(text)
    where, control = ("the line", control) if control else ("the file", name)
    if control is None:
        return message
    return f"{message}; {where} is of a program for {control}, expected RS274/NGC as LinuxCNC reads it"
