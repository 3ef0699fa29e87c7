"""Errors a user can meet, and the phrases their messages share.

Each error carries its place and prints as one line: ``place: what is wrong, and what was expected``.
"""

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches

_LONGEST = 600  # letters of a message's line
_MOST_LINES = 30  # of a file's mistakes are told
_MOST_WORDS = 40  # of those that could be meant are told and compared


class ParakinError(Exception):
    """Anything parakin refuses; ``str()`` is one line fit for a terminal.

    arguments : as of :class:`Exception`; texts are made printable, and long ones are cut in their middle
    """

    def __init__(self, *arguments: object):
        super().__init__(
            *(_shorten_message(argument) if isinstance(argument, str) else argument for argument in arguments)
        )


class InputError(ParakinError):
    """Malformed input.

    Parameters
    ----------
    message : what is wrong and what was expected, one line
    source : file name as the user gave it, or the argument's name
    line : 1-based line in that file, if there is one
    """

    def __init__(self, message: str, source: str | None = None, line: int | None = None):
        self.message, self.source, self.line = message, source, line
        place = source or ""
        if line is not None:
            place += f":{line}"
        super().__init__(f"{place}: {message}" if place else message)


def _shorten_message(text: str) -> str:
    """Make a message printable, and cut the middle of long lines: their ends say what was expected."""
    return "\n".join(_cut_middle(line) for line in make_printable(text).split("\n"))


def _cut_middle(line: str) -> str:
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 3 :]}"


class InputErrors(InputError):
    """Several input errors found in one pass; ``str()`` is one line each, of many the first ones.

    errors : all of them, in the file's order
    """

    def __init__(self, errors: list[InputError]):
        self.errors = errors
        super().__init__(errors[0].message, errors[0].source, errors[0].line)
        lines = [str(error) for error in errors[:_MOST_LINES]]
        if len(errors) > _MOST_LINES:
            last = errors[_MOST_LINES]
            lines.append(str(InputError(f"and {len(errors) - _MOST_LINES} more mistakes", last.source, last.line)))
        self.args = ("\n".join(lines),)


class DescriptionError(ParakinError):
    """A description that is well-formed but is no machine that works.

    key : the one at fault
    message : what is wrong, one line
    """

    def __init__(self, key: str, message: str):
        self.key = key
        super().__init__(f"{key}: {message}")


class PoseError(ParakinError):
    """Poses or joints of the wrong shape, type or mode, or another argument that can't be."""

    @property
    def argument(self) -> str:
        """The name that the message begins with, which is that of the argument at fault where one is told."""
        return re.split("[^a-z_]", str(self), maxsplit=1)[0]


class NoMethodError(ParakinError):
    """The machine's structure has no such closed form or complete method."""


def quote(text: object) -> str:
    """Put a user's text in quotes, on one line, cut to 60 characters."""
    line = " ".join(str(text).split())
    line = "".join(c if c.isprintable() else "?" for c in line)
    return f'"{line}"' if len(line) <= 60 else f'"{line[:57]}..."'


CONTROL_CHARACTER = re.compile("[\x00-\x08\x0a-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""What a text of one line never holds: control characters but for tabs, and signs that turn or break the line."""


def make_printable(text: object) -> str:
    """Replace characters that control a terminal, such as ESC; line ends stay."""
    return "\n".join(CONTROL_CHARACTER.sub("?", line) for line in str(text).split("\n"))


def suggest(word: str, known: Iterable[str], others: str = "") -> str:
    """Complete a message on an unknown word: ``, did you mean "x"?`` if a known one is close, else ``, expected ...``.

    ``others`` says what is expected; the default names all known words.
    """
    words = list(known)
    # Long words are cut: difflib's time grows with the square, and nobody misspells forty letters.
    close = [w for w in words if w.lower() == word.lower()] or get_close_matches(word[:40], words[:_MOST_WORDS], 1)
    if close:
        return f', did you mean "{close[0]}"?'
    others = others or (words[0] if len(words) == 1 else "one of " + join_words(words) if words else "")
    return f", expected {others}" if others else ""


def join_words(words: Sequence[str]) -> str:
    """Join words with commas, of many the first ones."""
    end = f", ... ({len(words)} in all)" if len(words) > _MOST_WORDS else ""
    return ", ".join(words[:_MOST_WORDS]) + end


class SingularHomeWarning(UserWarning):
    """A machine's home is a singularity: the direct problem has no side to stay on there."""
