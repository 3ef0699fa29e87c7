"""Execute the O words of RS274/NGC: subroutines, conditions and loops, with the rules and labels of LinuxCNC.

An O word that is not fulfilled skips lines up to the next O word with the same label.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from ..text import quote_short, refuse
from .block import VALUES, Block, parse_block, round_whole
from .expressions import read_value, skip_blanks
from .parameters import ARGUMENTS, Parameters

_LABEL = re.compile(r"/?[ \t]*(?:[Nn][ \t]*[\d. \t]+)?[Oo][ \t]*(?:<([^<>]*)>|(\d[\d \t]*)|(?=[#\[]))[ \t]*", re.ASCII)
_WORDS = (
    "sub", "endsub", "call", "return", "while", "endwhile", "do", "if", "elseif", "else", "endif", "repeat",
    "endrepeat", "break", "continue",
)  # fmt: skip
_WORD = re.compile(r"(?:[A-Za-z][ \t]*)+")
_VALUED = ("while", "if", "elseif", "repeat")  # words that one value follows


@dataclass
class ControlLine:
    """An O word.

    label : the number, or the name in lower case
    word : one of the words above
    rest : where the values behind the word begin
    """

    label: str
    word: str
    rest: int
    deleted: bool


@dataclass
class Label:
    """Where an O word with a label stands that others refer to.

    word, index : its word and its line's index
    repeats : how many are left
    changes : of parameters, when a while was last true in a loop that goes on; -1 outside of it
    """

    word: str
    index: int
    repeats: int = -1
    changes: int = -1


def find_control(text: str, parameters: Parameters) -> ControlLine | None:
    """Find an O word in a line; None for another line, and for a program number alone."""
    match = _LABEL.match(text)
    if match is None:
        return None
    name, digits = match.groups()
    at = match.end()
    if name is not None:
        label = "".join(name.split()).lower()
    elif digits is not None:
        label = "".join(digits.split()).lstrip("0") or "0"
    else:
        value, at = read_value(text, at, parameters)
        label = str(round_whole("O", value))
        at = skip_blanks(text, at)
    word = _WORD.match(text, at)
    said = "".join(word[0].split()).lower() if word else ""
    known = next((known for known in sorted(_WORDS, key=len, reverse=True) if said.startswith(known)), "")
    if not known:
        return None if digits is not None else ControlLine(label, "", at, text.startswith("/"))
    count = len(known)
    while count:
        count -= text[at] not in " \t"
        at += 1
    return ControlLine(label, known, at, text.startswith("/"))


class ControlFlow:
    """The state of conditions, loops and calls.

    skipping : the label that lines are skipped up to, None if they are executed
    """

    def __init__(self, parameters: Parameters):
        self.parameters = parameters
        self.skipping: str | None = None
        self._skipped_from = 0
        self._labels: dict[str, Label] = {}
        self._calls: list[tuple[str, int]] = []  # subroutine and the index to return to
        self._defining = ""
        self._executed_if = False
        self._breaking = self._continuing = False
        self._value, self._returned = 0.0, False
        parameters.readers["_value"] = lambda: self._value
        parameters.readers["_value_returned"] = lambda: float(self._returned)

    def execute(self, text: str, control: ControlLine, index: int) -> int:
        """Execute the O word in line ``index``; return the index of the line to go on with."""
        if not control.word:
            refuse(f"O words: {quote_short(text)}; expected a number or <name> and one of {' '.join(_WORDS)}")
        label = self._write_label(control)
        if self.skipping is not None and (label != self.skipping or (self._defining and control.word != "endsub")):
            return index + 1
        self._skipped_from = index
        if control.word == "call":
            return self._call(text, control, index)
        if control.word == "sub":
            return self._define(control.label, index)
        if control.word in ("endsub", "return"):
            return self._return(text, control, index)
        value, at = read_value(text, control.rest, self.parameters) if control.word in _VALUED else (0.0, control.rest)
        _check_end(text, at)
        step: Callable[[Label | None, str, int, float], int] = {
            "if": self._begin_if, "elseif": self._test_elseif, "else": self._take_else, "endif": self._end_if,
            "while": self._test_while, "do": self._begin_do, "repeat": self._test_repeat, "endwhile": self._end_loop,
            "endrepeat": self._end_loop, "break": self._break_loop, "continue": self._break_loop,
        }[control.word]  # fmt: skip
        known = self._find(control.word, label, index)
        if control.word == "continue" and self.skipping is None:
            self._continuing = True
        elif control.word == "break":
            self._breaking = True
        return step(known, label, index, value)

    def find_open_end(self) -> int | None:
        """Find the line that the end of the file leaves open: its index, None if there is none."""
        if self._calls:
            return self._calls[-1][1] - 1
        return self._skipped_from if self.skipping is not None else None

    def _write_label(self, control: ControlLine) -> str:
        """Write a label with the subroutine it belongs to."""
        inside = self._calls[-1][0] if self._calls else ""
        own = control.word in ("sub", "endsub", "call", "return")
        return control.label if own or not inside else f"{inside}#{control.label}"

    def _find(self, word: str, label: str, index: int) -> Label | None:
        """Find a label's own line; refuse one that does not fit the word."""
        known = self._labels.get(label)
        name = f"O{label.rpartition('#')[2]}"
        if word in ("if", "repeat", "while"):
            if known is not None and known.index != index and not (word == "while" and known.word == "do"):
                refuse(f"{name} stands for two things; expected another number or name")
            if known is None:
                self._labels[label] = Label(word, index)
            return self._labels[label]
        if word == "do":
            return known
        expected = {"elseif": "if", "else": "if", "endif": "if", "endwhile": "while", "endrepeat": "repeat"}
        if known is None or known.word not in (("while", "do") if word not in expected else (expected[word],)):
            refuse(f"{name} {word} without its {expected.get(word, 'while or do')} before it")
        return known

    # conditions

    def _begin_if(self, known: Label | None, label: str, index: int, value: float) -> int:
        self._executed_if = value != 0.0
        self.skipping = None if value != 0.0 else label
        return index + 1

    def _test_elseif(self, known: Label | None, label: str, index: int, value: float) -> int:
        if self._executed_if:
            self.skipping = label
        elif value != 0.0:
            self.skipping, self._executed_if = None, True
        return index + 1

    def _take_else(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping = label if self._executed_if else None
        self._executed_if = True
        return index + 1

    def _end_if(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping, self._executed_if = None, True
        return index + 1

    # loops

    def _begin_do(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping = None
        if known is None:
            self._labels[label] = Label("do", index)
        return index + 1

    def _test_while(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping = None
        if known is not None:
            goes_on = value != 0.0 and not self._breaking
            if goes_on and known.changes == self.parameters.changes:
                refuse("a loop that never ends: nothing in it sets a parameter")
            known.changes = self.parameters.changes if goes_on else -1
        if known is not None and known.word == "do":
            if value != 0.0 and not self._breaking:
                return known.index
            self._breaking = False
        elif value == 0.0:
            self.skipping = label
        return index + 1

    def _test_repeat(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping = None
        if known is None:
            return index + 1
        if known.repeats == -1:
            known.repeats = round(value)
        if known.repeats > 0:
            known.repeats -= 1
        else:
            known.repeats, self.skipping = -1, label
        return index + 1

    def _end_loop(self, known: Label | None, label: str, index: int, value: float) -> int:
        skipped, self.skipping = self.skipping is not None, None
        if known is None:
            return index + 1
        if skipped and not self._continuing:
            known.changes = -1
            return index + 1
        if skipped:
            self._continuing = False
        return known.index

    def _break_loop(self, known: Label | None, label: str, index: int, value: float) -> int:
        self.skipping = label
        return index + 1

    # subroutines

    def _define(self, label: str, index: int) -> int:
        if self._calls:
            refuse(f"O{label} sub within a subroutine; expected it before or behind")
        if label in self._labels:
            refuse(f"O{label} stands for two things; expected another number or name")
        self._labels[label] = Label("sub", index)
        self.skipping = self._defining = label
        return index + 1

    def _call(self, text: str, control: ControlLine, index: int) -> int:
        arguments, at = _read_values(text, control.rest, self.parameters)
        _check_end(text, at)
        known = self._labels.get(control.label)
        if known is None or known.word != "sub":
            refuse(f"O{control.label} call: the subroutine is not in this file before the call")
        if len(arguments) > ARGUMENTS:
            refuse(f"a call with more than {ARGUMENTS} arguments")
        self.parameters.enter(arguments)
        self._calls.append((control.label, index + 1))
        return known.index + 1

    def _return(self, text: str, control: ControlLine, index: int) -> int:
        if self._defining:
            self.skipping, self._defining = None, ""
            return index + 1
        if not self._calls or self._calls[-1][0] != control.label:
            refuse(f"O{control.label} {control.word} outside of its subroutine")
        values, at = _read_values(text, control.rest, self.parameters)
        _check_end(text, at)
        self._returned = bool(values)
        self._value = values[0] if values else 0.0
        self.parameters.leave()
        return self._calls.pop()[1]


def _read_values(text: str, at: int, parameters: Parameters) -> tuple[list[float], int]:
    """Read the bracketed values at ``at``."""
    values: list[float] = []
    at = skip_blanks(text, at)
    while text[at : at + 1] == "[":
        value, at = read_value(text, at, parameters)
        values.append(value)
        at = skip_blanks(text, at)
    return values, at


def _check_end(text: str, at: int) -> None:
    """Refuse words behind an O word; comments may stand there."""
    rest: Block = parse_block(text[at:].lstrip(" \t"), VALUES)
    if rest.values or rest.g or rest.m or rest.program is not None:
        refuse("other words in a block with an O word; expected two blocks")
