"""Read CL files line by line: lines become statements, which may go on over several lines or hide in comments."""

import re

from ....errors import CONTROL_CHARACTER, InputError
from ..text import decode_line, describe_control, is_number, parse_number, quote_short
from .actions import ClActions
from .statements import HIDDEN, ends_text, execute_statement

LONGEST = 4_000_000  # characters in one statement
_END_OF_FILE = "\x1a"  # the sign that DOS ends a text with
_HEADER = re.compile(r"\$\$\s*\*\s*CATIA0\b", re.IGNORECASE)
_HIDDEN = re.compile(r"\$\$\s*->")  # a statement that Creo hides in a comment


class LineReader:
    """Join lines to statements, and act on each.

    continued : the pieces of a statement that $ continues, from line ``continued_from`` on
    matrix : rows read so far of the matrix after $$*CATIA0 in line ``matrix_from``; None outside it
    skipped : statements after FINI: the first one's line and their count
    """

    def __init__(self, source: str, actions: ClActions):
        self.source = source
        self.actions = actions
        self.continued: list[str] = []
        self.continued_from = 0
        self.continued_length = 0
        self.matrix: list[list[float]] | None = None
        self.matrix_from = 0
        self.skipped = [0, 0]

    @property
    def is_open(self) -> bool:
        """Whether the next line goes on with the last one: a statement that $ continues, or a matrix."""
        return bool(self.continued) or self.matrix is not None

    def check_end(self) -> None:
        """Refuse a file that ends within a statement or a matrix."""
        if self.continued:
            raise self._fail(
                "continued by $, but the file ends; expected the statement's next line", self.continued_from
            )
        if self.matrix is not None:
            raise self._fail("expected three rows of four numbers after $$*CATIA0", self.matrix_from)

    def _fail(self, message: str, line: int) -> InputError:
        return InputError(message, self.source, line)

    def read_line(self, raw: bytes | bytearray, line: int) -> str:
        """Read one line; return the word of the statement it completes, or nothing."""
        text = decode_line(raw).strip()
        control = CONTROL_CHARACTER.search(text.strip(_END_OF_FILE))
        if control is not None:
            raise self._fail(describe_control(control[0]), line)
        text = text.rstrip(_END_OF_FILE)
        if self.matrix is not None:
            self._read_matrix_row(text, line)
            return ""
        if "$" in text:
            if _HEADER.match(text):
                self.matrix, self.matrix_from = [], line
            self.actions.read_comment(text, line)
            if self.matrix is not None:
                return ""
            text = self._strip_comment(text, line)
        if not text:
            return ""
        if self.continued and ends_text(self.continued[0], text):
            self._execute(*self._take_continued())
        if text.endswith("$"):
            self._continue_statement(text[:-1], line)
            return ""
        if self.continued:
            self._continue_statement(text, line)
            text, line = self._take_continued()
        return self._execute(text, line)

    def _strip_comment(self, text: str, line: int) -> str:
        """Return a line without its comment; a statement hidden in one is marked."""
        hidden = _HIDDEN.match(text)
        if hidden is None:
            return text.partition("$$")[0].rstrip()
        if self.continued:
            raise self._fail("a $$-> statement within a continued one; expected the rest of that", line)
        return HIDDEN + text[hidden.end() :].partition("$$")[0].strip()

    def _execute(self, text: str, line: int) -> str:
        """Act on a whole statement; return its word."""
        if self.actions.finished:
            self.skipped = [self.skipped[0] or line, self.skipped[1] + 1]
            return ""
        try:
            return execute_statement(self.actions, text, line)
        except InputError as error:
            raise self._fail(error.message, error.line or line) from error

    def _continue_statement(self, text: str, line: int) -> None:
        if not self.continued:
            self.continued_from = line
        self.continued.append(text)
        self.continued_length += len(text)
        if self.continued_length > LONGEST:
            raise self._fail(f"a statement of more than {LONGEST} characters", self.continued_from)

    def _take_continued(self) -> tuple[str, int]:
        """Join the pieces of a continued statement; return it with its first line."""
        text = " ".join(self.continued)  # a number ends with its line
        self.continued, self.continued_length = [], 0
        return text, self.continued_from

    def _read_matrix_row(self, text: str, line: int) -> None:
        """Read a row of the matrix after $$*CATIA0. Comments, such as the axis system's name, may come before it."""
        assert self.matrix is not None
        fields = text.removeprefix("$$").replace(",", " ").split()
        if len(fields) == 4 and all(is_number(f) for f in fields):
            try:
                self.matrix.append([parse_number(f) for f in fields])
                if len(self.matrix) == 3:
                    rows, self.matrix = self.matrix, None
                    self.actions.set_frame_matrix(rows, self.matrix_from)
            except InputError as error:
                raise self._fail(error.message, line) from error
        elif self.matrix or not (text.startswith("$$") or not text):
            raise self._fail(f"{quote_short(text)}; expected a row of four numbers of the matrix after $$*CATIA0", line)
