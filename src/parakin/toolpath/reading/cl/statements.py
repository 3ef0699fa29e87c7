"""One CL statement: split it into its word and arguments, and act on it as the table of words says."""

import re

from ....errors import InputError
from ..text import is_number, quote_short, refuse
from .actions import ClActions
from .word_arguments import remove_blanks
from .words import INFORMING, REFUSED, TEXT_WORDS, WORDS

_TEXT = re.compile(rf"\s*({'|'.join(TEXT_WORDS)})(?![A-Z0-9])", re.IGNORECASE | re.ASCII)
_NO_TEXT = re.compile(
    rf"\s*({'|'.join(name for name, word in WORDS.items() if word.ends_message)})\s*(?:[/,]|$)", re.IGNORECASE
)

_INSERT = re.compile(r"INSERT[ /,\"']*", re.IGNORECASE)
_CODE = re.compile(r"M ?\d+", re.IGNORECASE)  # the one that becomes an event
_BLOCK = re.compile(r"(?<![A-Z0-9_])[A-Z] ?=? ?[-+.]?\d|[=#$]|\w\(", re.IGNORECASE | re.ASCII)  # a controller's words
_G_CODE = re.compile(r"(?:[GMNXYZ][-+]?(?:\d+(?:\.\d*)?|\.\d+))(?:[A-Z][-+]?(?:\d+(?:\.\d*)?|\.\d+))*", re.ASCII)
_ONLY_CODES = re.compile(r"(?:[A-Z] ?[-+]?(?:\d+(?:\.\d*)?|\.\d+)\s*)+", re.IGNORECASE | re.ASCII)
_COMMENT = re.compile(r"(?<!\w)\([^()]*\)|;.*", re.DOTALL)
HIDDEN = "\0"  # a character that no line of a file has
_LONGEST_WORD = 10
_COORDINATES = range(3, 13)  # numbers of a point, with an axis, up to a frame
_NO_STEMS = frozenset(("FROM", "FINI", "TLON", "GO", "IF", "DO", "CUT", "SYN"))  # short, and other words begin so
_MOTION = tuple(name for name, word in WORDS.items() if word.act is not None and word.ends_message)
_STEMS = tuple(name for name in (*_MOTION, *REFUSED, "TRACUT", "TRANS", "CUTCOM") if name not in _NO_STEMS)
_ACTING = tuple(name for name, word in WORDS.items() if word.act is not None and len(name) >= 4)


def ends_text(begun: str, text: str) -> bool:
    """Tell whether a message with a trailing $ ends there all the same, because the line after it is motion."""
    return _TEXT.match(begun) is not None and _NO_TEXT.match(text) is not None


def execute_statement(actions: ClActions, text: str, line: int) -> str:
    """Act on a whole statement that begins at a line; return its word.

    Errors name no file, and a line only of another statement. HIDDEN begins a statement that a comment hides.
    """
    hidden = text.startswith(HIDDEN)
    text = text.removeprefix(HIDDEN)
    message = _TEXT.match(text)
    if message is not None:
        _check_insert(actions, text, line)
        actions.read_comment(text, line)
        actions.add_event(text, line)
        return message[1].upper()
    head, _, tail = text.partition("/")
    name, comma, minor = remove_blanks(head).partition(",")
    args = [remove_blanks(a) for a in tail.split(",")] if tail.strip() else []
    if comma:
        args = minor.split(",") + args
    actions.read_word(name, args, line)
    if name != "GOTO":
        actions.motion.arc_step = None
    word = WORDS.get(name)
    if comma and word is not None and not word.whole:
        refuse(f"{name}: a comma behind the word, or two statements in one; expected {name}/ with its values")
    if word is None:
        _take_unknown(actions, name, args, line, hidden=hidden)
        return name
    if word.act is not None:
        try:
            word.act(actions, [remove_blanks(text)] if word.whole else args, line)
        except InputError as error:
            refuse(error.message if error.line not in (None, line) else f"{name}: {error.message}", error.line)
    if word.event:
        actions.add_event(text, line)
    return name


def _check_insert(actions: ClActions, text: str, line: int) -> None:
    """Refuse an INSERT that gives the controller a block; note one of other words than a comment or an M code.

    SolidWorks CAM describes tools and stock in it, with numbers behind letters: there a block has nothing else.
    """
    plain = " ".join(text.split())
    begin = _INSERT.match(plain)
    given = plain[begin.end() :].rstrip(" \"'") if begin else ""
    if begin is None or _CODE.fullmatch(given):
        return
    said = _COMMENT.sub("", given).strip()
    if _ONLY_CODES.fullmatch(said) if actions.dialect == "solidworks" else _BLOCK.search(said):
        refuse(f"INSERT: {quote_short(given)}, a block for the controller, cannot be honoured; "
               "expected plain statements, or INSERT of one M code")  # fmt: skip
    if said:
        actions.motion.notes.add(line, "INSERT of words that are no M code: a comment in programs")


def _take_unknown(actions: ClActions, name: str, args: list[str], line: int, *, hidden: bool) -> None:
    """Refuse a word that would move, turn, shift or compensate; list one that informs; note any other.

    Numbers alone, as many as a point or a frame has, are taken for coordinates.
    """
    letters = re.match(r"[A-Z]*", name)
    begin = letters[0] if letters else ""
    if begin != name and begin in WORDS and WORDS[begin].slash:
        refuse(f"{quote_short(name)}; expected a slash after {begin}")
    core = re.split("[=)]", name)[-1]  # behind a label or a name: L1)GOTO, M1=MACRO
    if core in REFUSED:
        refuse(f"{quote_short(name)}: {REFUSED[core]}, and cannot be honoured; expected plain motion")
    if hidden or name in INFORMING:
        actions.informing.setdefault(name, line)
        return
    if _G_CODE.fullmatch(name):
        refuse(f"{quote_short(name)}, a block of G-code in a CL file; expected GOTO/x,y,z, or a file named .ngc")
    if name.startswith("GO"):
        refuse(f"unknown word {quote_short(name)} that begins as motion does; expected GOTO/x,y,z")
    meant = next((word for word in _MOTION if name.endswith(word)), None) or _find_meant(name)
    if meant is not None:
        refuse(f"unknown word {quote_short(name)}; expected {meant}")
    stem = next((word for word in _STEMS if name.startswith(word)), None)
    if stem is not None:
        refuse(f"unknown word {quote_short(name)} that begins as {stem} does; expected plain motion")
    if len(args) in _COORDINATES and all(is_number(a) for a in args):
        refuse(f"unknown word {quote_short(name)} with coordinates, which may be a motion; expected GOTO/x,y,z")
    actions.motion.notes.add(line, f"unknown word {quote_short(name)}, not acted on")


def _find_meant(name: str) -> str | None:
    """Find the word that acts from which a name is one letter off: more, less, another, or two of them swapped."""
    if not 3 <= len(name) <= _LONGEST_WORD:
        return None
    return next((word for word in _ACTING if _is_slip(name, word)), None)


def _is_slip(name: str, word: str) -> bool:
    """Tell whether two words differ by one typing error."""
    shorter, longer = sorted((name, word), key=len)
    if len(longer) - len(shorter) > 1:
        return False
    k = next((i for i, (p, q) in enumerate(zip(shorter, longer, strict=False)) if p != q), len(shorter))
    if len(shorter) < len(longer):
        return shorter[k:] == longer[k + 1 :]
    swapped = shorter[k : k + 2] == longer[k : k + 2][::-1] and shorter[k + 2 :] == longer[k + 2 :]
    return swapped or shorter[k + 1 :] == longer[k + 1 :]
