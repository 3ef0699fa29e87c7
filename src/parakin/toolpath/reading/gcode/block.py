"""Parse a line of G-code into its words. Pure functions of the text; errors name no file and no line."""

import re
from dataclasses import dataclass, field
from typing import NoReturn

from ....errors import CONTROL_CHARACTER
from ..text import LARGEST, describe_control, quote_short, refuse
from .codes import G43_4, find_g_group, find_m_group, format_g_code
from .expressions import Key, ParameterStore, read_key, read_value, skip_blanks

LONGEST = 4000  # characters in one line; RS274/NGC allows 256, but files have longer comments
POLAR = "@^"  # distance from the zero of X and Y, and angle from X, in place of X and Y
VALUES = "ABCDEFHIJKLPQRSTXYZ" + POLAR  # letters of words with a value
NO_PROGRAM = (
    "O words without sub, call, if, while and the like are not read; "
    "expected O and a program number alone in the first block"
)

_BLANKS = " \t"
# The blanks within a number can't be told from those behind it, so neither part of it is tried twice.
_TOKEN = re.compile(
    r"(?P<name>(?i:TRAORI))(?![A-Za-z0-9])"
    r"|(?P<letter>[A-Za-z@^])[ \t]*(?P<number>[+-]?[ \t]*(?:\d[\d \t]*(?:\.[\d \t]*)?|\.[ \t]*\d[\d \t]*))"
    r"|\((?P<comment>[^()]*)\)|;(?P<rest>.*)|[ \t]+",
    re.ASCII,
)
_COMPUTED = re.compile(
    r"[\[#]|[+-][ \t]*[\[#A-Za-z+-]|(?:[A-Za-z][ \t]*){2,6}\["
)  # begins a value that is no plain number
_MOST_M = 4  # M codes in a block, as RS274/NGC has it
_WHOLE = 1e-3  # so far off a whole number may be
_TENTH = 1e-6  # so far off a tenth may a G code be, in tenths
_MESSAGE = re.compile(r"\s*msg\s*,", re.IGNORECASE)
_PYTHON = re.compile(r"\s*py\s*,", re.IGNORECASE)
_REFUSED_SIGNS = {
    "#": "parameters (#) are not read here; expected plain numbers",
    "[": "an expression without a letter before it",
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
    assignments : parameters and the values that they take
    program : the digits of a program number, which leaves no room for other words
    deleted : whether the line begins with a slash
    spaced : whether a number has blanks within
    """

    values: dict[str, float] = field(default_factory=dict)
    g: dict[str, int] = field(default_factory=dict)
    m: dict[str, int] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)
    assignments: list[tuple[Key, float]] = field(default_factory=list)
    program: str | None = None
    deleted: bool = False
    spaced: bool = False


def parse_block(text: str, letters: str = VALUES, store: ParameterStore | None = None) -> Block:
    """Parse a line, without blanks around it, into words.

    letters : those of words with a value
    store : the parameters that expressions read; without it, expressions and parameters are refused
    """
    check_text(text)
    block = Block()
    at = 0
    if text.startswith("/"):
        block.deleted, at = True, 1
    first = True
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            if block.program is not None and text[at].isalpha():
                refuse(NO_PROGRAM)
            at = _add_computed(block, text, at, first, letters, store)
            first = False
            continue
        letter = token["letter"]
        if letter is not None:
            digits = token["number"].rstrip(_BLANKS)
            plain = "".join(digits.split())
            block.spaced = block.spaced or plain != digits
            _add_word(block, letter.upper(), plain, first, letters)
            first = False
        elif token["name"] is not None:
            _add_g_code(block, G43_4)
        elif token["comment"] is not None and _MESSAGE.match(token["comment"]):
            block.messages.append(token["comment"])
        elif _PYTHON.match(token["comment"] or token["rest"] or ""):
            refuse("a comment that LinuxCNC runs as Python; expected plain blocks")
        at = token.end()
    return block


def check_text(text: str) -> None:
    """Refuse a line that is too long or holds control characters."""
    if len(text) > LONGEST:
        refuse(f"a line of more than {LONGEST} characters; expected a block of G-code")
    control = CONTROL_CHARACTER.search(text)
    if control is not None:
        refuse(describe_control(control[0]))


def round_whole(letter: str, value: float) -> int:
    """Round the value of a word that counts or numbers something; refuse one that is not whole or below zero."""
    if not (value >= 0.0 and abs(value - round(value)) <= _WHOLE):
        refuse(f"{letter}{value:g}; expected a whole number, not below zero")
    return round(value)


def _add_computed(block: Block, text: str, at: int, first: bool, letters: str, store: ParameterStore | None) -> int:
    """Add a word whose value is an expression, or a parameter that is set; return where the text goes on."""
    sign = text[at]
    behind = skip_blanks(text, at + 1)
    if store is not None and sign == "#":
        key, at = read_key(text, behind, store)
        at = skip_blanks(text, at)
        if text[at : at + 1] != "=":
            refuse("a parameter without a letter before it or an equals sign behind it")
        value, at = read_value(text, at + 1, store)
        if not block.assignments and block.program is not None:
            refuse(NO_PROGRAM)
        block.assignments.append((key, value))
        return at
    if store is None or not (sign in POLAR or (sign.isascii() and sign.isalpha())) or not _COMPUTED.match(text, behind):
        _refuse_text(text, at)
    value, at = read_value(text, behind, store)
    _add_word(
        block, sign.upper(), format(value, ".15g") if abs(value) < LARGEST else repr(value), first, letters, value
    )
    return at


def _add_word(block: Block, letter: str, plain: str, first: bool, letters: str, computed: float | None = None) -> None:
    """Add a word to the block.

    plain : the number as written, without blanks
    computed : its value where that is not simply what is written
    """
    if block.program is not None:
        refuse(NO_PROGRAM)
    value = float(plain) if computed is None else computed
    if not abs(value) <= LARGEST:
        refuse(f"{letter}: {quote_short(plain)} is out of range")
    if letter in letters:
        if letter in block.values:
            refuse(f"two {letter} words in a block; expected one")
        block.values[letter] = value
    elif letter == "G":
        tenths = round(value * 10.0)
        if value < 0.0 or abs(tenths - value * 10.0) > _TENTH:
            refuse(f"G{plain} is no G code")
        _add_g_code(block, tenths)
    elif letter == "M":
        _add_m_code(block, round_whole("M", value))
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


def _add_g_code(block: Block, code: int) -> None:
    group = find_g_group(code)
    if group in block.g:
        names = f"{format_g_code(block.g[group])} and {format_g_code(code)}"
        refuse(f"{names} in a block: two codes of one modal group; expected one")
    block.g[group] = code


def _add_m_code(block: Block, code: int) -> None:
    group = find_m_group(code)
    if group in block.m:
        refuse(f"M{block.m[group]} and M{code} in a block: two codes of one modal group; expected one")
    block.m[group] = code
    if len(block.m) > _MOST_M:
        refuse(f"more than {_MOST_M} M codes in a block")


def _refuse_text(text: str, at: int) -> NoReturn:
    """Say what is wrong with the text that starts no word and no comment."""
    sign = text[at].upper()
    if sign in _REFUSED_SIGNS:
        refuse(_REFUSED_SIGNS[sign])
    if sign == "(":
        nested = "(" in text[at + 1 :].partition(")")[0]
        refuse("a comment within a comment" if nested else "a comment without an end; expected a closing bracket")
    rest = text[at + 1 :].lstrip(_BLANKS)
    if sign.isascii() and sign.isalpha() and rest[:1] == "=":
        refuse(f"{quote_short(text[at:])}: an equals sign; expected a letter and a number")
    if sign.isascii() and sign.isalpha():
        if rest[:1] in ("#", "["):
            refuse("parameters and expressions are not read here; expected plain numbers")
        letters = re.match(r"[A-Za-z]{2,}", text[at:])
        if letters is not None and rest[:1].isalpha() and len(letters[0]) > 2:
            refuse(f"{quote_short(letters[0])}: names and functions are not read; expected a letter and a number")
        refuse(f"{sign} without a number: {quote_short(text[at:])}")
    if sign in "+-.0123456789":
        refuse(f"{quote_short(text[at:])}: a number without a letter")
    refuse(f"{quote_short(text[at:])} is no word; expected a letter and a number")
