"""One CL statement: split it into its word and arguments, and act on it as the table of words says."""

import re

from ....errors import InputError
from ..text import quote_short, refuse
from .actions import ClActions
from .arguments import remove_blanks
from .words import TEXT_WORDS, WORDS

_TEXT = re.compile(rf"\s*({'|'.join(TEXT_WORDS)})(?![A-Z0-9])", re.IGNORECASE | re.ASCII)
_NO_TEXT = re.compile(
    rf"\s*({'|'.join(name for name, word in WORDS.items() if word.ends_message)})\s*(?:[/,]|$)", re.IGNORECASE
)


def ends_text(begun: str, text: str) -> bool:
    """Whether a message with a trailing $ ends there all the same, because the line after it is motion."""
    return _TEXT.match(begun) is not None and _NO_TEXT.match(text) is not None


def execute_statement(actions: ClActions, text: str, line: int) -> str:
    """Act on a whole statement that begins at a line; return its word. Errors name no file and no line."""
    message = _TEXT.match(text)
    if message is not None:
        actions.add_event(text, line)
        return message[1].upper()
    head, _, tail = text.partition("/")
    name, comma, minor = remove_blanks(head).partition(",")
    args = [remove_blanks(a) for a in tail.split(",")] if tail.strip() else []
    if comma:
        args = minor.split(",") + args
    word = WORDS.get(name)
    if word is None:
        _note_unknown(actions, name, line)
        return name
    if word.nx:
        actions.dialect = "nx"
    if word.act is not None:
        try:
            word.act(actions, [remove_blanks(text)] if word.whole else args, line)
        except InputError as error:
            refuse(f"{name}: {error.message}")
    if word.event:
        actions.add_event(text, line)
    return name


def _note_unknown(actions: ClActions, name: str, line: int) -> None:
    letters = re.match(r"[A-Z]*", name)
    begin = letters[0] if letters else ""
    if begin != name and begin in WORDS and WORDS[begin].slash:
        refuse(f"{quote_short(name)}; expected a slash after {begin}")
    actions.motion.notes.add(line, f"unknown word {quote_short(name)}, not acted on")
