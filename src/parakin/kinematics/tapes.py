"""The kinematics of a machine as tapes, for the batch kernels and for other interpreters."""

from __future__ import annotations

from typing import NamedTuple

from ..kernels.tape import NewtonTapes, Tape
from ..model.traces import Model


class KinematicTapes(NamedTuple):
    """The inverse in a working mode, and the direct problem: the common point of spheres, or Newton's method.

    coordinates : names of the motion's coordinates, which Newton's method solves for
    """

    inverse: Tape
    common_point: Tape | None
    newton: NewtonTapes | None
    coordinates: tuple[str, ...]


def collect_newton_tapes(model: Model, poses: bool = True) -> NewtonTapes:
    """Compile the tapes of Newton's method, from poses to poses, or from the motion's coordinates to these."""
    return NewtonTapes(
        model.begin_tape(poses), model.newton_tape(False), model.newton_tape(True), model.end_tape(poses)
    )


def collect_tapes(model: Model, mode: str) -> KinematicTapes:
    """Compile the tapes of inverse and direct problem in a working mode."""
    common_point = model.spheres_tape(None) if model.by_spheres else None
    newton = None if model.by_spheres else collect_newton_tapes(model)
    return KinematicTapes(model.inverse_tape(mode), common_point, newton, model.structure.coordinates)
