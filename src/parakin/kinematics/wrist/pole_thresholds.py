"""All thresholds at poles, with units and reasons.

Angles are rad; those "off the pole" are between the tool's axis and the first axis.

========== ============ ==============================================================================================
name       value, rad   reason
========== ============ ==============================================================================================
EXACT      1e-9         off the pole: nearer, float64 tells the first angle by rounding only
SAME_AXIS  1e-7         tool axis: nearer to the commanded one, a controller shows the commanded angles
PRINTED    2e-6         off the pole: nearer, the six decimals of a CL file tell no first angle
PROVED     4e-6         off the pole: a box of poses proved to be nearer counts as on it
ASIDE      8e-6         second angle by which a pose is moved off the pole to have its rates bounded
LEEWAY     1.6e-5       second angle that may change while the first one is free
SAME_MODE  1e-6         joints no farther from those of a mode are in that mode; mm too, for machines up to a metre
NEAR_MODE  0.01         the same, mm too, for joints as a controller's drives stand: they are never just where told
SWING      90°          first angles of neighbours farther apart than this swing: the other mode is tried
FLIP       0.01         off the pole: farther away no path changes its mode
DISTINCT   0.01         off the pole: from here on the first joint is as exact as the others
VICINITY   0.12         off the pole: a motion that stays farther away does not pass it
TRAVEL     0.05         tool axis: its travel before and behind a pass over which a swing is measured
REPORTED   45°          first angle: a swing that is reported
TILTED     0.2          second angle at which a tool that starts on the pole is tilted to choose its mode
NEAR_START 0.1          off the pole: a program comes to a first record that is nearer from aside
NEAR_TURN  0.02         off the pole: a tool that is nearer is tilted so far while whole turns are taken back
STANDING   8e-6         off the pole: nearer, a controller's first joint stands still, whatever the rounded pose says
RIM        8.024e-6     off the pole: just where that begins; a record there tells the first joint on either side
RIM_WIDTH  8e-8         off the pole: a record no farther from there is there
NEAR_Z     1e-4         B: on a wrist's pole so near to Z, C turns far while the tool passes over the pole
NEAR_HOLD  1e-5         off the pole: no tool axis is held nearer, or printed digits would turn the first angle
WAVER      0.02°        first angle: the controller's own way between two records turns it aside by no more
LEAST_LEAN 1e-6         tool axis: what is off its way by less is not brought nearer for that
FAR_TILT   30°          second angle at home of a controller: moves about it go neither round the pole nor through it
========== ============ ==============================================================================================
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, Flags

EXACT = 1e-9
SAME_AXIS = 1e-7
PRINTED = 2e-6
PROVED = 2.0 * PRINTED
ASIDE = 8e-6
LEEWAY = 8.0 * PRINTED
SAME_MODE = 1e-6
NEAR_MODE = 0.01
SWING = 0.5 * np.pi
FLIP = 0.01
DISTINCT = 0.01
VICINITY = 0.12
TRAVEL = 0.05
REPORTED = np.radians(45.0)
TILTED = 0.2
NEAR_START = 0.5 * TILTED
NEAR_TURN = 0.02
STANDING = 8e-6
RIM = 1.003 * STANDING
RIM_WIDTH = 0.01 * STANDING
NEAR_Z = 1e-4
NEAR_HOLD = 5.0 * PRINTED
WAVER = np.radians(0.02)
LEAST_LEAN = 0.5 * PRINTED
FAR_TILT = np.pi / 6.0


def convert_to_freedom(angle: float) -> float:
    """Convert an angle off the pole to its sin², the measure of :meth:`Wrist.measure_freedom`."""
    return float(np.sin(angle) ** 2)


def is_on_pole(square: Any, within: Any) -> Any:
    """Tell where a tool's axis, a unit vector, is on a pole, by the square of its part across the pole."""
    return square < within * within


def is_upright(b: Array, within: float = EXACT) -> Flags:
    """Tell where a tool at B, within half a turn, stands on the pole of B and C, up or down."""
    upright: Flags = np.abs(np.abs(b) - 0.5 * np.pi) > 0.5 * np.pi - within
    return upright
