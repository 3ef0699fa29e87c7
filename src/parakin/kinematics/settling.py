"""Answers of the direct problem that are settled in the pass that finds them: tapes that end with margins for it.

Where all margins are positive, the answer passes every check of :mod:`.forward`; the others are looked at again there.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from math import pi

from ..algebra import Scalar, Trace, absolute, dot, minimum
from ..kernels.tape import Tape
from ..model.spheres import compute_square_determinant
from ..model.traces import Model
from ..units import AXIS_UNITS
from .closure_roots import compute_mode_tolerance
from .start_modes import SETTLED
from .wrist.pole_crossing import flip_mode
from .wrist.pole_thresholds import EXACT

CLEAR = 0.01  # of the greatest leg: joints of legs that close are so far from another mode's, a hundred tolerances


def compile_settling_end(model: Model, mode: str | None, from_start: bool) -> Tape:
    """Compile coordinates, joints, near pose -> pose, then the margins of :func:`_list_margins`."""
    motions, drives, poses = len(model.structure.coordinates), len(model.drives), len(model.axes)

    def outputs(trace: Trace) -> list[Scalar]:
        joints = trace.inputs(drives, motions)
        near = trace.inputs(poses, motions + drives) if from_start else None
        coordinates = trace.inputs(motions)
        pose = model.compute_pose(coordinates, joints)
        return [*pose, *_list_margins(model, coordinates, joints, near, mode)]

    inputs = motions + drives + (poses if from_start else 0)
    return model.keep_tape(("settling end", mode, from_start), inputs, outputs)


def compile_settling_spheres(model: Model, mode: str, from_start: bool) -> Tape:
    """Compile joints, near pose -> pose, closures in mm, then the margins of :func:`_list_margins`.

    The pose is the legs' common point on the near pose's side, which that has with its own joints in the working mode;
    one more margin tells that this side is sure. Without a near pose it is the common point on home's side.
    """
    drives, poses = len(model.drives), len(model.axes)

    def outputs(trace: Trace) -> list[Scalar]:
        joints = trace.inputs(drives)
        near = trace.inputs(poses, drives) if from_start else None
        if near is None:
            coordinates, margins = model.spheres(joints, model.home_side), list[Scalar]()
        else:
            coordinates, margins = _find_on_side(model, joints, near, mode)
        margins += _list_margins(model, coordinates, joints, near, mode)
        return [*model.compute_pose(coordinates, joints), *model.scaled_closures(coordinates, joints), *margins]

    inputs = drives + (poses if from_start else 0)
    return model.keep_tape(("settling spheres", mode, from_start), inputs, outputs)


def _find_on_side(
    model: Model, joints: Sequence[Scalar], near: Sequence[Scalar], mode: str
) -> tuple[list[Scalar], list[Scalar]]:
    """Find the coordinates of the common point on a start's own side, and margins: positive where that side is sure."""
    placed = model.structure.place_with_joints(near, joints[model.leg_count :])
    coordinates = model.spheres(joints, None, placed.origin)
    steady = _measure_steadiness(model, coordinates, joints, near, mode)
    if steady is not None:
        return coordinates, [steady]
    side, margins = model.measure_own_side(near, mode), []
    if model.structure.branches:  # the same in both modes of head and table
        margins.append(side * model.measure_own_side(near, flip_mode(mode)))
    return model.spheres(joints, side), margins


def _measure_steadiness(
    model: Model, coordinates: Sequence[Scalar], joints: Sequence[Scalar], near: Sequence[Scalar], mode: str
) -> Scalar | None:
    """Measure what is positive where a start with its own joints surely lies on the answer's side; None if unknown.

    The platform's origin is d or less from the answer to the start. There each rod, of a length L at most, differs from
    the answer's by less than e = sway·L·d / m, with the least branch margin m. So the determinant D of n rods differs
    by less than n·e·Lⁿ⁻¹, and keeps its sign where D²·m² > (n·sway·Lⁿ·d)². It spares the start's inverse.
    """
    sways = [leg.sway for leg in model.spec.legs if leg.sway is not None]
    clear = model.list_branch_margins(coordinates, joints, mode)
    pose = model.compute_pose(coordinates, joints)
    way = model.structure.bound_platform_way([one - other for one, other in zip(pose, near, strict=True)])
    if way is None or clear is None or len(sways) < len(model.spec.legs):
        return None
    least, square = reduce(minimum, clear), compute_square_determinant(*model.find_spheres(joints))
    count, size = len(sways), max(model.sizes)
    return square * least * least - (count * max(sways) * size**count) ** 2 * way


def _list_margins(
    model: Model,
    coordinates: Sequence[Scalar],
    joints: Sequence[Scalar],
    near: Sequence[Scalar] | None,
    mode: str | None,
) -> list[Scalar]:
    """List margins that are positive where an answer needs no second look.

    The legs stand in the working mode (None: in any). If they have several, the answer is beside the near pose, where
    no other mode's answer is nearer. A tool whose axis B and C tell is not upright, and the second turn of three is
    within ±90°, where the determinant's sign is that of the twist. The turns from home are within half a turn; from a
    near pose Newton's method leaves none in a few steps.
    """
    pose, margins = model.compute_pose(coordinates, joints), list[Scalar]()
    if model.has_modes and mode is not None:
        clear = model.list_branch_margins(coordinates, joints, mode)
        if clear is not None:
            margins.append(reduce(minimum, clear) - CLEAR * max(model.sizes))
        else:
            off = model.compare_mode(pose, joints, mode)
            margins.append(compute_mode_tolerance(model) ** 2 - dot(off, off))
    if model.has_modes and near is not None:
        ways = [one - other for one, other in zip(pose, near, strict=True)]
        lengths = [way for way, axis in zip(ways, model.axes, strict=True) if AXIS_UNITS[axis] == "mm"]
        margins.append((SETTLED * max(model.sizes)) ** 2 - dot(lengths, lengths))
        margins += [SETTLED - absolute(ways[column]) for column in model.turning_columns]
    direction, middle = model.structure.direction, model.structure.middle_turn
    if direction is not None:
        margins.append(0.5 * pi - EXACT - absolute(pose[direction.b] - 0.5 * pi))
    if middle is not None:
        margins += [0.5 * pi - absolute(each[middle]) for each in (pose, near) if each is not None]
    if direction is None and near is None:
        margins += [pi - absolute(pose[column] - model.home[column]) for column in model.turning_columns]
    return margins
