"""A first program: a square about home."""

from __future__ import annotations

import numpy as np

from ...machine import Array, Machine
from .config import number, rim

_HALF = 20.0  # mm: of the square's side, halved until the machine can go round it
_LEAST = 0.1
_CORNERS = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 0.0))
_POINTS = 50  # of a side that are looked at
_FEED = 3000.0  # mm/min


def program(machine: Machine) -> str:
    """G-code that the machine can run as soon as it is homed; what LinuxCNC opens by itself lies out of its reach."""
    square = _square(machine)
    lines = [
        f"( {machine.name}: a square about home )",
        "G21 G90 G94 G61 G49 G54",
        *(f"G1 {_words(machine, pose)} F{number(_FEED)}" for pose in square),
        "M2",
        "",
    ]
    return "\n".join(lines)


def _square(machine: Machine) -> Array:
    """Home and the corners of the largest square allowed, (n, axes); home alone if none is."""
    half = _HALF
    while half >= _LEAST:
        corners = np.tile(machine.home, (1 + len(_CORNERS), 1))
        corners[1:, :2] += half * np.array(_CORNERS)
        share = np.linspace(0.0, 1.0, _POINTS)[:, None, None]
        between = (corners[:-1] + share * np.diff(corners, axis=0)).reshape(-1, len(machine.axes))
        if not machine.check(between).any():
            return corners
        half *= 0.5
    return machine.home[None, :]


def _words(machine: Machine, pose: Array) -> str:
    values = zip(machine.axes, pose.tolist(), machine.axis_units, strict=True)
    return " ".join(f"{axis}{number(rim(value, unit))}" for axis, value, unit in values)
