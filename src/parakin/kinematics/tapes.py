"""The kinematics of a machine as tapes, for interpreters other than the batch kernels."""

from __future__ import annotations

from typing import NamedTuple

from ..kernels.tape import Tape
from ..model.traces import Model


class NewtonTapes(NamedTuple):
    """Newton's method on the closures: pose and joints -> coordinates -> closures, their slopes -> pose.

    coordinates : names of the motion's coordinates
    """

    begin: Tape
    closures: Tape
    closures_and_slopes: Tape
    end: Tape
    coordinates: tuple[str, ...]


class KinematicTapes(NamedTuple):
    """The inverse in a working mode, and the direct problem: the common point of spheres, or Newton's method."""

    inverse: Tape
    common_point: Tape | None
    newton: NewtonTapes | None


def collect_tapes(model: Model, mode: str) -> KinematicTapes:
    """Compile the tapes of inverse and direct problem in a working mode."""
    inverse = model.inverse_tape(mode)
    if model.by_spheres:
        return KinematicTapes(inverse, model.spheres_tape(None), None)
    newton = NewtonTapes(
        model.begin_tape(), model.newton_tape(False), model.newton_tape(True), model.end_tape(),
        model.structure.coordinates,
    )  # fmt: skip
    return KinematicTapes(inverse, None, newton)
