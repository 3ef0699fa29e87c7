"""Find where a path passes over a pole: it goes on in the other of two modes where that spares a swing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar, Trace, dot
from ...arrays import Array, Flags
from ...kernels.tape import Tape, compile_tape
from ..turns import wrap_angle
from .pole_thresholds import SWING

# Working modes of the wrist along a path: the path's own, its other one, either one (on the pole, or not known).
OWN, OTHER, EITHER = 0, 1, 2
WristModes = NDArray[np.int8]

GAIN = 0.25  # of the squared way in the same mode: what the way in the other mode may be, for the path to change


def get_leg_signs(mode: str) -> str:
    """Return the legs' signs of a working mode that ends with head and table's."""
    return mode[:-1]


def flip_mode(mode: str) -> str:
    """Return a working mode with the other sign of head and table."""
    return mode[:-1] + ("-" if mode[-1] == "+" else "+")


def has_swing(first: Array) -> bool:
    """Tell whether first angles of neighbours on a path (n,) swing."""
    turned = np.abs(np.diff(first))
    return bool((np.abs(wrap_angle(turned[turned > SWING])) > SWING).any())


def spares_swing(before: Array, here: Array, there: Array) -> Flags:
    """Tell where going on from ``before`` in the other mode spares a swing; angles (n, 2 or more; first, second).

    here, there : the angles in the same mode and in the other one
    """
    stay, cross = wrap_angle(here - before), wrap_angle(there - before)
    with np.errstate(invalid="ignore"):
        spared: Flags = (np.abs(stay[:, 0]) > SWING) & ((cross**2).sum(1) < GAIN * (stay**2).sum(1))
    return spared


def find_crossings(here: Array, there: Array) -> Flags:
    """Find the rows of a path (n,) that go on in the other mode, whose angles are ``there`` (n, 2 or more).

    Every step that spares a swing changes the mode of all that follows, back and forth.
    """
    spared = spares_swing(here[:-1], here[1:], there[1:])
    return np.concatenate([np.zeros(min(len(here), 1), bool), np.cumsum(spared) % 2 == 1])


def compare_ways(stay: Sequence[Scalar], flip: Sequence[Scalar]) -> Scalar:
    """Compare the ways of angles from others in two modes: negative where the second way is shorter, by its square."""
    return dot(flip, flip) - dot(stay, stay)


def compile_way_comparison() -> Tape:
    """Compile the ways of B and C, then those of the other B and C -> :func:`compare_ways`, for other interpreters."""
    trace = Trace()
    return compile_tape(trace, [compare_ways(trace.inputs(2), trace.inputs(2, 2))], 4)
