"""Give letters of a control's axes to a machine's joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...errors import PoseError
from ...machine import Machine

LINEAR, TURNING = "XYZUVW", "ABC"


class AxisLetters(NamedTuple):
    """Letters that a control has for linear and for turning joints, in the order in which they are given."""

    linear: str = LINEAR
    turning: str = TURNING


GCODE_LETTERS = AxisLetters()


def assign_joint_letters(
    machine: Machine, axes: AxisLetters = GCODE_LETTERS, control: str = "G-code"
) -> tuple[str, ...]:
    """Assign a letter to each joint in their order, each letter once.

    control : its name, for the error

    Raises :class:`PoseError` where there are more joints than letters.
    """
    letters = list[str]()
    for unit in machine.joint_units:
        pool = axes.linear if unit == "mm" else axes.turning
        letters.append(next((letter for letter in pool if letter not in letters), ""))
    if "" in letters:
        linear = machine.joint_units.count("mm")
        has = f"{len(axes.linear)} and {len(axes.turning)}"
        has = f"{len(axes.linear)} in all" if axes.linear == axes.turning else has
        raise PoseError(
            f"{machine.name} has {linear} linear and {len(letters) - linear} turning joints; "
            f"{control} has letters for {has}"
        )
    return tuple(letters)


def describe_letters(letters: Sequence[str], machine: Machine) -> str:
    """Describe which joint each letter is."""
    names = zip(letters, machine.joints, machine.joint_units, strict=True)
    return ", ".join(f"{letter} is {name} in {'deg' if unit == 'rad' else 'mm'}" for letter, name, unit in names)
