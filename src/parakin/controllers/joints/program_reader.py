"""Read programs in joint space back."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arguments import check_arguments
from ...arrays import Array, Indices
from ...errors import InputError
from ...toolpath.reading.gcode.block import VALUES, Block, parse_block
from ...toolpath.reading.gcode.codes import format_g_code
from .letters import LINEAR, TURNING

_LETTERS = LINEAR + TURNING
_MODES = {"units": 210, "distance": 900, "feed": 930, "plane": 170, "compensation": 400, "length": 490}
_STATED = {"units": "G21", "distance": "G90", "feed": "G93"}  # before any motion
_DWELL, _STRAIGHT = 40, 10


@dataclass(frozen=True, eq=False)
class JointProgram:
    """A program in joint space, n motions.

    letters : (joints,) of the joints
    joints : (n, joints) where each motion ends, mm and degrees as written
    seconds : (n,) what each takes
    line : (n,) 1-based
    """

    letters: tuple[str, ...]
    joints: Array
    seconds: Array
    line: Indices

    def __repr__(self) -> str:
        return (
            f"<parakin joint program: {len(self.line)} motions of {' '.join(self.letters)}, {self.seconds.sum():.6g} s>"
        )


@check_arguments
def read_joint_program(path: str | os.PathLike[str]) -> JointProgram:
    """Read what :func:`.make_joint_program` writes: G1 in G21, G90 and G93, each with a value for every joint.

    path : of the file

    Raises :class:`InputError` with file and line for everything else.
    """
    source = os.fsdecode(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source) from error
    except UnicodeDecodeError as error:
        raise InputError("expected plain text", source) from error
    except ValueError as error:  # a name that is no text, or with a zero character
        raise InputError(f"cannot be read: {error}", source) from error
    reader = _JointProgramReader()
    for number, line in enumerate(text.split("\n"), 1):
        try:
            reader.read_block(parse_block(line.strip(" \t\r"), VALUES + "UVW"), number)
        except InputError as error:
            raise InputError(error.message, source, number) from error
    if not reader.rows:
        raise InputError("no motion; expected G1 with a value for every joint", source)
    letters = tuple(letter for letter in _LETTERS if letter in reader.letters)
    joints = np.array([[row[letter] for letter in letters] for row in reader.rows])
    return JointProgram(letters, joints, np.array(reader.seconds), np.array(reader.lines, np.int64))


class _JointProgramReader:
    """A reader of a program's blocks, one at a time; errors carry no place."""

    def __init__(self) -> None:
        self.letters: set[str] = set()
        self.rows: list[dict[str, float]] = []
        self.seconds: list[float] = []
        self.lines: list[int] = []
        self.stated: set[str] = set()
        self.ended = False

    def read_block(self, block: Block, line: int) -> None:
        values = block.values
        if self.ended and (values or block.g or block.m):
            raise InputError("a block after the program's end")
        for group, code in block.g.items():
            self._set_mode(group, code)
        row = {letter: values.pop(letter) for letter in _LETTERS if letter in values}
        if row:
            self._add_motion(row, block, line)
        values.pop("S", None)
        if block.g.get("once") == _DWELL:
            values.pop("P", None)
        for letter, value in values.items():
            raise InputError(f"{letter}{value:g}: no code of this block uses it")
        self.ended = block.m.get("stop") in (2, 30)

    def _set_mode(self, group: str, code: int) -> None:
        self.stated.add(group)
        if code not in (_MODES.get(group), _DWELL if group == "once" else _STRAIGHT if group == "motion" else None):
            raise InputError(f"{format_g_code(code)}: not of a program in joint space; expected G1 in G21, G90 and G93")

    def _add_motion(self, row: dict[str, float], block: Block, line: int) -> None:
        for group, name in _STATED.items():
            if group not in self.stated:
                raise InputError(f"a motion before {name}")
        if "motion" not in self.stated:
            raise InputError("a value without a motion code; expected G1 with it or before it")
        if not self.letters:
            self.letters = set(row)
        if set(row) != self.letters:
            missing = " ".join(sorted(self.letters ^ set(row)))
            raise InputError(f"expected a value for the same joints in every motion, not so for {missing}")
        rate = block.values.pop("F", 0.0)
        if not rate > 0.0:
            raise InputError("G1 in G93 without F above zero; expected the inverse of its minutes")
        self.rows.append(row)
        self.seconds.append(60.0 / rate)
        self.lines.append(line)
