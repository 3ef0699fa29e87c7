"""Ranges of the axes that hold the poses of a machine, by sampling."""

from __future__ import annotations

from functools import lru_cache
from math import pi

import numpy as np

from ...arrays import Array
from ...machine import Machine

_ROUNDS, _SAMPLES = 40, 16384
_BEYOND = 0.25  # a round samples as far outside the box so far, as a fraction of it, on both sides
_MARGIN = 0.1  # likewise, added at the end for what the samples miss
_GREATEST_TURN = pi
TURNS = 100  # turns of C to either side of a machine that poses only the tool's axis


@lru_cache(maxsize=32)
def estimate_axis_ranges(machine: Machine) -> tuple[Array, Array]:
    """Estimate the range of every axis by growing a box from home; return its ends, (axes,) each, mm and rad.

    The ends are whole mm and degrees, the same in every run. In each round the box is widened to the allowed poses of a
    sample in and around it. It is no proof, and needs none: a pose is judged by the machine's own limits, never by this
    box.
    """
    rng = np.random.default_rng(0)
    units = np.where(np.array(machine.axis_units) == "mm", 1.0, pi / 180.0)
    most = np.array([_GREATEST_TURN if unit == "rad" else np.inf for unit in machine.axis_units])
    low, high = machine.home - units, machine.home + units
    for _ in range(_ROUNDS):
        beyond = _BEYOND * (high - low)
        poses = rng.uniform(np.maximum(low - beyond, -most), np.minimum(high + beyond, most), (_SAMPLES, len(units)))
        allowed = poses[machine.check(poses) == 0]
        low = np.minimum(low, allowed.min(0, initial=np.inf))
        high = np.maximum(high, allowed.max(0, initial=-np.inf))
    margin = _MARGIN * (high - low)
    low, high = np.maximum(low - margin, -most), np.minimum(high + margin, most)
    direction = machine.direction
    if direction is not None:  # B may have either sign, and C go on turning
        b = max(-low[direction.b], high[direction.b])
        low[direction.pair], high[direction.pair] = [-b, -2.0 * pi * TURNS], [b, 2.0 * pi * TURNS]
    ends = np.floor(low / units) * units, np.ceil(high / units) * units
    for end in ends:
        end.flags.writeable = False
    return ends
