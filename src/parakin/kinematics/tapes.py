"""The kinematics of a machine as tapes, for the batch kernels and for other interpreters."""

from __future__ import annotations

from typing import NamedTuple

from ..kernels.tape import NewtonTapes, Tape
from ..model.traces import Model
from .wrist.pole_crossing import flip_mode


class SphereTapes(NamedTuple):
    """The direct problem in closed form, by the common point of the legs' spheres.

    at_home : joints -> pose on home's side, closures, the square of the height over the centres
    on_side : joints, a number -> pose on the side that its sign tells, closures
    own_side : pose -> such a number, for the pose's own joints; NaN out of reach
    own_side_over : the same in the other mode of head and table, where there is one
    """

    at_home: Tape
    on_side: Tape
    own_side: Tape
    own_side_over: Tape | None


class KinematicTapes(NamedTuple):
    """The inverse in a working mode, and the direct problem: the common point of spheres, or Newton's method.

    inverse : pose -> joints
    spheres : the direct problem in closed form; None where there is none
    newton : the direct problem by Newton's method; None where there is a closed form
    jacobians : pose, joints -> A (m·n) and B (m·m) with A x' = B q'
    coordinates : names of the motion's coordinates, which Newton's method solves for
    """

    inverse: Tape
    jacobians: Tape
    spheres: SphereTapes | None
    newton: NewtonTapes | None
    coordinates: tuple[str, ...]


def collect_newton_tapes(model: Model, poses: bool = True) -> NewtonTapes:
    """Compile the tapes of Newton's method, from poses to poses, or from the motion's coordinates to these."""
    return NewtonTapes(
        model.begin_tape(poses), model.newton_tape(False), model.newton_tape(True), model.end_tape(poses)
    )


def collect_tapes(model: Model, mode: str) -> KinematicTapes:
    """Compile the tapes of inverse and direct problem in a working mode."""
    spheres = _collect_sphere_tapes(model, mode) if model.by_spheres else None
    newton = None if model.by_spheres else collect_newton_tapes(model)
    return KinematicTapes(model.inverse_tape(mode), model.jacobian_tape(), spheres, newton, model.structure.coordinates)


def _collect_sphere_tapes(model: Model, mode: str) -> SphereTapes:
    """Compile the tapes of the direct problem in closed form."""
    over = model.own_side_tape(flip_mode(mode)) if model.structure.branches else None
    return SphereTapes(model.spheres_with_height_tape(), model.spheres_on_side_tape(), model.own_side_tape(mode), over)
