"""Write a first program: a square at home."""

from __future__ import annotations

from itertools import groupby, product

import numpy as np

from ...arrays import Array
from ...machine import Machine
from ...units import to_display
from .home_pose import find_home_pose
from .number_text import format_number

_SIDE = 40.0  # mm: the square's side, halved until the machine can go round it
_LEAST = 0.1  # mm
_CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))
_POINTS = 50  # points that are checked on each side
_FEED = 3000.0  # mm/min


def write_first_program(machine: Machine) -> str:
    """Write G-code that the machine can run once it is homed; LinuxCNC's own example lies out of its reach."""
    words = groupby(_format_words(machine, pose) for pose in _find_square(machine))
    lines = [
        f"( {machine.name}: a square at home )",
        "G21 G90 G94 G61 G49 G54",
        *(f"G1 {pose} F{format_number(_FEED)}" for pose, _ in words),
        "M2",
        "",
    ]
    return "\n".join(lines)


def _find_square(machine: Machine) -> Array:
    """Find the largest square with a corner at LinuxCNC's home; return its corners from home to home, or home alone."""
    side, home = _SIDE, find_home_pose(machine)
    while side >= _LEAST:
        for quadrant in product((1.0, -1.0), repeat=2):
            poses = np.tile(home, (len(_CORNERS), 1))
            poses[:, :2] += side * np.array(quadrant) * _CORNERS
            if _is_allowed(machine, poses):
                return poses
        side *= 0.5
    return home[None, :]


def _is_allowed(machine: Machine, poses: Array) -> bool:
    """Tell whether every limit is kept on the way from pose to pose, by joints that count their turns."""
    share = np.linspace(0.0, 1.0, _POINTS)[:, None, None]
    between = (poses[:-1] + share * np.diff(poses, axis=0)).swapaxes(0, 1).reshape(-1, len(machine.axes))
    return not machine.check(between, machine.follow(between)).any()


def _format_words(machine: Machine, pose: Array) -> str:
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return " ".join(f"{axis}{format_number(to_display(value, unit))}" for axis, value, unit in values)
