"""The ranges of the axes that hold every pose of a machine, as far as draws can tell."""

from __future__ import annotations

from math import pi

import numpy as np

from ...arrays import Array
from ...machine import Machine

_ROUNDS, _DRAWS = 40, 16384
_BEYOND = 0.25  # of the box found so far, on both sides: how far a round looks
_WIDER = 0.1  # likewise, added at the end for what the draws miss
_GREATEST = {"A": pi, "B": pi, "C": pi}
TURNS = 100  # that C may go on turning either way where of the orientation only the tool's axis counts


def extent(machine: Machine) -> tuple[Array, Array]:
    """Lower and upper end of every axis, (axes,), mm and rad; of whole mm and degrees, the same in every run.

    A box grows from home on by the allowed poses in and around it. It is no proof, and needs none: a pose is judged by
    the machine's own limits, never by this box.
    """
    rng = np.random.default_rng(0)
    units = np.where(np.array(machine.axis_units) == "mm", 1.0, pi / 180.0)
    most = np.array([_GREATEST.get(axis, np.inf) for axis in machine.axes])
    low, high = machine.home - units, machine.home + units
    for _ in range(_ROUNDS):
        beyond = _BEYOND * (high - low)
        poses = rng.uniform(np.maximum(low - beyond, -most), np.minimum(high + beyond, most), (_DRAWS, len(units)))
        allowed = poses[machine.check(poses) == 0]
        low = np.minimum(low, allowed.min(0, initial=np.inf))
        high = np.maximum(high, allowed.max(0, initial=-np.inf))
    wider = _WIDER * (high - low)
    low, high = np.maximum(low - wider, -most), np.minimum(high + wider, most)
    if machine.has_direction:  # B may have either sign, and C go on turning
        high[3] = max(-low[3], high[3])
        low[3:], high[3:] = [-high[3], -2.0 * pi * TURNS], [high[3], 2.0 * pi * TURNS]
    return np.floor(low / units) * units, np.ceil(high / units) * units
