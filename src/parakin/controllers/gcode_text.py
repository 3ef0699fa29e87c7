"""Write G-code: blocks of rows of numbers, and comments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ..arrays import Array

# Digits after the point. Beside the pole of a wrist a turning joint goes by tens of degrees for thousandths of them of
# the pose's angles, and steps of 1e-6° could be told from a smooth motion.
DIGITS = {"mm": 6, "rad": 8}
_DIGITS_OF_F = 6
LONGEST_COMMENT = 200  # characters; LinuxCNC takes 255 in a line
CHUNK = 1 << 16  # motions written at a time
ROWS = 1 << 14  # formatted at a time


def to_display(values: Array, units: Sequence[str], digits: Mapping[str, int] = DIGITS) -> Array:
    """Convert rows from mm and rad to mm and degrees, rounded to the digits that are printed."""
    scale = np.where(np.array(units) == "rad", 180.0 / np.pi, 1.0)
    columns = zip((values * scale).T, units, strict=True)
    return np.stack([np.round(column, digits[unit]) for column, unit in columns], axis=-1) + 0.0


def format_blocks(lead: str, letters: Sequence[str], units: Sequence[str], rows: Array, seconds: Array) -> str:
    """Format lines ``lead X.. Y.. F..`` of rows (k, letters), mm and degrees; F is the inverse of a line's minutes.

    units : of the letters, ``mm`` or ``rad``
    """
    words = " ".join(f"{letter}%.{DIGITS[unit]}f" for letter, unit in zip(letters, units, strict=True))
    line = f"{lead}{words} F%.{_DIGITS_OF_F}f\n"
    table = np.column_stack([rows, 60.0 / seconds])
    chunks = [table[begin : begin + ROWS] for begin in range(0, len(table), ROWS)]
    return "".join(line * len(chunk) % tuple(chunk.ravel().tolist()) for chunk in chunks)


def format_comments(text: str) -> Iterator[str]:
    """Split a remark into comments that fit on a line and that no controller acts upon."""
    yield from (f"( {piece} )" for piece in split_text(make_plain(text), LONGEST_COMMENT))


def split_text(text: str, longest: int) -> list[str]:
    """Split a text into pieces of at most so many characters, after blanks where it has some; none is one piece."""
    pieces = list[str]()
    while len(text) > longest:
        end = text.rfind(" ", 0, longest) + 1 or longest
        pieces.append(text[:end])
        text = text[end:]
    return [*pieces, text]


def make_plain(text: str) -> str:
    """Replace what can't stand in a comment: brackets, separators, and characters that are not ASCII."""
    words = " ".join(text.replace("°", " deg").split())
    plain = "".join(c if " " <= c <= "~" else "?" for c in words)
    return plain.translate(str.maketrans("();%", "[],?")).strip()


def join_lines(lines: Iterable[str]) -> str:
    """Join lines, each with its end."""
    return "".join(line + "\n" for line in lines)
