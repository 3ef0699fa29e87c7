"""Write the programs with which M428 to M430 choose LinuxCNC's kinematics: the machine's, or joint by joint."""

from __future__ import annotations

from ...machine import Machine

# LinuxCNC's numbers of kinematics that can be switched to, by the code that its own configurations give them.
_TYPES = {428: 0, 429: 1}
_NO_TYPE = 430
_WORDS = {428: "the kinematics of {machine}", 429: "every axis moves the joint of its number"}
_REFUSED = {428: "THE JOINTS STAY AS THEY ARE MOVED NOW", 429: "THE AXES STAY AS THEY ARE MOVED NOW"}

_PROGRAM = """\
; M{code}: {words}. Made by parakin; LinuxCNC runs it in the place of M{code}.
o<{name}> sub
M68 E3 Q{kind}
M66 E0 L0
o1 if [#<_task> EQ 1]
  o2 if [#<_hal[kins.identity]> NE {kind}]
    M68 E3 Q{other}
    M66 E0 L0
    (ABORT, M{code}: {refused})
  o2 endif
o1 endif
o<{name}> endsub
"""

_NO_PROGRAM = """\
; M430: {machine} has no third kinematics. Made by parakin; LinuxCNC runs it in the place of M430.
o<{name}> sub
o1 if [#<_task> EQ 1]
  (ABORT, M430: THERE IS NO THIRD KINEMATICS)
o1 endif
o<{name}> endsub
"""


def list_remaps(machine: Machine) -> str:
    """List the lines of the ini file that give M428 to M430 their programs."""
    codes = [*_TYPES, _NO_TYPE]
    return "\n".join(
        ["HAL_PIN_VARS = 1", *(f"REMAP = M{c} modalgroup=10 ngc={_name_program(machine, c)}" for c in codes)]
    )


def write_switch_programs(machine: Machine) -> dict[str, str]:
    """Write the programs: {file: text}."""
    texts = {
        code: _PROGRAM.format(
            code=code,
            kind=kind,
            other=1 - kind,
            name=_name_program(machine, code),
            words=_WORDS[code].format(machine=machine.name),
            refused=_REFUSED[code],
        )
        for code, kind in _TYPES.items()
    }
    texts[_NO_TYPE] = _NO_PROGRAM.format(machine=machine.name, name=_name_program(machine, _NO_TYPE))
    return {f"{_name_program(machine, code)}.ngc": text for code, text in texts.items()}


def _name_program(machine: Machine, code: int) -> str:
    """Name a program; LinuxCNC reads names of subprograms in small letters."""
    return f"{machine.name}_m{code}".lower()
