"""Write a machine's ``check_move``: its margins' bounds as two lists of operations, and the C that runs them."""

from __future__ import annotations

from importlib.resources import files
from typing import Literal

from ...errors import NoMethodError
from ...kernels.tape import Tape
from ...machine import Machine
from ...version import __version__

Firmware = Literal["Klipper", "grblHAL", "FluidNC", "RepRapFirmware"]

_TURN = 6.283185307179586
_REGISTER = (1 << 40) - 1  # of a tape's operands: above it stands what else the interpreter is told


def render_move_check(machine: Machine) -> str:
    """Render the C header with ``check_move`` for a machine in its own working mode.

    Raises :class:`NoMethodError` for a machine with turning joints of head and table, or with joints whose range is
    more than a turn: which turn they are in depends on more than the move.
    """
    if machine.wrist is not None:
        raise NoMethodError(f"{machine.name}: check_move is for machines without turning joints in head and table")
    for joint in machine.turning_joints:
        drive = machine.drives[joint]
        if drive.high - drive.low > _TURN:
            raise NoMethodError(f"{machine.name}: check_move needs {drive.name} to stay within one turn")
    line = machine.line_tapes(machine.mode)
    tables = [_render_tape("values", line.values), _render_tape("rates", line.rates)]
    tables.append(f"#define CM_INPUTS {line.values.inputs}")
    template = files(__package__).joinpath("move_check.h").read_text(encoding="utf-8")
    return template % {
        "title": _format_comment(f"{machine.name} ({machine.spec.title})"),
        "version": __version__,
        "axes": len(machine.axes),
        "names": " ".join(machine.axes),
        "margins": len(machine.limits),
        "sign": f"{line.sign:.1f}",
        "floor": f"{line.floor!r}",
        "tables": "\n".join(tables),
        "registers": max(line.values.registers, line.rates.registers),
    }


def render_firmware_check(machine: Machine, firmware: Firmware) -> str:
    """Render what makes a firmware refuse moves which ``check_move`` does not prove.

    It is a module for Klipper's ``klippy/extras``, a plugin for grblHAL, or a header that FluidNC's or RepRapFirmware's
    kinematics are derived by.

    Raises :class:`NoMethodError` for a machine whose axes are not X, Y and Z.
    """
    if machine.axes != ("X", "Y", "Z"):
        raise NoMethodError(f"{machine.name}: {firmware} moves X, Y and Z, not {' '.join(machine.axes)}")
    template = files(__package__).joinpath(f"{firmware.lower()}.txt").read_text(encoding="utf-8")
    title = _format_comment(f"{machine.name} ({machine.spec.title})")
    return template % {"version": __version__, "title": title, "header": render_move_check(machine)}


def _render_tape(name: str, tape: Tape) -> str:
    """Render a tape as tables of its operations and their constants."""
    count = len(tape.code)
    code = ",\n".join(
        "    {" + ", ".join(str(number & _REGISTER) for number in row) + "}" for row in tape.code.tolist()
    )
    constants = ",\n".join("    {" + ", ".join(f"{k!r}" for k in row) + "}" for row in tape.constants.tolist())
    return (
        f"#define CM_{name.upper()} {count}\n"
        f"static const unsigned short cm_{name}_code[CM_{name.upper()}][8] = {{\n{code}}};\n"
        f"static const double cm_{name}_constants[CM_{name.upper()}][4] = {{\n{constants}}};"
    )


def _format_comment(text: str) -> str:
    """Format a text that stays in a comment, and in a string of Python."""
    return " ".join(text.split()).replace("*/", "* /").replace('"', "'")
