"""A line of G-code into words. Pure functions of the text; errors carry no place, the reader adds file and line."""

import re
from dataclasses import dataclass, field
from typing import NoReturn

from ..cl.tokens import LARGEST, quoted, refuse
from .codes import TIP_CONTROL, g_group, g_name, m_group

LONGEST = 4000  # characters in one line; RS274/NGC allows 256, longer comments are met all the same
VALUES = "ABCFHIJKPQRSTXYZ"  # letters of words that carry a value
NO_PROGRAM = (
    "O words (subroutines, branches) are not read; expected plain blocks, "
    "or O and a program number alone in the first block"
)

_BLANKS = " \t"
_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")
# The blanks within a number can't be told from those behind it, so neither part of it is tried twice.
_TOKEN = re.compile(
    r"(?P<name>(?i:TRAORI))(?![A-Za-z0-9])"
    r"|(?P<letter>[A-Za-z])[ \t]*(?P<number>[+-]?[ \t]*(?:\d[\d \t]*(?:\.[\d \t]*)?|\.[ \t]*\d[\d \t]*))"
    r"|\((?P<comment>[^()]*)\)|;(?P<rest>.*)|[ \t]+",
    re.ASCII,
)
_MOST_M = 4  # M codes in a block, as RS274/NGC has it
_WHOLE = 1e-3  # of a word whose value is a whole number
_MESSAGE = re.compile(r"\s*msg\s*,", re.IGNORECASE)
_PYTHON = re.compile(r"\s*py\s*,", re.IGNORECASE)
_CONTROLS = {
    "\0": "a NUL byte: a binary or UTF-16 file; expected plain text",
    "\r": "a carriage return within a line; expected lines that end in LF or CR LF",
}
_WORDY = {
    "#": "parameters (#) are not read; expected plain numbers",
    "[": "expressions ([...]) are not read; expected plain numbers",
    "O": NO_PROGRAM,
    "%": "a % within the program; expected it alone on its line, both at the beginning and at the end, or not at all",
    ":": "a colon (program and main block numbers) is not read; expected O and a number, or N and a number",
    "/": "a slash within a block; expected it only at the block's beginning",
    ")": "a closing bracket without a comment to close",
}


@dataclass
class Block:
    """The words of one line.

    values : by letter, the numbers as written; whoever acts on a word takes it out
    g, m : the code of each modal group, G codes in tenths
    messages : the comments that are messages, without their brackets
    program : the digits of a program number, which leaves no room for other words
    deleted : whether the line begins with a slash
    spaced : whether a number has blanks within
    """

    values: dict[str, float] = field(default_factory=dict)
    g: dict[str, int] = field(default_factory=dict)
    m: dict[str, int] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)
    program: str | None = None
    deleted: bool = False
    spaced: bool = False


def parse(text: str, letters: str = VALUES) -> Block:
    """The words of a line, without blanks around it; ``letters`` are those of words that carry a value."""
    if len(text) > LONGEST:
        refuse(f"a line of more than {LONGEST} characters; expected a block of G-code")
    control = _CONTROL.search(text)
    if control is not None:
        refuse(_CONTROLS.get(control[0], f"a control character ({ord(control[0])}); expected plain text"))
    block = Block()
    at = 0
    if text.startswith("/"):
        block.deleted, at = True, 1
    first = True
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            if block.program is not None and text[at].isalpha():
                refuse(NO_PROGRAM)
            _refuse_at(text, at)
        letter = found["letter"]
        if letter is not None:
            _word(block, letter.upper(), found["number"].rstrip(_BLANKS), first, letters)
            first = False
        elif found["name"] is not None:
            _code(block, TIP_CONTROL)
        elif found["comment"] is not None and _MESSAGE.match(found["comment"]):
            block.messages.append(found["comment"])
        elif _PYTHON.match(found["comment"] or found["rest"] or ""):
            refuse("a comment that LinuxCNC runs as Python; expected plain blocks")
        at = found.end()
    return block


def whole(letter: str, value: float) -> int:
    """The value of a word that counts or numbers something."""
    if not (value >= 0.0 and abs(value - round(value)) <= _WHOLE):
        refuse(f"{letter}{value:g}; expected a whole number, not below zero")
    return round(value)


def _word(block: Block, letter: str, digits: str, first: bool, letters: str) -> None:
    plain = "".join(digits.split())
    if block.program is not None:
        refuse(NO_PROGRAM)
    block.spaced = block.spaced or plain != digits
    value = float(plain)
    if not abs(value) <= LARGEST:
        refuse(f"{letter}: {quoted(plain)} is out of range")
    if letter in letters:
        if letter in block.values:
            refuse(f"two {letter} words in a block; expected one")
        block.values[letter] = value
    elif letter == "G":
        tenths = round(value * 10.0)
        if value < 0.0 or abs(tenths - value * 10.0) > 1e-6:
            refuse(f"G{plain} is no G code")
        _code(block, tenths)
    elif letter == "M":
        code = whole("M", value)
        group = m_group(code)
        if group in block.m:
            refuse(f"M{block.m[group]} and M{code} in a block: two codes of one modal group; expected one")
        block.m[group] = code
        if len(block.m) > _MOST_M:
            refuse(f"more than {_MOST_M} M codes in a block")
    elif letter == "N":
        if not first:
            refuse("N within a block; expected the line's number at its beginning")
        if value < 0.0:
            refuse("a line number below zero")
    elif letter == "O":
        if not first or block.deleted or not plain.isdigit():
            refuse(NO_PROGRAM)
        block.program = plain
    else:
        refuse(f"{letter}{plain}: not a word this reader knows; expected words of {' '.join('GMN' + letters)}")


def _code(block: Block, tenths: int) -> None:
    group = g_group(tenths)
    if group in block.g:
        refuse(f"{g_name(block.g[group])} and {g_name(tenths)} in a block: two codes of one modal group; expected one")
    block.g[group] = tenths


def _refuse_at(text: str, at: int) -> NoReturn:
    """Say what is wrong with the text that starts no word and no comment."""
    sign = text[at].upper()
    if sign in _WORDY:
        refuse(_WORDY[sign])
    if sign == "(":
        nested = "(" in text[at + 1 :].partition(")")[0]
        refuse("a comment within a comment" if nested else "a comment without an end; expected a closing bracket")
    rest = text[at + 1 :].lstrip(_BLANKS)
    if sign.isascii() and sign.isalpha():
        if rest[:1] in ("#", "["):
            refuse(_WORDY[rest[0]])
        found = re.match(r"[A-Za-z]{2,}", text[at:])
        if found is not None and rest[:1].isalpha() and len(found[0]) > 2:
            refuse(f"{quoted(found[0])}: names and functions are not read; expected a letter and a number")
        refuse(f"{sign} without a number: {quoted(text[at:])}")
    if sign in "+-.0123456789":
        refuse(f"{quoted(text[at:])}: a number without a letter")
    refuse(f"{quoted(text[at:])} is no word; expected a letter and a number")
