"""A control's dialect: the words that a joint program has on it."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field

from ...errors import PoseError
from ...machine import Machine
from ..event_commands import Command
from ..gcode_text import make_plain, split_text
from .feeds import Feed
from .letters import GCODE_LETTERS, AxisLetters

_CODE = re.compile(r"(?:S(?P<speed>[-+\d.eE]+))? ?(?:M(?P<number>\d+))?(?P<parameters>(?: [PQREL][-+\d.eE]+)*)")


def name_codes(*numbers: int) -> dict[int, str]:
    """Name M codes that a control has as they are."""
    return {number: f"M{number}" for number in numbers}


@dataclass(frozen=True)
class JointDialect:
    """How a control is told a program of joint positions. Templates have ``{}`` where their value goes.

    title : the control's name
    feed : how fast a block runs; ``mixed_feed`` where linear and turning joints move together, if that is another
    begin, modes, start, end : lines: the first ones, before anything is switched, before any motion, the last ones;
        ``{name}`` is the part's
    motion : a block, of ``{axes}`` and ``{feed}``
    exact : what stands before a block at whose end the joints stand still
    notes : what the operator has to know, for the program's head
    axes : letters for joints
    digits : after the point, for ``mm`` and for ``rad``, printed as degrees
    sign, between : of numbers (``+``: always), and what stands between words
    longest : characters of a line
    clean : makes a text fit for a comment
    comment, message, dwell, spindle : lines; a message that a control has no word for is a comment
    spindle_apart : whether speed and direction of the spindle are two lines
    codes : what the M codes of G-code are here; an empty text is said as a comment
    own_codes : M codes of the machine's own that may be passed on: those that the control itself does not act upon
    parameter_codes : M codes of outputs and inputs that are as in G-code, with their parameters
    shortest : s that a block takes at least: fewer ones are written where they would be shorter
    line_seconds, buffer : what a line takes on its way to the planner, and how many the planner holds
    numbered : whether lines have their numbers from 0 on
    """

    title: str
    feed: Feed
    motion: str
    begin: tuple[str, ...] = ()
    modes: tuple[str, ...] = ()
    start: tuple[str, ...] = ()
    end: tuple[str, ...] = ()
    exact: str = ""
    notes: tuple[str, ...] = ()
    mixed_feed: Feed | None = None
    axes: AxisLetters = GCODE_LETTERS
    digits: Mapping[str, int] = field(default_factory=lambda: {"mm": 4, "rad": 4})
    sign: str = ""
    between: str = " "
    longest: int = 80
    clean: Callable[[str], str] = make_plain
    comment: str = "( {} )"
    message: str = ""
    dwell: tuple[str, ...] = ("G4 P{:.10g}",)
    spindle: str = "S{:.10g}"
    spindle_apart: bool = False
    codes: Mapping[int, str] = field(default_factory=lambda: name_codes(0, 1, 3, 4, 5, 7, 8, 9))
    own_codes: Container[int] = ()
    parameter_codes: Container[int] = ()
    shortest: float = 0.0
    line_seconds: float = 0.0
    buffer: int = 1
    numbered: bool = False

    def choose_feed(self, machine: Machine) -> Feed:
        """Choose how a machine's blocks are told their speed."""
        mixed = len(set(machine.joint_units)) > 1
        return self.mixed_feed if mixed and self.mixed_feed is not None else self.feed

    def make_pattern(self, letters: Sequence[str], machine: Machine) -> str:
        """Make the printf pattern of a block; its values are those of the axes and of the feed."""
        units = zip(letters, machine.joint_units, strict=True)
        axes = self.between.join(f"{letter}%{self.sign}.{self.digits[unit]}f" for letter, unit in units)
        feed = self.choose_feed(machine)
        return self.motion.format(axes=axes, feed=f"{feed.word}%.{feed.digits}f") + "\n"

    def format_remark(self, text: str) -> list[str]:
        """Format a remark as comments, none longer than a line may be."""
        room = self.longest - len(self.comment.format(""))
        return [self.comment.format(piece) for piece in split_text(self.clean(text), room)]

    def format_command(self, command: Command, source: str) -> list[str]:
        """Format the lines of a command.

        Raises :class:`PoseError` with file and line for what the control has no word for and must not be left out.
        """
        if command.kind == "dwell":
            return [line.format(float(command.text)) for line in self.dwell]
        if command.kind == "remark":
            return self.format_remark(command.text)
        if command.kind == "message":
            if not self.message:
                return self.format_remark(command.text)
            return [self.message.format(self.clean(command.text)[: self.longest - len(self.message.format(""))])]
        lines = self._format_code(command)
        if lines is None:
            raise PoseError(f"{source}:{command.line}: {self.title} has no word for {command.text}")
        return lines

    def _format_code(self, command: Command) -> list[str] | None:
        """Format S and M words; None where the control has none for them."""
        match = _CODE.fullmatch(command.text)
        if match is None:
            return None
        speed = [self.spindle.format(float(match["speed"]))] if match["speed"] else []
        if match["number"] is None:
            return speed
        number = int(match["number"])
        if match["parameters"] or number not in self.codes:
            passed = number in (self.own_codes if command.kind == "own" else self.parameter_codes)
            return [command.text] if passed and not (command.kind == "own" and match["parameters"]) else None
        code = self.codes[number]
        if not code:
            return self.format_remark(f"line {command.line}: {command.text}")
        return [*speed, code] if self.spindle_apart or not speed else [" ".join([*speed, code])]
