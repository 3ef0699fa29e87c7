"""A first program: a square at home."""

from __future__ import annotations

from itertools import groupby, product
from math import pi

import numpy as np

from ...arrays import Array
from ...machine import Machine
from .config import number, rim

_SIDE = 40.0  # mm: the square's side, halved until the machine can go round it
_LEAST = 0.1
_CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))
_TILT = pi / 12.0  # of a tool on a wrist, whose pole the square would else go round or through
_POINTS = 50  # of a side that are looked at
_FEED = 3000.0  # mm/min


def write_first_program(machine: Machine) -> str:
    """G-code that the machine can run as soon as it is homed; what LinuxCNC opens by itself lies out of its reach."""
    square = _square(machine)
    lines = [
        f"( {machine.name}: a square at home )",
        "G21 G90 G94 G61 G49 G54",
        *(f"G1 {words} F{number(_FEED)}" for words, _ in groupby(_words(machine, pose) for pose in square)),
        "M2",
        "",
    ]
    return "\n".join(lines)


def _square(machine: Machine) -> Array:
    """Home, the corners of the largest square with a corner there, and home, (n, axes); home alone if none is."""
    side = _SIDE
    while side >= _LEAST:
        for quadrant in product((1.0, -1.0), repeat=2):
            corners = np.tile(machine.home, (len(_CORNERS), 1))
            corners[:, :2] += side * np.array(quadrant) * _CORNERS
            if machine.wrist is not None:
                corners[:, machine.axes.index("B")] += _TILT
            way = np.concatenate([machine.home[None], corners, machine.home[None]])
            if _goes(machine, way):
                return way
        side *= 0.5
    return machine.home[None, :]


def _goes(machine: Machine, way: Array) -> bool:
    """Whether every limit is kept on the way, by joints that count their turns."""
    share = np.linspace(0.0, 1.0, _POINTS)[:, None, None]
    between = (way[:-1] + share * np.diff(way, axis=0)).swapaxes(0, 1).reshape(-1, len(machine.axes))
    return not machine.check(between, machine.follow(between)).any()


def _words(machine: Machine, pose: Array) -> str:
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return " ".join(f"{axis}{number(rim(value, unit))}" for axis, value, unit in values)
